//! The program from outside.

#[path = "../support/mod.rs"]
mod support;

mod animate;
mod bench;
mod commands;
mod device;
mod farm;
mod resume;
