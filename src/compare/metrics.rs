//! Measures of the difference between a picture and a reference.
//!
//! Convention: a *pixel's* error is the mean over its channels, the picture's error the mean over its pixels, which is
//! the mean over all numbers. Trimming removes whole pixels, those with the worst error, so a firefly counts once.

use crate::error::{Error, Result};
use crate::picture::image::{Layer, Picture};

/// Added to the squared reference in [`Metrics::relmse`]: keeps black pixels from ruling the mean.
pub const RELMSE_FLOOR: f64 = 0.01;

/// Fraction of the pixels, the worst, that [`Metrics::relmse_trimmed`] leaves out.
pub const TRIM: f64 = 0.001;

/// The difference between a picture x and a reference r. A number that is not finite in x counts as an infinite error:
/// nothing hides it but trimming, and [`Metrics::non_finite`] counts it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Metrics {
    /// Mean of (x - r)^2.
    pub mse: f64,
    /// Mean of (x - r)^2 / (r^2 + 0.01).
    pub relmse: f64,
    /// The same without the worst 0.1 % of the pixels (rounded down, so none of fewer than 1000).
    pub relmse_trimmed: f64,
    /// Mean of |x - r| / (|x| + |r|), where 0 / 0 counts as 0: at most 1. Symmetric in x and r.
    pub smape: f64,
    /// Greatest |x - r|.
    pub max: f64,
    /// Mean of x.
    pub mean: f64,
    /// Mean of r.
    pub reference_mean: f64,
    /// Mean of x over the mean of r; 1 where both are 0.
    pub mean_ratio: f64,
    /// Numbers in x that are not finite.
    pub non_finite: u64,
    /// Pixels compared.
    pub pixels: u64,
}

/// Compares one layer of two pictures, `name` empty for the beauty layer.
///
/// # Errors
/// [`Error::Usage`] if the sizes or the channels differ, or a picture lacks the layer or has no pixels, or the
/// reference holds a number that is not finite.
pub fn compare(picture: &Picture, reference: &Picture, name: &str) -> Result<Metrics> {
    let (x, r) = pair(picture, reference, name)?;
    Ok(measure(&x.data, &r.data, x.channels.count()))
}

/// The layers to compare: of one size, with the same channels, not empty, the reference finite.
///
/// # Errors
/// Those of [`compare`].
pub(super) fn pair<'a>(picture: &'a Picture, reference: &'a Picture, name: &str) -> Result<(&'a Layer, &'a Layer)> {
    if (picture.width, picture.height) != (reference.width, reference.height) {
        return Err(Error::Usage(format!(
            "the picture has {} x {} pixels, the reference {} x {}",
            picture.width, picture.height, reference.width, reference.height
        )));
    }
    let (x, r) = (find(picture, "picture", name)?, find(reference, "reference", name)?);
    if x.channels != r.channels {
        return Err(Error::Usage(format!("{} has other channels in the reference", called(name))));
    }
    if r.data.is_empty() {
        return Err(Error::Usage("the pictures have no pixels".into()));
    }
    if r.data.iter().any(|number| !number.is_finite()) {
        return Err(Error::Usage(format!("{} of the reference holds a number that is not finite", called(name))));
    }
    Ok((x, r))
}

/// Mean over the channels of (x - r)^2 / (r^2 + 0.01), of each pixel: what [`Metrics::relmse`] is the mean of. Infinite
/// where x is not finite.
///
/// # Errors
/// Those of [`compare`].
pub fn relative_squared_errors(picture: &Picture, reference: &Picture, name: &str) -> Result<Vec<f64>> {
    let (x, r) = pair(picture, reference, name)?;
    Ok(pixel_errors(&x.data, &r.data, x.channels.count(), &mut Sums::default()))
}

/// Mean over the channels of (x - r) / sqrt(r^2 + 0.01), of each pixel: above 0 where the picture is too bright. NaN
/// where x is not finite.
///
/// # Errors
/// Those of [`compare`].
pub fn signed_relative_errors(picture: &Picture, reference: &Picture, name: &str) -> Result<Vec<f64>> {
    let (x, r) = pair(picture, reference, name)?;
    let channels = x.channels.count();
    let error = |(x, r): (&f32, &f32)| {
        let (x, r) = (f64::from(*x), f64::from(*r));
        if x.is_finite() { (x - r) / (r * r + RELMSE_FLOOR).sqrt() } else { f64::NAN }
    };
    let pixels = x.data.chunks_exact(channels).zip(r.data.chunks_exact(channels));
    Ok(pixels.map(|(x, r)| x.iter().zip(r).map(error).sum::<f64>() / channels as f64).collect())
}

fn find<'a>(picture: &'a Picture, role: &str, name: &str) -> Result<&'a Layer> {
    picture.layer(name).ok_or_else(|| Error::Usage(format!("the {role} lacks {}", called(name))))
}

fn called(name: &str) -> String {
    if name.is_empty() { "the colour (R, G, B)".into() } else { format!("layer '{name}'") }
}

/// Compares interleaved numbers, `channels` to a pixel. `reference` is finite and not empty.
fn measure(picture: &[f32], reference: &[f32], channels: usize) -> Metrics {
    let mut sums = Sums::default();
    let mut errors = pixel_errors(picture, reference, channels, &mut sums);
    let numbers = reference.len() as f64;
    let relmse = errors.iter().sum::<f64>() / errors.len() as f64;
    Metrics {
        mse: sums.squares / numbers,
        relmse,
        relmse_trimmed: trimmed_mean(&mut errors),
        smape: sums.symmetric / numbers,
        max: sums.max,
        mean: sums.x / numbers,
        reference_mean: sums.r / numbers,
        mean_ratio: if sums.x == sums.r { 1.0 } else { sums.x / sums.r },
        non_finite: sums.non_finite,
        pixels: errors.len() as u64,
    }
}

/// Relative squared error of each pixel; adds all numbers to `sums`.
fn pixel_errors(picture: &[f32], reference: &[f32], channels: usize, sums: &mut Sums) -> Vec<f64> {
    let pixels = picture.chunks_exact(channels).zip(reference.chunks_exact(channels));
    let error = |(x, r): (&[f32], &[f32])| {
        let sum: f64 = x.iter().zip(r).map(|(&x, &r)| sums.add(x.into(), r.into())).sum();
        sum / channels as f64
    };
    pixels.map(error).collect()
}

#[derive(Default)]
struct Sums {
    squares: f64,
    symmetric: f64,
    max: f64,
    x: f64,
    r: f64,
    non_finite: u64,
}

impl Sums {
    /// Adds one number and returns its relative squared error.
    fn add(&mut self, x: f64, r: f64) -> f64 {
        // A NaN would slip through `max` and through sorting; infinity does not.
        let x = if x.is_finite() { x } else { f64::INFINITY };
        self.non_finite += u64::from(x.is_infinite());
        let difference = (x - r).abs();
        let squared = difference * difference;
        self.squares += squared;
        self.symmetric += if x.is_infinite() {
            1.0
        } else if difference > 0.0 {
            difference / (x.abs() + r.abs())
        } else {
            0.0
        };
        self.max = self.max.max(difference);
        self.x += x;
        self.r += r;
        squared / (r * r + RELMSE_FLOOR)
    }
}

/// Mean without the greatest [`TRIM`] of the values. Reorders them.
fn trimmed_mean(errors: &mut [f64]) -> f64 {
    let kept = errors.len() - (errors.len() as f64 * TRIM) as usize;
    errors.sort_unstable_by(f64::total_cmp);
    errors[..kept].iter().sum::<f64>() / kept as f64
}

/// Means over blocks of `block` x `block` pixels (smaller at the right and lower edge): a picture of
/// `ceil(width / block)` x `ceil(height / block)` in which noise is small and a bias stays.
///
/// # Panics
/// If `block` is 0.
pub fn block_means(picture: &Picture, block: u32) -> Picture {
    assert!(block > 0, "blocks have pixels");
    let mut means = Picture::new(picture.width.div_ceil(block), picture.height.div_ceil(block));
    for layer in &picture.layers {
        let data = layer_block_means(picture, layer, block as usize, means.width as usize);
        means.push(&layer.name, layer.channels, data);
    }
    means
}

fn layer_block_means(picture: &Picture, layer: &Layer, block: usize, columns: usize) -> Vec<f32> {
    let (width, height, channels) = (picture.width as usize, picture.height as usize, layer.channels.count());
    let mut sums = vec![0.0_f64; columns * height.div_ceil(block) * channels];
    for (index, &number) in layer.data.iter().enumerate() {
        let (pixel, channel) = (index / channels, index % channels);
        let (column, row) = (pixel % width / block, pixel / width / block);
        sums[(row * columns + column) * channels + channel] += f64::from(number);
    }
    let pixels_in = |index: usize| {
        let (column, row) = (index / channels % columns, index / channels / columns);
        (width - column * block).min(block) * (height - row * block).min(block)
    };
    sums.iter().enumerate().map(|(index, sum)| (sum / pixels_in(index) as f64) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::image::Channels;

    fn picture(width: u32, height: u32, data: Vec<f32>) -> Picture {
        let mut picture = Picture::new(width, height);
        picture.push("", Channels::Rgb, data);
        picture
    }

    /// A smooth reference of 64 x 64 pixels.
    fn reference() -> Picture {
        picture(64, 64, (0..64 * 64 * 3).map(|i| 0.2 + (i % 97) as f32 / 97.0).collect())
    }

    fn sabotaged(change: impl FnOnce(&mut Vec<f32>)) -> Metrics {
        let mut picture = reference();
        change(&mut picture.layers[0].data);
        compare(&picture, &reference(), "").expect("same size")
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let metrics = sabotaged(|_| ());
        assert_eq!(metrics.mse + metrics.relmse + metrics.relmse_trimmed + metrics.smape + metrics.max, 0.0);
        assert_eq!((metrics.mean_ratio, metrics.non_finite, metrics.pixels), (1.0, 0, 64 * 64));
    }

    #[test]
    fn values_by_hand() {
        let x = picture(2, 1, vec![1.0, 2.0, 3.0, 0.0, 0.0, 0.1]);
        let r = picture(2, 1, vec![1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let metrics = compare(&x, &r, "").expect("same size");
        assert!((metrics.mse - 5.01 / 6.0).abs() < 1e-8);
        assert!((metrics.relmse - (5.0 / 1.01 + 1.0) / 6.0).abs() < 1e-7);
        assert!((metrics.smape - (1.0 / 3.0 + 0.5 + 1.0) / 6.0).abs() < 1e-8);
        assert!((metrics.mean_ratio - 6.1 / 3.0).abs() < 1e-7);
        assert_eq!(metrics.max, 2.0);
        assert!((metrics.mean - 6.1 / 6.0).abs() < 1e-8 && metrics.reference_mean == 0.5);
    }

    #[test]
    fn errors_of_pixels_by_hand() {
        let x = picture(2, 1, vec![1.0, 2.0, 0.5, 0.0, 0.0, -0.1]);
        let r = picture(2, 1, vec![1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let close = |got: &[f64], want: [f64; 2]| got.iter().zip(want).all(|(got, want)| (got - want).abs() < 1e-7);
        let squared = relative_squared_errors(&x, &r, "").expect("a pair");
        assert!(close(&squared, [1.25 / 1.01 / 3.0, 1.0 / 3.0]), "{squared:?}");
        let relmse = compare(&x, &r, "").expect("a pair").relmse;
        assert!((squared.iter().sum::<f64>() / 2.0 - relmse).abs() < 1e-12);
        let signed = signed_relative_errors(&x, &r, "").expect("a pair");
        assert!(close(&signed, [0.5 / 1.01_f64.sqrt() / 3.0, -1.0 / 3.0]), "{signed:?}");
        for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let broken = picture(2, 1, vec![1.0, broken, 1.0, 0.0, 0.0, 0.0]);
            assert_eq!(relative_squared_errors(&broken, &r, "").expect("a pair"), [f64::INFINITY, 0.0]);
            let signed = signed_relative_errors(&broken, &r, "").expect("a pair");
            assert!(signed[0].is_nan() && signed[1] == 0.0);
        }
        assert!(signed_relative_errors(&x, &picture(1, 2, vec![0.0; 6]), "").is_err());
    }

    #[test]
    fn a_brighter_picture_shows_in_the_ratio() {
        let metrics = sabotaged(|data| data.iter_mut().for_each(|x| *x *= 1.01));
        assert!((metrics.mean_ratio - 1.01).abs() < 1e-6);
        assert!(metrics.relmse > 0.5e-4 && metrics.relmse_trimmed > 0.5e-4);
    }

    #[test]
    fn trimming_forgives_four_fireflies_in_4096_pixels_but_not_five() {
        let fireflies = |count: usize| sabotaged(|data| (0..count).for_each(|i| data[i * 300] = 1e4));
        assert!(fireflies(4).relmse > 1e3);
        assert_eq!(fireflies(4).relmse_trimmed, 0.0);
        assert!(fireflies(5).relmse_trimmed > 1e3);
        // Three bad channels of one pixel are one bad pixel.
        assert_eq!(sabotaged(|data| data[..12].fill(1e4)).relmse_trimmed, 0.0);
    }

    #[test]
    fn a_number_that_is_not_finite_is_an_infinite_error() {
        for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let metrics = sabotaged(|data| data[77] = broken);
            assert_eq!(metrics.non_finite, 1);
            assert_eq!(metrics.mse + metrics.relmse + metrics.max + metrics.mean_ratio, f64::INFINITY);
            let spread = sabotaged(|data| (0..9).for_each(|i| data[i * 300] = broken));
            assert_eq!(spread.relmse_trimmed, f64::INFINITY);
        }
    }

    #[test]
    fn swapped_channels_shifts_and_flips_are_seen() {
        assert!(sabotaged(|data| data.chunks_exact_mut(3).for_each(|c| c.swap(0, 2))).relmse_trimmed > 1e-4);
        assert!(sabotaged(|data| data.rotate_left(3)).relmse_trimmed > 1e-4);
        assert!(sabotaged(|data| data.reverse()).relmse_trimmed > 1e-4);
    }

    #[test]
    fn pictures_that_cannot_be_compared_are_refused() {
        let refused = |x: &Picture, r: &Picture, name| compare(x, r, name).expect_err("refused").to_string();
        let (a, b) = (picture(2, 1, vec![0.0; 6]), picture(1, 2, vec![0.0; 6]));
        assert_eq!(refused(&a, &b, ""), "the picture has 2 x 1 pixels, the reference 1 x 2");
        assert_eq!(refused(&a, &a, "depth"), "the picture lacks layer 'depth'");
        let broken = picture(2, 1, vec![f32::NAN; 6]);
        assert!(refused(&a, &broken, "").contains("not finite"));
        assert!(refused(&picture(0, 0, vec![]), &picture(0, 0, vec![]), "").contains("no pixels"));
        let mut vector = Picture::new(2, 1);
        vector.push("", Channels::Vector, vec![0.0; 6]);
        assert!(refused(&a, &vector, "").contains("other channels"));
    }

    #[test]
    fn block_means_by_hand() {
        let mut depth = Picture::new(3, 3);
        depth.push("depth", Channels::Scalar, (1..=9).map(|i| i as f32).collect());
        depth.push("", Channels::Rgb, (0..27).map(|i| (i % 3) as f32).collect());
        let means = block_means(&depth, 2);
        assert_eq!((means.width, means.height), (2, 2));
        assert_eq!(means.layers[0].data, [3.0, 4.5, 7.5, 9.0]);
        assert_eq!(means.layers[1].data, [0.0, 1.0, 2.0].repeat(4));
        assert_eq!(block_means(&depth, 1), depth);
        assert_eq!(block_means(&depth, 100).layers[0].data, [5.0]);
    }
}
