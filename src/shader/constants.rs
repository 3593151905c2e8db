//! Constants of GLSL for the host. SPIR-V does not keep them, so they are read from the text.
//!
//! Every constant at the top level of a file in `shared/` is meant for the host, elsewhere each one with a comment that
//! begins with three slashes, above it or behind it. What is meant for the host and cannot be evaluated is an error.

use super::expression::{Value, evaluate};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// A constant as the host gets it.
#[derive(Debug, Clone, PartialEq)]
pub struct HostConstant {
    pub name: String,
    pub value: Value,
    /// Comment of the source, if there is one.
    pub doc: String,
    /// File below the root, with slashes.
    pub file: String,
}

/// A line `const TYPE NAME = EXPRESSION; // COMMENT`.
struct Line<'a> {
    ty: &'a str,
    name: &'a str,
    expression: &'a str,
    comment: &'a str,
}

/// The constants for the host of all files below `root`: those of `shared` first, then by file, in the order of the
/// text.
pub fn read(root: &Path) -> Result<Vec<HostConstant>, String> {
    let mut found = Vec::new();
    let mut shared = BTreeMap::new();
    for path in glsl_files(root)? {
        let file = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
        let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        found.extend(of_file(&file, &text, &mut shared)?);
    }
    let mut first: BTreeMap<&str, &str> = BTreeMap::new();
    for constant in &found {
        if let Some(other) = first.insert(&constant.name, &constant.file) {
            return Err(format!(
                "constant {} stands in {other} and in {}: one of them is enough",
                constant.name, constant.file
            ));
        }
    }
    Ok(found)
}

/// Every file below `root`, those of `shared` first.
fn glsl_files(root: &Path) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        let entries = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        for entry in entries {
            let path = entry.map_err(|e| format!("{}: {e}", folder.display()))?.path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    files.sort_by_key(|path| (!path.starts_with(root.join("shared")), path.clone()));
    Ok(files)
}

/// The constants for the host of one file. Expressions may name earlier constants of the file and of `shared`.
fn of_file(file: &str, text: &str, shared: &mut BTreeMap<String, Value>) -> Result<Vec<HostConstant>, String> {
    let is_shared = file.starts_with("shared/");
    let mut known = shared.clone();
    let mut found = Vec::new();
    let mut above = String::new(); // the comment that ends on the line before
    for (number, text) in text.lines().enumerate() {
        if let Some(comment) = text.strip_prefix("//") {
            let _ = write!(above, "{}{comment}", if above.is_empty() { "" } else { " " });
            continue;
        }
        let doc = std::mem::take(&mut above);
        if !text.starts_with("const ") {
            continue;
        }
        let line = split(text);
        let comment = line.as_ref().map_or("", |line| line.comment);
        let wanted = is_shared || doc.starts_with('/') || comment.starts_with('/');
        let value = line.as_ref().ok_or_else(|| "not of the form `const TYPE NAME = EXPRESSION;`".to_owned());
        match value.and_then(|line| evaluate(line.ty, line.expression, &known).map(|value| (line.name, value))) {
            Ok((name, value)) => {
                known.insert(name.to_owned(), value);
                if wanted {
                    let doc = if comment.is_empty() { &doc } else { comment };
                    found.push(HostConstant { name: name.into(), value, doc: plain(doc), file: file.into() });
                }
            }
            Err(why) if wanted => {
                return Err(format!("{file}:{}: a constant for the host: {why}\n  {text}", number + 1));
            }
            Err(_) => {}
        }
    }
    if is_shared {
        *shared = known;
    }
    Ok(found)
}

fn split(text: &str) -> Option<Line<'_>> {
    let (code, comment) = text.split_once("//").unwrap_or((text, ""));
    let (head, expression) = code.trim().strip_suffix(';')?.split_once('=')?;
    let mut words = head.split_whitespace().skip(1);
    let line = Line { ty: words.next()?, name: words.next()?, expression, comment };
    (words.next().is_none() && !line.name.contains('[')).then_some(line)
}

/// A comment without the slashes of its lines.
fn plain(comment: &str) -> String {
    let words = comment.split_whitespace().map(|word| if word == "/" { "" } else { word });
    words.filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ")
}

/// The constants as Rust.
pub fn emit(constants: &[HostConstant]) -> String {
    let mut text = String::new();
    for HostConstant { name, value, doc, file } in constants {
        let doc = doc.replace('[', "\\[").replace(']', "\\]");
        let stop = if doc.is_empty() || doc.ends_with(['.', ':']) { "" } else { "." };
        let space = if doc.is_empty() { "" } else { " " };
        let _ = writeln!(
            text,
            "/// {doc}{stop}{space}From `glsl/{file}`.\npub const {name}: {} = {};",
            value.ty(),
            value.rust()
        );
    }
    text
}
