//! Comparison of pictures: how far a picture is from its reference, and where. No GPU.
//!
//! [`metrics`] has errors of whole layers, [`flip`] the difference that an eye sees, [`heat_map`] a picture of the
//! errors. [`quantiles`] say how far an estimate may be from what it estimates.

pub mod flicker;
pub mod flip;
mod flip_filters;
pub mod heat_map;
pub mod metrics;
pub mod quantiles;
