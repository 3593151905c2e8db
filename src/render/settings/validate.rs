//! The one place where settings are refused: every range, and what does not go together.

use std::fmt::Display;
use std::ops::RangeInclusive;

use super::{Estimator, Lens, PhotonBuild, Record, Sampling, Settings, Tracer, ranges};
use crate::error::{Error, Result, escaped};
use crate::graph::DeviceClass;
use crate::kernels::gather::Amplification;
use crate::kernels::photon::Footprint;
use crate::scene::{Projection, Scene};
use crate::vk::{Device, Feature};

impl Settings {
    /// Checks all settings: their ranges, what goes together, what the scene has, and what the device can do.
    ///
    /// # Errors
    /// [`Error::Setting`] with the fields at fault and what would be right; [`Error::MissingFeature`] if the device
    /// cannot run the estimator.
    pub fn validate(&self, scene: &Scene, device: &Device) -> Result<()> {
        self.validate_plan(scene, device.info().kind.into())?;
        if self.tracer != Tracer::Tree {
            needed_by(&["tracer"], device.require(&[Feature::Raster]))?;
        }
        if !draws_bounds(self.estimator_on(device.info().kind.into())) {
            return Ok(());
        }
        needed_by(&["estimator"], device.require(&[Feature::Raster]))?;
        match self.amplification {
            Amplification::Vertex => Ok(()),
            Amplification::Geometry => needed_by(&["amplification"], device.require(&[Feature::GeometryShader])),
        }
    }

    /// The same without a device, for plans that nobody runs.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn validate_plan(&self, scene: &Scene, class: DeviceClass) -> Result<()> {
        self.check_picture(scene)?;
        self.check_lens(scene)?;
        self.check_shutter()?;
        self.check_ranges()?;
        self.check_footprint()?;
        self.check_method()?;
        self.check_estimator(self.estimator_on(class))
    }

    fn check_picture(&self, scene: &Scene) -> Result<()> {
        within(&["width"], self.width, &ranges::SIDE)?;
        within(&["height"], self.height, &ranges::SIDE)?;
        let (pixels, most) = (u64::from(self.width) * u64::from(self.height), ranges::MOST_PIXELS);
        if pixels > u64::from(most) {
            return Err(Error::setting(&["width", "height"], format!("{pixels} pixels, at most {most} are possible")));
        }
        let (camera, cameras) = (self.camera, scene.cameras.len());
        if camera < cameras {
            return Ok(());
        }
        let scene = scene.path.display();
        Err(Error::setting(&["camera"], format!("no camera {camera} in {scene}: it has {cameras}, counted from 0")))
    }

    /// A lens needs a perspective camera, and lengths that it can be computed with.
    fn check_lens(&self, scene: &Scene) -> Result<()> {
        let Some(Lens { radius, focus }) = self.lens else { return Ok(()) };
        let camera = &scene.cameras[self.camera];
        if let Projection::Orthographic { .. } = camera.projection {
            let (number, name, scene) = (self.camera, escaped(&camera.name), scene.path.display());
            let cause =
                format!("camera {number} '{name}' of {scene} is orthographic, a lens needs a perspective camera");
            return Err(Error::setting(&["lens", "camera"], cause));
        }
        if is_length(focus) && is_length(radius) {
            return Ok(());
        }
        let cause = format!("a radius of {radius} and a focus at {focus}: both must be finite and positive");
        Err(Error::setting(&["lens"], cause))
    }

    fn check_shutter(&self) -> Result<()> {
        let Some(shutter) = self.shutter.filter(|shutter| !shutter.is_valid()) else { return Ok(()) };
        let cause = format!("from {} s to {} s: both must be finite and in order", shutter.open, shutter.close);
        Err(Error::setting(&["shutter"], cause))
    }

    fn check_ranges(&self) -> Result<()> {
        within(&["photons"], self.photons.unwrap_or_default(), &ranges::PHOTONS)?;
        within(&["knn_photons"], self.knn_photons, &ranges::KNN_PHOTONS)?;
        within(&["leaf_photons"], self.leaf_size(), &ranges::LEAF_PHOTONS)?;
        within(&["bound_vertices"], self.bound_vertices, &ranges::BOUND_VERTICES)?;
        within(&["eye_depth"], self.eye_depth, &ranges::DEPTH)?;
        within(&["photon_bounces"], self.photon_bounces, &ranges::PHOTON_BOUNCES)?;
        within(&["caustic_smoothing"], self.caustic_smoothing, &ranges::SMOOTHING)?;
        within(&["global_smoothing"], self.global_smoothing, &ranges::SMOOTHING)?;
        within(&["largest_footprint"], self.largest_footprint, &ranges::LARGEST_FOOTPRINT)?;
        within(&["alpha"], self.alpha, &ranges::ALPHA)?;
        self.check_maps()?;
        match self.sampling {
            Sampling::Full => Ok(()),
            Sampling::Regular(k) | Sampling::Stochastic { k, .. } => within(&["sampling"], k, &ranges::SAMPLING_K),
        }
    }

    fn check_maps(&self) -> Result<()> {
        let Tracer::Maps(maps) = self.tracer else { return Ok(()) };
        within(&["tracer"], maps.centres, &ranges::MAP_CENTRES)?;
        within(&["tracer"], maps.candidates, &ranges::MAP_CANDIDATES)?;
        within(&["tracer"], maps.resolution, &ranges::MAP_RESOLUTION)?;
        within(&["tracer"], maps.layers, &ranges::MAP_LAYERS)?;
        let texels = u64::from(maps.centres * maps.layers) * u64::from(6 * maps.resolution * maps.resolution);
        if texels <= u64::from(ranges::MOST_MAP_TEXELS) {
            return Ok(());
        }
        let most = ranges::MOST_MAP_TEXELS;
        Err(Error::setting(&["tracer"], format!("{texels} texels in all maps, at most {most} are possible")))
    }

    fn check_footprint(&self) -> Result<()> {
        let (usable, rule) = match self.footprint {
            Footprint::Differential => return Ok(()),
            Footprint::Fixed(radius) => (is_length(radius), format!("a fixed radius of {radius}")),
            Footprint::Density { min, max } => {
                (is_length(min) && is_length(max) && min <= max, format!("radii from {min} to {max}"))
            }
        };
        if usable {
            return Ok(());
        }
        let cause = format!("{rule}: radii must be finite and positive, the least one first");
        Err(Error::setting(&["footprint"], cause))
    }

    /// What the method has no model for.
    fn check_method(&self) -> Result<()> {
        let traits = self.method.traits();
        let refuse = |settings, cause: &str| Err(Error::setting(settings, cause));
        if self.blinn_phong && !traits.takes_blinn_phong {
            return refuse(&["method", "blinn_phong"], "the method scatters by GGX, it has no Blinn-Phong model");
        }
        if self.lens.is_some() && !traits.takes_lens {
            let cause = "the method connects light to a pinhole or a parallel camera, it cannot have a lens";
            return refuse(&["method", "lens"], cause);
        }
        if self.sampling != Sampling::Full && !traits.estimates_density {
            return refuse(&["method", "sampling"], "the method estimates no density, there is nothing to sample");
        }
        if self.tracer != Tracer::Tree && !traits.emits_photons {
            return refuse(&["method", "tracer"], "the method has no photons that maps could be traced for");
        }
        if traits.traces_paths && traits.estimates_density {
            self.check_hybrid()?;
        }
        if traits.traces_paths && !ranges::DEPTH.contains(&self.photon_bounces) {
            let cause = format!("a path meets at most {} surfaces", ranges::DEPTH.end());
            return refuse(&["method", "photon_bounces"], &cause);
        }
        Ok(())
    }

    /// Paths gather anywhere, not only where a pixel sees it.
    fn check_hybrid(&self) -> Result<()> {
        let refuse = |settings, cause: &str| Err(Error::setting(settings, cause));
        if matches!(self.sampling, Sampling::Regular(_)) {
            return refuse(&["method", "sampling"], "paths have no neighbours in the picture to take light from");
        }
        if self.photon_build == PhotonBuild::Vvh {
            return refuse(&["method", "photon_build"], "the host builds no tree between paths");
        }
        if self.estimator.is_some_and(|estimator| estimator == Estimator::Tiled || draws_bounds(estimator)) {
            return refuse(&["method", "estimator"], "it works in the picture, and paths gather anywhere");
        }
        Ok(())
    }

    /// What the estimator cannot do.
    fn check_estimator(&self, estimator: Estimator) -> Result<()> {
        let name = estimator.name();
        if matches!(self.sampling, Sampling::Stochastic { .. }) && !estimator.walks() {
            let cause = format!("'{name}' has no lists of photons to take a part of; regular sampling goes with it");
            return Err(Error::setting(&["sampling", "estimator"], cause));
        }
        if self.lens.is_some() && draws_bounds(estimator) {
            let cause = format!("'{name}' draws what a camera without a lens sees");
            return Err(Error::setting(&["estimator", "lens"], cause));
        }
        let reason = match (estimator, self.record) {
            (_, Record::Full) | (Estimator::Hash | Estimator::Tiled, _) => return Ok(()),
            (Estimator::Bvh, Record::Packed20) => return Ok(()),
            (Estimator::Bvh, Record::Packed12) => "it has no cells that positions could be relative to",
            _ => "it reads photons in full precision only",
        };
        let bytes = self.record.code();
        let cause = format!("packed records of {bytes} bytes do not go with the estimator '{name}': {reason}");
        Err(Error::setting(&["record", "estimator"], cause))
    }
}

/// Whether the estimator draws bounds around photons, by the device's rasteriser.
fn draws_bounds(estimator: Estimator) -> bool {
    matches!(estimator, Estimator::Bounds25d | Estimator::Bounds3d)
}

/// Whether this is a length that can be computed with: its inverse is finite, too.
fn is_length(x: f32) -> bool {
    x.is_finite() && x > 0.0 && x.recip().is_finite()
}

fn within<T: PartialOrd + Display>(
    settings: &'static [&'static str],
    value: T,
    range: &RangeInclusive<T>,
) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(Error::setting(settings, format!("{value} is out of range, expected {}", ranges::words(range))))
}

/// Adds to the report of a missing feature which settings ask for it.
fn needed_by(settings: &'static [&'static str], result: Result<()>) -> Result<()> {
    result.map_err(|error| match error {
        Error::MissingFeature { device, feature, .. } => Error::MissingFeature { device, feature, settings },
        other => other,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Method, PhotonBuild, Scale};
    use crate::scene::Camera;

    fn scene() -> Scene {
        let camera = |projection| Camera { projection, ..Camera::look_at([0.0; 3], [1.0; 3], [0.0, 1.0, 0.0], 0.7) };
        let orthographic = camera(Projection::Orthographic { xmag: 1.0, ymag: 1.0 });
        Scene {
            cameras: vec![camera(Projection::Perspective { yfov: 0.7, aspect: None }), orthographic],
            ..Scene::default()
        }
    }

    /// The settings at fault and the cause; nothing for settings that are fine.
    fn refused(change: impl FnOnce(&mut Settings)) -> Option<(&'static [&'static str], String)> {
        let mut settings = Settings::default();
        change(&mut settings);
        match settings.validate_plan(&scene(), DeviceClass::Cpu) {
            Ok(()) => None,
            Err(Error::Setting { settings, cause }) => Some((settings, cause)),
            Err(other) => panic!("{other}"),
        }
    }

    /// Checks that a field takes both ends of its range and refuses what is beyond, by its name and with its range.
    fn is_checked<T: Copy + Display>(
        name: &str,
        (inside, outside): ([T; 2], &[T]),
        words: &str,
        set: fn(&mut Settings, T),
    ) {
        for value in inside {
            assert_eq!(refused(|s| set(s, value)), None, "{name} {value}");
        }
        for value in outside {
            let (settings, cause) = refused(|s| set(s, *value)).unwrap_or_else(|| panic!("{name} {value} was taken"));
            assert_eq!(settings, [name], "{value}");
            assert!(cause.contains(words), "{name} {value}: {cause}");
        }
    }

    #[test]
    fn the_defaults_are_valid() {
        assert_eq!(refused(|_| ()), None);
        assert_eq!(refused(|s| s.camera = 1), None);
    }

    #[test]
    fn whole_numbers_have_ranges() {
        let sides: &[u32] = &[0, 65_537, u32::MAX];
        is_checked("width", ([1, 65_536], sides), "1 to 65536", |s, x| (s.width, s.height) = (x, 1));
        is_checked("height", ([1, 65_536], sides), "1 to 65536", |s, x| (s.width, s.height) = (1, x));
        let photons = ([0, 1 << 30], &[(1 << 30) + 1, u32::MAX][..]);
        is_checked("photons", photons, "0 to 1073741824", |s, x| s.photons = Some(x));
        is_checked("knn_photons", ([1, 512], &[0, 513, u32::MAX]), "1 to 512", |s, x| s.knn_photons = x);
        is_checked("leaf_photons", ([1, 16], &[0, 17, u32::MAX]), "1 to 16", |s, x| s.leaf_photons = Some(x));
        is_checked("bound_vertices", ([6, 18], &[0, 5, 19, u32::MAX]), "6 to 18", |s, x| s.bound_vertices = x);
        is_checked("eye_depth", ([0, 254], &[255, u32::MAX]), "0 to 254", |s, x| s.eye_depth = x);
        is_checked("photon_bounces", ([0, 16384], &[16385, u32::MAX]), "0 to 16384", |s, x| s.photon_bounces = x);
        let k: ([u32; 2], &[u32]) = ([2, 16], &[0, 1, 17, u32::MAX]);
        is_checked("sampling", k, "2 to 16", |s, x| s.sampling = Sampling::Regular(x));
        is_checked("sampling", k, "2 to 16", |s, k| {
            s.sampling = Sampling::Stochastic { k, scale: Scale::Ratio, filter: true };
        });
        is_checked("camera", ([0, 1], &[2, usize::MAX]), "it has 2", |s, x| s.camera = x);
    }

    #[test]
    fn pictures_have_a_largest_size() {
        assert_eq!(refused(|s| (s.width, s.height) = (1 << 14, 1 << 14)), None);
        let (settings, cause) = refused(|s| (s.width, s.height) = (1 << 16, 1 << 16)).expect("2^32 pixels");
        assert_eq!(settings, ["width", "height"]);
        assert!(cause.contains("4294967296 pixels, at most 268435456"), "{cause}");
        let huge = Settings { width: u32::MAX, height: u32::MAX, ..Settings::default() };
        assert_eq!((huge.pixels(), huge.photon_count()), (u32::MAX, 1 << 19), "asked before the check");
    }

    #[test]
    fn numbers_have_ranges() {
        let smoothing: ([f32; 2], &[f32]) = ([0.1, 100.0], &[0.0, -1.0, 0.099, 100.1, f32::INFINITY, f32::NAN]);
        is_checked("caustic_smoothing", smoothing, "0.1 to 100", |s, x| s.caustic_smoothing = x);
        is_checked("global_smoothing", smoothing, "0.1 to 100", |s, x| s.global_smoothing = x);
        let largest: ([f32; 2], &[f32]) = ([1e-4, 1.0], &[0.0, 0.9e-4, 1.1, -1.0, f32::INFINITY, f32::NAN]);
        is_checked("largest_footprint", largest, "0.0001 to 1", |s, x| s.largest_footprint = x);
        let alpha: ([f64; 2], &[f64]) = ([1e-6, 1.0], &[0.0, -0.5, 1.1, f64::INFINITY, f64::NAN]);
        is_checked("alpha", alpha, "0.000001 to 1", |s, x| s.alpha = x);
    }

    #[test]
    fn lengths_are_finite_and_positive() {
        let lengths: ([f32; 2], &[f32]) = ([1e-6, 1e6], &[0.0, -1.0, 1e-42, f32::INFINITY, f32::NAN]);
        let words = "finite and positive";
        is_checked("footprint", lengths, words, |s, x| s.footprint = Footprint::Fixed(x));
        is_checked("footprint", lengths, words, |s, x| s.footprint = Footprint::Density { min: x, max: x });
        is_checked("footprint", ([0.1, 0.2], &[0.05]), words, |s, max| {
            s.footprint = Footprint::Density { min: 0.1, max };
        });
        is_checked("lens", lengths, words, |s, radius| s.lens = Some(Lens { radius, focus: 1.0 }));
        is_checked("lens", lengths, words, |s, focus| s.lens = Some(Lens { radius: 1.0, focus }));
    }

    #[test]
    fn what_does_not_go_together_is_named() {
        let lens = Some(Lens { radius: 0.1, focus: 3.0 });
        let stochastic = Sampling::Stochastic { k: 2, scale: Scale::Unbiased, filter: false };
        type Change<'a> = &'a dyn Fn(&mut Settings);
        let changes: &[(&[&str], Change<'_>)] = &[
            (&["lens", "camera"], &|s| (s.lens, s.camera) = (lens, 1)),
            (&["method", "lens"], &|s| (s.lens, s.method) = (lens, Method::Light)),
            (&["method", "sampling"], &|s| (s.sampling, s.method) = (Sampling::Regular(2), Method::Light)),
            (&["method", "blinn_phong"], &|s| (s.blinn_phong, s.method) = (true, Method::Path)),
            (&["estimator", "lens"], &|s| (s.lens, s.estimator) = (lens, Some(Estimator::Bounds25d))),
            (&["estimator", "lens"], &|s| (s.lens, s.estimator) = (lens, Some(Estimator::Bounds3d))),
            (&["sampling", "estimator"], &|s| (s.sampling, s.estimator) = (stochastic, Some(Estimator::Knn))),
            (&["record", "estimator"], &|s| s.record = Record::Packed12),
        ];
        for (names, change) in changes {
            assert_eq!(refused(change).expect("refused").0, *names);
        }
        assert_eq!(refused(|s| (s.lens, s.photon_build) = (lens, PhotonBuild::Vvh)), None);
        assert_eq!(refused(|s| (s.lens, s.method) = (lens, Method::Path)), None);
    }

    #[test]
    fn records_go_with_estimators_that_can_read_them() {
        let goes = |estimator, record| refused(|s| (s.estimator, s.record) = (Some(estimator), record)).is_none();
        for estimator in Estimator::ALL {
            let packs = matches!(estimator, Estimator::Hash | Estimator::Tiled);
            assert!(goes(estimator, Record::Full));
            assert_eq!(goes(estimator, Record::Packed20), packs || estimator == Estimator::Bvh, "{estimator:?}");
            assert_eq!(goes(estimator, Record::Packed12), packs, "{estimator:?}");
        }
        let (_, cause) = refused(|s| s.record = Record::Packed12).expect("refused");
        assert!(cause.starts_with("packed records of 12 bytes do not go with the estimator 'bvh'"), "{cause}");
    }

    #[test]
    fn a_missing_feature_names_the_setting_that_asks_for_it() {
        let feature = || "geometry kernels".to_owned();
        let lacking = Err(Error::MissingFeature { device: "d".into(), feature: feature(), settings: &[] });
        let named = needed_by(&["amplification"], lacking);
        assert!(matches!(named, Err(Error::MissingFeature { settings: ["amplification"], .. })));
        assert!(matches!(needed_by(&["amplification"], Err(Error::Interrupted)), Err(Error::Interrupted)));
        assert!(needed_by(&["amplification"], Ok(())).is_ok());
    }
}
