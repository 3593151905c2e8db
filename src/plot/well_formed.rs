//! Test help: whether a document is well-formed XML, as far as our writers go (no comments, no CDATA, no namespaces).

/// Checks balance of tags, quoting and uniqueness of attributes, entities, characters, one root. A document type in
/// front is skipped. The fault is told with what stands there.
pub(crate) fn check(document: &str) -> Result<(), String> {
    let mut rest = document.trim_start();
    if rest.to_ascii_lowercase().starts_with("<!doctype") {
        rest = rest.split_once('>').ok_or("the document type does not end")?.1;
    }
    let (mut open, mut roots) = (Vec::new(), 0);
    while let Some(start) = rest.find('<') {
        text(&rest[..start], open.is_empty())?;
        let tag = &rest[start + 1..];
        let end = tag_end(tag).ok_or_else(|| format!("a tag does not end: {}", head(tag)))?;
        rest = &tag[end + 1..];
        let tag = &tag[..end];
        if let Some(name) = tag.strip_prefix('/') {
            let expected = open.pop();
            if expected != Some(name) {
                return Err(format!("</{name}> closes {expected:?}"));
            }
            continue;
        }
        let (tag, alone) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        roots += usize::from(open.is_empty());
        let name = element(tag)?;
        if !alone {
            open.push(name);
        }
    }
    text(rest, true)?;
    match (open.last(), roots) {
        (Some(name), _) => Err(format!("<{name}> is never closed")),
        (None, 1) => Ok(()),
        (None, roots) => Err(format!("{roots} roots")),
    }
}

fn head(text: &str) -> String {
    text.chars().take(60).collect()
}

/// Where a tag ends: a `>` outside of quotes.
fn tag_end(tag: &str) -> Option<usize> {
    let mut quoted = false;
    tag.char_indices()
        .find(|(_, c)| {
            quoted ^= *c == '"';
            *c == '>' && !quoted
        })
        .map(|(at, _)| at)
}

/// Text between tags, or the value of an attribute.
fn text(text: &str, outside: bool) -> Result<(), String> {
    if outside && !text.trim().is_empty() {
        return Err(format!("text outside of the root: {}", head(text)));
    }
    for part in text.split('&').skip(1) {
        let name = part.split_once(';').map(|(name, _)| name);
        if !matches!(name, Some("amp" | "lt" | "gt" | "quot" | "apos")) {
            return Err(format!("no entity: &{}", head(part)));
        }
    }
    match text.chars().find(|c| (c.is_control() && !matches!(c, '\t' | '\n' | '\r')) || *c == '\u{ffff}') {
        Some(c) => Err(format!("a character XML forbids: {c:?}")),
        None => Ok(()),
    }
}

/// The name of an element after a check of its attributes.
fn element(tag: &str) -> Result<&str, String> {
    let is_name = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || "-:_".contains(c))
    };
    let name = tag.split_whitespace().next().unwrap_or_default();
    if !is_name(name) || !tag.starts_with(name) {
        return Err(format!("no element: <{}", head(tag)));
    }
    let (mut rest, mut known) = (&tag[name.len()..], Vec::new());
    while !rest.trim().is_empty() {
        let fault = || format!("no attribute: {} in <{}", head(rest), head(tag));
        let (attribute, after) = rest.split_once("=\"").ok_or_else(fault)?;
        let (value, after) = after.split_once('"').ok_or_else(fault)?;
        let attribute = attribute.strip_prefix(char::is_whitespace).ok_or_else(fault)?.trim_start();
        if !is_name(attribute) || known.contains(&attribute) || value.contains('<') {
            return Err(fault());
        }
        text(value, false)?;
        known.push(attribute);
        rest = after;
    }
    Ok(name)
}

#[test]
fn the_check_sees_each_fault() {
    for good in ["<a/>", "<!DOCTYPE html>\n<a b=\"1\" c=\"&lt;>\"><d/>x &amp; y<e></e></a>\n"] {
        assert_eq!(check(good), Ok(()), "{good}");
    }
    for bad in [
        "",
        "x",
        "<a>",
        "</a>",
        "<a></b>",
        "<a><b></a></b>",
        "<a/><b/>",
        "<a/>x",
        "<a b/>",
        "<a b=1/>",
        "<a b=\"1\" b=\"2\"/>",
        "<a b=\"1\"c=\"2\"/>",
        "<a b=\"<\"/>",
        "<a b=\"&\"/>",
        "<a>&</a>",
        "<a>&nbsp;</a>",
        "<a>\u{1}</a>",
        "<a>1 < 2</a>",
        "<a b=\"1/>",
        "<1/>",
        "<a",
    ] {
        assert!(check(bad).is_err(), "{bad:?}");
    }
}
