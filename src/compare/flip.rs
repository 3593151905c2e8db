//! FLIP: how different two pictures look to somebody who flips between them, 0 (equal) to 1 per pixel.
//!
//! Sources: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for
//! Alternating Images" (2020), here A20, for pictures in 0 ... 1 (LDR-FLIP); Andersson, Nilsson, Shirley and
//! Akenine-Möller, "Visualizing Errors in Rendered High Dynamic Range Images" (2021), here A21, for radiance
//! (HDR-FLIP: the worst of LDR-FLIP over a range of exposures). Steps: opponent colours are blurred as the eye blurs
//! them at the given distance (`Eye`), their difference is taken in a uniform colour space and compressed, and
//! edges and points that only one picture has raise it.
//!
//! `tools/verify-flip` compares these numbers with those of the authors' program.

use crate::compare::flip_filters::{Eye, Plane};
use crate::compare::metrics::pair;
use crate::error::{Error, Result};
use crate::picture::image::{Channels, Picture};

use glam::{DMat3, DVec3, Mat3, Vec3};

/// Pixels per degree of sight of A20: a display of 3840 pixels on 0.7 m, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 67.020_64;

/// Weight of the colour difference before compression (A20, section 4.1).
const COMPRESSION: f32 = 0.7;
/// Differences up to this share of the greatest use [`KNEE_ERROR`] of the range (A20, section 4.1).
const KNEE: f32 = 0.4;
const KNEE_ERROR: f32 = 0.95;
/// Exponent of the feature difference (A20, section 4.2).
const FEATURE_EXPONENT: f32 = 0.5;

/// Tone-mapped value that a luminance has at the ends of the range of exposures (A21, section 3).
const BRIGHT: f64 = 0.85;
/// Least luminance that the range of exposures is fitted to.
const DARKEST: f64 = f32::EPSILON as f64;
/// Above this a tone-mapped radiance is white to the last bit; it keeps infinities out of the arithmetic.
const WHITE: f64 = 1e9;

/// A fit of the ACES film curve (Narkowicz 2016) with exposure factor 0.6: `(a x^2 + b x + c) / (d x^2 + e x + f)`.
const ACES: [f64; 6] = [0.36 * 2.51, 0.6 * 0.03, 0.0, 0.36 * 2.43, 0.6 * 0.59, 0.14];

/// Chromaticities of the sRGB primaries.
const PRIMARIES: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
/// Chromaticity of the white point D65, with the digits that the authors' program uses.
const D65: [f64; 2] = [0.312_71, 0.329_02];

/// Luminance of linear Rec.709 for the range of exposures, with the digits of the standard.
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// A FLIP of two pictures.
#[derive(Debug, Clone, PartialEq)]
pub struct Flip {
    /// Mean over the pixels, 0 ... 1.
    pub mean: f64,
    /// The difference of each pixel, 0 ... 1.
    pub map: Vec<f32>,
}

impl Flip {
    fn new(map: Vec<f32>) -> Self {
        let mean = map.iter().map(|&error| f64::from(error)).sum::<f64>() / map.len() as f64;
        Self { mean, map }
    }
}

/// The exposures over which HDR-FLIP takes the worst.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Exposures {
    /// The first, in stops: the brightest pixel of the reference is just not white.
    pub start: f64,
    /// The last, in stops: the median luminance of the reference is as bright.
    pub stop: f64,
    /// How many there are, evenly spaced, at least 2.
    pub count: u32,
}

impl Exposures {
    /// The range for a reference of interleaved linear RGB, at least one pixel (A21, section 3). Black counts as the
    /// luminance 2^-23, so that a mostly black picture has a finite range.
    pub fn of(reference: &[f32]) -> Self {
        let mut luminances: Vec<f64> = reference
            .chunks_exact(3)
            .map(|c| LUMINANCE.dot(DVec3::new(c[0].into(), c[1].into(), c[2].into()).max(DVec3::ZERO)))
            .collect();
        let middle = luminances.len() / 2;
        let (_, &mut median, brighter) = luminances.select_nth_unstable_by(middle, f64::total_cmp);
        let brightest = brighter.iter().copied().fold(median, f64::max);
        let stops = |luminance: f64| (bright_input() / luminance.max(DARKEST)).log2();
        let (start, stop) = (stops(brightest), stops(median));
        Self { start, stop, count: (stop - start).ceil().max(2.0) as u32 }
    }

    /// The exposures in stops.
    fn stops(self) -> impl Iterator<Item = f64> {
        let step = (self.stop - self.start) / f64::from(self.count - 1);
        (0..self.count).map(move |i| self.start + f64::from(i) * step)
    }
}

/// The input that [`ACES`] maps to [`BRIGHT`]: the greater root of a quadratic equation.
fn bright_input() -> f64 {
    let [a, b, c] = [0, 1, 2].map(|i| ACES[i] - BRIGHT * ACES[i + 3]);
    (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)
}

/// LDR-FLIP of one layer, `name` empty for the beauty layer: linear colours are cut off at 0 and 1, as an sRGB file
/// would without a tone curve. A pixel that is not finite in the picture has the difference 1. None for a layer that
/// is no colour.
///
/// # Errors
/// Those of [`crate::compare::metrics::compare`].
pub fn ldr(picture: &Picture, reference: &Picture, name: &str, pixels_per_degree: f64) -> Result<Option<Flip>> {
    Ok(Evaluator::new([picture, reference], name, pixels_per_degree)?.map(|evaluator| {
        let map = evaluator.difference(|channel| channel.clamp(0.0, 1.0));
        Flip::new(map)
    }))
}

/// HDR-FLIP of one layer, over the exposures that suit the reference ([`Exposures::of`]). Negative colours count as 0;
/// a pixel that is not finite in the picture has the difference 1. None for a layer that is no colour.
///
/// # Errors
/// Those of [`crate::compare::metrics::compare`].
pub fn hdr(
    picture: &Picture,
    reference: &Picture,
    name: &str,
    pixels_per_degree: f64,
) -> Result<Option<(Flip, Exposures)>> {
    Ok(Evaluator::new([picture, reference], name, pixels_per_degree)?.map(|evaluator| {
        let exposures = Exposures::of(evaluator.reference);
        let mut worst = vec![0.0_f32; evaluator.reference.len() / 3];
        for stops in exposures.stops() {
            let map = evaluator.difference(|channel| aces(f64::from(channel), stops.exp2()));
            worst.iter_mut().zip(map).for_each(|(worst, error)| *worst = worst.max(error));
        }
        (Flip::new(worst), exposures)
    }))
}

fn aces(channel: f64, gain: f64) -> f32 {
    let x = (channel.max(0.0) * gain).min(WHITE);
    let [a, b, c, d, e, f] = ACES;
    (((a * x + b) * x + c) / ((d * x + e) * x + f)).clamp(0.0, 1.0) as f32
}

/// What LDR-FLIP of two layers needs at every exposure.
struct Evaluator<'a> {
    picture: &'a [f32],
    reference: &'a [f32],
    size: [usize; 2],
    eye: Eye,
    colors: Colors,
}

impl<'a> Evaluator<'a> {
    fn new(pictures: [&'a Picture; 2], name: &str, pixels_per_degree: f64) -> Result<Option<Self>> {
        if !(1.0..=1000.0).contains(&pixels_per_degree) {
            return Err(Error::Usage(format!("{pixels_per_degree} pixels per degree are not between 1 and 1000")));
        }
        let (x, r) = pair(pictures[0], pictures[1], name)?;
        let size = [pictures[0].width as usize, pictures[0].height as usize];
        Ok((x.channels == Channels::Rgb).then(|| Self {
            picture: &x.data,
            reference: &r.data,
            size,
            eye: Eye::new(pixels_per_degree),
            colors: Colors::new(),
        }))
    }

    /// LDR-FLIP of each pixel, where `display` maps a finite linear channel to 0 ... 1.
    fn difference(&self, display: impl Fn(f32) -> f32) -> Vec<f32> {
        let (x, r) = (self.see(self.picture, &display), self.see(self.reference, &display));
        let pixels = x.uniform.iter().zip(&r.uniform).zip(x.features.iter().zip(&r.features));
        let errors = pixels.map(|((&x_color, &r_color), (x_features, r_features))| {
            let color = self.colors.compressed_difference(x_color, r_color);
            let feature = x_features.iter().zip(r_features).map(|(x, r)| (x - r).abs()).fold(0.0, f32::max);
            let feature = (feature * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT);
            color.powf(1.0 - feature)
        });
        let broken = self.picture.chunks_exact(3).map(|color| color.iter().any(|channel| !channel.is_finite()));
        errors.zip(broken).map(|(error, broken)| if broken { 1.0 } else { error }).collect()
    }

    /// A picture as it is seen.
    fn see(&self, data: &[f32], display: &impl Fn(f32) -> f32) -> Seen {
        let mut opponent = [(); 3].map(|()| Plane::new(self.size));
        for (pixel, color) in data.chunks_exact(3).enumerate() {
            let shown = Vec3::from_slice(color).map(|c| if c.is_finite() { display(c) } else { 0.0 });
            let values = self.colors.opponent(shown).to_array();
            opponent.iter_mut().zip(values).for_each(|(plane, value)| plane.values[pixel] = value);
        }
        let features = self.eye.features(&opponent[0]);
        let [y, cx, cz] = self.eye.blur(&opponent);
        let blurred = y.values.iter().zip(&cx.values).zip(&cz.values);
        let uniform = blurred.map(|((&y, &cx), &cz)| self.colors.uniform(Vec3::new(y, cx, cz))).collect();
        Seen { uniform, features }
    }
}

/// A picture after the eye.
struct Seen {
    /// Blurred colours in a uniform space.
    uniform: Vec<Vec3>,
    /// Strength of edges and of points.
    features: Vec<[f32; 2]>,
}

/// The matrices between linear Rec.709 and CIE XYZ relative to white, and the greatest colour difference.
struct Colors {
    to_xyz: Mat3,
    to_rgb: Mat3,
    greatest: f32,
}

impl Colors {
    fn new() -> Self {
        let to_xyz = rgb_to_relative_xyz();
        let mut colors = Self { to_xyz: to_xyz.as_mat3(), to_rgb: to_xyz.inverse().as_mat3(), greatest: 1.0 };
        // The greatest difference within the cube of colours is that of green and blue.
        let [green, blue] = [Vec3::Y, Vec3::Z].map(|color| colors.hunt_lab(color));
        colors.greatest = hyab(green, blue).powf(COMPRESSION);
        colors
    }

    /// Luminance, red-green and blue-yellow of A20's YCxCz, without its factors and offset, which a linear filter of
    /// sum 1 leaves alone.
    fn opponent(&self, rgb: Vec3) -> Vec3 {
        let xyz = self.to_xyz * rgb;
        Vec3::new(xyz.y, xyz.x - xyz.y, xyz.y - xyz.z)
    }

    /// Opponent colours in a uniform space; what blurring took out of the display's range is cut off.
    fn uniform(&self, opponent: Vec3) -> Vec3 {
        let y = opponent.x;
        let rgb = self.to_rgb * Vec3::new(y + opponent.y, y, y - opponent.z);
        self.hunt_lab(rgb.clamp(Vec3::ZERO, Vec3::ONE))
    }

    /// CIE L*a*b* with the Hunt effect: a and b times L / 100.
    fn hunt_lab(&self, rgb: Vec3) -> Vec3 {
        const DELTA: f32 = 6.0 / 29.0;
        let f = |t: f32| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
        let f = (self.to_xyz * rgb).map(f);
        let lightness = 116.0 * f.y - 16.0;
        Vec3::new(lightness, 5.0 * lightness * (f.x - f.y), 2.0 * lightness * (f.y - f.z))
    }

    /// The difference of two uniform colours, compressed to 0 ... 1.
    fn compressed_difference(&self, a: Vec3, b: Vec3) -> f32 {
        let (difference, knee) = (hyab(a, b).powf(COMPRESSION), KNEE * self.greatest);
        if difference < knee {
            KNEE_ERROR / knee * difference
        } else {
            (KNEE_ERROR + (difference - knee) / (self.greatest - knee) * (1.0 - KNEE_ERROR)).min(1.0)
        }
    }
}

/// The HyAB distance (Abasi, Tehran and Fairchild 2020): city block for lightness, Euclidean for the rest.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let difference = (a - b).abs();
    difference.x + difference.y.hypot(difference.z)
}

/// Linear Rec.709 to CIE XYZ divided by the white point: the rows have the sum 1.
fn rgb_to_relative_xyz() -> DMat3 {
    let xyz = |[x, y]: [f64; 2]| DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
    let white = xyz(D65);
    let primaries = DMat3::from_cols(xyz(PRIMARIES[0]), xyz(PRIMARIES[1]), xyz(PRIMARIES[2]));
    let scales = primaries.inverse() * white;
    DMat3::from_diagonal(white.recip()) * primaries * DMat3::from_diagonal(scales)
}

#[cfg(test)]
mod tests;
