//! Text in pictures: escaped, and about how wide.

/// Text for element content and attribute values; what XML forbids becomes a question mark.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&apos;"),
            c if (c.is_control() && !matches!(c, '\t' | '\n' | '\r')) || matches!(c, '\u{fffe}' | '\u{ffff}') => {
                escaped.push('?');
            }
            c => escaped.push(c),
        }
    }
    escaped
}

/// About how wide a text is in a sans-serif font of a size, from above, in the units of the size.
pub fn width(text: &str, size: f64) -> f64 {
    let em = |c: char| match c {
        'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' => 0.34,
        'm' | 'w' | 'M' | 'W' | '%' | '@' => 0.98,
        c if c.is_uppercase() => 0.75,
        c if c.is_ascii() => 0.64,
        c if u32::from(c) >= 0x1100 => 1.0,
        _ => 0.72,
    };
    size * text.chars().map(em).sum::<f64>()
}

/// The first letters of a text that is longer than so many, with an ellipsis.
pub fn shortened(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    text.chars().take(most.saturating_sub(1)).chain(['\u{2026}']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_xml_reserves_is_escaped() {
        assert_eq!(escape("a<b> & \"c'\u{1}"), "a&lt;b&gt; &amp; &quot;c&apos;?");
    }

    #[test]
    fn long_texts_end_early() {
        assert_eq!(shortened("abc", 3), "abc");
        assert_eq!(shortened("abcd", 3), "ab\u{2026}");
        assert_eq!(shortened("äöüß", 2), "ä\u{2026}");
        assert_eq!(shortened("abc", 0), "\u{2026}");
        assert!(width("wide", 10.0) > width("ill", 10.0) && width("", 10.0) == 0.0);
    }
}
