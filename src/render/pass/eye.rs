//! Eye paths to the surfaces that gather light, with the light that reaches these surfaces directly.

use super::transport::{BandLight, BandView};
use crate::graph::{Buf, Graph};
use crate::kernels::eye::{self, EyeHits, EyeSettings, LightChoice};
use crate::render::scene::upload::DeviceScene;

/// Shadow rays per eye hit and pass, where there is more than one direction to choose.
const SHADOW_RAYS: u32 = 4;

/// Shadow rays of an eye hit: a single light without extent has nothing to choose; otherwise a few cost little of a
/// pass.
pub fn light_samples(device: &DeviceScene) -> u32 {
    if device.light_count == 1 && !device.has_wide_lights { 1 } else { SHADOW_RAYS }
}

/// What eye paths see in a band: their hits, and room for the light that is gathered there, still dark.
pub fn look(g: &mut Graph, at: BandView<'_>) -> (EyeHits, Buf<[f32; 4]>) {
    let (device, settings) = (at.content.device, at.content.settings);
    let slots = at.content.slots();
    let eye_settings =
        EyeSettings { pixels: at.pixels, slots, max_depth: settings.eye_depth, aov: settings.layers, path: None };
    let mut hits = g.scope("eye paths", |g| eye::trace(g, at.view(), device.variant, eye_settings));
    if device.light_count > 0 {
        let choice = LightChoice::new(device.light_count, light_samples(device));
        g.scope("direct light", |g| eye::direct(g, at.view(), device.variant, choice, &mut hits));
    }
    let mut gathered = g.buffer("gathered", 2 * at.pixels * slots);
    g.fill(&mut gathered, 0);
    (hits, gathered)
}

impl BandLight {
    /// The light at eye hits.
    pub fn of(hits: EyeHits, gathered: Buf<[f32; 4]>) -> Self {
        let EyeHits { radiance, aov_first, truncated, .. } = hits;
        Self { radiance, gathered, aov_first, truncated }
    }
}
