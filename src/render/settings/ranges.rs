//! The ranges of settings, written once: for [`Settings::validate`](super::Settings::validate) and for code that
//! reads settings from text.

use std::fmt::Display;
use std::ops::RangeInclusive;

use crate::kernels::gather::{MAX_NEIGHBOURS, POLYGON_CORNERS};
use crate::kernels::lbvh::COUNTED_LEAF;
use crate::kernels::path::MOST_DEPTH;

/// Width and height of a picture in pixels.
pub const SIDE: RangeInclusive<u32> = 1..=1 << 16;

/// Pixels of a picture at most: indices and sums of pixels stay within 32 bits.
pub const MOST_PIXELS: u32 = 1 << 28;

/// Photons emitted per pass: indices of their data stay within 32 bits.
pub const PHOTONS: RangeInclusive<u32> = 0..=1 << 30;

/// Photons of each class that the estimator `knn` seeks.
pub const KNN_PHOTONS: RangeInclusive<u32> = 1..=MAX_NEIGHBOURS;

/// Photons in a leaf of the photon map at most.
pub const LEAF_PHOTONS: RangeInclusive<u32> = 1..=COUNTED_LEAF;

/// Corners of the polygon around a photon.
pub const BOUND_VERTICES: RangeInclusive<u32> = POLYGON_CORNERS;

/// Values of k of a sampled density estimate, which takes one pixel in each block of k x k or one photon in k^2: 1
/// would take all, and beyond 16 next to nothing is left.
pub const SAMPLING_K: RangeInclusive<u32> = 2..=16;

/// Centres of environment maps.
pub const MAP_CENTRES: RangeInclusive<u32> = 1..=32;

/// Places that these are chosen from.
pub const MAP_CANDIDATES: RangeInclusive<u32> = 1..=crate::constants::MAP_CANDIDATES;

/// Texels along a side of a map's face.
pub const MAP_RESOLUTION: RangeInclusive<u32> = 8..=1024;

/// Surfaces behind each other in a map.
pub const MAP_LAYERS: RangeInclusive<u32> = 1..=4;

/// Texels of all maps: those of the shortest binding that every device has.
pub const MOST_MAP_TEXELS: u32 = 1 << 23;

/// Surfaces that an eye path may meet after its first, and that a path of path tracing may meet: paths keep them in 8
/// bits.
pub const DEPTH: RangeInclusive<u32> = 0..=MOST_DEPTH;

/// Surfaces that a photon may meet. Each is a step of the recorded pass, so that many make it long.
pub const PHOTON_BOUNCES: RangeInclusive<u32> = 0..=1 << 14;

/// Smoothing factors, in photon spacings.
pub const SMOOTHING: RangeInclusive<f32> = 0.1..=100.0;

/// Largest semiaxis of a footprint, in scene radii.
pub const LARGEST_FOOTPRINT: RangeInclusive<f32> = 1e-4..=1.0;

/// Exponent of the radius schedule: 1 never shrinks.
pub const ALPHA: RangeInclusive<f64> = 1e-6..=1.0;

/// A range in words: `2 to 16`.
pub fn words<T: Display>(range: &RangeInclusive<T>) -> String {
    format!("{} to {}", range.start(), range.end())
}
