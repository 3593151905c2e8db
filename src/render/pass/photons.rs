//! Photon mapping ([`Method::Photons`](crate::render::Method::Photons)): photons are stored where they meet surfaces,
//! and the eye hits gather them by a density estimate.

use super::budget::PhotonBudget;
use super::content::Content;
use super::estimator::{self, Structure};
use super::transport::{BandLight, BandView, Transport};
use super::{emission, eye};
use crate::graph::{Buf, Graph};
use crate::kernels::deposits::Deposits;
use crate::kernels::eye::{EyeHits, boundaries};
use crate::kernels::gather::{Band, Points, Program};
use crate::kernels::photon::{PhotonMap, Reach};
use crate::kernels::scene_data::SceneBuffers;
use crate::render::settings::Settings;

/// The photons of a pass and what the estimator built from them; `None` without photons.
pub struct Photons(Option<Stored>);

/// Deposits, and what the estimator built from them.
pub struct Stored {
    pub deposits: Deposits,
    pub structure: Structure,
}

impl Photons {
    /// Traces the photons of a pass and builds what the estimator gathers from.
    pub fn prepare(g: &mut Graph, content: Content<'_>, buffers: &SceneBuffers, budget: &PhotonBudget) -> Self {
        Self(Stored::trace(g, content, buffers, budget))
    }

    /// Photons that were traced before, with the map that the host built of them.
    pub fn mapped((deposits, map): (Deposits, PhotonMap)) -> Self {
        Self(Some(Stored { deposits, structure: Structure::Bvh(map) }))
    }
}

impl Transport for Photons {
    fn band(&mut self, g: &mut Graph, at: BandView<'_>) -> BandLight {
        let (mut hits, mut gathered) = eye::look(g, at);
        if let Some(stored) = &mut self.0 {
            if let Some(reach) = fold_reach(at.content) {
                let EyeHits { hits, list, count, args, .. } = &mut hits;
                g.scope("boundaries", |g| boundaries(g, at.buffers, reach, (list, count, args), hits));
            }
            gathered = g.scope("gather", |g| stored.gather(g, at, &hits, gathered));
        }
        BandLight::of(hits, gathered)
    }

    fn deposits(&self) -> Option<&Deposits> {
        self.0.as_ref().map(|stored| &stored.deposits)
    }

    fn counts(&self, g: &mut Graph) -> Vec<(&'static str, Buf<u32>)> {
        self.0.as_ref().map_or(vec![], |stored| estimator::counts(g, &stored.structure))
    }
}

impl Stored {
    /// Traces the photons of a pass and builds what the estimator gathers from; `None` without photons.
    pub fn trace(g: &mut Graph, content: Content<'_>, buffers: &SceneBuffers, budget: &PhotonBudget) -> Option<Self> {
        let mut deposits = emission::photons(g, content, buffers, budget)?;
        let structure = g.scope("photon map", |g| estimator::build(g, content, &mut deposits));
        Some(Self { deposits, structure })
    }

    /// Writes the light at some of a band's hits.
    pub fn estimate(&mut self, g: &mut Graph, at: BandView<'_>, points: Points<'_>, target: &mut Buf<[f32; 4]>) {
        let Content { device, settings, .. } = at.content;
        let program = Program {
            count_pairs: settings.count_pairs,
            loop_limit: device.loop_limit,
            walk: settings.sampling.walk(),
            ..Program::of(device.variant, settings.weight)
        };
        estimator::gather(g, program, (&mut self.structure, &self.deposits), (points, band_of(at)), target);
    }

    /// Adds the light at the eye hits of a band to `gathered`, or to as many of them as the settings sample.
    fn gather(&mut self, g: &mut Graph, at: BandView<'_>, hits: &EyeHits, gathered: Buf<[f32; 4]>) -> Buf<[f32; 4]> {
        let points = (Points::new(hits, at.buffers), band_of(at));
        let sampling = at.content.settings.sampling;
        sampling.apply(g, points, gathered, |g, some, target| self.estimate(g, at, some, target))
    }
}

/// How far footprints reach that are folded at boundaries; `None` if the settings want none of this.
pub fn fold_reach(content: Content<'_>) -> Option<Reach> {
    let Settings { fold, footprint, largest_footprint, .. } = *content.settings;
    fold.then(|| footprint.reach(largest_footprint))
}

fn band_of(at: BandView<'_>) -> Band<'_> {
    let settings = at.content.settings;
    let size = [settings.width, settings.height];
    Band { camera: at.camera, size, first_pixel: at.first_pixel, pixels: at.pixels }
}
