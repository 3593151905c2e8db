//! Bloom: the part of the light that lens and eye scatter around its proper place.
//!
//! There is no threshold: `amount` of *all* light is spread, by a mix of three Gaussians whose weights add up to 1, so
//! that only what is far brighter than its surroundings is seen to glow. The picture continues as its own mirror image
//! beyond the border: the weights that reach a pixel then add up to 1, and so do those that leave one, so neither a
//! constant picture nor the sum over any picture changes.
//!
//! A Gaussian is four box filters in a row (the central limit theorem; Wells 1986, "Efficient synthesis of Gaussian
//! filters by cascaded uniform filters"), whose ends have fractional weights so that the variance is met exactly
//! (Gwosdek et al. 2011, "Theoretical foundations of Gaussian convolution by extended box filtering"). The time does
//! not depend on the size.

use super::rows::for_each_row;

/// Scattered light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bloom {
    /// Fraction of the light that is scattered, 0 ... 1.
    pub amount: f32,
    /// Standard deviation of the widest Gaussian, as a fraction of the picture's height.
    pub size: f32,
}

/// Width relative to the widest, and weight.
const GAUSSIANS: [(f32, f32); 3] = [(1.0 / 9.0, 0.5), (1.0 / 3.0, 0.3), (1.0, 0.2)];

/// Boxes for each Gaussian.
const BOXES: usize = 4;

impl Bloom {
    /// What is done, with its numbers.
    pub fn describe(&self) -> String {
        format!("bloom {} size {}", self.amount, self.size)
    }

    /// The picture with its glow: interleaved linear RGB of `[width, height]` pixels. What is not finite is not spread.
    pub fn apply(&self, [width, height]: [usize; 2], beauty: &[f32]) -> Vec<f32> {
        let mut result = beauty.to_vec();
        for channel in 0..3 {
            let finite = |x: f32| if x.is_finite() { f64::from(x) } else { 0.0 };
            let plane: Vec<f64> = beauty.iter().skip(channel).step_by(3).map(|x| finite(*x)).collect();
            let mut glow = vec![0.0; plane.len()];
            for (relative, weight) in GAUSSIANS {
                let sigma = f64::from(self.size * relative) * height as f64;
                let blurred = blur(&plane, [width, height], sigma);
                glow.iter_mut().zip(&blurred).for_each(|(glow, x)| *glow += f64::from(weight) * x);
            }
            let amount = f64::from(self.amount);
            for (index, glow) in glow.into_iter().enumerate() {
                let x = &mut result[3 * index + channel];
                if x.is_finite() {
                    *x = ((1.0 - amount) * f64::from(*x) + amount * glow) as f32;
                }
            }
        }
        result
    }
}

/// A plane blurred along both axes.
fn blur(plane: &[f64], [width, height]: [usize; 2], sigma: f64) -> Vec<f64> {
    let along_x = blur_rows(plane, width, sigma);
    transposed(&blur_rows(&transposed(&along_x, width), height, sigma), height)
}

fn transposed(plane: &[f64], width: usize) -> Vec<f64> {
    let height = plane.len() / width;
    (0..plane.len()).map(|i| plane[(i % height) * width + i / height]).collect()
}

fn blur_rows(plane: &[f64], width: usize, sigma: f64) -> Vec<f64> {
    let kernel = Box::of_variance(sigma * sigma / BOXES as f64);
    let mut result = plane.to_vec();
    for_each_row(&mut result, width, |_, row| {
        let mut sums = Vec::new();
        for _ in 0..BOXES {
            kernel.filter(row, &mut sums);
        }
    });
    result
}

/// Weights 1 at offsets up to `reach`, `end` one further on either side, divided by their sum.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Box {
    reach: usize,
    end: f64,
}

impl Box {
    /// The box of this variance: that of the weights is
    /// `(r (r + 1) (2 r + 1) / 3 + 2 end (r + 1)^2) / (2 r + 1 + 2 end)`, solved for `end`.
    fn of_variance(variance: f64) -> Self {
        let reach = (0.5 * (12.0 * variance + 1.0).sqrt() - 0.5).floor().max(0.0);
        let end = (2.0 * reach + 1.0) * (3.0 * variance - reach * (reach + 1.0))
            / (6.0 * ((reach + 1.0) * (reach + 1.0) - variance));
        Self { reach: reach as usize, end: end.max(0.0) }
    }

    /// Filters one row in place; `sums` is scratch memory.
    fn filter(self, row: &mut [f64], sums: &mut Vec<f64>) {
        let length = row.len() as i64;
        // The mirrored row repeats after twice its length; running sums over one period give any sum.
        let period = 2 * length;
        let mirrored = |i: i64| {
            let at = i.rem_euclid(period);
            at.min(period - 1 - at) as usize
        };
        sums.clear();
        sums.push(0.0);
        let mut sum = 0.0;
        for i in 0..period {
            sum += row[mirrored(i)];
            sums.push(sum);
        }
        let total = sum;
        // Sum of the mirrored row over [0, i).
        let up_to = |i: i64| i.div_euclid(period) as f64 * total + sums[i.rem_euclid(period) as usize];
        let reach = self.reach as i64;
        let scale = 1.0 / (2.0 * self.reach as f64 + 1.0 + 2.0 * self.end);
        let old = row.to_vec();
        for (i, x) in row.iter_mut().enumerate() {
            let i = i as i64;
            let ends = old[mirrored(i - reach - 1)] + old[mirrored(i + reach + 1)];
            *x = (up_to(i + reach + 1) - up_to(i - reach) + self.end * ends) * scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOOM: Bloom = Bloom { amount: 0.3, size: 0.1 };

    fn sum(data: &[f32]) -> f64 {
        data.iter().map(|x| f64::from(*x)).sum()
    }

    fn point([width, height]: [usize; 2], [x, y]: [usize; 2]) -> Vec<f32> {
        let mut data = vec![0.0; 3 * width * height];
        data[3 * (y * width + x) + 1] = 1000.0;
        data
    }

    #[test]
    fn a_constant_stays_and_no_light_is_lost() {
        assert!((GAUSSIANS.iter().map(|(_, weight)| weight).sum::<f32>() - 1.0).abs() < 1e-6);
        for size in [[40, 30], [7, 1], [1, 9], [1, 1]] {
            let pixels = size[0] * size[1];
            for extent in [0.0, 0.001, 0.1, 3.0] {
                let bloom = Bloom { size: extent, ..BLOOM };
                let flat = bloom.apply(size, &vec![0.7; 3 * pixels]);
                assert!(flat.iter().all(|x| (x - 0.7).abs() < 1e-6), "{size:?}, {extent}");
                for at in [[0, 0], [size[0] / 2, size[1] / 3], [size[0] - 1, size[1] - 1]] {
                    let glow = bloom.apply(size, &point(size, at));
                    assert!((sum(&glow) - 1000.0).abs() < 1e-2, "{size:?}, {extent}, {at:?}: {}", sum(&glow));
                    assert!(glow.iter().all(|x| *x >= 0.0));
                    assert!(glow.iter().step_by(3).all(|x| *x == 0.0), "channels are apart");
                }
            }
        }
    }

    #[test]
    fn a_point_glows_as_the_mix_of_gaussians() {
        let (size, at) = ([121, 121], [60, 60]);
        let glow = Bloom { amount: 1.0, size: 0.08 }.apply(size, &point(size, at));
        let wanted = |x: usize, factor: f64| -> f64 {
            let mix = |(relative, weight): &(f32, f32)| {
                let variance = (f64::from(0.08 * relative) * 121.0 * factor).powi(2);
                let d = (x as f64 - 60.0).powi(2);
                f64::from(*weight) * (-d / (2.0 * variance)).exp() / (2.0 * std::f64::consts::PI * variance)
            };
            1000.0 * GAUSSIANS.iter().map(mix).sum::<f64>()
        };
        let found = |x: usize| f64::from(glow[3 * (60 * 121 + x) + 1]);
        let worst = |factor: f64| {
            (60..90).map(|x| (found(x) - wanted(x, factor)).abs()).fold(0.0, f64::max) / wanted(60, factor)
        };
        assert!(worst(1.0) < 0.08, "off by {} of the peak", worst(1.0));
        assert!(worst(1.2) > 0.16, "a fifth wider must be noticed: {}", worst(1.2));
    }

    #[test]
    fn the_variance_is_met_exactly() {
        for sigma in [0.2, 0.7, 1.0, 2.3, 5.0] {
            let mut row = vec![0.0; 201];
            row[100] = 1.0;
            let blurred = blur_rows(&row, 201, sigma);
            let second: f64 = blurred.iter().enumerate().map(|(i, x)| x * (i as f64 - 100.0).powi(2)).sum();
            assert!((second / (sigma * sigma) - 1.0).abs() < 1e-9, "sigma {sigma}: {second}");
        }
    }

    #[test]
    fn running_sums_equal_direct_ones() {
        let row: Vec<f64> = (0..11).map(|i| f64::from(i * i % 7) + 0.25).collect();
        for kernel in [Box { reach: 0, end: 0.4 }, Box { reach: 3, end: 0.0 }, Box { reach: 40, end: 0.9 }] {
            let mut found = row.clone();
            kernel.filter(&mut found, &mut Vec::new());
            for (i, x) in found.into_iter().enumerate() {
                let at = |k: i64| {
                    let mut k = k;
                    while !(0..11).contains(&k) {
                        k = if k < 0 { -1 - k } else { 21 - k };
                    }
                    row[k as usize]
                };
                let (i, reach) = (i as i64, kernel.reach as i64);
                let inner: f64 = (i - reach..=i + reach).map(at).sum();
                let all = inner + kernel.end * (at(i - reach - 1) + at(i + reach + 1));
                let wanted = all / (2.0 * reach as f64 + 1.0 + 2.0 * kernel.end);
                assert!((x - wanted).abs() < 1e-12, "{kernel:?} at {i}: {x}, not {wanted}");
            }
        }
    }
}
