//! Path tracing ([`Method::Path`](crate::render::Method::Path)): paths from the eye find all light by themselves. With
//! photons ([`Method::Hybrid`](crate::render::Method::Hybrid)) they are told of caustics wherever they come.

use super::budget::PhotonBudget;
use super::content::Content;
use super::estimator;
use super::photons::{self, Stored};
use super::transport::{BandLight, BandView, Transport};
use crate::graph::{Buf, Graph};
use crate::kernels::deposits::Deposits;
use crate::kernels::eye::LightChoice;
use crate::kernels::gather::Points;
use crate::kernels::path::{self, PathLight, PathSettings};
use crate::kernels::scene_data::SceneBuffers;

/// Paths from the eye, and the caustic photons that they gather.
pub struct EyePaths(Option<Stored>);

impl EyePaths {
    /// Without photons: nothing has to be prepared.
    pub fn alone() -> Self {
        Self(None)
    }

    /// With the photons of the budget, which are caustic ones; without any, the same as [`Self::alone`].
    pub fn with_caustics(g: &mut Graph, content: Content<'_>, buffers: &SceneBuffers, budget: &PhotonBudget) -> Self {
        Self(Stored::trace(g, content, buffers, budget))
    }
}

impl Transport for EyePaths {
    /// Paths may meet as many surfaces as photons may or eye paths may, whichever is more: mirrors and glass count like
    /// the others. One light sample is taken at each surface; the sample of the lobes is the other strategy.
    fn band(&mut self, g: &mut Graph, at: BandView<'_>) -> BandLight {
        let Content { device, settings, .. } = at.content;
        let path_settings = PathSettings {
            pixels: at.pixels,
            max_depth: settings.photon_bounces.max(settings.eye_depth),
            lights: LightChoice::new(device.light_count, 1),
            aov: settings.layers,
        };
        let mut gather = self.0.as_mut().map(|stored| {
            move |g: &mut Graph, points: Points<'_>, target: &mut Buf<[f32; 4]>| stored.estimate(g, at, points, target)
        });
        let reach = photons::fold_reach(at.content);
        let caustics = gather.as_mut().map(|gather| path::Caustics { gather, reach });
        let paths = g.scope("paths", |g| path::trace(g, at.view(), device.variant, path_settings, caustics));
        let PathLight { radiance, gathered, aov_first, truncated } = paths;
        BandLight { radiance, gathered, aov_first, truncated }
    }

    fn deposits(&self) -> Option<&Deposits> {
        self.0.as_ref().map(|stored| &stored.deposits)
    }

    fn counts(&self, g: &mut Graph) -> Vec<(&'static str, Buf<u32>)> {
        self.0.as_ref().map_or(vec![], |stored| estimator::counts(g, &stored.structure))
    }
}
