//! A render in progress: passes by global index, the film, and what is known about them.

pub mod error_model;
pub mod estimator_bytes;
pub mod identity;
pub mod outline;
mod pixels;

use std::time::Instant;

use self::estimator_bytes::EstimatorBytes;
use crate::error::{Error, MemoryCause, Result};
use crate::film::accumulate::{Film, LAYER_SUMS, PassSet, SUMS};
use crate::film::error_estimate::{ErrorEstimate, Model, Schedule};
use crate::film::exact::ExactSum;
use crate::film::film_file::Totals;
use crate::graph::{Runtime, Timing};
use crate::kernels::generated::{Pass, Photon};
use crate::kernels::photon::COUNTERS;
use crate::picture::image::Picture;
use crate::render::pass::budget::PhotonBudget;
use crate::render::pass::content::Content;
use crate::render::pass::estimator;
use crate::render::pass::film_state::FilmState;
use crate::render::pass::leaf_size;
use crate::render::pass::plan;
use crate::render::pass::recording::Recording;
use crate::render::scene::memory::Memory;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::{Estimator, Lens, Settings};
use crate::scene::{Projection, Scene};

/// Counts over all passes so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statistics {
    /// Passes in the film.
    pub passes: u64,
    /// Passes repeated because their photons did not fit.
    pub repeated: u64,
    /// Photons emitted.
    pub photons: u64,
    /// Deposits stored in photon maps, or light vertices by [`crate::render::Method::Light`].
    pub deposits: u64,
    /// Guards that fired, by name.
    pub counters: Vec<(&'static str, u64)>,
    /// Photons that were still in flight at the bounce limit.
    pub photons_truncated: u64,
    /// Eye paths that ended at the depth limit.
    pub eye_paths_truncated: u64,
    /// Pixel values that were not finite and counted as black.
    pub rejected: u64,
    /// Photons tested against eye hits, if [`Settings::count_pairs`].
    pub pairs_tested: u64,
    /// Photons whose footprint held the eye hit, if [`Settings::count_pairs`].
    pub pairs_accepted: u64,
    /// What the estimator built, by name: `photons_in_tiles` and `tile_entries` of [`crate::render::Estimator::Tiled`].
    pub structure_counts: Vec<(&'static str, u64)>,
    /// Seconds spent in passes.
    pub seconds: f64,
}

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
        let statistics =
            Statistics { counters: COUNTERS.iter().map(|name| (*name, 0)).collect(), ..Statistics::default() };
        Ok(Self {
            runtime: runtime.clone(),
            scene,
            device_scene,
            settings,
            budget,
            state,
            recording,
            statistics,
            passes: PassSet::default(),
            rejected_before: 0,
        })
    }

    /// Renders the pass with this global index and adds it to the film. Its content depends on nothing but the scene, the
    /// settings and the index.
    ///
    /// # Errors
    /// [`Error::Usage`] if the pass is in the film already, and those of the device.
    pub fn run_pass(&mut self, index: u64) -> Result<()> {
        if self.passes.contains(index) {
            return Err(Error::Usage(format!("pass {index} is in the film already")));
        }
        self.repeat_pass(index)?;
        self.passes.insert(index);
        Ok(())
    }

    /// The work of [`Self::run_pass`], any number of times, for measurements of it: the film is worth nothing afterwards.
    ///
    /// # Errors
    /// Those of the device.
    pub fn repeat_pass(&mut self, index: u64) -> Result<()> {
        let start = Instant::now();
        let pass = Pass {
            index: index as u32,
            seed: self.settings.seed ^ ((index >> 32) as u32).wrapping_mul(0x9e37_79b9),
            radius_scale: self.settings.radius_scale(index),
            reserved: 0,
        };
        loop {
            let overflow = self.recording.run(pass)?;
            if overflow == 0 {
                break;
            }
            self.grow(overflow)?;
        }
        self.count(start);
        Ok(())
    }

    /// Makes room for deposits that did not fit; the pass was not added and is repeated.
    fn grow(&mut self, overflow: u64) -> Result<()> {
        let (needed, most) = (u64::from(self.budget.capacity) + overflow, u64::from(self.device_scene.most_deposits));
        if needed > most {
            return Err(Error::OutOfMemory {
                object: "photon map".into(),
                bytes: needed * size_of::<Photon>() as u64,
                cause: MemoryCause::TooManyPhotons { most },
            });
        }
        self.statistics.repeated += 1;
        self.budget.capacity = (needed * 5 / 4).min(most) as u32;
        let content = Content { scene: &self.scene, device: &self.device_scene, settings: &self.settings };
        self.recording = Recording::new(&self.runtime, content, &self.budget, &self.state)?;
        Ok(())
    }

    fn count(&mut self, start: Instant) {
        let (photons_truncated, eye_truncated) =
            (self.recording.sum(|r| &r.truncated), self.recording.sum(|r| &r.eye_truncated));
        let deposits = self.recording.first(|r| r.deposits.as_ref());
        let (counters, pairs) = (self.recording.counters(), self.recording.pairs());
        let structure = self.recording.structure();
        let s = &mut self.statistics;
        s.pairs_tested += pairs[0];
        s.pairs_accepted += pairs[1];
        s.passes += 1;
        s.photons += self.budget.emissions.iter().map(|e| u64::from(e.count)).sum::<u64>();
        s.deposits += deposits;
        s.photons_truncated += photons_truncated;
        s.eye_paths_truncated += eye_truncated;
        for ((_, total), value) in s.counters.iter_mut().zip(counters) {
            *total += u64::from(value);
        }
        for (name, value) in structure {
            match s.structure_counts.iter_mut().find(|(known, _)| *known == name) {
                Some((_, total)) => *total += value,
                None => s.structure_counts.push((name, value)),
            }
        }
        s.seconds += start.elapsed().as_secs_f64();
    }

    /// Photons stored in the last pass, in order of emission; none unless [`Settings::read_photons`] and [`crate::render::Method::Photons`].
    pub fn photons(&self) -> Vec<Photon> {
        self.recording.photons()
    }

    /// Photons in a leaf of the photon map at most, as given or as chosen; `None` where there is no such map.
    pub fn leaf_photons(&self) -> Option<u32> {
        self.settings.leaf_photons
    }

    /// The scene that is rendered.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene on the device.
    pub fn device_scene(&self) -> &DeviceScene {
        &self.device_scene
    }

    /// Photons emitted per pass, caustic ones and others.
    pub fn photons_per_pass(&self) -> (u32, u32) {
        let of = |caustic: bool| self.budget.emissions.iter().filter(|e| e.caustic == caustic).map(|e| e.count).sum();
        (of(true), of(false))
    }

    /// Times of the scopes of the last pass.
    pub fn timings(&self) -> Vec<Timing> {
        self.recording.timings()
    }

    /// The plan of a pass as text.
    pub fn plan_text(&self) -> &str {
        &self.recording.dump
    }

    /// Passes of the plan (dispatches, fills, copies).
    pub fn plan_passes(&self) -> usize {
        self.recording.dispatches
    }

    /// Bytes of transients on the device.
    pub fn transient_bytes(&self) -> u64 {
        self.recording.device_bytes()
    }

    /// How the light of the photons is estimated.
    pub fn estimator(&self) -> Estimator {
        self.settings.estimator_on(self.device_scene.device_class)
    }

    /// Bytes of the estimator; `None` without photons, and for methods that have none.
    pub fn estimator_bytes(&self) -> Option<EstimatorBytes> {
        if !self.settings.method.traits().estimates_density {
            return None;
        }
        let content = Content { scene: &self.scene, device: &self.device_scene, settings: &self.settings };
        let plan = |budget: &PhotonBudget| plan::plan(content, budget, &self.state).plan;
        estimator_bytes::of(plan, &self.budget)
    }

    /// Counts so far.
    pub fn statistics(&self) -> Result<Statistics> {
        let rejected = self.rejected_before + u64::from(self.runtime.download(&self.state.rejected)?[0]);
        Ok(Statistics { rejected, ..self.statistics.clone() })
    }

    /// The film of all passes so far: with it a render can be shown, resumed and merged.
    pub fn film(&self) -> Result<Film> {
        let Settings { width, height, layers, .. } = self.settings;
        let mut film = Film::new(width, height, self.device_scene.exponents, layers);
        film.passes = self.passes.clone();
        film.rejected = self.rejected_before + u64::from(self.runtime.download(&self.state.rejected)?[0]);
        for band in &self.state.bands {
            let places = (band.first_pixel..band.first_pixel + band.pixels).map(|index| self.place(index));
            let layers = if layers { self.runtime.download(&band.layers)? } else { vec![] };
            let mut layers = layers.chunks_exact(LAYER_SUMS);
            for (place, sums) in places.zip(self.runtime.download(&band.film)?.chunks_exact(SUMS)) {
                film.sums[place] = std::array::from_fn(|k| ExactSum::from_words(sums[k]));
                if let Some(sums) = layers.next() {
                    film.layers[place] = std::array::from_fn(|k| ExactSum::from_words(sums[k]));
                }
            }
        }
        Ok(film)
    }

    /// The error of the film so far: downloads the film.
    ///
    /// # Errors
    /// Those of the device.
    pub fn error_estimate(&self) -> Result<ErrorEstimate> {
        Ok(self.error_of(&self.film()?))
    }

    /// The error of a film of this render or of a part of it.
    pub fn error_of(&self, film: &Film) -> ErrorEstimate {
        let schedule = Schedule::of(&film.passes, |index| self.settings.radius_scale(index));
        ErrorEstimate::of(film, schedule, self.error_model())
    }

    /// What has to be known of this render, besides its film, to estimate its error.
    pub fn error_model(&self) -> Model {
        error_model::of(&self.settings, self.estimator(), &self.device_scene, &self.budget)
    }

    /// Puts a film of the same render in place of this one's: passes that follow are added to it, bit for bit as if the
    /// render had never been stopped.
    ///
    /// # Errors
    /// [`Error::Usage`] if size, layers or units differ.
    pub fn restore(&mut self, film: &Film) -> Result<()> {
        let Settings { width, height, layers, .. } = self.settings;
        Film::new(width, height, self.device_scene.exponents, layers).merge(film)?;
        for band in &self.state.bands {
            let places = (band.first_pixel..band.first_pixel + band.pixels).map(|index| self.place(index));
            let sums: Vec<[u32; 4]> = places.clone().flat_map(|place| film.sums[place].map(ExactSum::words)).collect();
            self.runtime.overwrite(&band.film, &sums)?;
            if layers {
                let sums: Vec<[u32; 4]> = places.flat_map(|place| film.layers[place].map(ExactSum::words)).collect();
                self.runtime.overwrite(&band.layers, &sums)?;
            }
        }
        self.runtime.overwrite(&self.state.rejected, &[0])?;
        self.rejected_before = film.rejected;
        self.passes = film.passes.clone();
        Ok(())
    }

    /// [`Self::restore`] with the counts of the film's passes, so that [`Self::statistics`] are those of all passes, too.
    ///
    /// # Errors
    /// Those of [`Self::restore`].
    pub fn resume(&mut self, film: &Film, totals: &Totals) -> Result<()> {
        self.restore(film)?;
        self.statistics = Statistics::restored(totals, film.passes.count());
        Ok(())
    }

    /// Passes in the film.
    pub fn passes(&self) -> &PassSet {
        &self.passes
    }

    /// The mean of all passes: beauty, and the layers if the settings ask for them. Black before the first pass.
    pub fn picture(&self) -> Result<Picture> {
        Ok(self.film()?.picture())
    }

    /// Row-major index of the pixel with this index on the device.
    fn place(&self, index: u32) -> usize {
        let (x, y) = pixels::position(index, self.settings.width, self.settings.height);
        (y * self.settings.width + x) as usize
    }

    /// Per pixel (row by row) and channel: sum, sum of squares, and sum of values times squared footprint scale, in double
    /// precision.
    pub fn moments(&self) -> Result<Vec<[f64; SUMS]>> {
        Ok(self.film()?.moments())
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
