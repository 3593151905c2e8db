//! What a pass is made from.

use super::budget::PhotonBudget;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::{Estimator, Settings};
use crate::scene::Scene;

/// A scene, on the host and on the device, and how it is rendered.
#[derive(Clone, Copy)]
pub struct Content<'a> {
    pub scene: &'a Scene,
    pub device: &'a DeviceScene,
    pub settings: &'a Settings,
}

impl Content<'_> {
    /// Path slots per pixel: splitting needs them only where paths can go on after their first surface.
    pub fn slots(&self) -> u32 {
        if self.device.variant.glossy && self.settings.method.traits().splits_eye_paths { 4 } else { 1 }
    }

    /// How the light of the photons is estimated.
    pub fn estimator(&self) -> Estimator {
        self.settings.estimator_on(self.device.device_class)
    }

    /// Whether a pass builds a tree over photons.
    pub fn has_photon_tree(&self, budget: &PhotonBudget) -> bool {
        let gathers = self.settings.method.traits().estimates_density && !budget.emissions.is_empty();
        gathers && self.estimator() == Estimator::Bvh
    }

    /// Whether the host wants the photons of a pass.
    pub fn reads_photons(&self) -> bool {
        self.settings.read_photons && self.settings.method.traits().estimates_density
    }
}
