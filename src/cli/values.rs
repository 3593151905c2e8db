//! Values of flags: sizes, durations, counts, names.

use clap::ValueEnum;
use clap::builder::PossibleValue;

use crate::picture::tonemap::Curve;
pub use crate::render::names::{
    FootprintRule, Size, bound_vertices, choose_camera, footprint, knn_photons, largest_footprint, sampling, size,
    smoothing, tracer,
};
use crate::render::{Amplification, Estimator, Method, Named, PhotonBuild, Record, TreeBuild, Weight};

/// Parses `30s`, `1h30m`, `250ms` or plain seconds; the result is in seconds and greater than 0.
pub fn duration(text: &str) -> std::result::Result<f64, String> {
    const LONGEST: f64 = 1e9;
    let seconds = text.parse::<f64>().ok().or_else(|| duration_with_units(text));
    seconds
        .filter(|seconds| *seconds > 0.0 && *seconds <= LONGEST)
        .ok_or_else(|| "expected a time such as 30s, 2m, 1h30m or 500ms".into())
}

fn duration_with_units(text: &str) -> Option<f64> {
    let (mut rest, mut seconds) = (text, 0.0);
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.')?;
        let (number, tail) = rest.split_at(digits);
        let unit = tail.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(tail.len());
        let scale = match &tail[..unit] {
            "ms" => 1e-3,
            "s" => 1.0,
            "m" | "min" => 60.0,
            "h" => 3600.0,
            "d" => 86400.0,
            _ => return None,
        };
        seconds += number.parse::<f64>().ok()? * scale;
        rest = &tail[unit..];
    }
    Some(seconds)
}

/// Parses `250000`, `250k` or `1.5M`: a whole number greater than 0.
pub fn count(text: &str) -> std::result::Result<u64, String> {
    let expected = || "expected a whole number greater than 0, such as 250000, 250k or 1.5M".to_owned();
    let scaled = |digits: &str, scale: f64| {
        let number = digits.parse::<f64>().ok()? * scale;
        // Beyond 2^53 a product of f64 is no longer the number that was written.
        (number.fract() == 0.0 && (0.0..=9e15).contains(&number)).then_some(number as u64)
    };
    let number = match text.strip_suffix(['k', 'K']) {
        Some(digits) => scaled(digits, 1e3),
        None => match text.strip_suffix('M') {
            Some(digits) => scaled(digits, 1e6),
            None => text.parse().ok(),
        },
    };
    number.filter(|number| *number > 0).ok_or_else(expected)
}

/// Parses an exposure in stops.
pub fn stops(text: &str) -> std::result::Result<f32, String> {
    let stops = text.parse::<f32>().ok().filter(|stops| stops.abs() <= 64.0);
    stops.ok_or_else(|| "expected stops between -64 and 64, for example -1.5".into())
}

/// Parses `2%` or `0.02`: greater than 0, at most 1.
pub fn relative_error(text: &str) -> std::result::Result<f64, String> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number.trim_end(), 0.01));
    let fraction = number.parse::<f64>().ok().map(|number| number * unit);
    fraction
        .filter(|x| *x > 0.0 && *x <= 1.0)
        .ok_or_else(|| "expected a relative error such as 2% or 0.02, at most 100%".into())
}

/// Model of gathered glossy lobes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Bsdf {
    /// Microfacets as glTF describes them
    Ggx,
    /// Normalised Blinn-Phong with a full diffuse lobe (Mara, Luebke and McGuire 2013): for comparisons; can gain
    /// energy
    BlinnPhong,
}

/// Lets the parser of flags choose among named values.
macro_rules! choose_by_name {
    ($($type:ty),*) => {
        $(impl ValueEnum for $type {
            fn value_variants<'a>() -> &'a [Self] {
                <Self as Named>::VALUES
            }

            fn to_possible_value(&self) -> Option<PossibleValue> {
                Some(PossibleValue::new(Named::name(*self)).help(Named::help(*self)))
            }
        })*
    };
}

choose_by_name!(Amplification, Estimator, Method, PhotonBuild, Record, TreeBuild, Weight);

/// Additional layers of the EXR.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Aov {
    /// Reflectance of the first surface that is not a mirror or glass
    Albedo,
    /// Its shading normal, world space
    Normal,
    /// Distance from the camera along the view axis, scene units
    Depth,
    /// Light sources as seen, and light that comes straight from one; direct + indirect + caustic is the picture
    Direct,
    /// Light that was scattered at least once, caustics not included
    Indirect,
    /// Light focused by mirrors and glass
    Caustic,
    /// What the error of the colour stays below with 90 % confidence, per channel, by the render's own estimate of
    /// noise and bias, before passes over the finished picture; every EXR has it
    Error,
    /// All of these
    All,
}

impl Aov {
    /// Name of the layer in the EXR.
    pub fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Caustic => "caustic",
            Self::Error => "error",
            Self::All => "all",
        }
    }

    /// The layers asked for: each once, in a fixed order, `all` resolved.
    pub fn resolve(list: &[Self]) -> Vec<Self> {
        let wanted = |aov: &Self| *aov != Self::All && (list.contains(aov) || list.contains(&Self::All));
        Self::value_variants().iter().copied().filter(wanted).collect()
    }
}

impl ValueEnum for Curve {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Neutral, Self::Linear, Self::Reinhard]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(match self {
            Self::Neutral => {
                PossibleValue::new("neutral").help("Khronos PBR Neutral: keeps colours, softens highlights")
            }
            Self::Linear => PossibleValue::new("linear").help("No curve; cut off at 1"),
            Self::Reinhard => PossibleValue::new("reinhard").help("x / (1 + x) on the luminance"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Sampling, Scale};

    #[test]
    fn largest_footprints() {
        assert_eq!(largest_footprint("0.05"), Ok(0.05));
        for bad in ["", "0", "-1", "nan", "inf", "1.1", "x"] {
            assert!(largest_footprint(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes() {
        assert_eq!(size("640x480"), Ok(Size { width: 640, height: 480 }));
        assert_eq!(size("1X16384").map(|size| size.to_string()), Ok("1x16384".into()));
        for bad in ["", "x", "640", "640x", "0x5", "-1x5", "1.5x2", "65537x1", "65536x65536", "4x4x4", "4 x 4"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn durations() {
        for (text, seconds) in [("30s", 30.0), ("90", 90.0), ("2m", 120.0), ("1h30m", 5400.0), ("1.5min", 90.0)] {
            assert_eq!(duration(text), Ok(seconds), "{text}");
        }
        assert_eq!(duration("250ms"), Ok(0.25));
        assert_eq!(duration("1d"), Ok(86400.0));
        for bad in ["", "s", "0s", "-5s", "5x", "5s3", "nan", "inf", "1e300", "1..5s", "5 s", "5µs", "m5"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn counts() {
        for (text, number) in [("1", 1), ("250000", 250_000), ("250k", 250_000), ("1.5M", 1_500_000)] {
            assert_eq!(count(text), Ok(number), "{text}");
        }
        assert_eq!(count("18446744073709551615"), Ok(u64::MAX));
        for bad in ["", "0", "-1", "0k", "1.5", "1.0001k", "M", "1e300M", "nank", "1G", "18446744073709551616"] {
            assert!(count(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn relative_errors() {
        for (text, value) in [("2%", 0.02), ("0.02", 0.02), ("2 %", 0.02), ("100%", 1.0), ("0.5%", 0.005)] {
            assert!((relative_error(text).expect(text) - value).abs() < 1e-12, "{text}");
        }
        for bad in ["", "%", "0", "-1%", "2", "101%", "nan", "inf%", "1%%", "x%"] {
            assert!(relative_error(bad).is_err_and(|e| e.contains("2% or 0.02")), "{bad}");
        }
    }

    #[test]
    fn exposures() {
        assert_eq!(stops("-1.5"), Ok(-1.5));
        for bad in ["", "nan", "inf", "65", "one"] {
            assert!(stops(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn smoothing_factors() {
        assert_eq!(smoothing("2.5"), Ok(2.5));
        for bad in ["", "0", "-1", "nan", "inf", "101", "x"] {
            assert!(smoothing(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn footprints() {
        assert_eq!(footprint("differential"), Ok(FootprintRule::Differential));
        assert_eq!(footprint("density"), Ok(FootprintRule::Density(None)));
        assert_eq!(footprint("density:0.1:2"), Ok(FootprintRule::Density(Some((0.1, 2.0)))));
        assert_eq!(footprint("fixed:0.05"), Ok(FootprintRule::Fixed(0.05)));
        for bad in
            ["", "fixed", "fixed:0", "fixed:-1", "fixed:nan", "fixed:inf", "density:1", "density:2:1", "fixed:1:2"]
        {
            assert!(footprint(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn samplings() {
        let stochastic = |k, scale, filter| Ok(Sampling::Stochastic { k, scale, filter });
        assert_eq!(sampling("full"), Ok(Sampling::Full));
        assert_eq!(sampling("regular:16"), Ok(Sampling::Regular(16)));
        assert_eq!(sampling("stochastic:2"), stochastic(2, Scale::Unbiased, false));
        assert_eq!(sampling("stochastic:3:ratio"), stochastic(3, Scale::Ratio, false));
        assert_eq!(sampling("stochastic:4:filter:ratio"), stochastic(4, Scale::Ratio, true));
        for bad in ["", "full:2", "regular", "regular:", "regular:1", "regular:17", "regular:2:ratio", "stochastic"] {
            assert!(sampling(bad).is_err(), "{bad}");
        }
        for bad in ["stochastic:0", "stochastic:-2", "stochastic:2:", "stochastic:2:x", "stochastic:ratio", "some:2"] {
            assert!(sampling(bad).is_err(), "{bad}");
        }
        assert!(sampling("stochastic:4:best").is_err_and(|e| e.contains("'best'")));
    }

    #[test]
    fn cameras_by_name_then_by_index() {
        let names = ["front", "0", "side"];
        assert_eq!(choose_camera("side", &names).ok(), Some(2));
        assert_eq!(choose_camera("0", &names).ok(), Some(1), "a name goes before an index");
        assert_eq!(choose_camera("2", &names).ok(), Some(2));
        let error = choose_camera("3", &names).expect_err("three cameras");
        assert_eq!(error.to_string(), "no camera '3'; the scene has 0 'front', 1 '0', 2 'side'");
        let error = choose_camera("top", &["", "a\u{1b}[2J", ""]).expect_err("no such name");
        assert_eq!(error.to_string(), "no camera 'top'; the scene has 0, 1 'a\\u{1b}[2J', 2");
        let error = choose_camera("top", &[""; 30]).expect_err("no such name");
        assert!(error.to_string().ends_with(" 18, 19, others up to 29"), "{error}");
    }

    #[test]
    fn layers_come_once_and_in_order() {
        use Aov::{Albedo, All, Caustic, Depth};
        assert_eq!(Aov::resolve(&[Depth, Albedo, Depth]), [Albedo, Depth]);
        assert_eq!(Aov::resolve(&[Caustic, All]).len(), 7);
        assert_eq!(Aov::resolve(&[]), []);
    }
}
