//! The film: sums of passes, pictures, their files, and the measures that compare them. No GPU.
//!
//! A picture travels one way: [`accumulate`] holds the sums of all passes ([`exact`], in files [`film_file`]), [`image`] the finished layers,
//! [`post`] changes them where it is asked to, [`exr`] and [`png`] encode them ([`tonemap`] for the latter), and
//! [`output`] makes the files appear whole or not at all. [`metrics`] compares a picture with a reference.

pub mod accumulate;
pub mod exact;
pub mod exr;
pub mod film_file;
pub mod image;
pub mod metrics;
pub mod output;
pub mod png;
pub mod post;
mod stale;
pub mod tonemap;
