//! A render in progress: passes by global index, the film, and what is known about them.

pub mod error_model;
pub mod estimator_bytes;
mod film;
pub mod identity;
pub mod outline;
mod passes;
mod pixels;
mod report;
mod statistics;

use crate::error::{Error, Result};
use crate::film::accumulate::PassSet;
use crate::graph::Runtime;
use crate::render::pass::budget::PhotonBudget;
use crate::render::pass::content::Content;
use crate::render::pass::estimator;
use crate::render::pass::film_state::FilmState;
use crate::render::pass::leaf_size;
use crate::render::pass::recording::Recording;
use crate::render::scene::memory::Memory;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::{Lens, Settings};
use crate::scene::{Projection, Scene};

pub use statistics::Statistics;

/// A render in progress.
pub struct Session {
    runtime: Runtime,
    scene: Scene,
    device_scene: DeviceScene,
    settings: Settings,
    budget: PhotonBudget,
    state: FilmState,
    recording: Recording,
    statistics: Statistics,
    passes: PassSet,
    /// Values rejected in passes of a film that was restored.
    rejected_before: u64,
}

impl Session {
    /// Uploads the scene and records the pass.
    ///
    /// # Errors
    /// [`Error::Usage`] for a camera that does not exist or cannot have the lens, or settings that are out of range or do
    /// not go together; [`Error::MissingFeature`] if the device cannot run the estimator; [`Error::OutOfMemory`] for what
    /// does not fit the device.
    pub fn new(runtime: &Runtime, scene: Scene, mut settings: Settings) -> Result<Self> {
        if settings.camera >= scene.cameras.len() {
            return Err(Error::Usage(format!(
                "camera {} of {}: there are {}",
                settings.camera,
                scene.path.display(),
                scene.cameras.len()
            )));
        }
        settings.check_method()?;
        check_lens(&scene, &settings)?;
        estimator::check(runtime.device(), &settings)?;
        let mut device_scene = DeviceScene::new(runtime, &scene, settings.full_program)?;
        let estimator = settings.estimator_on(device_scene.device_class);
        settings.sampling.check(estimator)?;
        estimator.check_record(settings.record)?;
        device_scene.variant.blinn_phong = settings.blinn_phong;
        device_scene.variant.lens |= settings.lens.is_some();
        if settings.lambert_estimate {
            (device_scene.variant.gathers_glossy, device_scene.variant.gathers_smooth) = (false, false);
        }
        let budget = PhotonBudget::of(&device_scene, &settings);
        let content = Content { scene: &scene, device: &device_scene, settings: &settings };
        let state = FilmState::new(Memory::Device(runtime), content)?;
        if settings.leaf_photons.is_none() && content.has_photon_tree(&budget) {
            let coverage = leaf_size::survey(runtime, content, &budget)?;
            settings.leaf_photons = Some(leaf_size::automatic(coverage, settings.photon_build));
        }
        let content = Content { scene: &scene, device: &device_scene, settings: &settings };
        let recording = Recording::new(runtime, content, &budget, &state)?;
        Ok(Self {
            runtime: runtime.clone(),
            scene,
            device_scene,
            settings,
            budget,
            state,
            recording,
            statistics: Statistics::none(),
            passes: PassSet::default(),
            rejected_before: 0,
        })
    }

    /// What its passes are made from.
    fn content(&self) -> Content<'_> {
        Content { scene: &self.scene, device: &self.device_scene, settings: &self.settings }
    }
}

/// A lens needs a perspective camera, and lengths that it can be computed with.
fn check_lens(scene: &Scene, settings: &Settings) -> Result<()> {
    let Some(Lens { radius, focus }) = settings.lens else { return Ok(()) };
    let camera = &scene.cameras[settings.camera];
    if let Projection::Orthographic { .. } = camera.projection {
        return Err(Error::Usage(format!(
            "camera {} '{}' of {} is orthographic: a lens (depth of field) needs a perspective camera",
            settings.camera,
            camera.name,
            scene.path.display()
        )));
    }
    let usable = |x: f32| x.is_finite() && x > 0.0 && x.recip().is_finite();
    if usable(focus) && usable(radius) {
        return Ok(());
    }
    Err(Error::Usage(format!("a lens of radius {radius} focused at {focus}: both must be finite and positive")))
}
