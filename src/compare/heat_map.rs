//! Pictures of numbers: the colour of a pixel shows its error. Equal differences of the error look equally large.
//!
//! The colours are ours, straight lines in Oklab's lightness (Ottosson, "A perceptual color space for image
//! processing", 2020): equal steps of the number are equal steps of lightness, so the map can be read without hue.

use std::io::Write;
use std::path::Path;

use crate::error::Result;
use crate::picture::png;
use crate::picture::tonemap::srgb_from_linear;

/// Part of the pixels that a fitted scale shows without cutting them off.
const SHOWN: f64 = 0.999;

/// Colour of a pixel whose number is NaN; it is in neither scale.
const NOT_A_NUMBER: [u8; 3] = [0, 255, 255];

/// From which number to which the colours go.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Scale {
    /// The number of the first colour, and of all below.
    pub low: f64,
    /// The number of the last colour, and of all above.
    pub high: f64,
}

impl Scale {
    /// From 0 to `high`: dark violet, red, yellow, nearly white.
    pub fn from_zero(high: f64) -> Self {
        Self { low: 0.0, high }
    }

    /// From `-high` to `high`: blue below 0, nearly black at 0, red above.
    pub fn around_zero(high: f64) -> Self {
        Self { low: -high, high }
    }

    /// The colour of a number, as sRGB. NaN is cyan.
    pub fn color(self, value: f64) -> [u8; 3] {
        if value.is_nan() {
            return NOT_A_NUMBER;
        }
        let t = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        srgb8(if self.low < 0.0 { diverging(2.0 * t - 1.0) } else { sequential(t) })
    }
}

/// The magnitude that 99.9 % of the numbers do not exceed: where a scale should end. At most the greatest finite one;
/// 1 if there is none above 0.
pub fn fitted(values: &[f64]) -> f64 {
    let mut magnitudes: Vec<f64> = values.iter().map(|value| value.abs()).filter(|value| value.is_finite()).collect();
    magnitudes.sort_unstable_by(f64::total_cmp);
    let shown = ((magnitudes.len() as f64 * SHOWN).ceil() as usize).saturating_sub(1);
    // Where fewer than one pixel in a thousand differs, the quantile is 0 and would hide them.
    let ends = [magnitudes.get(shown), magnitudes.last()];
    ends.into_iter().flatten().copied().find(|value| *value > 0.0).unwrap_or(1.0)
}

/// Writes a PNG of `width` times n pixels, one for each number. `path` only names the file in errors.
///
/// # Errors
/// [`crate::error::Error::Io`] if `sink` fails or the format cannot hold the size.
pub fn write(sink: impl Write, path: &Path, width: u32, values: &[f64], scale: Scale) -> Result<()> {
    let colors: Vec<u8> = values.iter().flat_map(|value| scale.color(*value)).collect();
    png::write_rgb8(sink, path, [width, (values.len() / width.max(1) as usize) as u32], &colors)
}

/// Dark violet at 0 over red to pale yellow at 1, as linear Rec.709.
fn sequential(t: f64) -> [f64; 3] {
    let chroma = 0.05 + 0.13 * (std::f64::consts::PI * t).sin();
    oklch(0.10 + 0.87 * t, chroma, 280.0 + 180.0 * t)
}

/// Blue at -1, nearly black at 0, red at 1, as linear Rec.709; equal magnitudes are equally light.
fn diverging(t: f64) -> [f64; 3] {
    let hue = if t < 0.0 { 255.0 } else { 40.0 };
    oklch(0.12 + 0.56 * t.abs(), 0.165 * t.abs(), hue)
}

/// Linear Rec.709 of an Oklab colour in polar coordinates, the hue in degrees.
fn oklch(lightness: f64, chroma: f64, hue: f64) -> [f64; 3] {
    let (a, b) = (chroma * hue.to_radians().cos(), chroma * hue.to_radians().sin());
    let [l, m, s] = [
        lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b,
        lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b,
        lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b,
    ]
    .map(|root| root * root * root);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

fn srgb8(linear: [f64; 3]) -> [u8; 3] {
    linear.map(|channel| (srgb_from_linear(channel.clamp(0.0, 1.0) as f32) * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// CIE lightness of an sRGB colour: another measure than the one that made the colours.
    fn lightness(color: [u8; 3]) -> f64 {
        let linear = color.map(|byte| {
            let x = f64::from(byte) / 255.0;
            if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
        });
        let luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
        if luminance > 0.008856 { 116.0 * luminance.cbrt() - 16.0 } else { 903.3 * luminance }
    }

    #[test]
    fn a_greater_number_is_lighter() {
        let all: Vec<f64> = (0..=64).map(|i| lightness(Scale::from_zero(2.0).color(f64::from(i) / 32.0))).collect();
        assert!(all.windows(2).all(|pair| pair[1] > pair[0] && pair[1] - pair[0] < 3.5), "{all:?}");
        assert!(all[0] < 10.0 && all[64] > 90.0, "{all:?}");
        for i in 1..=32 {
            let [below, above] = [-1.0, 1.0].map(|sign| Scale::around_zero(32.0).color(sign * f64::from(i)));
            let before = Scale::around_zero(32.0).color(f64::from(i - 1));
            assert!(lightness(above) > lightness(before));
            assert!((lightness(above) - lightness(below)).abs() < 8.0);
            assert!(above[0] > above[2] && below[2] > below[0], "red above, blue below: {i}");
        }
    }

    #[test]
    fn the_colours_are_within_the_gamut() {
        for i in 0..=100 {
            let t = f64::from(i) / 100.0;
            for color in [sequential(t), diverging(t), diverging(-t)] {
                assert!(color.iter().all(|channel| (-1e-4..=1.0).contains(channel)), "{t}: {color:?}");
            }
        }
    }

    #[test]
    fn numbers_beyond_the_scale_and_nan_have_a_colour() {
        let scale = Scale::from_zero(0.5);
        assert_eq!(scale.color(f64::INFINITY), scale.color(0.5));
        assert_eq!(scale.color(-3.0), scale.color(0.0));
        assert_eq!(scale.color(f64::NAN), NOT_A_NUMBER);
        assert_eq!(Scale::around_zero(1.0).color(f64::NEG_INFINITY), Scale::around_zero(1.0).color(-1.0));
    }

    #[test]
    fn a_fitted_scale_leaves_out_fireflies_but_not_everything() {
        let mut values: Vec<f64> = (0..2000).map(|i| f64::from(i) / 2000.0).collect();
        assert_eq!(fitted(&values), 1997.0 / 2000.0);
        values[7] = -1e6;
        assert_eq!(fitted(&values), 1998.0 / 2000.0);
        values[8] = f64::INFINITY;
        values[9] = f64::NAN;
        assert!(fitted(&values) < 1.0);
        let mut lone = vec![0.0; 5000];
        lone[100] = -0.25;
        assert_eq!(fitted(&lone), 0.25);
        assert_eq!((fitted(&[0.0; 3]), fitted(&[]), fitted(&[f64::INFINITY])), (1.0, 1.0, 1.0));
    }

    #[test]
    fn the_picture_has_one_pixel_for_each_number() {
        let (mut bytes, scale) = (Vec::new(), Scale::from_zero(1.0));
        let values = [0.0, 0.2, 0.4, 0.6, 0.8, f64::NAN];
        write(&mut bytes, Path::new("x.png"), 3, &values, scale).expect("in memory");
        let back = ::image::load_from_memory(&bytes).expect("a PNG").to_rgb8();
        assert_eq!(back.dimensions(), (3, 2));
        let colors: Vec<[u8; 3]> = back.pixels().map(|pixel| pixel.0).collect();
        assert_eq!(colors, values.map(|value| scale.color(value)));
    }
}
