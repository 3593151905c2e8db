//! A render in progress: passes by global index, the film, and what is known about them.

pub mod changes;
pub mod error_model;
pub mod estimator_bytes;
mod film;
pub mod identity;
mod moving;
pub mod outline;
mod passes;
mod pixels;
mod report;
mod statistics;
mod trial;
mod turns;
mod update;

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
use crate::render::settings::{Method, Settings};
use crate::scene::Scene;
use crate::vk::Device;

use turns::Other;

pub use statistics::{CLASSES, Statistics};
pub use turns::Choice;
pub use update::Updated;

/// A render in progress.
pub struct Session {
    runtime: Runtime,
    scene: Arc<Scene>,
    device_scene: DeviceScene,
    settings: Settings,
    budget: PhotonBudget,
    state: FilmState,
    recording: Recording,
    statistics: Statistics,
    /// Seconds that the last pass of this session took, without those of [`Other`].
    last_seconds: Option<f64>,
    passes: PassSet,
    /// Values rejected in passes of a film that was restored.
    rejected_before: u64,
    /// The film on the device is to be emptied before the next pass.
    stale_film: bool,
    /// Nobody said how many photons a leaf of their tree holds.
    automatic_leaf: bool,
    /// It is to be found out again before the next pass.
    stale_leaf: bool,
    /// Photons that a point of the scene meets on average, in the first pass; `None` where nobody asked.
    coverage: Option<f64>,
    /// Passes of another method, where methods take turns.
    other: Option<Box<Other>>,
}

impl Session {
    /// Uploads the scene and records the pass.
    ///
    /// # Errors
    /// Those of [`Scene::validate_references`] and [`Settings::validate`];
    /// [`Error::OutOfMemory`](crate::error::Error::OutOfMemory) for what does not fit the device.
    pub fn new(device: &Arc<Device>, mut scene: Scene, settings: Settings) -> Result<Self> {
        scene.validate_references()?;
        settings.validate(&scene, device)?;
        moving::open(&mut scene, &settings);
        let runtime = &Runtime::new(device.clone());
        let device_scene = DeviceScene::new(runtime, &scene, &settings)?;
        let scene = Arc::new(scene);
        let settings = settings.resolved();
        if settings.method != Method::Auto {
            return Self::over(runtime, (scene, device_scene), settings);
        }
        let settings = Settings { count_work: true, ..settings };
        let mut paths = turns::settings_of_paths(&settings);
        paths.method = trial::method_of_paths(runtime, (&scene, &device_scene), &paths)?;
        let paths = Self::over(runtime, (scene.clone(), device_scene.clone()), paths)?;
        Ok(Self { other: Some(Box::new(Other::new(paths))), ..Self::over(runtime, (scene, device_scene), settings)? })
    }

    /// A session of one method over a scene that is on the device.
    fn over(
        runtime: &Runtime,
        (scene, mut device_scene): (Arc<Scene>, DeviceScene),
        mut settings: Settings,
    ) -> Result<Self> {
        device_scene.specialise(&settings);
        device_scene.take_maps(Memory::Device(runtime), &settings, false)?;
        let budget = PhotonBudget::of(&device_scene, &settings);
        let automatic_leaf = settings.leaf_photons.is_none();
        let mut coverage = None;
        let content = Content { scene: &scene, device: &device_scene, settings: &settings };
        let state = FilmState::new(Memory::Device(runtime), content)?;
        if automatic_leaf {
            let survey = leaf_size::chosen(runtime, content)?;
            settings.leaf_photons = survey.map(|survey| survey.leaf);
            coverage = survey.map(|survey| survey.coverage);
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
            last_seconds: None,
            passes: PassSet::default(),
            rejected_before: 0,
            stale_film: false,
            automatic_leaf,
            stale_leaf: false,
            coverage,
            other: None,
        })
    }

    /// What its passes are made from.
    fn content(&self) -> Content<'_> {
        Content { scene: &self.scene, device: &self.device_scene, settings: &self.settings }
    }
}
