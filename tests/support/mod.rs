//! What the rooms of tests share. A room is a folder of `tests/` and becomes one program; each has this module.

#![allow(dead_code, unused_imports)] // each room uses a part

pub mod affine;
pub mod boxes;
pub mod clock;
pub mod device;
pub mod fake;
pub mod files;
pub mod gather;
pub mod harness;
pub mod lab;
pub mod moving;
pub mod program;
pub mod proof;
pub mod random;
pub mod shared;
pub mod view;
pub mod ztest;

use std::path::{Path, PathBuf};

/// A file or folder of this repository.
pub fn repository(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// Says that a test, or a part of it, is skipped, and why. The line is kept even where the output of tests is captured.
pub fn skip(reason: &str) {
    use std::io::Write;
    // `eprintln` would be captured, as the test passes. One write, so that no other output comes between.
    let _ = std::io::stderr().write_all(format!("skipped: {reason}\n").as_bytes());
}
