//! How footprints shrink from pass to pass.

use super::Settings;

impl Settings {
    /// Footprint scale of pass `index` relative to pass 0: the square root of the product of (k + a) / (k + 1) over k
    /// from 1 to `index`, in closed form by the gamma function, so that any pass can be computed on its own.
    pub fn radius_scale(&self, index: u64) -> f32 {
        // prod_{k=1}^{i} (k + a)/(k + 1) = Gamma(i + 1 + a) / Gamma(1 + a) * Gamma(2) / Gamma(i + 2)
        let i = index as f64;
        let log_ratio = ln_gamma(i + 1.0 + self.alpha) - ln_gamma(1.0 + self.alpha) - ln_gamma(i + 2.0);
        (0.5 * log_ratio).exp() as f32
    }
}

/// Natural logarithm of the gamma function for x >= 1: Stirling's series after moving the argument beyond 16.
fn ln_gamma(x: f64) -> f64 {
    let mut shift = 0.0;
    let mut x = x;
    while x < 16.0 {
        shift += x.ln();
        x += 1.0;
    }
    let (inverse, square) = (1.0 / x, 1.0 / (x * x));
    let series = inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0)));
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * std::f64::consts::PI).ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Case 25 of the extreme cases: the closed form equals the product in double precision.
    #[test]
    fn radius_schedule_equals_the_product() {
        let settings = Settings::default();
        let mut squared = 1.0f64;
        for index in 0..1_000_001u64 {
            if index > 0 {
                squared *= (index as f64 + settings.alpha) / (index as f64 + 1.0);
            }
            if index < 100 || index % 99_991 == 0 || index == 1_000_000 {
                let relative = f64::from(settings.radius_scale(index)) / squared.sqrt() - 1.0;
                assert!(relative.abs() < 1e-6, "pass {index}: off by {relative}");
            }
        }
        assert!((f64::from(settings.radius_scale(10)) - squared.sqrt()).abs() > 1e-3, "the check can fail");
    }
}
