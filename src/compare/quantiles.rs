//! Quantiles of Student's t.

use std::f64::consts::PI;

/// The quantile at probability `p`, 1/2 <= `p` < 1, of Student's t distribution with `freedom` degrees of freedom: the
/// number that the variable stays below with this probability. `freedom` counts as at least 1 and at most 10,000, from
/// where on the normal distribution has the same four digits.
pub fn student(p: f64, freedom: u64) -> f64 {
    let (freedom, within) = (freedom.clamp(1, 10_000), 2.0 * p.clamp(0.5, 1.0 - 1e-9) - 1.0);
    // The probability grows with the angle atan(t / sqrt(freedom)), so bisection finds the angle.
    let (mut low, mut high) = (0.0, 0.5 * PI);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if student_within(middle, freedom) < within { low = middle } else { high = middle }
    }
    (0.5 * (low + high)).tan() * (freedom as f64).sqrt()
}

/// P(|T| < t) for t = tan(angle) sqrt(freedom): Abramowitz and Stegun 1964, equations 26.7.3 and 26.7.4.
fn student_within(angle: f64, freedom: u64) -> f64 {
    let (sine, cosine) = angle.sin_cos();
    let odd = freedom % 2 == 1;
    let mut term = if odd { cosine } else { 1.0 };
    let mut sum = 0.0;
    let mut k = if odd { 3 } else { 2 };
    while k <= freedom {
        sum += term;
        term *= cosine * cosine * (k - 1) as f64 / k as f64;
        k += 2;
    }
    if odd { (angle + sine * sum) / (0.5 * PI) } else { sine * sum }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
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
            assert!((found / t - 1.0).abs() < 1e-4, "{p}, {freedom}: {found}, not {t}");
        }
        assert!(student(1.0, 1).is_finite() && student(0.975, u64::MAX) < 1.9605);
        assert!(student(0.95, 0) == student(0.95, 1) && student(0.5, 7).abs() < 1e-9);
    }
}
