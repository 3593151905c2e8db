//! Scenes with an analytic answer and scenes that are stiff, degenerate or empty. The numbers in the names of the tests
//! are those of the list of extreme cases in the design.
//!
//! Every render here goes through [`support::lab::Shot`], which fails on a validation message, on a number that is not
//! finite and on a pixel that the film had to reject, and prints the guards that fired.

#[path = "../support/mod.rs"]
mod support;

mod comparators;
mod convergence;
mod degenerate;
mod differentials;
mod error_bars;
mod exact;
mod lambert;
mod lens;
mod mirrors;
mod specular;
mod variants;
mod walls;
