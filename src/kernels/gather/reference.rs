//! The specification of the density estimators for Lambert surfaces, in double precision, and photons and hits to feed
//! it.

use super::Weight;
use crate::constants::{FOLD, SAME_SURFACE, SLAB};
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
    /// Boundary: a unit vector and a distance below 1, both in units of the semiaxes.
    pub fold: Option<([f32; 2], f32)>,
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
            c: words(t.map(|x| x / u), self.fold.map_or(0, |(n, reach)| fold_encode(n, reach))),
            d: words(b.map(|x| x / v), if self.caustic { -density } else { density }.to_bits()),
        };
        let extent: [f32; 3] = std::array::from_fn(|k| (t[k] * u).hypot(b[k] * v) + SLAB * longer * normal[k].abs());
        let min = std::array::from_fn(|k| self.position[k] - extent[k]);
        (photon, Aabb { min, max: std::array::from_fn(|k| self.position[k] + extent[k]) })
    }
}

/// A hit on a Lambert surface; `factor` is throughput times reflectance over pi.
pub fn lambert_hit(position: [f32; 3], normal: [f32; 3], factor: [f32; 3]) -> EyeHit {
    let words = |v: [f32; 3], w: u32| [v[0].to_bits(), v[1].to_bits(), v[2].to_bits(), w];
    let n = oct_encode(normal);
    EyeHit { a: words(position, n), b: words(factor, n), c: words([1.0; 3], 1f32.to_bits()), d: [n, 0, 0, 0] }
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
    let folded = match fold_decode(photon.c[3]) {
        None => shape(weight, r2),
        Some((n, reach)) => {
            let beyond = at[0] * n[0] + at[1] * n[1] - reach;
            let image: f64 = (0..2).map(|k| (at[k] - 2.0 * beyond * n[k]).powi(2)).sum();
            let back = if image < 1.0 { shape(weight, image) } else { 0.0 };
            if beyond > 0.0 { 0.0 } else { shape(weight, r2) + back }
        }
    };
    float(photon.d[3]).abs() * facing * folded
}

/// Longer semiaxis of a photon's footprint.
pub(super) fn longer_semiaxis(photon: &Photon) -> f64 {
    let square = |words: &[u32; 4]| (0..3).map(|k| float(words[k]).powi(2)).sum::<f64>();
    square(&photon.c).min(square(&photon.d)).sqrt().recip()
}

/// A boundary as it is stored (fold_encode of glsl/lib/fold.glsl).
pub fn fold_encode(n: [f32; 2], reach: f32) -> u32 {
    let [x, y] = n.map(|x| ((x * 511.0).round() + 512.0) as u32);
    FOLD | ((reach * 2048.0) as u32).min(2047) << 20 | x << 10 | y
}

fn fold_decode(fold: u32) -> Option<([f64; 2], f64)> {
    let component = |shift: u32| f64::from((fold >> shift) & 1023) - 512.0;
    let (x, y) = (component(10), component(0));
    let length = x.hypot(y);
    let reach = (f64::from((fold >> 20) & 2047) + 0.5) / 2048.0;
    (fold & FOLD != 0).then_some(([x / length, y / length], reach))
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
                fold: None,
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

    #[test]
    fn directions_survive_their_code() {
        for v in [[0.0f32, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, -0.8, 0.0], [-0.48, 0.6, -0.64]] {
            let decoded = oct_decode(oct_encode(v));
            assert!((0..3).all(|k| (decoded[k] - f64::from(v[k])).abs() < 1e-4), "{v:?} became {decoded:?}");
        }
    }
}
