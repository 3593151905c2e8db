//! Studies and measurements.

#[path = "../support/mod.rs"]
mod support;

mod bench;
mod config;
mod runs;
