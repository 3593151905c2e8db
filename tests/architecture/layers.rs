//! What ARCHITECTURE.md promises about the sources: layers, sizes, where `unsafe` may stand, no paths of one machine.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// What each module may use of the crate, beside itself. The graph's modules are layers of their own; to the others its
/// facade gives the names of those modules that are listed, so `kernels` can declare passes but not run them.
const LAYERS: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("constants", &[]),
    ("injection", &[]),
    ("shader", &[]),
    ("input", &["error"]),
    ("scene", &["constants", "input", "error"]),
    ("picture", &["injection", "input", "error"]),
    ("compare", &["picture", "error"]),
    ("film", &["constants", "input", "picture", "compare", "error"]),
    ("draw_state", &[]),
    ("fit", &[]),
    ("plot", &[]),
    ("vk", &["draw_state", "injection", "error"]),
    ("graph::draw", &["draw_state"]),
    ("graph::declare", &["constants", "graph::draw"]),
    ("graph::raster", &["graph::declare", "graph::draw", "draw_state"]),
    ("graph::windows", &["graph::declare"]),
    ("graph::place", &[]),
    ("graph::plan", &["graph::declare", "graph::draw", "graph::place"]),
    ("graph::dump", &["graph::declare", "graph::draw", "graph::plan", "draw_state"]),
    ("graph::trace", &[]),
    ("graph::run", &["graph::declare", "graph::draw", "graph::plan", "graph::trace", "vk", "error"]),
    ("kernels", &["constants", "graph::declare", "graph::draw", "graph::raster", "graph::windows", "draw_state"]),
    ("render", &["constants", "kernels", "graph", "scene", "film", "picture", "vk", "error"]),
    ("bench", &["constants", "draw_state", "fit", "plot", "render", "kernels", "graph", "scene", "vk", "error"]),
    // A study opens sessions, which takes the graph's runtime.
    ("study", &["fit", "plot", "render", "graph", "input", "scene", "picture", "compare", "error"]),
    // Cases use all that they test.
    (
        "check",
        &["constants", "fit", "plot", "study", "render", "kernels", "graph", "scene", "film", "picture", "vk", "error"],
    ),
    (
        "cli",
        &[
            "bench", "check", "study", "fit", "render", "kernels", "graph", "scene", "film", "picture", "compare",
            "vk", "error",
        ],
    ),
    ("viewer", &["render", "scene", "film", "picture", "vk", "error"]),
];

/// Lines of a source file.
const MOST_LINES: usize = 600;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Files below `folder` with one of the extensions (all if there are none), with their text, as paths from the root.
pub fn files(folder: &str, extensions: &[&str]) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = fs::read_dir(&folder) else { continue };
        for path in entries.map(|entry| entry.expect("an entry").path()) {
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            if path.is_dir() {
                folders.push(path);
            } else if (extensions.is_empty() || extensions.contains(&extension))
                && let Ok(text) = fs::read_to_string(&path)
            {
                found.push((relative(&path), text));
            }
        }
    }
    found.sort();
    found
}

fn relative(path: &Path) -> String {
    path.strip_prefix(root()).expect("a file of the crate").to_string_lossy().replace('\\', "/")
}

/// The code of a file: no comments, no strings, and nothing from the tests at its end on.
fn code(text: &str) -> String {
    code_and_strings(text).0
}

/// The code of a file and its string literals, both without comments and without the tests at its end.
fn code_and_strings(text: &str) -> (String, Vec<&str>) {
    let mut rest = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let (mut code, mut strings) = (String::new(), vec![]);
    while let Some(letter) = rest.chars().next() {
        let skipped = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("r#\"") {
            rest.find("\"#").map_or(rest.len(), |end| end + 2)
        } else if letter == '"' {
            string_length(rest)
        } else if rest.starts_with("'\"'") {
            3
        } else {
            code.push(letter);
            letter.len_utf8()
        };
        if letter == '"' || rest.starts_with("r#\"") {
            strings.push(&rest[..skipped]);
        }
        rest = &rest[skipped..];
    }
    (code, strings)
}

/// Whether a string names a flag: two hyphens and a letter, other than a variable of a style sheet.
fn names_flag(string: &str) -> bool {
    string.match_indices("--").any(|(at, hyphens)| {
        let (before, after) = (&string[..at], &string[at + hyphens.len()..]);
        let is_variable = [";", "{", "var("].iter().any(|end| before.ends_with(end));
        after.starts_with(|c: char| c.is_ascii_alphabetic()) && !is_variable
    })
}

/// Strings that name a flag, in a file that knows none.
fn flag_faults(file: &str, text: &str) -> Vec<String> {
    if file.starts_with("src/cli/") {
        return vec![];
    }
    let (_, strings) = code_and_strings(text);
    let at_fault = strings.into_iter().filter(|string| names_flag(string));
    at_fault.map(|string| format!("{file}: a flag below the command line: {string}")).collect()
}

/// Bytes of the string literal at the start.
fn string_length(text: &str) -> usize {
    let mut escaped = false;
    for (at, letter) in text.char_indices().skip(1) {
        match letter {
            '"' if !escaped => return at + 1,
            _ => escaped = letter == '\\' && !escaped,
        }
    }
    text.len()
}

/// `src/graph/plan.rs` to `graph::plan`; `src/graph/mod.rs` to `graph`.
fn module(file: &str) -> String {
    let path = file.trim_start_matches("src/").trim_end_matches(".rs").replace('/', "::");
    path.trim_end_matches("::mod").to_owned()
}

/// Where an identifier ends.
fn word(text: &str) -> usize {
    text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len())
}

/// The paths that a use tree such as `a::{b, c::d}` names.
fn expand(tree: &str, prefix: &[String], paths: &mut Vec<Vec<String>>) {
    let tree = tree.trim_start();
    if let Some(group) = tree.strip_prefix('{') {
        let (mut depth, mut start) = (0, 0);
        for (at, letter) in group.char_indices() {
            match letter {
                '{' => depth += 1,
                '}' if depth > 0 => depth -= 1,
                '}' | ',' if depth == 0 => {
                    expand(&group[start..at], prefix, paths);
                    start = at + 1;
                    if letter == '}' {
                        return;
                    }
                }
                _ => {}
            }
        }
        return;
    }
    let end = word(tree);
    if end == 0 {
        return;
    }
    let mut path = prefix.to_vec();
    path.push(tree[..end].to_owned());
    match tree[end..].strip_prefix("::") {
        Some(rest) if rest.trim_start().starts_with('{') || word(rest) > 0 => expand(rest, &path, paths),
        _ => paths.push(path),
    }
}

/// All paths from the crate's root that the code of `module` names, `super::` resolved.
fn paths(module: &str, code: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    let parent: Vec<String> =
        module.rsplit_once("::").map_or(vec![], |(p, _)| p.split("::").map(str::to_owned).collect());
    for (marker, prefix) in [("crate::", &[][..]), ("super::", &parent)] {
        for (at, _) in code.match_indices(marker) {
            if !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':' || c == '$') {
                expand(&code[at + marker.len()..], prefix, &mut paths);
            }
        }
    }
    paths
}

/// Which module of the graph each name of its facade comes from.
fn facade(text: &str) -> BTreeMap<String, String> {
    let mut names = BTreeMap::new();
    for (at, _) in text.match_indices("pub use ") {
        let mut paths = Vec::new();
        let tree = &text[at + "pub use ".len()..];
        expand(tree.split(';').next().unwrap_or_default(), &[], &mut paths);
        for path in paths.iter().filter(|path| path.len() == 2) {
            names.insert(path[1].clone(), format!("graph::{}", path[0]));
        }
    }
    names
}

/// The entry of [`LAYERS`] that `path` belongs to.
fn layer(path: &[String], facade: &BTreeMap<String, String>) -> String {
    let (first, second) = (path[0].as_str(), path.get(1).map(String::as_str));
    match second {
        Some(name) if first == "graph" && LAYERS.iter().any(|(known, _)| *known == format!("graph::{name}")) => {
            format!("graph::{name}")
        }
        Some(name) if first == "graph" => facade.get(name).cloned().unwrap_or_else(|| "graph".to_owned()),
        _ => first.to_owned(),
    }
}

/// Uses that break the layers in one file.
fn layer_faults(file: &str, text: &str, facade: &BTreeMap<String, String>) -> Vec<String> {
    let module = module(file);
    if ["lib", "low_level", "main", "graph"].contains(&module.as_str()) {
        return Vec::new(); // facades
    }
    let own = layer(&module.split("::").map(str::to_owned).collect::<Vec<_>>(), facade);
    let Some((_, allowed)) = LAYERS.iter().find(|(name, _)| *name == own) else {
        return vec![format!("{file}: module {own} has no entry in the table of layers")];
    };
    paths(&module, &code(text))
        .into_iter()
        .filter(|path| {
            let used = layer(path, facade);
            let parent = used.split("::").next().unwrap_or_default();
            used != own && !allowed.contains(&used.as_str()) && !allowed.contains(&parent)
        })
        .map(|path| format!("{file}: {own} may not use {}", path.join("::")))
        .collect()
}

/// Faults of one file that do not depend on its layer.
fn text_faults(file: &str, text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let lines = text.lines().count();
    // Pages that the program makes are as long as they are.
    if lines > MOST_LINES && !file.ends_with(".md") {
        faults.push(format!("{file}: {lines} lines"));
    }
    // Written apart, so that this file is not at fault itself.
    let folders = ["home", "root", "Users", "work", "tmp/wt", "var/tmp", "mnt"].map(|name| format!("/{name}/"));
    for (number, line) in text.lines().enumerate() {
        for folder in &folders {
            let starts = |at: usize| !line[..at].ends_with(|c: char| c.is_alphanumeric() || "._-/}$".contains(c));
            if line.match_indices(folder.as_str()).any(|(at, _)| starts(at)) {
                faults.push(format!("{file}:{}: a path of one machine: {folder}", number + 1));
            }
        }
    }
    faults
}

/// Whether `unsafe` stands in a file outside of src/vk.
fn unsafe_faults(file: &str, text: &str) -> Vec<String> {
    let code = code(text);
    let is_block = |at: usize| {
        let after = code[at + "unsafe".len()..].trim_start();
        ["{", "fn ", "impl ", "extern ", "trait "].iter().any(|next| after.starts_with(next))
    };
    let used = code.match_indices("unsafe").any(|(at, _)| is_block(at)) || code.contains("allow(unsafe_code)");
    if used && !file.starts_with("src/vk/") { vec![format!("{file}: unsafe outside of src/vk")] } else { vec![] }
}

fn graph_facade() -> BTreeMap<String, String> {
    facade(&fs::read_to_string(root().join("src/graph/mod.rs")).expect("the graph's facade"))
}

#[test]
fn layers_use_only_what_lies_below_them() {
    let facade = graph_facade();
    let sources = files("src", &["rs"]);
    assert!(sources.len() > 50, "{} sources", sources.len());
    let faults: Vec<_> = sources.iter().flat_map(|(file, text)| layer_faults(file, text, &facade)).collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_checker_of_layers_sees_each_way_to_break_them() {
    let facade = graph_facade();
    assert_eq!(facade.get("Runtime").map(String::as_str), Some("graph::run"));
    let faults = |file: &str, text: &str| layer_faults(file, text, &facade).len();
    assert_eq!(faults("src/kernels/scan.rs", "use crate::graph::{Buf, Graph, Grid, Windows};"), 0);
    assert_eq!(faults("src/kernels/scan.rs", "use super::Items;\nuse super::generated::Scan;"), 0);
    assert_eq!(faults("src/scene/load/mesh.rs", "use super::super::Scene; use crate::scene::Mesh;"), 0);
    assert_eq!(
        faults(
            "src/graph/run/execute.rs",
            "use crate::graph::plan::Plan;\nuse crate::{error::Error, vk::{self, Device}};"
        ),
        0
    );
    for (file, text, count) in [
        ("src/kernels/scan.rs", "use crate::graph::{Buf, Runtime};", 1),
        ("src/kernels/scan.rs", "use crate::{graph::{Graph, Executable}, vk::Device};", 2),
        ("src/kernels/scan.rs", "use crate::graph::{\n    Buf,\n    Executable,\n};", 1),
        ("src/kernels/scan.rs", "fn f() { crate::vk::devices(); }", 1),
        ("src/graph/plan.rs", "use super::run::Runtime;", 1),
        ("src/graph/plan.rs", "use super::Runtime;", 1),
        ("src/graph/declare.rs", "use crate::error::Error;", 1),
        ("src/scene/mod.rs", "use crate::kernels::generated::Light;", 1),
        ("src/picture/mod.rs", "use crate::film::accumulate::Film;", 1),
        ("src/compare/flip.rs", "use crate::film::accumulate::Film;", 1),
        ("src/film/mod.rs", "use crate::{\n    error::Result,\n    render::Session,\n};", 1),
        ("src/error.rs", "pub use crate::vk::Device;", 1),
        ("src/render/pass/plan.rs", "use crate::cli::Flags;", 1),
        ("src/unheard_of/mod.rs", "", 1),
    ] {
        assert_eq!(faults(file, text), count, "{file}: {text}");
    }
    let hidden = "// use crate::vk::Device;\n#[cfg(test)]\nmod tests {\n    use crate::vk::Device;\n}\n";
    assert_eq!(faults("src/scene/mod.rs", hidden), 0, "comments and tests are free");
    let text = "const A: &str = \"\\\" crate::vk::Device\"; const B: char = '\"'; use crate::vk::Device; // \"";
    assert_eq!(faults("src/scene/mod.rs", text), 1, "a string is no code, what follows it is");
}

#[test]
fn files_are_short_and_free_of_paths_of_one_machine() {
    let mut sources = vec![("build.rs".to_owned(), fs::read_to_string(root().join("build.rs")).expect("build.rs"))];
    for folder in ["src", "tests", "benches", "glsl"] {
        sources.extend(files(folder, &["rs", "glsl", "comp", "vert", "geom", "frag"]));
    }
    for folder in [".cargo", "tools", "docs"] {
        let texts = files(folder, &["toml", "py", "sh", "md", ""]);
        sources.extend(texts.into_iter().filter(|(file, _)| !file.starts_with("tools/cache")));
    }
    let faults: Vec<_> = sources.iter().flat_map(|(file, text)| text_faults(file, text)).collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn unsafe_has_one_address() {
    let mut sources = files("src", &["rs"]);
    sources.extend(files("tests", &["rs"]).into_iter().filter(|(file, _)| file != "tests/architecture/layers.rs"));
    assert!(sources.iter().any(|(file, text)| file.starts_with("src/vk/") && text.contains("unsafe {")));
    let faults: Vec<_> = sources.iter().flat_map(|(file, text)| unsafe_faults(file, text)).collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn only_the_command_line_names_flags() {
    let faults: Vec<_> = files("src", &["rs"]).iter().flat_map(|(file, text)| flag_faults(file, text)).collect();
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_checkers_of_text_see_faults() {
    let advice = "const A: &str = \"lower --photons\"; // --size";
    assert_eq!((flag_faults("src/vk/buffer.rs", advice).len(), flag_faults("src/cli/advice.rs", advice).len()), (1, 0));
    assert_eq!(flag_faults("src/vk/buffer.rs", "f(r#\"lower --photons\"#, \"a -- b\", \"--\") // \"--size\"").len(), 1);
    assert_eq!(
        flag_faults("src/study/report/mod.rs", "const STYLE: &str = \":root{--ink:#202020}a{color:var(--ink)}\";")
            .len(),
        0
    );
    assert_eq!(text_faults("a.rs", &"\n".repeat(MOST_LINES)), Vec::<String>::new());
    assert_eq!(text_faults("a.rs", &"\n".repeat(MOST_LINES + 1)).len(), 1);
    let at = |folder: &str| text_faults("a.rs", &format!("let x = \"/{folder}/someone/x\";")).len();
    assert_eq!([at("home"), at("root"), at("Users"), at("work")], [1; 4]);
    assert_eq!(text_faults("a.rs", "see ../shared/home/x and https://example.org/home/x").len(), 0);
    for text in ["fn f() { unsafe { g() } }", "unsafe fn f() {}", "#![allow(unsafe_code)]", "unsafe impl Send for X {}"]
    {
        assert_eq!(unsafe_faults("src/film/mod.rs", text).len(), 1, "{text}");
        assert_eq!(unsafe_faults("src/vk/mod.rs", text).len(), 0, "{text}");
    }
    assert_eq!(unsafe_faults("src/lib.rs", "#![deny(unsafe_code)] // no unsafe { } here").len(), 0);
}
