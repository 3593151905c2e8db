//! Z-test of many estimates against expected values: are the differences what chance allows?
//!
//! Each value is one two-sided test of z = (found - expected) / error. Of n tests at once the smallest p-value is
//! compared with the level of Sidak 1967, 1 - (1 - significance)^(1/n), at which n independent tests of correct values
//! fail all together with the probability `significance`. Mitsuba's tests of renderings do the same.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Result of [`z_test`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZTest {
    /// Smallest two-sided p-value of all tests, by the normal distribution; 1 of no tests.
    pub smallest_p: f64,
    /// The level that `smallest_p` must not fall below: 1 - (1 - significance)^(1/n).
    pub threshold: f64,
    /// Index of the test with the smallest p-value, the first of equal ones.
    pub worst: usize,
    /// No test is below the threshold, and there was one at all.
    pub passed: bool,
}

/// Tests `found` with its `standard_error` against `expected` with its `expected_error` (one standard deviation each,
/// 0: exact; the errors are independent). `significance` is the probability with which correct values fail.
///
/// A value without any error passes where it is exactly the expected one; what is not a number, and a negative error,
/// fail.
///
/// # Panics
/// If the slices differ in length.
pub fn z_test(
    found: &[f64],
    standard_error: &[f64],
    expected: &[f64],
    expected_error: &[f64],
    significance: f64,
) -> ZTest {
    let n = found.len();
    assert!(
        standard_error.len() == n && expected.len() == n && expected_error.len() == n,
        "a Z-test of {n} values needs as many errors and expected values"
    );
    let (mut smallest_p, mut worst) = (1.0, 0);
    for i in 0..n {
        let p = p_value(found[i] - expected[i], standard_error[i], expected_error[i]);
        if p < smallest_p {
            (smallest_p, worst) = (p, i);
        }
    }
    let threshold = -((-significance).ln_1p() / n as f64).exp_m1();
    ZTest { smallest_p, threshold, worst, passed: n > 0 && smallest_p >= threshold }
}

fn p_value(difference: f64, a: f64, b: f64) -> f64 {
    let error = a.hypot(b);
    if difference.is_nan() || error.is_nan() || a < 0.0 || b < 0.0 {
        return 0.0;
    }
    if difference == 0.0 {
        return 1.0;
    }
    let z = difference.abs() / error;
    // Infinite over infinite says nothing about the value.
    if z.is_nan() { 0.0 } else { two_sided(z) }
}

/// Probability of a standard normal value at least as far from zero as `z`, which is not negative.
pub fn two_sided(z: f64) -> f64 {
    erfc(z * FRAC_1_SQRT_2)
}

/// The complementary error function of a number that is not negative, with small relative error in the tail as well: no
/// difference from 1 is formed there. Abramowitz and Stegun 1964, 7.1.6 below 2 and 7.1.14 above.
pub fn erfc(x: f64) -> f64 {
    if x < 2.0 { 1.0 - erf_series(x) } else { erfc_fraction(x) }
}

/// 2 / sqrt(pi) exp(-x^2) sum of 2^n x^(2n+1) / (1 3 ... (2n+1)): all terms positive.
pub fn erf_series(x: f64) -> f64 {
    let (mut term, mut sum, mut n) = (x, x, 0.0);
    while term > 1e-18 * sum {
        n += 1.0;
        term *= 2.0 * x * x / (2.0 * n + 1.0);
        sum += term;
    }
    2.0 / PI.sqrt() * (-x * x).exp() * sum
}

/// exp(-x^2) / sqrt(pi) times 1 / (x + (1/2) / (x + 1 / (x + (3/2) / (x + ...)))), from the inside out.
pub fn erfc_fraction(x: f64) -> f64 {
    // At x = 2 a hundred levels leave 1e-15; the fraction converges faster above.
    let tail = (1..=100).rev().fold(x, |inner, k| x + 0.5 * f64::from(k) / inner);
    (-x * x).exp() / (PI.sqrt() * tail)
}
