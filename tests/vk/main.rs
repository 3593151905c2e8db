//! The device layer under validation.

#[path = "../support/mod.rs"]
mod support;

mod device;
mod validation;
