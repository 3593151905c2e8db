//! When the shutter is open: motion blur.

/// The time that light comes in, in seconds of the scene's motion. Each pass shows the scene at one moment of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shutter {
    /// It opens: any finite number.
    pub open: f64,
    /// It closes: not before it opens.
    pub close: f64,
}

impl Shutter {
    /// The moment of a pass by its index among those of its method.
    ///
    /// Indices with their bits reversed (van der Corput 1935) are spread evenly however many passes there are, and
    /// whichever part of them a machine renders depends on no other. All are shifted by the same share of the time,
    /// which follows from the seed: without that few passes would show an early moment.
    pub fn moment(&self, index: u64, seed: u32) -> f64 {
        let reversed = (index.reverse_bits() >> 11) as f64 / (1u64 << 53) as f64;
        let share = (reversed + f64::from(mixed(seed)) / 2f64.powi(32)).fract();
        self.open * (1.0 - share) + self.close * share
    }

    /// Whether both times are finite and in order.
    pub(in crate::render) fn is_valid(&self) -> bool {
        self.open.is_finite() && self.close.is_finite() && self.open <= self.close
    }
}

/// A number in which every bit of the seed counts (the finaliser of MurmurHash3); half of the range for 0.
fn mixed(seed: u32) -> u32 {
    let mut x = seed;
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    (x ^ (x >> 16)) ^ (1 << 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_number_of_passes_is_spread_over_the_shutter() {
        let shutter = Shutter { open: 2.0, close: 3.0 };
        for seed in [0, 1, 0xdead_beef] {
            for count in [1u64, 2, 7, 64, 1000] {
                let mut moments: Vec<f64> = (0..count).map(|i| shutter.moment(i, seed) - 2.0).collect();
                moments.sort_by(f64::total_cmp);
                assert!(moments[0] >= 0.0 && moments[count as usize - 1] < 1.0);
                // The largest gap, around the end as well: never more than twice the mean one by much.
                let around = moments[0] + 1.0 - moments[count as usize - 1];
                let gap = moments.windows(2).map(|pair| pair[1] - pair[0]).fold(around, f64::max);
                assert!(gap <= 2.0 / count as f64 + 1e-9, "seed {seed}, {count} passes: a gap of {gap}");
            }
        }
        assert_eq!(shutter.moment(0, 0), 2.5, "one pass shows the middle");
        assert_ne!(shutter.moment(0, 1), shutter.moment(0, 2));
        let instant = Shutter { open: 2.0, close: 2.0 };
        assert!((0..99).all(|i| instant.moment(i, 7) == 2.0));
    }

    #[test]
    fn times_are_finite_and_in_order() {
        let valid = |open, close| Shutter { open, close }.is_valid();
        assert!(valid(-1.0, 2.0) && valid(0.0, 0.0));
        assert!(!valid(1.0, 0.0) && !valid(f64::NAN, 1.0) && !valid(0.0, f64::INFINITY));
    }
}
