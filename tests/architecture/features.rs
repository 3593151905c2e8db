//! What the features of the package bring in.

use std::process::Command;

use crate::support::repository;

/// Packages that only the command line needs.
const OF_THE_COMMAND_LINE: [&str; 4] = ["clap", "indicatif", "signal-hook", "toml"];

/// Names of the packages that the library is built of.
fn packages(features: &[&str]) -> Vec<String> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["tree", "--offline", "--locked", "--edges", "normal", "--prefix", "none"]).args(features);
    let output = cargo.current_dir(repository("")).output().expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    text.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned).collect()
}

#[test]
fn without_default_features_nothing_of_the_command_line_is_built() {
    let (alone, all) = (packages(&["--no-default-features"]), packages(&[]));
    assert!(alone.iter().any(|name| name == "ash"), "{alone:?}");
    for name in OF_THE_COMMAND_LINE {
        assert!(!alone.iter().any(|package| package == name), "{name} in {alone:?}");
        assert!(all.iter().any(|package| package == name), "the check can fail: {name}");
    }
}
