//! Bias and variance of pictures over many seeds.

use crate::compare::metrics::RELMSE_FLOOR;

/// Mean and sum of squared deviations per number of a picture, updated picture by picture (Welford 1962).
#[derive(Debug, Clone, Default)]
pub struct Moments {
    count: u64,
    mean: Vec<f64>,
    deviation: Vec<f64>,
}

/// Relative squared bias and relative variance, means over the numbers of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasAndVariance {
    /// As [`super::results::Decomposition::bias_squared`].
    pub bias_squared: f64,
    /// As [`super::results::Decomposition::variance`].
    pub variance: f64,
}

impl Moments {
    /// Includes a picture; all have the same length.
    pub fn add(&mut self, picture: &[f32]) {
        self.mean.resize(picture.len(), 0.0);
        self.deviation.resize(picture.len(), 0.0);
        self.count += 1;
        for ((mean, deviation), &x) in self.mean.iter_mut().zip(&mut self.deviation).zip(picture) {
            let difference = f64::from(x) - *mean;
            *mean += difference / self.count as f64;
            *deviation += difference * (f64::from(x) - *mean);
        }
    }

    /// Number of pictures that were added.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Against a reference, each number weighted with 1 / (reference^2 + `floor`), or with 1 where there is no floor;
    /// `None` with fewer than two pictures.
    fn against(&self, reference: &[f32], floor: Option<f64>) -> Option<BiasAndVariance> {
        if self.count < 2 || reference.is_empty() {
            return None;
        }
        let (mut bias_squared, mut variance) = (0.0, 0.0);
        for ((mean, deviation), &r) in self.mean.iter().zip(&self.deviation).zip(reference) {
            let r = f64::from(r);
            let weight = floor.map_or(1.0, |floor| 1.0 / (r * r + floor));
            let spread = deviation / (self.count - 1) as f64;
            bias_squared += weight * ((mean - r) * (mean - r) - spread / self.count as f64);
            variance += weight * spread;
        }
        let numbers = reference.len() as f64;
        Some(BiasAndVariance { bias_squared: bias_squared / numbers, variance: variance / numbers })
    }

    /// As [`super::results::Decomposition`] defines them; `None` with fewer than two pictures.
    pub fn relative(&self, reference: &[f32]) -> Option<BiasAndVariance> {
        self.against(reference, Some(RELMSE_FLOOR))
    }

    /// In units of the picture, squared, every number with weight 1; `None` with fewer than two pictures.
    pub fn absolute(&self, reference: &[f32]) -> Option<BiasAndVariance> {
        self.against(reference, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [0, 1), the same ones every time.
    fn noise(seed: u64) -> f64 {
        let mut x = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d;
        x = (x ^ (x >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        x = (x ^ (x >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
        (x >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Pictures of mean 1 + `bias` and variance `width`^2 / 12 against a reference of 1.
    fn measured(bias: f64, width: f64, seeds: u64) -> BiasAndVariance {
        let mut moments = Moments::default();
        for seed in 0..seeds {
            let numbers = (0..3000).map(|i| (1.0 + bias + width * (noise(seed * 3000 + i) - 0.5)) as f32);
            moments.add(&numbers.collect::<Vec<_>>());
        }
        moments.relative(&vec![1.0; 3000]).expect("two seeds or more")
    }

    #[test]
    fn bias_and_variance_come_apart() {
        for (bias, width) in [(0.0, 0.6), (0.1, 0.6), (-0.2, 0.1)] {
            let found = measured(bias, width, 16);
            let expected = (bias * bias / 1.01, width * width / 12.0 / 1.01);
            assert!((found.variance / expected.1 - 1.0).abs() < 0.02, "{found:?} {expected:?}");
            // The deviation of a mean of 3000 squared means of 16, and of the cross term with the bias.
            let noise =
                expected.1 / 16.0 * (2.0f64 / 3000.0).sqrt() + 2.0 * bias.abs() * (expected.1 / 48_000.0).sqrt();
            assert!((found.bias_squared - expected.0).abs() < 4.0 * noise, "{found:?} {expected:?} {noise}");
        }
        // Without the correction for the noise of the mean, two seeds would show half the variance as bias.
        assert!(measured(0.0, 0.6, 2).bias_squared.abs() < 0.1 * measured(0.0, 0.6, 2).variance);
    }

    #[test]
    fn a_variance_needs_two() {
        let mut moments = Moments::default();
        assert_eq!(moments.relative(&[1.0]), None);
        moments.add(&[1.0]);
        assert_eq!(moments.relative(&[1.0]), None);
        moments.add(&[4.0]);
        let found = moments.absolute(&[1.0]).expect("two");
        assert_eq!(found, BiasAndVariance { bias_squared: 1.5 * 1.5 - 4.5 / 2.0, variance: 4.5 });
    }
}
