//! Changes of a scene that is being rendered: what follows from them is redone, and nothing else.

use std::sync::Arc;

use super::changes::{Change, Changes, Effect, Step, Steps};
use super::moving::is_blurred;
use super::{Session, Statistics, trial, turns};
use crate::error::{Error, Result};
use crate::film::accumulate::PassSet;
use crate::kernels::photon::Emission;
use crate::kernels::scene_data::Variant;
use crate::render::pass::budget::PhotonBudget;
use crate::render::pass::content::Content;
use crate::render::pass::film_state::FilmState;
use crate::render::pass::leaf_size;
use crate::render::pass::recording::Recording;
use crate::render::scene::memory::Memory;
use crate::render::scene::upload::Stale;
use crate::render::settings::{PhotonBuild, Settings};
use crate::scene::Scene;

/// What an update did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Updated {
    /// The steps that were taken; none where nothing differs from before.
    pub steps: Steps,
}

/// All that a recorded pass depends on, but for the contents of buffers.
#[derive(Debug, PartialEq)]
struct PlanKey {
    variant: Variant,
    generation: u64,
    emissions: Vec<Emission>,
    exponents: [i32; 2],
    /// Without lights there is no direct light, and a single one without extent takes one ray.
    lights: (bool, bool),
}

impl PlanKey {
    fn of(content: Content<'_>, budget: &PhotonBudget) -> Self {
        let device = content.device;
        Self {
            variant: device.variant,
            generation: device.generation,
            emissions: budget.emissions.clone(),
            exponents: device.exponents,
            lights: (device.light_count > 0, device.light_count == 1 && !device.has_wide_lights),
        }
    }
}

impl Session {
    /// Changes the scene or its view. Passes that follow are, to the bit, those of a new session of the changed scene;
    /// the film starts again, unless nothing that is seen has changed. The film on the device is emptied with the next
    /// pass, and the size of leaves that the host builds ([`PhotonBuild::Vvh`]) is chosen with it, see
    /// [`Session::prepare`].
    ///
    /// # Errors
    /// [`Error::Usage`] for a change that names what the scene does not have or whose numbers are out of range, and
    /// those of [`crate::render::Settings::validate`]: nothing has changed then. After an error of the device the
    /// session is of no more use.
    pub fn update(&mut self, changes: Changes) -> Result<Updated> {
        if let Some((index, fault)) = faults(&changes.0, &self.scene).next() {
            return Err(Error::Usage(format!("change {index}: {fault}")));
        }
        let theirs = self.other.as_ref().map(|other| other.session.since_opening(turns::changes_of_paths(&changes)));
        self.update_each(self.since_opening(changes), theirs)
    }

    /// Changes this session, and with `theirs` that of the other method.
    pub(super) fn update_each(&mut self, ours: Changes, theirs: Option<Changes>) -> Result<Updated> {
        let steps = self.update_own(ours)?;
        if let Some(changes) = theirs {
            self.update_other(changes, &steps)?;
        }
        Ok(Updated { steps })
    }

    fn update_own(&mut self, mut changes: Changes) -> Result<Steps> {
        let was_blurred = is_blurred(&self.scene, &self.settings);
        let mut effect = Effect::default();
        for change in &mut changes.0 {
            change.exchange(Arc::make_mut(&mut self.scene), &mut self.settings);
            effect = effect.and(change.stale(&self.scene, &self.settings));
        }
        if let Err(error) = self.settings.validate(&self.scene, self.runtime.device()) {
            let scene = Arc::make_mut(&mut self.scene);
            changes.0.iter_mut().rev().for_each(|change| change.exchange(scene, &mut self.settings));
            return Err(error);
        }
        if was_blurred && effect.film {
            // The film had the units of its first moment.
            effect = effect.and(Effect::of(Stale::default()));
        }
        self.redo(effect, None)
    }

    /// Changes the scene of the passes of paths, which may need photons now, or need them no more.
    fn update_other(&mut self, changes: Changes, steps: &Steps) -> Result<()> {
        let Some(other) = &mut self.other else { return Ok(()) };
        other.session.update_own(changes)?;
        if steps.has(Step::Film) {
            // As in a new session: nobody said the size of leaves.
            let leaf_photons = self.settings.leaf_photons.filter(|_| !self.automatic_leaf);
            let settings = turns::settings_of_paths(&Settings { leaf_photons, ..self.settings.clone() });
            let method = trial::method_of_paths(&self.runtime, (&self.scene, &self.device_scene), &settings)?;
            if method != other.session.settings.method {
                let on_device = (self.scene.clone(), self.device_scene.clone());
                other.session = Self::over(&self.runtime, on_device, Settings { method, ..settings })?;
            }
            other.reset();
        }
        Ok(())
    }

    /// Empties the film and the statistics, so that the passes that follow are the first.
    pub fn reset(&mut self) {
        self.statistics = Statistics::none();
        self.passes = PassSet::default();
        self.rejected_before = 0;
        self.stale_film = true;
        if let Some(other) = &mut self.other {
            other.reset();
        }
    }

    /// Redoes what is stale. With `exponents` the film keeps its units and its sums, and choices stay what they are.
    pub(super) fn redo(&mut self, effect: Effect, exponents: Option<[i32; 2]>) -> Result<Steps> {
        let mut steps = Vec::new();
        let (former, slots) = (PlanKey::of(self.content(), &self.budget), self.content().slots());
        let (memory, camera) = (Memory::Device(&self.runtime), self.settings.camera);
        if let Some(stale) = &effect.scene {
            let redone = self.device_scene.update(memory, &self.scene, camera, stale)?;
            steps.push(Step::Lights);
            let taken = [
                (redone.casters, Step::Casters),
                (redone.materials, Step::Materials),
                (redone.vertices, Step::Vertices),
                (redone.tree, Step::Tree),
            ];
            steps.extend(taken.into_iter().filter(|(taken, _)| *taken).map(|(_, step)| step));
        } else if effect.camera {
            self.device_scene.look(memory, &self.scene, camera)?;
        }
        self.device_scene.specialise(&self.settings);
        let moved = steps.contains(&Step::Tree);
        self.device_scene.take_maps(memory, &self.settings, moved)?;
        self.device_scene.exponents = exponents.unwrap_or(self.device_scene.exponents);
        let budget = PhotonBudget::of(&self.device_scene, &self.settings);
        if budget.emissions != self.budget.emissions {
            self.budget = budget;
        }
        // Leaves that the host builds count for the order of sums; those of the device only for speed, and these may
        // stay.
        self.stale_leaf |= effect.leaf && self.settings.photon_build == PhotonBuild::Vvh;
        // The overlap of footprints, which is found out with it, counts for the turns of methods.
        self.stale_leaf |= effect.film && self.settings.count_work;
        if effect.film {
            steps.push(Step::Film);
            self.reset();
        }
        if effect.camera {
            steps.push(Step::Camera);
        }
        if PlanKey::of(self.content(), &self.budget) != former {
            steps.push(Step::Plan);
            self.plan_anew(slots, exponents.is_some())?;
        } else if effect.camera {
            let content = Content { scene: &self.scene, device: &self.device_scene, settings: &self.settings };
            self.recording.set_camera(content);
        }
        Ok(Steps::of(steps))
    }

    /// Plans and records; the film has other bands where paths had another number of slots. `goes_on`: its sums stay.
    fn plan_anew(&mut self, former_slots: u32, goes_on: bool) -> Result<()> {
        if self.content().slots() != former_slots {
            let kept = if goes_on { Some((self.own_film()?, self.own_rejected()?)) } else { None };
            self.state = FilmState::new(Memory::Device(&self.runtime), self.content())?;
            if let Some((film, rejected)) = kept {
                self.restore_own(&film)?;
                self.rejected_before = rejected;
            }
        }
        if !goes_on {
            self.stale_leaf = true;
            self.choose_leaf()?;
        }
        self.recording = Recording::new(&self.runtime, self.content(), &self.budget, &self.state)?;
        Ok(())
    }

    /// Chooses how many photons a leaf of their tree holds, if it is stale and nobody said it; true if it is another.
    fn choose_leaf(&mut self) -> Result<bool> {
        if !self.stale_leaf || !self.automatic_leaf {
            self.stale_leaf = false;
            return Ok(false);
        }
        let former = self.settings.leaf_photons;
        let survey = leaf_size::chosen(&self.runtime, self.content())?;
        self.settings.leaf_photons = survey.map(|survey| survey.leaf);
        self.coverage = survey.map(|survey| survey.coverage);
        self.stale_leaf = false;
        Ok(former != self.settings.leaf_photons)
    }

    /// Does now what updates leave to the next pass: empties the film on the device, and chooses the size of leaves
    /// that the host builds.
    ///
    /// # Errors
    /// Those of the device; the next call tries again.
    pub fn prepare(&mut self) -> Result<()> {
        if self.stale_film {
            for band in &self.state.bands {
                self.runtime.clear(&band.film)?;
                if self.settings.layers {
                    self.runtime.clear(&band.layers)?;
                }
            }
            self.runtime.clear(&self.state.rejected)?;
            self.stale_film = false;
        }
        let former = self.settings.leaf_photons;
        if self.choose_leaf()? {
            let recording = Recording::new(&self.runtime, self.content(), &self.budget, &self.state);
            self.recording = recording.inspect_err(|_| {
                (self.settings.leaf_photons, self.stale_leaf) = (former, true);
            })?;
        }
        Ok(())
    }
}

/// Changes that cannot be made, with their places and why.
fn faults<'a>(changes: &'a [Change], scene: &'a Scene) -> impl Iterator<Item = (usize, String)> + 'a {
    changes.iter().enumerate().filter_map(|(index, change)| Some((index, change.fault(scene)?)))
}
