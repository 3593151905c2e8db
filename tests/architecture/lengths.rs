//! Lengths: lines of functions, columns of lines.

use super::layers::files;

/// Lines of a function in Rust, from `fn` to its last brace.
const MOST_RUST: usize = 79;

/// Lines of a function in GLSL.
const MOST_GLSL: usize = 60;

/// Columns of a line.
const MOST_COLUMNS: usize = 120;

/// Folders in which every line has at most [`MOST_COLUMNS`] columns.
const NARROW: &[&str] = &["glsl/", "src/"];

/// Name and number of lines of each function in a file that rustfmt has laid out; those on one line are left out.
fn rust_functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let indent = &line[..line.len() - line.trim_start().len()];
        let Some(name) = rust_name(line.trim_start()) else { continue };
        if line.ends_with([';', '}']) {
            continue;
        }
        let close = format!("{indent}}}");
        let declares = |line: &str| line.starts_with(&format!("{indent})")) && line.ends_with(';');
        let end = lines[at..].iter().position(|line| *line == close || declares(line));
        found.push((name.to_owned(), end.map_or(usize::MAX, |end| end + 1)));
    }
    found
}

/// The name of the function that begins on this line, if one does.
fn rust_name(mut line: &str) -> Option<&str> {
    if let Some(rest) = line.strip_prefix("pub") {
        let scope = rest.strip_prefix('(').and_then(|rest| rest.split_once(')'));
        line = scope.map_or(rest, |(_, rest)| rest).trim_start();
    }
    for word in ["const ", "async ", "unsafe ", "extern \"C\" ", "extern \"system\" "] {
        line = line.strip_prefix(word).unwrap_or(line);
    }
    let name = line.strip_prefix("fn ")?;
    name.split(|c: char| !c.is_alphanumeric() && c != '_').next().filter(|name| !name.is_empty())
}

/// The same for GLSL, where functions begin and end in the first column.
fn glsl_functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let Some((head, _)) = line.split_once('(') else { continue };
        let words: Vec<&str> = head.split(' ').collect();
        let is_name = |word: &&str| !word.is_empty() && word.chars().all(|c| c.is_alphanumeric() || c == '_');
        if words.len() != 2 || !words.iter().all(is_name) || line.ends_with([';', '}']) {
            continue;
        }
        if lines[at..].iter().find(|line| line.ends_with([';', '{'])).is_some_and(|line| line.ends_with(';')) {
            continue; // a declaration
        }
        let end = lines[at..].iter().position(|line| *line == "}");
        found.push((words[1].to_owned(), end.map_or(usize::MAX, |end| end + 1)));
    }
    found
}

/// Functions with more lines than `most`.
fn long_functions(file: &str, functions: Vec<(String, usize)>, most: usize) -> Vec<String> {
    let long = functions.into_iter().filter(|(_, lines)| *lines > most);
    long.map(|(name, lines)| format!("{file}: {name} has {lines} lines, at most {most} are allowed")).collect()
}

/// Lines with more than [`MOST_COLUMNS`] columns.
fn wide_lines(file: &str, text: &str) -> Vec<String> {
    let wide = text.lines().enumerate().map(|(at, line)| (at + 1, line.chars().count()));
    wide.filter(|(_, columns)| *columns > MOST_COLUMNS).map(|(at, n)| format!("{file}:{at}: {n} columns")).collect()
}

#[test]
fn functions_are_short() {
    let (rust, glsl) = (files("src", &["rs"]), files("glsl", &["glsl", "comp", "vert", "geom", "frag"]));
    let count = |found: usize, least: usize| assert!(found > least, "the checker sees {found} functions only");
    count(rust.iter().map(|(_, text)| rust_functions(text).len()).sum(), 1000);
    count(glsl.iter().map(|(_, text)| glsl_functions(text).len()).sum(), 100);
    let mut faults = Vec::new();
    for (file, text) in &rust {
        faults.extend(long_functions(file, rust_functions(text), MOST_RUST));
    }
    for (file, text) in &glsl {
        faults.extend(long_functions(file, glsl_functions(text), MOST_GLSL));
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn lines_are_narrow() {
    let mut sources = files("src", &["rs"]);
    sources.extend(files("tests", &["rs"]));
    sources.extend(files("glsl", &["glsl", "comp", "vert", "geom", "frag"]));
    for place in NARROW {
        assert!(sources.iter().any(|(file, _)| file.starts_with(place)), "there is no {place}");
    }
    let narrow = |file: &str| NARROW.iter().any(|place| file.starts_with(place));
    let faults: Vec<_> =
        sources.iter().filter(|(file, _)| narrow(file)).flat_map(|(file, text)| wide_lines(file, text)).collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_checkers_of_lengths_see_faults() {
    let body = "    x();\n".repeat(MOST_RUST - 2);
    for head in ["fn f() {", "pub(super) const unsafe fn f() {", "pub fn f<T: A>(a: T) -> B {"] {
        let fits = format!("{head}\n{body}}}\n");
        assert_eq!(rust_functions(&fits), [("f".to_owned(), MOST_RUST)], "{head}");
        assert_eq!(long_functions("a.rs", rust_functions(&fits), MOST_RUST).len(), 0, "{head}");
        let long = format!("{head}\n{body}\n}}\n");
        assert_eq!(long_functions("a.rs", rust_functions(&long), MOST_RUST).len(), 1, "{head}");
    }
    let method = "impl A {\n    fn f(\n        a: B,\n    ) -> C {\n        if a {\n        }\n    }\n}\n";
    assert_eq!(rust_functions(method), [("f".to_owned(), 6)]);
    let others = "trait A {\n    fn f();\n    fn g(\n        a: B,\n    );\n}\nfn h() {}\n// fn i() {\n";
    assert_eq!(rust_functions(others), [("g".to_owned(), 3)]);
    assert_eq!(rust_functions("fn f() {\n")[0].1, usize::MAX, "a function that does not end is a fault");

    let function = "vec3 f(vec3 a,\n       vec3 b) {\n    return a;\n}\n";
    let shader = format!("layout(local_size_x = 1) in;\n{function}void g(int a,\n    int b);\n");
    assert_eq!(glsl_functions(&shader), [("f".to_owned(), 4)]);
    let long = format!("void main() {{\n{}}}\n", "    x();\n".repeat(MOST_GLSL - 1));
    assert_eq!(long_functions("a.comp", glsl_functions(&long), MOST_GLSL).len(), 1);

    assert_eq!(wide_lines("a.rs", &"\u{e9}".repeat(MOST_COLUMNS)), Vec::<String>::new(), "columns are not bytes");
    assert_eq!(wide_lines("a.rs", &"e".repeat(MOST_COLUMNS + 1)).len(), 1);
}
