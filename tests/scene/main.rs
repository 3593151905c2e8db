//! Loading of scenes: sound, broken and sample files.

#[path = "../support/mod.rs"]
mod support;

mod bad;
mod load;
mod moving;
mod packed;
mod samples;
mod second_reader;
