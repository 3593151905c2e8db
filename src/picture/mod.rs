//! Pictures: finished layers, what is done to them after the render, and their files. No GPU.
//!
//! [`image`] holds the layers of a picture. [`post`] changes them where it is asked to. [`exr`] and [`png`] encode
//! them, the latter by way of [`tonemap`]. [`output`] writes a file such that it appears whole or not at all.

pub mod claim;
pub mod exr;
pub mod image;
pub mod output;
pub mod png;
pub mod post;
mod stale;
pub mod tonemap;
