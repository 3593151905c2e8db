//! The specification of the estimate from the k nearest photons (glsl/lib/knn.glsl), by sorting all of them.

use std::f64::consts::PI;

use super::Weight;
use super::reference::{density, float, longer_semiaxis, shape};
use crate::constants::KNN_LEAST_RADIUS;
use crate::kernels::generated::{EyeHit, Photon};

/// What is found at a hit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Found {
    /// Radiance: caustic, then other light.
    pub light: [[f64; 3]; 2],
    /// Photons that counted, of both classes.
    pub accepted: u32,
}

/// Gathered radiance of each hit on a Lambert surface from the `k` nearest photons of each class. Distances are
/// compared in single precision, as the kernels do, everything else is computed in double.
pub fn gather(hits: &[EyeHit], photons: &[Photon], weight: Weight, k: usize) -> Vec<Found> {
    hits.iter().map(|hit| at(hit, photons, weight, k)).collect()
}

fn at(hit: &EyeHit, photons: &[Photon], weight: Weight, k: usize) -> Found {
    let mut found = Found::default();
    for class in 0..2 {
        let counts = |photon: &&Photon| {
            usize::from(f32::from_bits(photon.d[3]) > 0.0) == class && density(hit, photon, Weight::Constant) > 0.0
        };
        let mut sorted: Vec<_> = photons.iter().filter(counts).map(|photon| (distance2(hit, photon), photon)).collect();
        // Stable: equal distances stay in the order of the photons.
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let disc = sorted.get(k).map(|next| f64::from(next.0));
        for (d2, photon) in sorted.iter().take(k) {
            let density = match disc {
                None => density(hit, photon, weight),
                Some(disc) => {
                    let r2 = disc.max((f64::from(KNN_LEAST_RADIUS) * longer_semiaxis(photon)).powi(2));
                    shape(weight, (f64::from(*d2) / r2).min(1.0)) / (PI * r2)
                }
            };
            (0..3).for_each(|i| found.light[class][i] += density * float(photon.b[i]) * float(hit.b[i]));
            found.accepted += 1;
        }
    }
    found
}

fn distance2(hit: &EyeHit, photon: &Photon) -> f32 {
    let [x, y, z]: [f32; 3] = std::array::from_fn(|i| f32::from_bits(hit.a[i]) - f32::from_bits(photon.a[i]));
    x * x + y * y + z * z
}
