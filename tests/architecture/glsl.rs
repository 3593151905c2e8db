//! What ARCHITECTURE.md promises about the GLSL: short functions, short lines, salts in one place.

use std::fs;
use std::path::{Path, PathBuf};

/// Lines of a function, its head and its closing brace included.
const MOST_FUNCTION_LINES: usize = 60;

/// Columns of a line.
const MOST_COLUMNS: usize = 120;

fn sources(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of the sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else {
            let text = fs::read_to_string(&path).expect("a source file");
            found.push((path, text));
        }
    }
    found.sort();
    found
}

/// Name and number of lines of each function. It begins with a line that begins with two words and a parenthesis, and
/// ends with a brace at the beginning of a line, or of its only line.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let mut found = Vec::new();
    let mut begun: Option<(&str, usize)> = None;
    for (number, line) in text.lines().enumerate() {
        let head = line.split('(').next().unwrap_or_default();
        let words: Vec<_> = head.split_whitespace().collect();
        let is_head = line.starts_with(|c: char| c.is_ascii_alphabetic())
            && line.contains('(')
            && !line.ends_with(';')
            && words.len() == 2
            && !["layout", "const", "struct", "shared"].contains(&words[0]);
        if begun.is_none() && is_head {
            begun = Some((words[1], number));
        }
        if line.starts_with('}') || (begun.is_some_and(|(_, at)| at == number) && line.ends_with('}')) {
            found.extend(begun.take().map(|(name, at)| (name, number - at + 1)));
        }
    }
    found
}

/// What is wrong with a file of GLSL.
fn faults(file: &str, text: &str) -> Vec<String> {
    let long = functions(text).into_iter().filter(|(_, lines)| *lines > MOST_FUNCTION_LINES);
    let mut faults: Vec<_> = long.map(|(name, lines)| format!("{file}: {name} has {lines} lines")).collect();
    for (number, line) in text.lines().enumerate() {
        if line.chars().count() > MOST_COLUMNS {
            faults.push(format!("{file}:{}: {} columns", number + 1, line.chars().count()));
        }
        if line.contains("^ 0x") && line.contains("seed") {
            faults.push(format!("{file}:{}: a salt without a name (lib/salts.glsl)", number + 1));
        }
    }
    faults
}

#[test]
fn glsl_is_in_short_functions_and_lines() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("glsl");
    let sources = sources(&root);
    let count: usize = sources.iter().map(|(_, text)| functions(text).len()).sum();
    assert!(sources.len() > 80 && count > 300, "{} files, {count} functions: not all were found", sources.len());
    let faults: Vec<_> = sources
        .iter()
        .flat_map(|(path, text)| faults(&path.strip_prefix(&root).unwrap().to_string_lossy(), text))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_checker_of_glsl_sees_faults() {
    let body = |lines: usize| format!("float f(float x) {{\n{}}}\n", "    x += 1.0;\n".repeat(lines - 2));
    assert_eq!(functions(&format!("{}uint g() {{ return 1u; }}\n", body(7))), [("f", 7), ("g", 1)]);
    assert_eq!(
        functions("layout(local_size_x = 64) in;\nstruct S {\n    uint x;\n};\nvoid main(\n    uint a\n) {\n}\n").len(),
        1
    );
    assert_eq!(faults("a.glsl", &body(MOST_FUNCTION_LINES)), Vec::<String>::new());
    assert_eq!(faults("a.glsl", &body(MOST_FUNCTION_LINES + 1)).len(), 1);
    assert_eq!(faults("a.glsl", &"/".repeat(MOST_COLUMNS)).len(), 0);
    assert_eq!(faults("a.glsl", &"/".repeat(MOST_COLUMNS + 1)).len(), 1);
    assert_eq!(faults("a.glsl", "    float u = unit_float(hash(seed ^ 0x1u));").len(), 1);
}
