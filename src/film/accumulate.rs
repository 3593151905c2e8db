//! The film state, kept so that a million passes lose nothing: the specification that the film kernel mirrors.
//!
//! A plain f32 sum stops growing once a pass is smaller than half an ulp of it: 2^24 passes of 0.1 are already wrong in
//! the first digits. Here every sum is a pair of f32 whose exact sum is the value; the pair is built with Knuth's
//! two-sum (The Art of Computer Programming, vol. 2, section 4.2.2), whose rounding error is itself an f32. An addition
//! loses at most 2^-47 of the sum, so n additions of one sign are right to n 2^-47: 1.2e-7 after 2^24 passes.
//!
//! A shader needs `precise` on every operation here, or the compiler may simplify the error term to zero.

/// An unevaluated sum `hi + lo`, with `hi` the f32 nearest to it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TwoFloat {
    /// The leading 24 bits.
    pub hi: f32,
    /// The remainder, at most half an ulp of `hi`.
    pub lo: f32,
}

impl TwoFloat {
    /// Adds a number (Knuth's two-sum, then Dekker's fast two-sum to keep `lo` small).
    pub fn plus(self, x: f32) -> Self {
        let (sum, error) = two_sum(self.hi, x);
        fast_two_sum(sum, self.lo + error)
    }

    /// Adds another pair.
    pub fn plus_pair(self, other: Self) -> Self {
        let (sum, error) = two_sum(self.hi, other.hi);
        fast_two_sum(sum, error + (self.lo + other.lo))
    }

    /// The value in double precision.
    pub fn to_f64(self) -> f64 {
        f64::from(self.hi) + f64::from(self.lo)
    }
}

/// `a + b` as rounded sum and exact error, for any order of magnitudes.
fn two_sum(a: f32, b: f32) -> (f32, f32) {
    let sum = a + b;
    let b_part = sum - a;
    let a_part = sum - b_part;
    (sum, (a - a_part) + (b - b_part))
}

/// `a + b` as a pair, given `|a| >= |b|`.
fn fast_two_sum(a: f32, b: f32) -> TwoFloat {
    let hi = a + b;
    TwoFloat { hi, lo: b - (hi - a) }
}

/// Sums of one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PixelSums {
    /// Sum of the pass results, per channel.
    pub sum: [TwoFloat; 3],
    /// Sum of their squares, per channel.
    pub sum_sq: [TwoFloat; 3],
}

/// The film: what error bars, resuming and merging need, and nothing else.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Passes added.
    pub passes: u64,
    /// Numbers that were not finite and counted as 0 instead. One would poison its pixel for good; a correct
    /// renderer keeps this at 0.
    pub rejected: u64,
    /// One entry per pixel, rows from the top.
    pub pixels: Vec<PixelSums>,
}

impl Film {
    /// A black film without passes.
    pub fn new(width: u32, height: u32) -> Self {
        let pixels = vec![PixelSums::default(); width as usize * height as usize];
        Self { width, height, passes: 0, rejected: 0, pixels }
    }

    /// Adds the result of one pass: linear RGB, interleaved, rows from the top.
    ///
    /// # Panics
    /// If `pass` does not have three numbers for each pixel.
    pub fn add_pass(&mut self, pass: &[f32]) {
        assert_eq!(pass.len(), 3 * self.pixels.len(), "numbers in a pass");
        for (pixel, color) in self.pixels.iter_mut().zip(pass.chunks_exact(3)) {
            for (channel, &x) in color.iter().enumerate() {
                let square = x * x;
                if !x.is_finite() || !square.is_finite() {
                    self.rejected += 1;
                    continue;
                }
                pixel.sum[channel] = pixel.sum[channel].plus(x);
                pixel.sum_sq[channel] = pixel.sum_sq[channel].plus(square);
            }
        }
        self.passes += 1;
    }

    /// Adds the passes of another film of the same size.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!((self.width, self.height), (other.width, other.height), "size of a merged film");
        for (pixel, theirs) in self.pixels.iter_mut().zip(&other.pixels) {
            for channel in 0..3 {
                pixel.sum[channel] = pixel.sum[channel].plus_pair(theirs.sum[channel]);
                pixel.sum_sq[channel] = pixel.sum_sq[channel].plus_pair(theirs.sum_sq[channel]);
            }
        }
        self.passes += other.passes;
        self.rejected += other.rejected;
    }

    /// The picture: the mean over all passes as interleaved linear RGB; black without passes.
    pub fn mean(&self) -> Vec<f32> {
        let scale = self.passes.max(1) as f64;
        self.pixels.iter().flat_map(|pixel| pixel.sum.map(|sum| (sum.to_f64() / scale) as f32)).collect()
    }

    /// The standard error of [`Film::mean`], interleaved RGB: the square root of the unbiased sample variance over the
    /// number of passes. Infinite with fewer than two passes, where nothing is known about it.
    ///
    /// Cancellation limits it: a spread below about 3e-4 of the mean is lost in the rounding of the squares.
    pub fn standard_error(&self) -> Vec<f32> {
        if self.passes < 2 {
            return vec![f32::INFINITY; 3 * self.pixels.len()];
        }
        let n = self.passes as f64;
        let error = |sum: TwoFloat, sum_sq: TwoFloat| {
            let mean = sum.to_f64() / n;
            let variance = ((sum_sq.to_f64() / n - mean * mean) * n / (n - 1.0)).max(0.0);
            (variance / n).sqrt() as f32
        };
        self.pixels
            .iter()
            .flat_map(|pixel| [0, 1, 2].map(|channel| error(pixel.sum[channel], pixel.sum_sq[channel])))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn sixteen_million_passes_of_a_tenth_are_a_tenth() {
        let passes = (1_u32 << 24) + 1;
        let (mut naive, mut pair) = (0.0_f32, TwoFloat::default());
        for _ in 0..passes {
            naive += 0.1;
            pair = pair.plus(0.1);
        }
        let relative = |sum: f64| (sum / f64::from(passes) / 0.1 - 1.0).abs();
        assert!(relative(pair.to_f64()) < 1e-6, "two-float sum is {} off", relative(pair.to_f64()));
        assert!(relative(f64::from(naive)) > 0.05, "the naive sum should fail this test");
    }

    #[test]
    fn a_film_keeps_mean_error_and_count() {
        let mut film = Film::new(2, 1);
        for pass in 0..1000 {
            let x = if pass % 2 == 0 { 1.0 } else { 3.0 };
            film.add_pass(&[x, 0.25, 0.0, 1e-3 * x, 1e6, 7.0]);
        }
        assert_eq!(film.passes, 1000);
        assert_eq!(film.mean(), [2.0, 0.25, 0.0, 2e-3, 1e6, 7.0]);
        // The deviation of 1, 3, 1, 3 ... is 1: standard error 1 / sqrt(999).
        let error = film.standard_error();
        assert!((error[0] - 999_f32.sqrt().recip()).abs() < 1e-6);
        assert!((error[3] - 1e-3 * 999_f32.sqrt().recip()).abs() < 1e-8);
        assert!(error[1] == 0.0 && error[2] == 0.0);
    }

    #[test]
    fn nothing_is_known_from_one_pass() {
        let mut film = Film::new(1, 1);
        assert_eq!(film.mean(), [0.0; 3]);
        film.add_pass(&[1.0; 3]);
        assert_eq!(film.standard_error(), [f32::INFINITY; 3]);
    }

    #[test]
    fn broken_numbers_are_counted_and_do_not_spread() {
        let mut film = Film::new(1, 1);
        film.add_pass(&[1.0, 2.0, 3.0]);
        film.add_pass(&[f32::NAN, f32::INFINITY, 1e30]);
        assert_eq!(film.rejected, 3);
        assert_eq!(film.mean(), [0.5, 1.0, 1.5]);
    }

    #[test]
    fn merged_films_equal_one_film() {
        let pass = |index: u32| [0.1 * index as f32, 1.0 / (1.0 + index as f32), 1e5];
        let (mut whole, mut front, mut back) = (Film::new(1, 1), Film::new(1, 1), Film::new(1, 1));
        for index in 0..5000 {
            whole.add_pass(&pass(index));
            if index < 1234 { &mut front } else { &mut back }.add_pass(&pass(index));
        }
        front.merge(&back);
        assert_eq!(front.passes, whole.passes);
        assert_eq!(front.mean(), whole.mean());
        assert_eq!(front.standard_error(), whole.standard_error());
    }

    proptest! {
        #[test]
        fn a_pair_is_the_exact_sum_of_two(a in -1e30_f32..1e30, b in -1e30_f32..1e30) {
            let (sum, error) = two_sum(a, b);
            prop_assert_eq!(sum, a + b);
            // Both parts are multiples of the smaller ulp, so f64 shows the identity wherever it can hold the sum.
            let exact = f64::from(a) + f64::from(b);
            prop_assert_eq!(f64::from(sum) + f64::from(error), exact);
        }

        #[test]
        fn long_sums_agree_with_f64(numbers in prop::collection::vec(0.0_f32..1e6, 1..2000)) {
            let pair = numbers.iter().fold(TwoFloat::default(), |sum, &x| sum.plus(x)).to_f64();
            let exact: f64 = numbers.iter().map(|&x| f64::from(x)).sum();
            prop_assert!((pair - exact).abs() <= exact * 1e-11);
        }
    }
}
