//! Scenes with an analytic answer and scenes that are stiff, degenerate or empty. The numbers in the names of the tests
//! are those of the list of extreme cases in the design.
//!
//! The cases themselves are in `src/check`, for `nephroid check`. Every render fails on a validation message, on a
//! number that is not finite, on a pixel that the film had to reject, and on photons whose light is not accounted for.

#[path = "../support/mod.rs"]
mod support;

mod cases;
mod lens;
mod variants;
