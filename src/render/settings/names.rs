//! Settings as they are written, on the command line and in the file of a study.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use super::ranges;
use super::sampling::{Sampling, Scale};
use super::tracer::{MapSettings, Tracer};
use crate::error::{Error, Result, escaped};
use crate::kernels::photon::Footprint;
use crate::scene::Scene;

/// Picture size in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// 1 ... 65536.
    pub width: u32,
    /// 1 ... 65536.
    pub height: u32,
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// Parses `640x480`.
pub fn size(text: &str) -> std::result::Result<Size, String> {
    let side = |side: &str| side.parse::<u32>().ok().filter(|side| ranges::SIDE.contains(side));
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| Some((side(width)?, side(height)?)));
    let (width, height) = sides.ok_or("expected WIDTHxHEIGHT in pixels, for example 640x480")?;
    if u64::from(width) * u64::from(height) > u64::from(ranges::MOST_PIXELS) {
        return Err(format!("more than {} pixels", ranges::MOST_PIXELS));
    }
    Ok(Size { width, height })
}

/// Parses a number of [`ranges::LARGEST_FOOTPRINT`].
pub fn largest_footprint(text: &str) -> std::result::Result<f32, String> {
    number(text, &ranges::LARGEST_FOOTPRINT)
}

/// Parses a number of [`ranges::SMOOTHING`].
pub fn smoothing(text: &str) -> std::result::Result<f32, String> {
    number(text, &ranges::SMOOTHING)
}

/// Parses a number of [`ranges::ALPHA`].
pub fn alpha(text: &str) -> std::result::Result<f64, String> {
    number(text, &ranges::ALPHA)
}

/// Parses a number of [`ranges::KNN_PHOTONS`].
pub fn knn_photons(text: &str) -> std::result::Result<u32, String> {
    number(text, &ranges::KNN_PHOTONS)
}

/// Parses a number of [`ranges::BOUND_VERTICES`].
pub fn bound_vertices(text: &str) -> std::result::Result<u32, String> {
    number(text, &ranges::BOUND_VERTICES)
}

fn number<T: FromStr + PartialOrd + Display>(text: &str, range: &RangeInclusive<T>) -> std::result::Result<T, String> {
    let number = text.parse::<T>().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| format!("expected a number between {} and {}", range.start(), range.end()))
}

/// Cameras that an error lists.
const MOST_NAMES: usize = 20;

/// The camera that `wanted` means: a name, otherwise an index from 0.
///
/// # Errors
/// [`Error::Usage`] with the numbers and names there are.
pub fn choose_camera(wanted: &str, names: &[&str]) -> Result<usize> {
    let by_name = names.iter().position(|name| *name == wanted);
    let by_index = || wanted.parse().ok().filter(|index| *index < names.len());
    by_name.or_else(by_index).ok_or_else(|| {
        let one = |(index, name): (usize, &&str)| match *name {
            "" => format!("{index}"),
            name => format!("{index} '{}'", escaped(name)),
        };
        let mut list: Vec<String> = names.iter().enumerate().take(MOST_NAMES).map(one).collect();
        if names.len() > MOST_NAMES {
            list.push(format!("others up to {}", names.len() - 1));
        }
        Error::Usage(format!("no camera '{wanted}'; the scene has {}", list.join(", ")))
    })
}

/// A rule for footprints as it is written; the radii of `density` without numbers follow from the size of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FootprintRule {
    /// By photon differentials.
    Differential,
    /// By path density, between two radii in scene units.
    Density(Option<(f32, f32)>),
    /// One radius in scene units.
    Fixed(f32),
}

/// Smallest and largest radius of `density` without numbers, in scene radii: the range that differentials mostly give.
const DENSITY_RADII: [f32; 2] = [0.002, 0.02];

impl FootprintRule {
    /// The rule with the lengths of a scene.
    pub fn in_scene(self, scene: &Scene) -> Footprint {
        match self {
            Self::Differential => Footprint::Differential,
            Self::Fixed(radius) => Footprint::Fixed(radius),
            Self::Density(Some((min, max))) => Footprint::Density { min, max },
            Self::Density(None) => {
                let [min, max] = DENSITY_RADII.map(|r| r * scene.bounds().map_or(1.0, |b| b.radius()));
                Footprint::Density { min, max }
            }
        }
    }
}

/// Parses `differential`, `density`, `density:0.01:0.1`, `fixed:0.05`.
pub fn footprint(text: &str) -> std::result::Result<FootprintRule, String> {
    let expected =
        || "expected differential, density, density:MIN:MAX or fixed:RADIUS, for example fixed:0.05".to_owned();
    let radius = |text: &str| text.parse::<f32>().ok().filter(|r| *r > 0.0 && r.is_finite()).ok_or_else(expected);
    let parts: Vec<&str> = text.split(':').collect();
    match parts[..] {
        ["differential"] => Ok(FootprintRule::Differential),
        ["density"] => Ok(FootprintRule::Density(None)),
        ["density", min, max] => {
            let (min, max) = (radius(min)?, radius(max)?);
            if min <= max {
                Ok(FootprintRule::Density(Some((min, max))))
            } else {
                Err("MIN is greater than MAX".into())
            }
        }
        ["fixed", r] => Ok(FootprintRule::Fixed(radius(r)?)),
        _ => Err(expected()),
    }
}

/// Parses `tree`, `maps`, `maps:centres=8:candidates=32:resolution=256:layers=2:steps`.
pub fn tracer(text: &str) -> std::result::Result<Tracer, String> {
    let mut parts = text.split(':');
    match (parts.next(), text) {
        (_, "tree") => return Ok(Tracer::Tree),
        (Some("maps"), _) => {}
        _ => return Err("expected tree, maps, or maps with options such as maps:centres=8:resolution=256".into()),
    }
    let mut maps = MapSettings::default();
    for part in parts {
        if part == "steps" {
            maps.steps = true;
            continue;
        }
        let (name, value) = part.split_once('=').unwrap_or((part, ""));
        let (place, range) = match name {
            "centres" => (&mut maps.centres, &ranges::MAP_CENTRES),
            "candidates" => (&mut maps.candidates, &ranges::MAP_CANDIDATES),
            "resolution" => (&mut maps.resolution, &ranges::MAP_RESOLUTION),
            "layers" => (&mut maps.layers, &ranges::MAP_LAYERS),
            _ => return Err(format!("'{name}' is not an option of maps")),
        };
        *place = number(value, range).map_err(|cause| format!("{name}: {cause}"))?;
    }
    Ok(Tracer::Maps(maps))
}

/// Parses `full`, `regular:4`, `stochastic:4`, `stochastic:4:ratio:filter`.
pub fn sampling(text: &str) -> std::result::Result<Sampling, String> {
    let (mode, rest) = text.split_once(':').map_or((text, None), |(mode, rest)| (mode, Some(rest)));
    let (k, options) = rest.map_or((None, vec![]), |rest| {
        let mut parts = rest.split(':');
        (parts.next(), parts.collect::<Vec<_>>())
    });
    let k = || {
        let k = k.and_then(|k| k.parse().ok()).filter(|k| ranges::SAMPLING_K.contains(k));
        let range = ranges::words(&ranges::SAMPLING_K);
        k.ok_or_else(|| format!("expected a whole number from {range} after the mode, for example {mode}:4"))
    };
    let wrong = |option: &str| format!("'{option}' is not an option of {mode}");
    match (mode, &options[..]) {
        ("full", []) if rest.is_none() => Ok(Sampling::Full),
        ("regular", []) => Ok(Sampling::Regular(k()?)),
        ("regular", [option, ..]) => Err(wrong(option)),
        ("stochastic", options) => {
            let k = k()?;
            if let Some(option) = options.iter().find(|option| !["ratio", "filter"].contains(option)) {
                return Err(wrong(option));
            }
            let scale = if options.contains(&"ratio") { Scale::Ratio } else { Scale::Unbiased };
            Ok(Sampling::Stochastic { k, scale, filter: options.contains(&"filter") })
        }
        _ => Err("expected full, regular:K, stochastic:K, stochastic:K:ratio or stochastic:K:filter".into()),
    }
}
