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

use std::sync::Arc;

use crate::error::Result;
use crate::film::accumulate::PassSet;
use crate::graph::Runtime;
use crate::render::pass::budget::PhotonBudget;
use crate::render::pass::content::Content;
use crate::render::pass::film_state::FilmState;
use crate::render::pass::leaf_size;
use crate::render::pass::recording::Recording;
use crate::render::scene::memory::Memory;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::Settings;
use crate::scene::Scene;
use crate::vk::Device;

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
    /// Those of [`Settings::validate`]; [`Error::OutOfMemory`](crate::error::Error::OutOfMemory) for what does not fit
    /// the device.
    pub fn new(device: &Arc<Device>, scene: Scene, mut settings: Settings) -> Result<Self> {
        settings.validate(&scene, device)?;
        let runtime = &Runtime::new(device.clone());
        let mut device_scene = DeviceScene::new(runtime, &scene, settings.full_program)?;
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
