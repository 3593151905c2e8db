//! Sums without rounding: the specification that the film kernel (`glsl/lib/exact_sum.glsl`) mirrors.
//!
//! A sum is a 128-bit two's complement integer in units of 2^-64. Every f32 between 2^-40 and 2^46 is a multiple of
//! that unit, so sums are exact, and because integer addition is associative, passes may be added in any order and in
//! any grouping and give the same bits. Floating sums, however long, do not have that property: a render that was
//! resumed or merged from parts would differ in its last bits from one that ran through.

/// Units in one.
const UNITS: f64 = 18_446_744_073_709_551_616.0; // 2^64

/// Greatest magnitude of a summand; greater ones are cut, so that 2^17 of them fit.
pub use crate::constants::EXACT_LARGEST as LARGEST;

/// An exact sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExactSum(pub i128);

impl ExactSum {
    /// From four words, least significant first.
    pub fn from_words(words: [u32; 4]) -> Self {
        Self(words.iter().rev().fold(0u128, |sum, &word| (sum << 32) | u128::from(word)) as i128)
    }

    /// As four words, least significant first.
    pub fn words(self) -> [u32; 4] {
        [0, 32, 64, 96].map(|shift| (self.0 as u128 >> shift) as u32)
    }

    /// Adds a finite number of magnitude up to [`LARGEST`]. Below 2^-40 it is rounded to a multiple of 2^-64; a
    /// denormal one counts as zero.
    pub fn plus(self, x: f32) -> Self {
        debug_assert!(x.abs() <= LARGEST, "{x} is beyond the range of an exact sum");
        let bits = x.to_bits();
        let biased = ((bits >> 23) & 0xff) as i32;
        if biased == 0 {
            return self;
        }
        let mantissa = i128::from((bits & 0x7f_ffff) | 0x80_0000);
        let shift = biased - 150 + 64;
        let units = match shift {
            ..-24 => 0,
            -24..0 => (mantissa + (1 << (-shift - 1))) >> -shift,
            _ => mantissa << shift,
        };
        Self(if x < 0.0 { self.0 - units } else { self.0 + units })
    }

    /// Adds another sum.
    pub fn plus_sum(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }

    /// The nearest f64.
    pub fn to_f64(self) -> f64 {
        self.0 as f64 / UNITS
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Case 26 of the extreme cases.
    #[test]
    fn sixteen_million_passes_of_a_tenth_are_a_tenth() {
        let passes = (1_u32 << 24) + 1;
        let (mut naive, mut exact) = (0.0_f32, ExactSum::default());
        for _ in 0..passes {
            naive += 0.1;
            exact = exact.plus(0.1);
        }
        let relative = |sum: f64| (sum / f64::from(passes) / f64::from(0.1_f32) - 1.0).abs();
        assert!(relative(exact.to_f64()) < 1e-15, "{}", relative(exact.to_f64()));
        assert!(relative(f64::from(naive)) > 1e-3, "the check can fail");
    }

    #[test]
    fn the_ends_of_the_range() {
        assert_eq!(ExactSum::default().plus(f32::MIN_POSITIVE), ExactSum(0));
        assert_eq!(ExactSum::default().plus(f32::MIN_POSITIVE / 2.0), ExactSum(0));
        // Half a unit is rounded up, less than half is lost.
        assert_eq!(ExactSum::default().plus(2f32.powi(-65)), ExactSum(1));
        assert_eq!(ExactSum::default().plus(2f32.powi(-66)), ExactSum(0));
        assert_eq!(ExactSum::default().plus(-2f32.powi(-64)), ExactSum(-1));
        assert_eq!(ExactSum::default().plus(LARGEST), ExactSum(1 << 110));
        assert_eq!(ExactSum::default().plus(-LARGEST).to_f64(), -f64::from(LARGEST));
    }

    proptest! {
        #[test]
        fn words_come_back(words in any::<[u32; 4]>()) {
            prop_assert_eq!(ExactSum::from_words(words).words(), words);
        }

        #[test]
        fn order_and_grouping_leave_no_trace(
            numbers in prop::collection::vec(-1e9_f32..1e9, 2..200), at in any::<prop::sample::Index>(),
        ) {
            let sum = |numbers: &[f32]| numbers.iter().fold(ExactSum::default(), |sum, &x| sum.plus(x));
            let (front, back) = numbers.split_at(at.index(numbers.len()));
            prop_assert_eq!(sum(&numbers), sum(back).plus_sum(sum(front)));
            let exact: f64 = numbers.iter().map(|&x| f64::from(x)).sum();
            prop_assert!((sum(&numbers).to_f64() - exact).abs() <= 1e-3);
        }
    }
}
