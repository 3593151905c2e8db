//! Every kernel is proven by a test: it claims so ([`crate::support::proof`]), calls the reference it names and ends in
//! an assertion. That the kernel ran is checked by the claim itself, when the test runs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use nephroid::low_level::kernels::generated;

use crate::support::{proof, repository};

/// Functions by name; of several with one name, all bodies.
type Functions = BTreeMap<String, String>;

/// What a test says of some kernels.
#[derive(Debug, PartialEq)]
struct Claim {
    test: String,
    /// The function that it compares with, without its path; `None` for an answer known otherwise.
    reference: Option<String>,
    kernels: Vec<String>,
}

fn sources(folder: &Path, all: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).expect("a folder of tests") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, all);
        } else if path.extension().is_some_and(|extension| extension == "rs") && !path.ends_with("kernels/proofs.rs") {
            all.push(std::fs::read_to_string(&path).expect("a source"));
        }
    }
}

/// The names that a text calls: words before a bracket, with or without types between.
fn called(text: &str) -> BTreeSet<&str> {
    let part_of_word = |c: char| c.is_alphanumeric() || c == '_';
    let ends = text.match_indices('(').chain(text.match_indices("::<")).map(|(at, _)| &text[..at]);
    let words = ends.map(|before| &before[before.trim_end_matches(part_of_word).len()..]);
    words.filter(|word| !word.is_empty()).collect()
}

/// The name of a function by the line that begins it, at any depth.
fn function_name(line: &str) -> Option<&str> {
    let rest = line.trim_start().trim_start_matches("pub ").strip_prefix("fn ")?;
    rest.split(['(', '<']).next()
}

/// All functions with their bodies, without comments; a body ends at a brace as far in as the function.
fn functions(source: &str) -> Vec<(bool, String, String)> {
    let lines: Vec<&str> = source.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let Some(name) = function_name(line) else { continue };
        let end = format!("{}}}", &line[..line.len() - line.trim_start().len()]);
        let body: Vec<&str> = lines[at + 1..].iter().copied().take_while(|next| *next != end).collect();
        let attributes = lines[..at].iter().rev().take_while(|before| before.trim_start().starts_with("#["));
        let attributes: Vec<&str> = attributes.map(|attribute| attribute.trim()).collect();
        let runs = attributes.contains(&"#[test]") && !attributes.iter().any(|a| a.starts_with("#[ignore"));
        found.push((runs, name.to_owned(), body.join("\n")));
    }
    found
}

/// The text of `body` and of all functions it calls, directly or not.
fn reached(body: &str, all: &Functions) -> String {
    let (mut text, mut open) = (String::new(), vec![body]);
    let mut seen = BTreeSet::new();
    while let Some(body) = open.pop() {
        for name in called(body) {
            if seen.insert(name) {
                open.extend(all.get(name).map(String::as_str));
            }
        }
        text.push_str(body);
        text.push('\n');
    }
    text
}

/// The claims in a body, which end with the first `;`.
fn claims(test: &str, body: &str) -> Vec<Claim> {
    let claim = |(at, _)| {
        let text = body[at + "proof::".len()..].split(';').next().unwrap_or_default();
        let kernels = text.split('"').skip(1).step_by(2).map(String::from).collect();
        let reference = text.strip_prefix("by(").and_then(|rest| rest.split(',').next());
        let reference = reference.map(|path| path.trim().rsplit("::").next().unwrap_or_default().to_owned());
        Claim { test: test.to_owned(), reference, kernels }
    };
    body.match_indices("proof::by").map(claim).collect()
}

/// What is wrong with the claims in `sources` to prove `kernels`.
fn faults(sources: &[String], kernels: &[&str]) -> Vec<String> {
    let functions: Vec<_> = sources.iter().flat_map(|source| functions(source)).collect();
    let mut all = Functions::new();
    for (_, name, body) in &functions {
        all.entry(name.clone()).or_default().push_str(body);
    }
    let (mut proven, mut faults) = (BTreeSet::new(), Vec::new());
    for (runs, name, body) in &functions {
        for claim in claims(name, body) {
            let text = reached(body, &all);
            let test = &claim.test;
            match &claim.reference {
                _ if !runs => faults.push(format!("{test} claims and is no test that runs")),
                Some(reference) if !called(&text).contains(reference.as_str()) => {
                    faults.push(format!("{test} never calls {reference}"))
                }
                _ if !text.contains("assert") => faults.push(format!("{test} asserts nothing")),
                _ => proven.extend(claim.kernels),
            }
        }
    }
    let unknown = proven.iter().filter(|kernel| !kernels.contains(&kernel.as_str()));
    faults.extend(unknown.map(|kernel| format!("{kernel} is claimed and does not exist")));
    let open = kernels.iter().filter(|kernel| !proven.contains(**kernel));
    faults.extend(open.map(|kernel| format!("no test proves {kernel}")));
    faults
}

fn kernel_names() -> Vec<&'static str> {
    let shaders = generated::SHADERS.iter().map(|shader| shader.name);
    generated::ALL.iter().map(|kernel| kernel.name).chain(shaders).collect()
}

fn all_sources() -> Vec<String> {
    let mut all = Vec::new();
    sources(&repository("tests"), &mut all);
    all
}

#[test]
fn every_kernel_is_proven_by_a_test() {
    let kernels = kernel_names();
    assert!(kernels.len() > 80, "{} kernels", kernels.len());
    let faults = faults(&all_sources(), &kernels);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_kernel_without_proof_is_noticed_in_these_tests() {
    let mut kernels = kernel_names();
    kernels.push("scan_backwards");
    assert_eq!(faults(&all_sources(), &kernels), ["no test proves scan_backwards"]);
    kernels.pop();
    let without_scan: Vec<_> = all_sources().into_iter().map(|s| s.replace("\"scan_spine\"", "")).collect();
    assert_eq!(faults(&without_scan, &kernels), ["no test proves scan_spine"]);
    let without_call: Vec<_> = all_sources().into_iter().map(|s| s.replace("sort::reference_keys(", "not(")).collect();
    let expected = ["sort_of_keys never calls reference_keys", "no test proves sort_count"];
    assert_eq!(faults(&without_call, &kernels)[..2], expected);
}

#[test]
fn empty_claims_are_noticed() {
    let faults = |text: &str| faults(&[text.to_owned()], &["k"]);
    let helper = "fn compare() {\n    assert!(reference());\n}\n";
    let test = |attribute: &str, body: &str| format!("{helper}{attribute}\nfn it() {{\n{body}\n}}\n");
    let good = "    compare();\n    proof::by(a::reference, &[\"k\"]);";
    assert_eq!(faults(&test("#[test]", good)), [""; 0]);
    let open = "no test proves k";
    assert_eq!(faults(&test("", good)), ["it claims and is no test that runs", open]);
    assert_eq!(faults(&test("#[test]\n#[ignore]", good)), ["it claims and is no test that runs", open]);
    let alone = "    proof::by(a::reference, &[\"k\"]);";
    assert_eq!(faults(&test("#[test]", alone)), ["it never calls reference", open]);
    let comment = format!("    // compare();\n{alone}");
    assert_eq!(faults(&test("#[test]", &comment)), ["it never calls reference", open]);
    let silent = "    reference();\n    proof::by(a::reference, &[\"k\"]);";
    assert_eq!(faults(&test("#[test]", silent)), ["it asserts nothing", open]);
    assert_eq!(faults(&test("#[test]", "    proof::by_answer(&[\"k\"]);")), ["it asserts nothing", open]);
    let other = "    compare();\n    proof::by_answer(&[\"l\"]);";
    assert_eq!(faults(&test("#[test]", other)), ["l is claimed and does not exist", open]);
}

/// A claim by a test that did not run the kernel fails when the test runs.
#[test]
fn claims_without_a_run_fail() {
    let fails = |kernels: &'static [&'static str]| std::panic::catch_unwind(|| proof::by_answer(kernels)).is_err();
    let plan = "phase 0\n  scope: ran [2 x 1] #5=1 <- source, count -> target\nculled\n  gone [1 x 1]\nmemory\n";
    assert!(fails(&["ran"]), "nothing ran");
    proof::ran(plan);
    assert!(!fails(&["ran"]));
    assert!(fails(&["ran"]), "a claim is for what ran before it");
    for other in [&["ran", "gone"], &["ran", "source"], &["ran", "target"], &["ran", "never"]] {
        proof::ran(plan);
        assert!(fails(other), "{other:?}");
    }
}
