//! What a session tells of itself.

use super::estimator_bytes::{self, EstimatorBytes};
use super::{Session, Statistics};
use crate::error::Result;
use crate::film::accumulate::PassSet;
use crate::graph::Timing;
use crate::kernels::generated::Photon;
use crate::render::pass::budget::PhotonBudget;
use crate::render::pass::plan;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::Estimator;
use crate::scene::Scene;

impl Session {
    /// The scene that is rendered.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene on the device.
    pub fn device_scene(&self) -> &DeviceScene {
        &self.device_scene
    }

    /// Passes in the film.
    pub fn passes(&self) -> &PassSet {
        &self.passes
    }

    /// Counts so far.
    pub fn statistics(&self) -> Result<Statistics> {
        let mut statistics = self.statistics.clone();
        if let Some(other) = &self.other {
            statistics.add(&other.session.statistics);
        }
        Ok(Statistics { rejected: self.rejected()?, ..statistics })
    }

    /// Photons stored in the last pass, in order of emission; none unless
    /// [`Settings::read_photons`](crate::render::Settings::read_photons) and
    /// [`crate::render::Method::Photons`].
    pub fn photons(&self) -> Vec<Photon> {
        self.recording.photons()
    }

    /// Photons in a leaf of the photon map at most, as given or as chosen; `None` where there is no such map.
    pub fn leaf_photons(&self) -> Option<u32> {
        self.settings.leaf_photons
    }

    /// Photons that a point of the scene meets on average, in the first pass; `None` where nobody asked.
    pub fn coverage(&self) -> Option<f64> {
        self.coverage
    }

    /// Photons emitted per pass, caustic ones and others.
    pub fn photons_per_pass(&self) -> (u32, u32) {
        let of = |caustic: bool| self.budget.emissions.iter().filter(|e| e.caustic == caustic).map(|e| e.count).sum();
        (of(true), of(false))
    }

    /// Photons emitted in all passes.
    pub fn photons_emitted(&self) -> u64 {
        self.statistics.photons + self.other.as_ref().map_or(0, |other| other.session.statistics.photons)
    }

    /// Times of the scopes of the last pass.
    pub fn timings(&self) -> Vec<Timing> {
        match &self.other {
            Some(other) if other.was_last => other.session.timings(),
            _ => self.recording.timings(),
        }
    }

    /// The plan of a pass as text.
    pub fn plan_text(&self) -> &str {
        &self.recording.dump
    }

    /// Passes of the plan (dispatches, fills, copies).
    pub fn plan_passes(&self) -> usize {
        self.recording.dispatches
    }

    /// Seconds that planning of a pass took on the host, declaration and recording not included.
    pub fn planning_seconds(&self) -> f64 {
        self.recording.planning_seconds
    }

    /// Bytes of transients on the device.
    pub fn transient_bytes(&self) -> u64 {
        let theirs = self.other.as_ref().map_or(0, |other| other.session.transient_bytes());
        self.recording.device_bytes() + theirs
    }

    /// How the light of the photons is estimated.
    pub fn estimator(&self) -> Estimator {
        self.content().estimator()
    }

    /// Bytes of the estimator; `None` without photons, and for methods that have none.
    pub fn estimator_bytes(&self) -> Option<EstimatorBytes> {
        if !self.settings.method.traits().estimates_density {
            return None;
        }
        let plan = |budget: &PhotonBudget| plan::plan(self.content(), budget, &self.state).plan;
        estimator_bytes::of(plan, &self.budget)
    }
}
