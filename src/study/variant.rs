//! The settings of a variant as they are written in the file of a study, under the names of the flags of `nephroid
//! render`.

use std::collections::BTreeMap;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, Visitor};

use crate::render::names::{self, FootprintRule, Size};
use crate::render::{Estimator, Method, Named, PhotonBuild, Record, Sampling, Settings, Tracer, Weight, by_name};
use crate::scene::Scene;

/// What can be read from a word or a number.
pub trait Spelled: Sized {
    /// Reads the value; the error says what is expected.
    ///
    /// # Errors
    /// A sentence.
    fn spelled(text: &str) -> Result<Self, String>;
}

/// A value and how it was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written<T> {
    /// As in the file.
    pub text: String,
    /// What it means.
    pub value: T,
}

impl<T: Spelled> Written<T> {
    fn new<E: serde::de::Error>(text: &str) -> Result<Self, E> {
        let value = T::spelled(text).map_err(|expected| E::custom(format!("'{text}': {expected}")))?;
        Ok(Self { text: text.to_owned(), value })
    }
}

impl<'de, T: Spelled> Deserialize<'de> for Written<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text<T>(PhantomData<T>);
        impl<T: Spelled> Visitor<'_> for Text<T> {
            type Value = Written<T>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a word or a number")
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Self::Value, E> {
                Written::new(text)
            }

            fn visit_i64<E: serde::de::Error>(self, number: i64) -> Result<Self::Value, E> {
                Written::new(&number.to_string())
            }

            fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Self::Value, E> {
                Written::new(&number.to_string())
            }

            fn visit_f64<E: serde::de::Error>(self, number: f64) -> Result<Self::Value, E> {
                Written::new(&number.to_string())
            }
        }
        deserializer.deserialize_any(Text(PhantomData))
    }
}

impl<T: Named> Spelled for T {
    fn spelled(text: &str) -> Result<Self, String> {
        by_name(text)
    }
}

impl Spelled for Sampling {
    fn spelled(text: &str) -> Result<Self, String> {
        names::sampling(text)
    }
}

impl Spelled for Tracer {
    fn spelled(text: &str) -> Result<Self, String> {
        names::tracer(text)
    }
}

impl Spelled for FootprintRule {
    fn spelled(text: &str) -> Result<Self, String> {
        names::footprint(text)
    }
}

impl Spelled for Size {
    fn spelled(text: &str) -> Result<Self, String> {
        names::size(text)
    }
}

/// A whole number from 1 on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Count(pub u32);

impl Spelled for Count {
    fn spelled(text: &str) -> Result<Self, String> {
        let count = text.parse().ok().filter(|n| *n > 0);
        count.map(Self).ok_or_else(|| format!("expected a whole number from 1 to {}", u32::MAX))
    }
}

/// A number greater than 0 and at most 1e6: seconds, factors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Positive(pub f64);

impl Spelled for Positive {
    fn spelled(text: &str) -> Result<Self, String> {
        let number = text.parse().ok().filter(|x| *x > 0.0 && *x <= 1e6);
        number.map(Self).ok_or_else(|| "expected a number greater than 0 and at most 1000000".into())
    }
}

/// A smoothing factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothing(pub f32);

impl Spelled for Smoothing {
    fn spelled(text: &str) -> Result<Self, String> {
        names::smoothing(text).map(Self)
    }
}

/// Largest semiaxis in scene radii.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LargestFootprint(pub f32);

impl Spelled for LargestFootprint {
    fn spelled(text: &str) -> Result<Self, String> {
        names::largest_footprint(text).map(Self)
    }
}

/// Exponent of the radius schedule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alpha(pub f64);

impl Spelled for Alpha {
    fn spelled(text: &str) -> Result<Self, String> {
        names::alpha(text).map(Self)
    }
}

/// Settings that differ from the defaults.
#[derive(Debug, Clone, Default, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VariantSettings {
    /// Name of the variant.
    pub name: String,
    /// As `--method`.
    pub method: Option<Written<Method>>,
    /// As `--estimator`.
    pub estimator: Option<Written<Estimator>>,
    /// As `--photon-build`.
    pub photon_build: Option<Written<PhotonBuild>>,
    /// As `--knn-photons`.
    pub knn_photons: Option<Written<Count>>,
    /// As `--sampling`.
    pub sampling: Option<Written<Sampling>>,
    /// As `--tracer`.
    pub tracer: Option<Written<Tracer>>,
    /// As `--footprint`.
    pub footprint: Option<Written<FootprintRule>>,
    /// As `--kernel`.
    #[serde(rename = "kernel")]
    pub weight: Option<Written<Weight>>,
    /// As `--photon-record`.
    pub photon_record: Option<Written<Record>>,
    /// Photons per pass, as `--photons`.
    pub photons: Option<Written<Count>>,
    /// Photons per pass and pixel; [`Self::photons`] goes first.
    pub photons_per_pixel: Option<Written<Positive>>,
    /// As `--caustic-smoothing`.
    pub caustic_smoothing: Option<Written<Smoothing>>,
    /// As `--global-smoothing`.
    pub global_smoothing: Option<Written<Smoothing>>,
    /// As `--largest-footprint`.
    pub largest_footprint: Option<Written<LargestFootprint>>,
    /// Factor on both smoothings and on the largest footprint: on the first radius, whatever sets it.
    pub radius: Option<Written<Positive>>,
    /// Exponent of the radius schedule, 0 to 1; 1 never shrinks.
    pub alpha: Option<Written<Alpha>>,
    /// Surfaces that a photon may meet.
    pub photon_bounces: Option<Written<Count>>,
    /// Surfaces that an eye path may meet after its first.
    pub eye_depth: Option<Written<Count>>,
}

impl VariantSettings {
    /// What was set, by name, as it was written.
    pub fn settings(&self) -> BTreeMap<String, String> {
        fn text<T>(written: &Option<Written<T>>) -> Option<&String> {
            written.as_ref().map(|written| &written.text)
        }
        let all = [
            ("method", text(&self.method)),
            ("estimator", text(&self.estimator)),
            ("photon_build", text(&self.photon_build)),
            ("knn_photons", text(&self.knn_photons)),
            ("sampling", text(&self.sampling)),
            ("tracer", text(&self.tracer)),
            ("footprint", text(&self.footprint)),
            ("kernel", text(&self.weight)),
            ("photon_record", text(&self.photon_record)),
            ("photons", text(&self.photons)),
            ("photons_per_pixel", text(&self.photons_per_pixel)),
            ("caustic_smoothing", text(&self.caustic_smoothing)),
            ("global_smoothing", text(&self.global_smoothing)),
            ("largest_footprint", text(&self.largest_footprint)),
            ("radius", text(&self.radius)),
            ("alpha", text(&self.alpha)),
            ("photon_bounces", text(&self.photon_bounces)),
            ("eye_depth", text(&self.eye_depth)),
        ];
        all.into_iter().filter_map(|(name, text)| Some((name.to_owned(), text?.clone()))).collect()
    }

    /// The settings of a session for a picture of this size.
    pub fn resolve(&self, scene: &Scene, camera: usize, size: Size) -> Settings {
        fn or<T: Copy>(written: &Option<Written<T>>, default: T) -> T {
            written.as_ref().map_or(default, |written| written.value)
        }
        let d = Settings::default();
        let radius = or(&self.radius, Positive(1.0)).0 as f32;
        let by_pixel = |ratio: Positive| {
            let photons = ratio.0 * f64::from(size.width) * f64::from(size.height);
            photons.round().clamp(1.0, f64::from(u32::MAX)) as u32
        };
        Settings {
            width: size.width,
            height: size.height,
            camera,
            method: or(&self.method, d.method),
            photons: match (&self.photons, &self.photons_per_pixel) {
                (Some(photons), _) => Some(photons.value.0),
                (None, ratio) => ratio.as_ref().map(|ratio| by_pixel(ratio.value)),
            },
            estimator: self.estimator.as_ref().map(|written| written.value),
            photon_build: or(&self.photon_build, d.photon_build),
            knn_photons: or(&self.knn_photons, Count(d.knn_photons)).0,
            sampling: or(&self.sampling, d.sampling),
            tracer: or(&self.tracer, d.tracer),
            weight: or(&self.weight, d.weight),
            footprint: or(&self.footprint, FootprintRule::Differential).in_scene(scene),
            record: or(&self.photon_record, d.record),
            caustic_smoothing: or(&self.caustic_smoothing, Smoothing(d.caustic_smoothing)).0 * radius,
            global_smoothing: or(&self.global_smoothing, Smoothing(d.global_smoothing)).0 * radius,
            largest_footprint: or(&self.largest_footprint, LargestFootprint(d.largest_footprint)).0 * radius,
            alpha: or(&self.alpha, Alpha(d.alpha)).0,
            photon_bounces: or(&self.photon_bounces, Count(d.photon_bounces)).0,
            eye_depth: or(&self.eye_depth, Count(d.eye_depth)).0,
            ..d
        }
    }
}

/// Lists of values: a variant for each combination.
#[derive(Debug, Clone, Default, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Grid {
    /// Photons per pass and pixel.
    photons_per_pixel: Vec<Written<Positive>>,
    /// Factors on the first radius.
    radius: Vec<Written<Positive>>,
    /// Largest semiaxes in scene radii.
    largest_footprint: Vec<Written<LargestFootprint>>,
    /// Exponents of the radius schedule.
    alpha: Vec<Written<Alpha>>,
    /// Weights of photons within their footprint.
    #[serde(rename = "kernel")]
    weight: Vec<Written<Weight>>,
    /// Estimators.
    estimator: Vec<Written<Estimator>>,
}

impl Grid {
    /// The variants, named by their values: of photons, as these are what the values are about.
    pub fn variants(&self) -> Vec<VariantSettings> {
        fn with<T: Clone>(
            (variants, key): (Vec<VariantSettings>, &str),
            values: &[Written<T>],
            set: impl Fn(&mut VariantSettings, Written<T>),
        ) -> Vec<VariantSettings> {
            if values.is_empty() {
                return variants;
            }
            let one = |variant: &VariantSettings, value: &Written<T>| {
                let mut variant = variant.clone();
                let gap = if variant.name.is_empty() { "" } else { " " };
                variant.name += &format!("{gap}{key}={}", value.text);
                set(&mut variant, value.clone());
                variant
            };
            variants.iter().flat_map(|variant| values.iter().map(move |value| one(variant, value))).collect()
        }
        let method = Some(Written { text: Method::Photons.name().into(), value: Method::Photons });
        let variants = vec![VariantSettings { method, ..VariantSettings::default() }];
        let variants = with((variants, "ppp"), &self.photons_per_pixel, |v, x| v.photons_per_pixel = Some(x));
        let variants = with((variants, "r"), &self.radius, |v, x| v.radius = Some(x));
        let variants = with((variants, "largest"), &self.largest_footprint, |v, x| v.largest_footprint = Some(x));
        let variants = with((variants, "a"), &self.alpha, |v, x| v.alpha = Some(x));
        let variants = with((variants, "k"), &self.weight, |v, x| v.weight = Some(x));
        with((variants, "e"), &self.estimator, |v, x| v.estimator = Some(x))
    }
}
