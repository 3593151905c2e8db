//! The specification of the hash grid's filing ([`mod@super::hash`]).

use super::hash::{HASH_BITS, LEVELS, NONE};
use crate::constants::{HASH_GREATEST, HASH_LARGE, HASH_SMALL, HASH_WIDER};
use crate::kernels::generated::{Aabb, HashLevel, Photon};
use crate::kernels::reduce::is_valid;

/// Centre of a photon.
pub fn centre(photon: &Photon) -> [f32; 3] {
    std::array::from_fn(|k| f32::from_bits(photon.a[k]))
}

/// Largest distance along any axis from a photon's centre to the sides of its footprint's box; 0 where there is none.
pub fn extent(photon: &Photon, b: &Aabb) -> f32 {
    let p = centre(photon);
    let furthest = (0..3).map(|k| (b.max[k] - p[k]).max(p[k] - b.min[k])).fold(f32::NEG_INFINITY, f32::max);
    let extent = furthest * 1.000_001;
    if is_valid(b) && (0.0..=f32::MAX).contains(&extent) { extent } else { 0.0 }
}

/// Radius and scale of the levels, for the largest extent and the box of all footprints.
pub fn levels(largest: f32, bounds: &Aabb) -> Vec<HashLevel> {
    let reach = bounds.min.iter().chain(&bounds.max).fold(0f32, |a, x| a.max(x.abs()));
    let level = |l: u32| {
        let radius = (largest * 0.5f32.powi(l as i32)).max(HASH_SMALL).max(HASH_SMALL * reach);
        let scale = 1.0 / (2.0 * HASH_WIDER * radius);
        if reach <= HASH_LARGE { HashLevel { radius, scale } } else { HashLevel { radius: 0.0, scale: 0.0 } }
    };
    (0..LEVELS).map(level).collect()
}

/// The level of an extent among `count`: the last one whose radius is not below it.
pub fn level(extent: f32, largest: f32, count: u32) -> u32 {
    let fits = |l: &u32| extent <= largest * 0.5f32.powi(*l as i32);
    (0..count).take_while(fits).last().unwrap_or(0)
}

/// A coordinate, in cells and whole, as 20 bits.
pub fn coordinate(cell: f32) -> u32 {
    let wrapped = f64::from(cell).rem_euclid(1_048_576.0) as u32;
    let high = (f64::from(cell) / 1_048_576.0).floor() as f32;
    let mixed = if high == 0.0 { 0 } else { high.to_bits().wrapping_mul(0x9e37_79b1) >> 12 };
    (wrapped ^ mixed) & 0xfffff
}

/// 64 to 32 bits by shifts (Wang 2007, "Integer Hash Function").
pub fn wang(mut k: u64) -> u32 {
    k = (!k).wrapping_add(k << 18);
    k ^= k >> 31;
    k = k.wrapping_mul(21);
    k ^= k >> 11;
    k = k.wrapping_add(k << 6);
    k ^= k >> 22;
    k as u32
}

/// Key of the cell in which a place is filed.
pub fn key(level: u32, place: [f32; 3], of: HashLevel, hash_bits: u32) -> u32 {
    let [x, y, z] = place.map(|p| u64::from(coordinate((p * of.scale).floor())));
    let hash = wang(x | y << 20 | z << 40 | u64::from(level) << 60) & ((1 << hash_bits) - 1);
    level << HASH_BITS | hash.min(HASH_GREATEST)
}

/// The cells along an axis that a hit at `x` meets, ascending.
pub fn cells_met(x: f32, of: HashLevel) -> Vec<f32> {
    let (low, high) = (((x - of.radius) * of.scale).floor(), ((x + of.radius) * of.scale).floor());
    // Beyond 2^23 not all whole numbers are floats.
    let next = |cell: &f32| Some((cell + 1.0).max(cell.next_up()));
    std::iter::successors(Some(low), next).take_while(|cell| *cell <= high).collect()
}

/// Keys of all photons in `levels` levels, and the order of the photons by key.
pub fn file(photons: &[(Photon, Aabb)], cells: &[HashLevel], levels: u32, hash_bits: u32) -> Vec<(u32, u32)> {
    let largest = photons.iter().map(|(p, b)| extent(p, b)).fold(0f32, f32::max);
    let one = |((photon, b), i): (&(Photon, Aabb), u32)| {
        let level = level(extent(photon, b), largest, levels);
        let filed = is_valid(b) && centre(photon).iter().all(|x| x.is_finite());
        (if filed { key(level, centre(photon), cells[level as usize], hash_bits) } else { NONE }, i)
    };
    let mut all: Vec<_> = photons.iter().zip(0..).map(one).collect();
    all.sort_unstable();
    all
}

/// Key, first and end of each run of sorted keys, without those that are in no cell.
pub fn runs(keys: &[u32]) -> Vec<(u32, u32, u32)> {
    let mut runs: Vec<(u32, u32, u32)> = Vec::new();
    for (&key, i) in keys.iter().zip(0..).filter(|(key, _)| **key != NONE) {
        match runs.last_mut() {
            Some(run) if run.0 == key => run.2 = i + 1,
            _ => runs.push((key, i, i + 1)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn coordinates_are_distinct_nearby_and_far() {
        let near: HashSet<u32> = (-5000..5000).map(|x| coordinate(x as f32)).collect();
        assert_eq!(near.len(), 10_000);
        assert_eq!(coordinate(-0.0), coordinate(0.0));
        // Where floats are whole multiples of 2^20, wrapping alone would leave one cell.
        let far: HashSet<u32> =
            (0..10_000u32).map(|k| coordinate(f32::from_bits(2f32.powi(44).to_bits() + k))).collect();
        assert!(far.len() > 9000, "{} of 10000", far.len());
    }

    /// No photon within the radius is in another cell than those that a hit meets, and these are two, or near the end
    /// of the floats' precision at most five.
    #[test]
    fn a_hit_meets_few_cells_and_misses_none() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut most = [0; 2];
        for _ in 0..400_000 {
            let radius = 2f32.powf(20.0 * random() - 10.0);
            let of = levels(radius, &Aabb { min: [-1.0; 3], max: [1.0; 3] })[0];
            let x = radius * 2f32.powf(50.0 * random()) * (if random() < 0.5 { -1.0 } else { 1.0 });
            let met = cells_met(x, of);
            let far = usize::from((x * of.scale).abs() > 32_768.0);
            most[far] = most[far].max(met.len());
            for p in [x - radius, x + radius, x, x + radius * (2.0 * random() - 1.0)] {
                let within = (f64::from(p) - f64::from(x)).abs() <= f64::from(of.radius);
                assert!(!within || met.contains(&(p * of.scale).floor()), "{p} is not met from {x}, radius {radius}");
            }
        }
        assert!(most[0] == 2 && most[1] <= 5, "{most:?} cells, near and far");
    }

    /// Against integers of arbitrary length, reduced modulo 2^64 after each step.
    #[test]
    fn the_hash_is_wangs() {
        let words =
            [(0u64, 0x2aea_a2ab), (1, 0x1551_5fbc), (0x0123_4567_89ab_cdef, 0xadfa_ddd7), (u64::MAX, 0x1fbb_f8ea)];
        for (word, hash) in words {
            assert_eq!(wang(word), hash, "{word:#x}");
        }
    }
}
