//! The `nephroid` command line program.
fn main() {}
