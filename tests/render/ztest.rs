//! The Z-test itself: tabulated values, Sidak's level, and values that must fail.

use crate::support::ztest::{erf_series, erfc, erfc_fraction, two_sided, z_test};

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * b.abs(), "{a} is not {b}");
}

#[test]
fn the_error_function_has_the_tabulated_values() {
    // DLMF, table 7.1 and known p-values of the normal distribution.
    assert_eq!(erfc(0.0), 1.0);
    close(erfc(0.5), 0.479_500_122_186_953_5, 1e-14);
    close(erfc(1.0), 0.157_299_207_050_285_1, 1e-14);
    close(erfc(2.0), 4.677_734_981_047_266e-3, 1e-13);
    close(erfc(3.0), 2.209_049_699_858_544e-5, 1e-13);
    close(erfc(5.0), 1.537_459_794_428_035e-12, 1e-12);
    close(erfc(10.0), 2.088_487_583_762_545e-45, 1e-12);
    close(two_sided(1.959_963_984_540_054), 0.05, 1e-13);
    close(two_sided(2.575_829_303_548_901), 0.01, 1e-13);
    // The two forms agree where one takes over, and far tails end in zero, not in nonsense.
    close(1.0 - erf_series(2.0), erfc_fraction(2.0), 1e-12);
    assert!(two_sided(37.0) > 0.0);
    assert_eq!(two_sided(1e9), 0.0);
    assert_eq!(two_sided(f64::INFINITY), 0.0);
}

#[test]
fn the_threshold_is_sidaks() {
    let one = z_test(&[0.0], &[1.0], &[0.0], &[0.0], 0.05);
    close(one.threshold, 0.05, 1e-14);
    let many = z_test(&[0.0; 1000], &[1.0; 1000], &[0.0; 1000], &[0.0; 1000], 0.01);
    close(1.0 - (1.0 - many.threshold).powi(1000), 0.01, 1e-10);
    assert!(many.passed);
}

#[test]
fn errors_of_both_sides_count() {
    let z = |a, b| z_test(&[1.0], &[a], &[0.0], &[b], 0.01).smallest_p;
    close(z(0.3, 0.4), two_sided(2.0), 1e-12);
    assert_eq!(z(0.0, 0.5), z(0.5, 0.0));
}

#[test]
fn one_wrong_value_among_many_fails_and_is_named() {
    let mut found = vec![1.0; 4096];
    let (error, zero) = (vec![0.01; 4096], vec![0.0; 4096]);
    let expected = found.clone();
    assert!(z_test(&found, &error, &expected, &zero, 0.01).passed);
    // 4.5 standard errors: 0.007 of a percent in one test, 3 percent in 4096.
    found[1234] = 1.045;
    let allowed = z_test(&found, &error, &expected, &zero, 0.01);
    assert!(allowed.passed && allowed.worst == 1234, "{allowed:?}");
    found[1234] = 1.055;
    let wrong = z_test(&found, &error, &expected, &zero, 0.01);
    assert!(!wrong.passed && wrong.worst == 1234, "{wrong:?}");
}

#[test]
fn correct_values_fail_as_often_as_promised() {
    // Sums of twelve uniform numbers are nearly normal; 400 sets of 50 tests at 20 % fail 80 +- 8 times.
    let mut state = 12345u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut failures = 0;
    for _ in 0..400 {
        let found: Vec<f64> = (0..50).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect();
        failures += usize::from(!z_test(&found, &[1.0; 50], &[0.0; 50], &[0.0; 50], 0.2).passed);
    }
    assert!((48..=112).contains(&failures), "{failures} of 400");
}

#[test]
fn what_cannot_be_tested_fails() {
    let fails = |found, error, expected| !z_test(&[found], &[error], &[expected], &[0.0], 0.01).passed;
    assert!(fails(f64::NAN, 1.0, 0.0));
    assert!(fails(0.0, f64::NAN, 0.0));
    assert!(fails(0.0, -1.0, 1.0));
    assert!(fails(1.0, 0.0, 0.0));
    assert!(fails(f64::INFINITY, 1.0, 0.0));
    assert!(fails(f64::INFINITY, f64::INFINITY, 0.0));
    assert!(!fails(1.0, 0.0, 1.0));
    assert!(!z_test(&[], &[], &[], &[], 0.01).passed);
}
