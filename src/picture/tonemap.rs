//! From linear radiance to the numbers of a display: exposure, tone curve, sRGB encoding.
//!
//! Sources: Khronos PBR Neutral Tone Mapper (Khronos Group, 2024); Reinhard et al., "Photographic tone reproduction
//! for digital images" (2002), equation 3; IEC 61966-2-1 for sRGB.

/// The tone curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Curve {
    /// Khronos PBR Neutral: colours up to 0.8 keep hue and saturation, highlights fade to white.
    #[default]
    Neutral,
    /// No curve; what exceeds 1 is cut off, channel by channel.
    Linear,
    /// `x / (1 + x)` on the luminance; hue and saturation are kept until a channel is cut off at 1.
    Reinhard,
}

/// Everything between a linear colour and a display value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ToneMap {
    /// The tone curve.
    pub curve: Curve,
    /// Exposure in stops: colours are multiplied by 2 to this power before the curve.
    pub exposure: f32,
}

/// Above this a tone curve is white to the last bit; it keeps infinities out of the arithmetic.
const WHITE: f32 = 1e9;

impl ToneMap {
    /// A linear Rec.709 colour as linear display values in 0 ... 1. Negative and NaN channels count as 0.
    #[expect(clippy::manual_clamp, reason = "`clamp` keeps NaN; `max` first turns it into 0")]
    pub fn apply(self, color: [f32; 3]) -> [f32; 3] {
        let gain = self.exposure.exp2();
        let exposed = color.map(|channel| (channel * gain).max(0.0).min(WHITE));
        let mapped = match self.curve {
            Curve::Neutral => neutral(exposed),
            Curve::Linear => exposed,
            Curve::Reinhard => reinhard(exposed),
        };
        mapped.map(|channel| channel.clamp(0.0, 1.0))
    }

    /// A linear Rec.709 colour as sRGB-encoded display values in 0 ... 1.
    pub fn display(self, color: [f32; 3]) -> [f32; 3] {
        self.apply(color).map(srgb_from_linear)
    }

    /// A linear Rec.709 colour as 8-bit sRGB.
    pub fn encode(self, color: [f32; 3]) -> [u8; 3] {
        self.display(color).map(|channel| (channel * 255.0).round() as u8)
    }
}

/// Khronos PBR Neutral for colours of at least 0. Takes off the 4 % that a dielectric reflects at normal incidence (so
/// that a base colour comes back as itself), leaves peaks up to 0.76 alone, compresses the rest towards 1 and
/// desaturates what was compressed.
fn neutral(color: [f32; 3]) -> [f32; 3] {
    const FRESNEL: f32 = 0.04;
    const START: f32 = 0.8 - FRESNEL;
    const DESATURATION: f32 = 0.15;
    let least = color.iter().copied().fold(f32::INFINITY, f32::min);
    let offset = if least < 2.0 * FRESNEL { least - least * least / (4.0 * FRESNEL) } else { FRESNEL };
    let color = color.map(|channel| channel - offset);
    let peak = color.iter().copied().fold(0.0, f32::max);
    if peak < START {
        return color;
    }
    let range = 1.0 - START;
    let new_peak = 1.0 - range * range / (peak + range - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|channel| channel * (new_peak / peak) * (1.0 - white) + new_peak * white)
}

/// Reinhard's curve on the Rec.709 luminance.
fn reinhard(color: [f32; 3]) -> [f32; 3] {
    let luminance = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
    color.map(|channel| channel / (1.0 + luminance))
}

/// The sRGB transfer function for a linear value in 0 ... 1.
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEUTRAL: ToneMap = ToneMap { curve: Curve::Neutral, exposure: 0.0 };
    const CURVES: [Curve; 3] = [Curve::Neutral, Curve::Linear, Curve::Reinhard];

    fn assert_near(got: [f32; 3], want: [f32; 3]) {
        for (g, w) in got.iter().zip(want) {
            assert!((g - w).abs() < 2e-6, "got {got:?}, want {want:?}");
        }
    }

    #[test]
    fn neutral_only_offsets_below_the_shoulder() {
        // A colour whose least channel is at least 0.08 and whose peak is below 0.8 loses exactly 0.04.
        assert_near(NEUTRAL.apply([0.2, 0.5, 0.79]), [0.16, 0.46, 0.75]);
        assert_near(NEUTRAL.apply([0.08, 0.08, 0.08]), [0.04; 3]);
        // Below 0.08 the offset is x - 6.25 x^2: at 0.04 that is 0.03, and black stays black.
        assert_near(NEUTRAL.apply([0.04, 0.5, 0.5]), [0.01, 0.47, 0.47]);
        assert_near(NEUTRAL.apply([0.0, 0.3, 0.6]), [0.0, 0.3, 0.6]);
    }

    #[test]
    fn neutral_gives_a_base_colour_back() {
        // Lit to irradiance pi, a dielectric of base colour b with 4 % reflection shows b + 0.04.
        for base in [0.04_f32, 0.1, 0.5, 0.75] {
            assert_near(NEUTRAL.apply([base + 0.04; 3]), [base; 3]);
        }
    }

    #[test]
    fn neutral_compresses_as_published() {
        // By hand: 1.04 - 0.04 = 1; 1 - 0.24^2 / (1 + 0.24 - 0.76) = 0.88. A grey is not changed by desaturation.
        assert_near(NEUTRAL.apply([1.04; 3]), [0.88; 3]);
        // By hand, red 2.76: peak 2.76, new peak 1 - 0.0576 / 2.24 = 0.974286, g = 1 - 1 / (0.15 * 1.785714 + 1).
        assert_near(NEUTRAL.apply([2.76, 0.0, 0.0]), [0.974_285_7, 0.205_835, 0.205_835]);
    }

    #[test]
    fn curves_are_monotone_continuous_and_end_at_white() {
        for curve in CURVES {
            let map = ToneMap { curve, exposure: 0.0 };
            let mut last = 0.0;
            for step in 0..40_000 {
                let grey = step as f32 * 1e-4;
                let value = map.apply([grey; 3])[0];
                assert!(value >= last - 1e-7, "{curve:?} falls at {grey}");
                assert!(value - last < 2.1e-4, "{curve:?} jumps at {grey}");
                last = value;
            }
            assert_near(map.apply([f32::INFINITY; 3]), [1.0; 3]);
        }
    }

    #[test]
    fn broken_numbers_stay_in_range() {
        let broken = [f32::NAN, f32::NEG_INFINITY, f32::INFINITY, -1.0, 0.0, f32::MAX, f32::MIN_POSITIVE];
        for curve in CURVES {
            for exposure in [-200.0, 0.0, 200.0] {
                for a in broken {
                    for b in broken {
                        let out = ToneMap { curve, exposure }.apply([a, b, 0.5]);
                        assert!(out.iter().all(|c| (0.0..=1.0).contains(c)), "{curve:?} {a} {b}: {out:?}");
                    }
                }
            }
        }
        assert_eq!(NEUTRAL.encode([f32::NAN; 3]), [0; 3]);
    }

    #[test]
    fn exposure_counts_in_stops() {
        let map = |exposure| ToneMap { curve: Curve::Linear, exposure }.apply([0.1; 3])[0];
        assert_eq!(map(0.0), 0.1);
        assert_eq!(map(2.0), 0.4);
        assert_eq!(map(-1.0), 0.05);
    }

    #[test]
    fn reinhard_halves_a_luminance_of_one() {
        assert_near(ToneMap { curve: Curve::Reinhard, exposure: 0.0 }.apply([1.0; 3]), [0.5; 3]);
    }

    #[test]
    fn srgb_meets_its_standard() {
        let linear = ToneMap { curve: Curve::Linear, exposure: 0.0 };
        assert_eq!(linear.encode([0.0, 0.214_041_14, 1.0]), [0, 128, 255]);
        assert_eq!(linear.encode([0.5, 0.18, 0.0005]), [188, 118, 2]);
        assert!((srgb_from_linear(0.003_130_8) - 0.040_449_94).abs() < 1e-6);
        assert!((srgb_from_linear(0.003_130_9) - srgb_from_linear(0.003_130_8)).abs() < 3e-6);
    }
}
