//! The specification of the density estimators for Lambert surfaces, in double precision, and photons and hits to feed
//! it.

use super::Weight;
pub use crate::constants::BOUNDARY_FAR;
use crate::constants::{MOST_NARROWER, SAME_SURFACE, SLAB};
use crate::kernels::generated::{Aabb, EyeHit, Photon};

/// A photon with an elliptic footprint.
#[derive(Debug, Clone, Copy)]
pub struct Disc {
    /// Centre.
    pub position: [f32; 3],
    /// Unit normal of the surface that it lies on.
    pub normal: [f32; 3],
    /// Semiaxes: lengths along two orthogonal unit vectors in the plane, which follow from the normal.
    pub radii: [f32; 2],
    /// Flux in watts.
    pub flux: [f32; 3],
    /// Unit direction of travel.
    pub direction: [f32; 3],
    /// Focused by mirrors or glass.
    pub caustic: bool,
}

/// Least distance of a boundary that is stored, in units (glsl/lib/boundary.glsl).
const LEAST_DISTANCE: f32 = 6.103_515_6e-5;

/// Boundaries of the surface around a hit (glsl/lib/boundary.glsl).
#[derive(Debug, Clone, Copy)]
pub struct Boundaries {
    /// Unit vector in the surface, at right angles to its normal.
    pub across: [f32; 3],
    /// Distances towards `across` and against it, towards the normal's cross product with it and against that, in units
    /// of `unit`; [`BOUNDARY_FAR`] for none.
    pub reach: [f32; 4],
    /// In scene units.
    pub unit: f32,
}

impl Boundaries {
    /// As they are stored. Distances lose all but ten binary digits.
    pub fn stored(&self) -> [u32; 4] {
        let half = |x: f32| (x.max(LEAST_DISTANCE).to_bits() >> 13) - (112 << 10);
        let [a, b, c, d] = self.reach.map(half);
        [oct_encode(self.across), a | b << 16, c | d << 16, self.unit.to_bits()]
    }
}

impl Disc {
    /// As it is stored, and the box around its footprint.
    pub fn stored(&self) -> (Photon, Aabb) {
        let normal = oct_decode(oct_encode(self.normal)).map(|x| x as f32);
        let (t, b) = tangents(normal);
        let [u, v] = self.radii;
        let longer = u.max(v);
        let density = 1.0 / (std::f32::consts::PI * u * v);
        let words = |v: [f32; 3], w: u32| [v[0].to_bits(), v[1].to_bits(), v[2].to_bits(), w];
        let photon = Photon {
            a: words(self.position, oct_encode(self.normal)),
            b: words(self.flux, oct_encode(self.direction)),
            c: words(t.map(|x| x / u), 0),
            d: words(b.map(|x| x / v), if self.caustic { -density } else { density }.to_bits()),
        };
        let extent: [f32; 3] = std::array::from_fn(|k| (t[k] * u).hypot(b[k] * v) + SLAB * longer * normal[k].abs());
        let min = std::array::from_fn(|k| self.position[k] - extent[k]);
        (photon, Aabb { min, max: std::array::from_fn(|k| self.position[k] + extent[k]) })
    }
}

/// A hit on a Lambert surface without boundaries; `factor` is throughput times reflectance over pi.
pub fn lambert_hit(position: [f32; 3], normal: [f32; 3], factor: [f32; 3]) -> EyeHit {
    let words = |v: [f32; 3], w: u32| [v[0].to_bits(), v[1].to_bits(), v[2].to_bits(), w];
    let n = oct_encode(normal);
    let (a, b, c) = (words(position, n), words(factor, n), words([1.0; 3], 1f32.to_bits()));
    EyeHit { a, b, c, d: [n, 0, 0, 0], e: [0; 4] }
}

/// Gathered radiance of each hit from all photons: caustic, then other light.
pub fn gather(hits: &[EyeHit], photons: &[Photon], weight: Weight) -> Vec<[[f64; 3]; 2]> {
    let one = |hit: &EyeHit| {
        let mut sums = [[0.0; 3]; 2];
        for photon in photons {
            let density = density(hit, photon, weight);
            let sum = &mut sums[usize::from(f32::from_bits(photon.d[3]) > 0.0)];
            (0..3).for_each(|k| sum[k] += density * float(photon.b[k]) * float(hit.b[k]));
        }
        sums
    };
    hits.iter().map(one).collect()
}

/// Weight [1/area] of a photon's footprint at a hit, on the hit's surface.
pub fn density(hit: &EyeHit, photon: &Photon, weight: Weight) -> f64 {
    let offset: [f64; 3] = std::array::from_fn(|k| float(hit.a[k]) - float(photon.a[k]));
    let along = |words: &[u32; 4]| (0..3).map(|k| offset[k] * float(words[k])).sum::<f64>();
    let at = [along(&photon.c), along(&photon.d)];
    let r2 = at[0] * at[0] + at[1] * at[1];
    let normal = oct_decode(photon.a[3]);
    let height = dot(offset, normal) / longer_semiaxis(photon);
    let facing = dot(normal, oct_decode(hit.a[3]));
    let covers = r2 < 1.0 && height.abs() < f64::from(SLAB) && facing > f64::from(SAME_SURFACE);
    if !covers {
        return 0.0;
    }
    let folded = if hit.e[3] == 0 { shape(weight, r2) } else { folded(hit, photon, offset, weight) };
    float(photon.d[3]).abs() * facing * folded
}

/// Weight of a photon between the boundaries of a hit, over the weight that is constant: its footprint is made as
/// narrow as two boundaries are apart, and each boundary adds a mirror image.
fn folded(hit: &EyeHit, photon: &Photon, offset: [f64; 3], weight: Weight) -> f64 {
    let across = oct_decode(hit.e[0]);
    let axes = [across, cross(oct_decode(hit.a[3]), across)];
    let unit = float(hit.e[3]);
    let reach = [[hit.e[1] & 0xffff, hit.e[1] >> 16], [hit.e[2] & 0xffff, hit.e[2] >> 16]];
    let reach = reach.map(|side| side.map(|bits| unit * f64::from(f32::from_bits((bits << 13) + (112 << 23)))));
    let place = axes.map(|axis| -dot(offset, axis));
    if (0..2).any(|k| place[k] > reach[k][0] || -place[k] > reach[k][1]) {
        return 0.0;
    }
    let dual = [&photon.c, &photon.d].map(|words| [0, 1, 2].map(|k| float(words[k])));
    let mut at = dual.map(|u| dot(u, offset));
    let (mut images, mut narrower) = (vec![[0.0; 2]], 1.0);
    for k in 0..2 {
        let semiaxes = dual.map(|u| dot(u, axes[k]) / dot(u, u));
        let half_width = semiaxes[0].hypot(semiaxes[1]);
        let factor = (half_width / (reach[k][0] + reach[k][1])).clamp(1.0, f64::from(MOST_NARROWER));
        (0..2).for_each(|i| at[i] -= semiaxes[i] * place[k] * (factor - 1.0) / half_width.powi(2));
        narrower *= factor;
        let shifts = [0.0, reach[k][0], -reach[k][1]].map(|d| 2.0 * factor * d / half_width.powi(2));
        let shifted = |from: &[f64; 2]| shifts.map(|s| [from[0] + s * semiaxes[0], from[1] + s * semiaxes[1]]);
        images = images.iter().flat_map(shifted).collect();
    }
    let seen = |image: &[f64; 2]| (at[0] + image[0]).powi(2) + (at[1] + image[1]).powi(2);
    images.iter().map(seen).filter(|r2| *r2 < 1.0).map(|r2| shape(weight, r2)).sum::<f64>() * narrower
}

/// Longer semiaxis of a photon's footprint.
pub(super) fn longer_semiaxis(photon: &Photon) -> f64 {
    let square = |words: &[u32; 4]| (0..3).map(|k| float(words[k]).powi(2)).sum::<f64>();
    square(&photon.c).min(square(&photon.d)).sqrt().recip()
}

/// Weight at the squared relative radius `r2` <= 1, over the weight that is constant.
pub(super) fn shape(weight: Weight, r2: f64) -> f64 {
    match weight {
        Weight::Constant => 1.0,
        Weight::Cone => 0.2f64.min(1.0 - r2.sqrt()) / (0.2 * (0.2f64 * 0.2 / 3.0 - 0.2 + 1.0)),
        Weight::Epanechnikov => 2.0 * (1.0 - r2),
    }
}

pub(super) fn float(word: u32) -> f64 {
    f64::from(f32::from_bits(word))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Two unit vectors at right angles to a unit normal and to each other.
fn tangents(n: [f32; 3]) -> ([f32; 3], [f32; 3]) {
    let axis = if n[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let cross =
        |a: [f32; 3], b: [f32; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let t = cross(n, axis);
    let length = t.iter().map(|x| x * x).sum::<f32>().sqrt();
    let t = t.map(|x| x / length);
    (t, cross(n, t))
}

/// Octahedral code of a direction, 16 bits an axis (oct_encode of glsl/lib/math.glsl).
pub fn oct_encode(v: [f32; 3]) -> u32 {
    let sum = v[0].abs() + v[1].abs() + v[2].abs();
    let p = [v[0] / sum, v[1] / sum];
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    let folded = [(1.0 - p[1].abs()) * sign(p[0]), (1.0 - p[0].abs()) * sign(p[1])];
    let p = if v[2] < 0.0 { folded } else { p };
    let code = |x: f32| ((x * 32767.0).round().clamp(-32767.0, 32767.0) + 32768.0) as u32;
    code(p[0]) | (code(p[1]) << 16)
}

/// The direction of a code.
pub fn oct_decode(bits: u32) -> [f64; 3] {
    let axis = |x: u32| (f64::from(x) - 32768.0) / 32767.0;
    let (x, y) = (axis(bits & 0xffff), axis(bits >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let t = (-z).max(0.0);
    let fold = |x: f64| if x >= 0.0 { x - t } else { x + t };
    let v = [fold(x), fold(y), z];
    let length = dot(v, v).sqrt();
    v.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each weight integrates to one over the footprint, on its own plane and on one that is tilted by 30 degrees.
    #[test]
    fn weights_integrate_to_one() {
        for tilt in [0.0f32, 0.5] {
            let normal = [tilt.sin(), 0.0, tilt.cos()];
            let disc = Disc {
                position: [0.0; 3],
                normal: [0.0, 0.0, 1.0],
                radii: [1.0, 0.25],
                flux: [1.0; 3],
                direction: [0.0, 0.0, -1.0],
                caustic: false,
            };
            let (photon, _) = disc.stored();
            for weight in [Weight::Constant, Weight::Cone, Weight::Epanechnikov] {
                let (steps, half) = (400, 1.25f32);
                let cell = 2.0 * half / steps as f32;
                let mut sum = 0.0;
                for i in 0..steps * steps {
                    let (u, v) = ((i % steps) as f32 * cell - half, (i / steps) as f32 * cell - half);
                    // The plane is parametrised by its own lengths.
                    let position = [u * tilt.cos(), v, -u * tilt.sin()];
                    sum += density(&lambert_hit(position, normal, [1.0; 3]), &photon, weight);
                }
                let integral = sum * f64::from(cell * cell);
                // The slab of half a longer semiaxis cuts the tilted plane at tan(0.5) = 0.546: only its rim.
                let expected = if tilt == 0.0 { 1.0 } else { 0.99 };
                assert!((integral - expected).abs() < 0.012, "{weight:?} tilted by {tilt}: {integral}");
            }
        }
    }

    /// Even light is even between boundaries: photons everywhere in a strip or a corner bring a hit there as much as
    /// they do far from any boundary, if their footprints are round and no strip is very thin; those beyond bring
    /// nothing.
    #[test]
    fn boundaries_keep_even_light_even() {
        let far = BOUNDARY_FAR;
        let even = 0.98..1.02;
        let lines = [
            ([0.25, far, far, far], even.clone()),
            ([0.25, 0.125, far, far], even.clone()),
            ([0.5, far, 0.125, far], even.clone()),
            ([0.1875; 4], even),
            // A strip of a tenth of a semiaxis is thinner than footprints are made narrow: some of the light is lost.
            ([0.025, 0.025, far, far], 0.3..0.9),
        ];
        for (reach, expected) in lines {
            let boundaries = Boundaries { across: [0.6, 0.8, 0.0], reach, unit: 2.0 };
            let hit = EyeHit { e: boundaries.stored(), ..lambert_hit([0.0; 3], [0.0, 0.0, 1.0], [1.0; 3]) };
            for weight in [Weight::Constant, Weight::Cone, Weight::Epanechnikov] {
                let (steps, cell) = (300, 2.2f32 / 300.0);
                let mut sum = 0.0;
                for i in 0..steps * steps {
                    let at = |k: i32| (k as f32 + 0.5) * cell - 1.1;
                    let position = [at(i % steps), at(i / steps), 0.0];
                    let normal = [0.0, 0.0, 1.0];
                    let direction = [0.0, 0.0, -1.0];
                    let disc = Disc { position, normal, radii: [1.0; 2], flux: [1.0; 3], direction, caustic: false };
                    sum += density(&hit, &disc.stored().0, weight);
                }
                let found = sum * f64::from(cell * cell);
                assert!(expected.contains(&found), "{weight:?} within {reach:?}: {found}");
            }
        }
    }

    #[test]
    fn directions_survive_their_code() {
        for v in [[0.0f32, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, -0.8, 0.0], [-0.48, 0.6, -0.64]] {
            let decoded = oct_decode(oct_encode(v));
            assert!((0..3).all(|k| (decoded[k] - f64::from(v[k])).abs() < 1e-4), "{v:?} became {decoded:?}");
        }
    }
}
