//! Colour grading by the ASC CDL: the American Society of Cinematographers' Color Decision List, version 1.2.
//!
//! Per channel `out = clamp(in * slope + offset) ^ power`, then saturation around the Rec.709 luma
//! `0.2126 R + 0.7152 G + 0.0722 B`, and a clamp again. The standard leaves the encoding to
//! its user; here it works on display values: after the tone curve, sRGB-encoded.

/// A grade. The default changes nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cdl {
    /// Factor per channel, at least 0: gain; unequal numbers shift the white balance.
    pub slope: [f32; 3],
    /// Added per channel: lift.
    pub offset: [f32; 3],
    /// Exponent per channel, greater than 0: above 1 darkens the middle tones.
    pub power: [f32; 3],
    /// 0 is grey, 1 leaves colours alone.
    pub saturation: f32,
}

impl Default for Cdl {
    fn default() -> Self {
        Self { slope: [1.0; 3], offset: [0.0; 3], power: [1.0; 3], saturation: 1.0 }
    }
}

impl Cdl {
    /// What is done, with its numbers.
    pub fn describe(&self) -> String {
        let list = |x: [f32; 3]| x.map(|x| x.to_string()).join(",");
        let (slope, offset, power) = (list(self.slope), list(self.offset), list(self.power));
        format!("asc cdl slope {slope} offset {offset} power {power} saturation {}", self.saturation)
    }

    /// Grades a colour of 0 ... 1; the result is within it, too.
    pub fn apply(&self, color: [f32; 3]) -> [f32; 3] {
        let graded: [f32; 3] = std::array::from_fn(|k| {
            let x = (color[k] * self.slope[k] + self.offset[k]).clamp(0.0, 1.0);
            if self.power[k] == 1.0 { x } else { x.powf(self.power[k]) }
        });
        if self.saturation == 1.0 {
            return graded;
        }
        let luma = luma(graded);
        graded.map(|x| (luma + self.saturation * (x - luma)).clamp(0.0, 1.0))
    }
}

/// Rec.709 luma of display values.
pub(super) fn luma(color: [f32; 3]) -> f32 {
    0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(got: [f32; 3], want: [f32; 3]) {
        assert!(got.iter().zip(want).all(|(g, w)| (g - w).abs() < 1e-6), "got {got:?}, want {want:?}");
    }

    #[test]
    fn the_neutral_grade_changes_no_bit() {
        for color in [[0.0, 0.3, 1.0], [0.123_456_7, 0.999_999, 1e-30]] {
            assert_eq!(Cdl::default().apply(color), color);
        }
    }

    #[test]
    fn grades_equal_those_by_hand() {
        let cdl = Cdl { slope: [2.0, 1.0, 0.5], offset: [0.1, -0.2, 0.0], power: [2.0, 1.0, 0.5], saturation: 1.0 };
        // (0.2 * 2 + 0.1)^2, 0.6 - 0.2, sqrt(0.5 * 0.5)
        assert_near(cdl.apply([0.2, 0.6, 0.5]), [0.25, 0.4, 0.5]);
        // Clamped before the power: 0.9 * 2 + 0.1 > 1, 0.1 - 0.2 < 0.
        assert_near(cdl.apply([0.9, 0.1, 0.02]), [1.0, 0.0, 0.1]);
        // Luma of (1, 0, 0) is 0.2126; half way to it, away from it with a clamp, and on it.
        let with = |saturation| Cdl { saturation, ..Cdl::default() }.apply([1.0, 0.0, 0.0]);
        assert_near(with(0.5), [0.6063, 0.1063, 0.1063]);
        assert_near(with(2.0), [1.0, 0.0, 0.0]);
        assert_near(with(0.0), [0.2126; 3]);
        assert_near(Cdl { saturation: 3.0, ..Cdl::default() }.apply([0.5; 3]), [0.5; 3]);
    }

    #[test]
    fn every_grade_stays_within_the_display() {
        for slope in [0.0, 1.0, 1000.0] {
            for offset in [-10.0, 0.0, 10.0] {
                for power in [0.01, 1.0, 100.0] {
                    for saturation in [0.0, 1.0, 100.0] {
                        let cdl = Cdl { slope: [slope; 3], offset: [offset; 3], power: [power; 3], saturation };
                        let out = cdl.apply([0.0, 0.5, 1.0]);
                        assert!(out.iter().all(|x| (0.0..=1.0).contains(x)), "{cdl:?}: {out:?}");
                    }
                }
            }
        }
    }
}
