//! Tables of what rough lobes reflect: how single scattering is scaled up to all scattering, and directional albedos.
//!
//! Single scattering loses the light that meets a second facet. A symmetric scale per direction, `s(wo) s(wi)`, gives
//! it back: for a lobe with reflectance 1 there is one positive `s` for which the scaled lobe reflects everything from
//! every direction, because scaling rows and columns of a positive symmetric kernel to sums of one has a solution
//! (Sinkhorn 1964). It is Turquin's compensation (2019, "Practical multiple scattering compensation for microfacet
//! models"), whose scale depends on one of the directions only, made reciprocal: photons and eye paths must agree.

use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::microfacet::{facet_weight, fresnel_dielectric, refract, sample_visible_normal, schlick_edge};
use crate::constants::{LOBE_COSINES, LOBE_MAX_SCALE, LOBE_ROUGHNESSES};

/// Entries of a row: one for each cosine.
const COSINES: usize = LOBE_COSINES as usize;
const ROWS: usize = LOBE_ROUGHNESSES as usize;
/// Facets for each entry: points of a Fibonacci lattice, and the number before in Fibonacci's sequence.
const FACETS: [usize; 2] = [377, 233];
/// The same for boundaries of glass, where total reflection begins at once.
const BOUNDARY_FACETS: [usize; 2] = [987, 610];
/// Between entries, interpolated scales are too large by up to half of a thousandth. This much less, lobes may lose a
/// thousandth of the light, and gain none.
const INTERPOLATED: f64 = 0.9995;
/// Steps of the iteration for the scales. Its error falls by a third or more in a step.
const STEPS: usize = 60;

/// GGX alpha of a row: roughnesses are spread evenly.
fn row_alpha(row: usize) -> f64 {
    (row as f64 / (ROWS - 1) as f64).powi(2)
}

/// Cosine of an entry: its square root is spread evenly, because lobes change fast at grazing angles.
fn entry_cosine(entry: usize) -> f64 {
    (entry as f64 / (COSINES - 1) as f64).powi(2).max(1e-4)
}

/// The two entries around a cosine, and the share of the second.
fn entries_around(cosine: f64) -> (usize, f64) {
    let place = cosine.clamp(0.0, 1.0).sqrt() * (COSINES - 1) as f64;
    let first = (place as usize).min(COSINES - 2);
    (first, place - first as f64)
}

/// The two rows around a GGX alpha, and the share of the second.
fn rows_around(alpha: f64) -> (usize, f64) {
    let place = alpha.clamp(0.0, 1.0).sqrt() * (ROWS - 1) as f64;
    let first = (place as usize).min(ROWS - 2);
    (first, place - first as f64)
}

/// The words of all rows. Each row is worked out alone, by as many threads as there are processors.
fn rows(row: impl Fn(usize) -> Vec<u32> + Sync) -> Vec<u32> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(ROWS);
    let row = &row;
    let share = |thread: usize| (thread..ROWS).step_by(threads).map(|at| (at, row(at))).collect::<Vec<_>>();
    let mut all: Vec<(usize, Vec<u32>)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|thread| scope.spawn(move || share(thread))).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("a row of a table")).collect()
    });
    all.sort_unstable_by_key(|(at, _)| *at);
    all.into_iter().flat_map(|(_, words)| words).collect()
}

/// What the lobe of reflection does with light at an angle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LobeEntry {
    /// Factor on single scattering, for each of the two directions.
    pub scale: f64,
    /// Albedo of single scattering with reflectance 1.
    pub single: f64,
    /// The same with reflectance (1 - cos)^5.
    pub edge: f64,
    /// The same, scaled.
    pub edge_scaled: f64,
}

impl LobeEntry {
    fn mix(self, other: Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        Self {
            scale: mix(self.scale, other.scale),
            single: mix(self.single, other.single),
            edge: mix(self.edge, other.edge),
            edge_scaled: mix(self.edge_scaled, other.edge_scaled),
        }
    }

    fn words(self) -> [u32; 2] {
        [pack(self.scale / f64::from(LOBE_MAX_SCALE), self.single), pack(self.edge, self.edge_scaled)]
    }

    fn of_words([a, b]: [u32; 2]) -> Self {
        let ([scale, single], [edge, edge_scaled]) = (unpack(a), unpack(b));
        Self { scale: scale * f64::from(LOBE_MAX_SCALE), single, edge, edge_scaled }
    }

    /// Albedo of a lobe with Schlick's reflectance from `f0` to `f90`, scattered any number of times. Light that is
    /// scattered again is reflected once more with `f0`.
    pub fn albedo(self, f0: f64, f90: f64) -> f64 {
        let (head_on, head_on_scaled) = (self.single - self.edge, 1.0 - self.edge_scaled);
        let again = f0 * (head_on_scaled - head_on) + (self.edge_scaled - self.edge);
        f0 * head_on + f90 * self.edge + f0 * again
    }
}

/// Two numbers in [0, 1] in 16 bits each.
fn pack(low: f64, high: f64) -> u32 {
    let code = |x: f64| {
        assert!((-1e-6..1.000001).contains(&x), "{x} is beyond the table's range");
        (x.clamp(0.0, 1.0) * 65535.0).round() as u32
    };
    code(low) | code(high) << 16
}

fn unpack(word: u32) -> [f64; 2] {
    [word & 0xffff, word >> 16].map(|x| f64::from(x) / 65535.0)
}

/// The table of reflection as the kernels read it (`glsl/lib/lobes.glsl`): for each roughness two words for each
/// cosine, and two for the mean over all directions. It is the same for all scenes, and computed once.
pub fn reflection_words() -> &'static [u32] {
    static WORDS: OnceLock<Vec<u32>> = OnceLock::new();
    WORDS.get_or_init(|| rows(|row| reflection_row(row).into_iter().flat_map(LobeEntry::words).collect()))
}

/// The entry for a lobe and a cosine, interpolated in the words as the kernels do it; `None` asks for the mean over
/// all directions, weighted by their cosines.
pub fn reflection(alpha: f64, cosine: Option<f64>) -> LobeEntry {
    let words = reflection_words();
    let entry = |row: usize, at: usize| {
        let first = 2 * (row * (COSINES + 1) + at);
        LobeEntry::of_words([words[first], words[first + 1]])
    };
    let (row, share) = rows_around(alpha);
    let in_row = |row: usize| match cosine {
        None => entry(row, COSINES),
        Some(cosine) => {
            let (first, share) = entries_around(cosine);
            entry(row, first).mix(entry(row, first + 1), share)
        }
    };
    in_row(row).mix(in_row(row + 1), share)
}

/// Facets seen at a cosine: the direction, and each with its share of what is seen.
fn facets(cosine: f64, alpha: f64, [count, generator]: [usize; 2]) -> (DVec3, impl Iterator<Item = (DVec3, f64)>) {
    let w = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let facet = move |i: usize| {
        // Denser at the rim of the disc, from where light is reflected farthest.
        let from_rim = 1.0 - (i as f64 + 0.5) / count as f64;
        let around = ((i * generator) % count) as f64 / count as f64;
        let h = sample_visible_normal(w, alpha, DVec2::new(1.0 - from_rim * from_rim, around));
        (h, 2.0 * from_rim / count as f64)
    };
    (w, (0..count).map(facet))
}

/// Adds a share of light that goes to a cosine to the entries around it, the first of which is at `offset`.
fn add(row: &mut [f64], offset: usize, cosine: f64, share: f64) {
    let (first, second) = entries_around(cosine);
    row[offset + first] += share * (1.0 - second);
    row[offset + first + 1] += share * second;
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The scales for which every row of `lobe` reflects everything: `scale[i] sum_k lobe[i][k] scale[k] = 1`. The mean of
/// two steps of Sinkhorn's iteration, which alone goes back and forth.
fn balance(lobe: &[Vec<f64>]) -> Vec<f64> {
    let mut scales = vec![1.0; lobe.len()];
    for _ in 0..STEPS {
        scales = lobe.iter().zip(&scales).map(|(row, scale)| (scale / dot(row, &scales)).sqrt()).collect();
    }
    scales
}

/// The entries of a row, and their mean over all directions, weighted by their cosines.
fn reflection_row(row: usize) -> Vec<LobeEntry> {
    let mut entries = if row == 0 { mirror_row() } else { rough_row(row_alpha(row)) };
    let mut mean = LobeEntry::default();
    for (entry, weight) in entries.iter().zip(mean_weights()) {
        mean.scale += weight * entry.scale;
        mean.single += weight * entry.single;
        mean.edge += weight * entry.edge;
        mean.edge_scaled += weight * entry.edge_scaled;
    }
    entries.push(mean);
    entries
}

/// The limit of smooth surfaces, which lose nothing.
fn mirror_row() -> Vec<LobeEntry> {
    let edge = |entry| schlick_edge(entry_cosine(entry));
    (0..COSINES).map(|i| LobeEntry { scale: 1.0, single: 1.0, edge: edge(i), edge_scaled: edge(i) }).collect()
}

fn rough_row(alpha: f64) -> Vec<LobeEntry> {
    let (mut all, mut edge) = (vec![vec![0.0; COSINES]; COSINES], vec![vec![0.0; COSINES]; COSINES]);
    for own in 0..COSINES {
        let (w, facets) = facets(entry_cosine(own), alpha, FACETS);
        for (h, share) in facets {
            let wi = 2.0 * w.dot(h) * h - w;
            if wi.z > 0.0 {
                let share = share * facet_weight(w.z, wi.z, alpha);
                add(&mut all[own], 0, wi.z, share);
                add(&mut edge[own], 0, wi.z, share * schlick_edge(w.dot(h)));
            }
        }
    }
    let scales = balance(&all);
    let entry = |i: usize| LobeEntry {
        scale: scales[i] * INTERPOLATED,
        single: all[i].iter().sum(),
        edge: edge[i].iter().sum(),
        edge_scaled: scales[i] * dot(&edge[i], &scales),
    };
    (0..COSINES).map(entry).collect()
}

/// Integral of 2 cos over [0, 1] times the function that is 1 at an entry and 0 at all others, linear in the square
/// root of the cosine: weights of a mean that is exact for what the kernels interpolate.
fn mean_weights() -> Vec<f64> {
    // With x the square root: 2 cos d(cos) = 4 x^3 dx. The antiderivatives of x^3 and x^4.
    let h = 1.0 / (COSINES - 1) as f64;
    let moments = |a: f64, b: f64| [(b.powi(4) - a.powi(4)) / 4.0, (b.powi(5) - a.powi(5)) / 5.0];
    let mut weights = vec![0.0; COSINES];
    for i in 0..COSINES - 1 {
        let (a, b) = (i as f64 * h, (i + 1) as f64 * h);
        let [third, fourth] = moments(a, b);
        let rising = 4.0 * (fourth - a * third) / h;
        weights[i] += 4.0 * third - rising;
        weights[i + 1] += rising;
    }
    weights
}

/// The table of a rough boundary between dielectrics (`glsl/lib/lobes.glsl`): for each roughness a word for each
/// cosine and one for the mean over all directions, with the albedo of single scattering outside and inside. What is
/// missing to one leaves by further facets ([`super::Boundary`]).
pub fn boundary_words(ior: f64) -> Vec<u32> {
    let row = |row: usize| {
        let albedo = |inside: bool| {
            let of =
                |i: usize| if row == 0 { 1.0 } else { boundary_albedo(row_alpha(row), ior, (entry_cosine(i), inside)) };
            let entries: Vec<f64> = (0..COSINES).map(of).collect();
            let mean = dot(&entries, &mean_weights());
            entries.into_iter().chain([mean])
        };
        albedo(false).zip(albedo(true)).map(|(outside, inside)| pack(outside, inside)).collect()
    };
    rows(row)
}

/// Albedo of single scattering for light from a cosine outside or inside.
fn boundary_albedo(alpha: f64, ior: f64, (cosine, inside): (f64, bool)) -> f64 {
    let eta = if inside { ior } else { 1.0 / ior };
    let (w, facets) = facets(cosine, alpha, BOUNDARY_FACETS);
    let of = |(h, share): (DVec3, f64)| {
        let cosine = w.dot(h);
        let reflectance = fresnel_dielectric(cosine, eta);
        let wi = 2.0 * cosine * h - w;
        let reflected = if wi.z > 0.0 { reflectance * facet_weight(w.z, wi.z, alpha) } else { 0.0 };
        let behind = refract(w, h, eta).filter(|wi| wi.z < 0.0);
        let refracted = behind.map_or(0.0, |wi| (1.0 - reflectance) * facet_weight(w.z, wi.z, alpha));
        share * (reflected + refracted)
    };
    facets.map(of).sum()
}

/// Albedo of a boundary for a cosine outside or inside, interpolated in its words as the kernels do it; `None` asks for
/// the mean over all directions, weighted by their cosines.
pub fn boundary(words: &[u32], alpha: f64, (cosine, inside): (Option<f64>, bool)) -> f64 {
    let entry = |row: usize, at: usize| unpack(words[row * (COSINES + 1) + at])[usize::from(inside)];
    let (row, share) = rows_around(alpha);
    let in_row = |row: usize| match cosine {
        None => entry(row, COSINES),
        Some(cosine) => {
            let (first, share) = entries_around(cosine);
            entry(row, first) + (entry(row, first + 1) - entry(row, first)) * share
        }
    };
    in_row(row) + (in_row(row + 1) - in_row(row)) * share
}
