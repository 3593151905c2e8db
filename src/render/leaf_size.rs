//! How many photons a leaf of the photon map holds.

use crate::kernels::lbvh::COUNTED_LEAF;

/// Photons in a leaf for each photon that a point of the scene meets on average: fitted, see [`automatic`].
const LEAF_PER_COVERAGE: f64 = 0.5;

/// The leaf size T of Fabianowski and Dingliana 2009, section 5.3: proportional to `coverage`, the sum of the footprints'
/// areas over the area of all surfaces; a power of two between 1 and [`COUNTED_LEAF`].
pub fn automatic(coverage: f64) -> u32 {
    let wanted = (LEAF_PER_COVERAGE * coverage).max(1.0);
    // NaN, where nothing has an area, became 1.
    let exponent = wanted.log2().round().min(f64::from(COUNTED_LEAF.ilog2()));
    1 << exponent as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_grow_with_the_overlap_and_stay_within_the_encoding() {
        let sizes: Vec<u32> = (-4..20).map(|i| automatic(2f64.powi(i))).collect();
        assert!(sizes.is_sorted() && sizes.iter().all(|size| size.is_power_of_two()));
        assert_eq!((sizes[0], *sizes.last().expect("some")), (1, COUNTED_LEAF));
        assert_eq!(automatic(2.0 / LEAF_PER_COVERAGE), 2);
        for odd in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(automatic(odd), 1);
        }
        assert_eq!(automatic(f64::INFINITY), COUNTED_LEAF);
    }
}
