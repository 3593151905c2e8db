//! Quantiles of the normal distribution and of Student's t.

use std::f64::consts::PI;

/// The number that a standard normal variable stays below with probability `p`, for 0 < `p` < 1; beyond 1e-9 of either end
/// the quantile of that end.
pub fn normal(p: f64) -> f64 {
    let p = p.clamp(1e-9, 1.0 - 1e-9);
    if p < 0.5 {
        return -normal(1.0 - p);
    }
    // Newton's method from 0: the distribution is concave on this side, so no step goes too far.
    let mut z = 0.0_f64;
    loop {
        let density = (-0.5 * z * z).exp() / (2.0 * PI).sqrt();
        let step = (p - 0.5 - density * odd_series(z)) / density;
        z += step;
        if step < 1e-12 {
            return z;
        }
    }
}

/// (Phi(z) - 1/2) / phi(z) = z + z^3 / 3 + z^5 / (3 5) + ... (Abramowitz and Stegun, 26.2.11).
fn odd_series(z: f64) -> f64 {
    let (mut term, mut sum, mut k) = (z, z, 1.0);
    while term > 1e-16 * sum {
        k += 2.0;
        term *= z * z / k;
        sum += term;
    }
    sum
}

/// The number that a variable after Student with `freedom` > 0 degrees of freedom stays below with probability `p`: in
/// closed form for one and two, else by expansion in 1 / freedom (Abramowitz and Stegun, 26.7.5), good to 1 % for `p` up to 0.95.
pub fn student(p: f64, freedom: u64) -> f64 {
    if freedom <= 1 {
        return (PI * (p.clamp(1e-9, 1.0 - 1e-9) - 0.5)).tan();
    }
    if freedom == 2 {
        let a = 2.0 * p.clamp(1e-9, 1.0 - 1e-9) - 1.0;
        return a * (2.0 / (1.0 - a * a)).sqrt();
    }
    let (z, n) = (normal(p), freedom as f64);
    let q = z * z;
    let first = (q + 1.0) / 4.0;
    let second = ((5.0 * q + 16.0) * q + 3.0) / 96.0;
    let third = (((3.0 * q + 19.0) * q + 17.0) * q - 15.0) / 384.0;
    let fourth = ((((79.0 * q + 776.0) * q + 1482.0) * q - 1920.0) * q - 945.0) / 92160.0;
    z * (1.0 + (first + (second + (third + fourth / n) / n) / n) / n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (p, z) in [(0.5, 0.0), (0.75, 0.674_490), (0.95, 1.644_854), (0.975, 1.959_964), (0.9999, 3.719_016)] {
            assert!((normal(p) - z).abs() < 1e-6 && (normal(1.0 - p) + z).abs() < 1e-6, "{p}: {}", normal(p));
        }
        for (p, freedom, t) in [
            (0.95, 1, 6.313_75),
            (0.95, 2, 2.919_99),
            (0.95, 3, 2.353_36),
            (0.95, 5, 2.015_05),
            (0.95, 30, 1.697_26),
            (0.975, 10, 2.228_14),
            (0.95, 1_000_000, 1.644_86),
        ] {
            let found = student(p, freedom);
            assert!((found / t - 1.0).abs() < 0.01, "{p}, {freedom}: {found}, not {t}");
        }
        assert!(normal(0.0).is_finite() && normal(1.0).is_finite() && student(1.0, 1).is_finite());
    }
}
