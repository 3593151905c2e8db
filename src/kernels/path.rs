//! Path tracing from the eye with next-event estimation and multiple importance sampling: a reference for the photons.
//!
//! Each step is one of the eye paths' (the same kernels), light samples at the surfaces that gather (the same kernel),
//! and one more that goes on there by a gathered lobe. Emitters that gathered lobes hit and those that light samples
//! hit share the light by the balance heuristic (Veach 1997, section 9.2.2). A path that was followed through mirrors
//! and glass counts what it hits in full: light samples see no way there.
//!
//! With a gather of caustic photons, light that reaches a gathering surface by way of mirrors and glass alone is what
//! the photons bring, at every such surface of a path; what paths find of it by themselves is left out. The first such
//! surface of a path sees it in the layer of caustics, others in that of other light.

use super::Items;
use super::eye::{
    self, Children, EyeHits, EyeSettings, EyeState, EyeTrace, LightChoice, LightSamples, LitHits, PathKind, Paths,
    SlotList, View,
};
use super::gather::Points;
use super::generated::{
    PathGather, PathGatherBindings, PathHits, PathHitsBindings, PathLayers, PathLayersBindings, PathLayersParams,
    PathScatter, PathScatterBindings,
};
use super::photon::Reach;
use super::scene_data::Variant;
use crate::constants::PATH_DEPTH_MASK;
use crate::graph::{Buf, Graph, Grid};

/// Most surfaces after the first that the state of a path has bits for.
pub const MOST_DEPTH: u32 = PATH_DEPTH_MASK - 1;

/// Extent of the paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathSettings {
    /// Pixels of the image; each has one path.
    pub pixels: u32,
    /// Most surfaces that a path meets after the first, at most [`MOST_DEPTH`].
    pub max_depth: u32,
    /// Light samples at each surface that gathers.
    pub lights: LightChoice,
    /// Whether layers are written.
    pub aov: bool,
}

/// What the paths leave.
#[derive(Debug)]
pub struct PathLight {
    /// Emission and direct light, first of all per pixel.
    pub radiance: Buf<[f32; 4]>,
    /// Caustic (seen at one surface that gathers, by way of mirrors and glass) and other light per pixel.
    pub gathered: Buf<[f32; 4]>,
    /// [`eye::AOV_FLOATS`] per pixel.
    pub aov_first: Buf<f32>,
    /// Paths that were still alive at the depth limit.
    pub truncated: Buf<u32>,
}

/// Writes the light of caustic photons at the listed hits: two vectors for a slot, of which the first counts.
pub type Gather<'a> = dyn FnMut(&mut Graph, Points<'_>, &mut Buf<[f32; 4]>) + 'a;

/// Caustic photons that the paths gather.
pub struct Caustics<'a, 'b> {
    /// Writes their light.
    pub gather: &'a mut Gather<'b>,
    /// How far their footprints reach, if these are folded at boundaries.
    pub reach: Option<Reach>,
}

/// Adds the passes of path tracing; with `caustics` for what photons bring.
pub fn trace(
    g: &mut Graph,
    view: View<'_>,
    variant: Variant,
    settings: PathSettings,
    mut caustics: Option<Caustics<'_, '_>>,
) -> PathLight {
    let pixels = settings.pixels;
    let max_depth = settings.max_depth.min(MOST_DEPTH);
    let path = if caustics.is_some() { PathKind::Told } else { PathKind::Alone };
    let eye_settings = EyeSettings { pixels, slots: 1, max_depth, aov: settings.aov, path: Some(path) };
    // Three layers: direct light, then pairs of caustic and other light.
    let mut state = EyeState { paths: Paths::new(g, pixels), result: EyeHits::new(g, eye_settings, 3 * pixels) };
    g.fill(&mut state.result.radiance, 0);
    let eye = EyeTrace { view, variant, settings: eye_settings };
    let mut list = g.scope("eye generate", |g| eye::generate(g, eye, &mut state));
    for step in 0..=eye_settings.max_depth {
        let mut children = g.scope("eye bounce", |g| eye::bounce(g, eye, &list, &mut state));
        if settings.lights.samples > 0 {
            g.scope("direct light", |g| light_samples(g, eye, settings.lights, &list, &mut state));
        }
        if let Some(caustics) = &mut caustics {
            g.scope("gather", |g| add_caustics(g, eye, caustics, &list, &mut state));
        }
        g.scope("path scatter", |g| scatter(g, eye, &list, &mut state, &mut children));
        if step < eye_settings.max_depth {
            list = SlotList::select(g, Items::Counted(&children.places), &children.flags, &children.slots, pixels);
        }
    }
    let gathered = layers(g, &state.result.radiance, pixels);
    let EyeHits { radiance, aov_first, truncated, .. } = state.result;
    PathLight { radiance, gathered, aov_first, truncated }
}

/// Adds the light of samples of lights at the hits of this step.
fn light_samples(g: &mut Graph, eye: EyeTrace<'_>, lights: LightChoice, list: &SlotList, state: &mut EyeState) {
    let EyeHits { hits, radiance, .. } = &mut state.result;
    let LightChoice { samples: count, candidates } = lights;
    let samples = LightSamples { count, candidates, path: eye.settings.path };
    let states = &state.paths.states;
    let lit = LitHits { list: &list.list, count: &list.count, args: &list.args, hits, states, radiance };
    eye::sample_lights(g, eye.view, eye.variant, samples, lit);
}

/// Adds the light of caustic photons at the hits of this step.
fn add_caustics(
    g: &mut Graph,
    eye: EyeTrace<'_>,
    caustics: &mut Caustics<'_, '_>,
    list: &SlotList,
    state: &mut EyeState,
) {
    let mut flags = g.buffer("path_hit_flags", list.list.len());
    let bind = PathHitsBindings {
        list: &list.list,
        count: &list.count,
        radiance: &state.result.radiance,
        hit_flags: &mut flags,
    };
    g.dispatch(PathHits, Grid::Indirect(&list.args), (), bind);
    let hits = SlotList::select(g, Items::Counted(&list.count), &flags, &list.list, eye.settings.pixels);
    let mut gathered = g.buffer("path_gathered", 2 * eye.settings.pixels);
    g.fill(&mut gathered, 0);
    if let Some(reach) = caustics.reach {
        let listed = (&hits.list, &hits.count, &hits.args);
        eye::boundaries(g, eye.view.scene, reach, listed, &mut state.result.hits);
    }
    (caustics.gather)(g, Points::listed(&state.result.hits, &hits, eye.view.scene), &mut gathered);
    let bind = PathGatherBindings {
        camera: eye.view.camera,
        list: &hits.list,
        count: &hits.count,
        gathered: &gathered,
        radiance: &mut state.result.radiance,
    };
    g.dispatch(PathGather, Grid::Indirect(&hits.args), (), bind);
}

/// Goes on by the gathered lobes of the hits of this step.
fn scatter(g: &mut Graph, eye: EyeTrace<'_>, list: &SlotList, state: &mut EyeState, children: &mut Children) {
    let EyeState { paths, result } = state;
    let bind = PathScatterBindings {
        view: eye.view,
        list: &list.list,
        count: &list.count,
        rays: &mut paths.rays,
        eye_hits: &result.hits,
        throughput: &mut paths.throughput,
        states: &mut paths.states,
        radiance: &mut result.radiance,
        child_flags: &mut children.flags,
        child_slots: &mut children.slots,
        truncated: &mut result.truncated,
    };
    let kernel = PathScatter { max_depth: eye.settings.max_depth, ..PathScatter::of(&eye.variant) };
    g.dispatch(kernel, Grid::Indirect(&list.args), (), bind);
}

/// Caustic and other light as the film takes them.
fn layers(g: &mut Graph, radiance: &Buf<[f32; 4]>, pixels: u32) -> Buf<[f32; 4]> {
    let mut gathered = g.buffer("gathered", 2 * pixels);
    let bind = PathLayersBindings { radiance, gathered: &mut gathered };
    g.dispatch(PathLayers, Grid::Threads(pixels), PathLayersParams { pixels }, bind);
    gathered
}
