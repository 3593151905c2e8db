//! The film: sums of passes, pictures, their files, and the measures that compare them. No GPU.
//!
//! A picture travels one way: [`accumulate`] holds the sums of all passes ([`exact`], in files [`film_file`]), [`image`] the finished layers,
//! [`post`] changes them where it is asked to, [`exr`] and [`png`] encode them ([`tonemap`] for the latter), and
//! [`output`] makes the files appear whole or not at all. [`metrics`] and
//! [`flip`] compare a picture with a reference, and [`heat_map`] shows where it differs; [`ztest`] compares many estimates.
//! [`error_estimate`] tells how wrong a film is without a reference, with the [`quantiles`] of its errors.

pub mod accumulate;
pub mod error_estimate;
pub mod exact;
pub mod exr;
pub mod film_file;
pub mod flip;
mod flip_filters;
pub mod heat_map;
pub mod image;
pub mod metrics;
pub mod output;
pub mod png;
pub mod post;
pub mod quantiles;
mod stale;
pub mod tonemap;
pub mod ztest;
