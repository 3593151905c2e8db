//! Path tracing ([`Method::Path`](crate::render::Method::Path)): paths from the eye find all light by themselves.

use super::transport::{BandLight, BandView, Transport};
use crate::graph::Graph;
use crate::kernels::eye::LightChoice;
use crate::kernels::path::{self, PathLight, PathSettings};

/// Paths from the eye: nothing has to be prepared for them.
pub struct EyePaths;

impl Transport for EyePaths {
    /// Paths may meet as many surfaces as photons may or eye paths may, whichever is more: mirrors and glass count like
    /// the others. One light sample is taken at each surface; the sample of the lobes is the other strategy.
    fn band(&mut self, g: &mut Graph, at: BandView<'_>) -> BandLight {
        let (device, settings) = (at.content.device, at.content.settings);
        let path_settings = PathSettings {
            pixels: at.pixels,
            max_depth: settings.photon_bounces.max(settings.eye_depth),
            lights: LightChoice::new(device.light_count, 1),
            aov: settings.layers,
        };
        let paths = g.scope("paths", |g| path::trace(g, at.view(), device.variant, path_settings));
        let PathLight { radiance, gathered, aov_first, truncated } = paths;
        BandLight { radiance, gathered, aov_first, truncated }
    }
}
