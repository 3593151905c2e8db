//! Eye paths: from the camera through mirrors and glass to the surfaces where light is gathered, and the direct light
//! there.
//!
//! One bounce a dispatch; survivors are compacted in order. A pixel has a fixed number of path slots; a path that
//! splits divides its slots, so that every result has one writer and the film adds them in a fixed order.

pub use super::generated::View;
use super::generated::{
    DirectLight, DirectLightBindings, EYE_SHADE_INFO, EyeBoundaries, EyeBoundariesBindings, EyeBoundariesParams,
    EyeGenerate, EyeGenerateBindings, EyeHit, EyeShade, EyeShadeBindings, ListSelect, ListSelectBindings, SceneBuffers,
    TraceCamera, TraceCameraBindings, TraceList, TraceListBindings, TraceMedium, TraceMediumBindings,
};
use super::photon::Reach;
use super::scene_data::Variant;
use super::{Items, compact};

pub use crate::constants::AOV_FLOATS;
use crate::constants::MEDIUM_UNKNOWN;
use crate::graph::{Buf, DispatchArgs, Graph, Grid};

/// Workgroup size of the transport kernels.
pub(super) const LOCAL: u32 = EYE_SHADE_INFO.local_size[0];

/// Extent of the eye paths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EyeSettings {
    /// Pixels of the image.
    pub pixels: u32,
    /// Path slots per pixel, at least 1.
    pub slots: u32,
    /// Most surfaces that a path meets after the first.
    pub max_depth: u32,
    /// Whether layers are written.
    pub aov: bool,
    /// Whether these are steps of path tracing ([`super::path`]), which has one slot per pixel, and of which kind.
    pub path: Option<PathKind>,
}

/// What paths find by themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PathKind {
    /// All light.
    Alone,
    /// All but the light that photons tell them of: what reaches a surface by way of mirrors and glass alone.
    Told,
}

/// What the eye paths leave.
#[derive(Debug)]
pub struct EyeHits {
    /// Hits, valid where listed.
    pub hits: Buf<EyeHit>,
    /// Slots with a hit, ascending.
    pub list: Buf<u32>,
    /// How many.
    pub count: Buf<u32>,
    /// Groups for one invocation per hit.
    pub args: Buf<DispatchArgs>,
    /// States of the paths, by slot: what medium is around a hit.
    pub states: Buf<u32>,
    /// Per slot: emission met on the way, later also direct light.
    pub radiance: Buf<[f32; 4]>,
    /// [`AOV_FLOATS`] per pixel.
    pub aov_first: Buf<f32>,
    /// Paths that were still alive at the depth limit: none, unless splitting or masks led there.
    pub truncated: Buf<u32>,
}

/// A list of slots and its length on the device.
pub(super) struct SlotList {
    pub list: Buf<u32>,
    pub count: Buf<u32>,
    pub args: Buf<DispatchArgs>,
}

impl SlotList {
    /// The first `len` slots of `list`.
    pub(super) fn full(g: &mut Graph, list: Buf<u32>, len: u32) -> Self {
        let mut count = g.buffer("list_count", 1);
        g.fill(&mut count, len);
        let args = compact::dispatch_args(g, &count, len, LOCAL);
        Self { list, count, args }
    }

    /// The slots of `source` whose flag is set, in order; at most `most` of them are.
    pub(super) fn select(g: &mut Graph, items: Items<'_>, flags: &Buf<u32>, source: &Buf<u32>, most: u32) -> Self {
        let kept = compact::indices(g, items, flags, LOCAL);
        let mut list = g.buffer("slots", source.len().min(most));
        let bind = ListSelectBindings { indices: &kept.indices, count: &kept.count, source, target: &mut list };
        g.dispatch(ListSelect, Grid::Indirect(&kept.args), (), bind);
        Self { list, count: kept.count, args: kept.args }
    }
}

/// Kinds of work for [`Graph::tally`]: rays of eye paths with what is done where they end, rays towards lights.
pub const EYE_RAYS: &str = "eye rays";
/// See [`EYE_RAYS`].
pub const SHADOW_RAYS: &str = "shadow rays";

/// Buffers of the paths in flight, by slot.
pub(super) struct Paths {
    pub rays: Buf<[f32; 4]>,
    pub throughput: Buf<[f32; 4]>,
    pub states: Buf<u32>,
    hits: Buf<[u32; 4]>,
    valid: Buf<u32>,
}

impl Paths {
    pub(super) fn new(g: &mut Graph, slots: u32) -> Self {
        Self {
            rays: g.buffer("eye_rays", 2 * slots),
            throughput: g.buffer("eye_throughput", slots),
            states: g.buffer("eye_states", slots),
            hits: g.buffer("eye_ray_hits", slots),
            valid: g.buffer("eye_valid", slots),
        }
    }
}

impl EyeHits {
    /// Nothing yet, with room for `radiance` values.
    pub(super) fn new(g: &mut Graph, settings: EyeSettings, radiance: u32) -> Self {
        let mut result = Self {
            hits: g.buffer("eye_hits", settings.pixels * settings.slots),
            list: g.buffer("unused", 1),
            count: g.buffer("unused", 1),
            args: g.buffer("unused", 1),
            states: g.buffer("unused", 1),
            radiance: g.buffer("radiance", radiance),
            aov_first: g.buffer("aov_first", if settings.aov { AOV_FLOATS * settings.pixels } else { 1 }),
            truncated: g.buffer("eye_truncated", 1),
        };
        g.fill(&mut result.truncated, 0);
        result
    }
}

/// What steps of eye paths have in common.
#[derive(Clone, Copy)]
pub(super) struct EyeTrace<'a> {
    pub view: View<'a>,
    pub variant: Variant,
    pub settings: EyeSettings,
}

/// Paths in flight, and what they have left so far.
pub(super) struct EyeState {
    pub paths: Paths,
    pub result: EyeHits,
}

/// Adds the passes of the eye paths.
pub fn trace(g: &mut Graph, view: View<'_>, variant: Variant, settings: EyeSettings) -> EyeHits {
    let slots = settings.pixels * settings.slots;
    let mut state = EyeState { paths: Paths::new(g, slots), result: EyeHits::new(g, settings, slots) };
    let eye = EyeTrace { view, variant, settings };
    let mut list = g.scope("eye generate", |g| generate(g, eye, &mut state));
    let bounces = if variant.glossy || variant.alpha_mask { settings.max_depth + 1 } else { 1 };
    for step in 0..bounces {
        let children = g.scope("eye bounce", |g| bounce(g, eye, &list, &mut state));
        if step + 1 < bounces {
            let places = Items::Counted(&children.places);
            list = SlotList::select(g, places, &children.flags, &children.slots, slots);
        }
    }
    let EyeState { paths, result } = state;
    let everything = compact::indices(g, Items::All, &paths.valid, LOCAL);
    let compact::Survivors { indices: list, count, args } = everything;
    EyeHits { list, count, args, states: paths.states, ..result }
}

/// The first list: every pixel's first slot.
pub(super) fn generate(g: &mut Graph, eye: EyeTrace<'_>, state: &mut EyeState) -> SlotList {
    let EyeTrace { view, variant, settings } = eye;
    let EyeState { paths, result } = state;
    let mut list = g.buffer("eye_first_list", settings.pixels);
    let bind = EyeGenerateBindings {
        camera: view.camera,
        pass: &view.scene.pass,
        rays: &mut paths.rays,
        throughput: &mut paths.throughput,
        states: &mut paths.states,
        list: &mut list,
        radiance: &mut result.radiance,
        valid: &mut paths.valid,
    };
    // Where nothing absorbs, it does not matter what is around the camera.
    let start_medium = if variant.absorption { MEDIUM_UNKNOWN } else { 0 };
    g.dispatch(EyeGenerate { lens: variant.lens, start_medium }, Grid::Threads(settings.pixels), (), bind);
    SlotList::full(g, list, settings.pixels)
}

/// Traces the rays of the listed slots and shades what they hit.
pub(super) fn bounce(g: &mut Graph, eye: EyeTrace<'_>, list: &SlotList, state: &mut EyeState) -> Children {
    let EyeTrace { view, variant, settings } = eye;
    let EyeState { paths, result } = state;
    g.tally(EYE_RAYS, 1, &list.count);
    if variant.one_sided {
        trace_camera(g, view.scene, list, paths);
    } else {
        trace_list(g, view.scene, list, TraceList { photons: false }, (&paths.rays, &mut paths.hits));
    }
    if variant.absorption {
        trace_medium(g, view.scene, list, InFlight::of(paths));
    }
    let mut children = Children::new(g, 2 * list.list.len());
    let EyeSettings { aov, max_depth, path, .. } = settings;
    let told = path == Some(PathKind::Told);
    let kernel = EyeShade { aov, max_depth, path: path.is_some(), told, ..EyeShade::of(&variant) };
    let bind = EyeShadeBindings {
        view,
        list: &list.list,
        count: &list.count,
        rays: &mut paths.rays,
        hits: &paths.hits,
        throughput: &mut paths.throughput,
        states: &mut paths.states,
        radiance: &mut result.radiance,
        eye_hits: &mut result.hits,
        valid: &mut paths.valid,
        child_flags: &mut children.flags,
        child_slots: &mut children.slots,
        child_places: &mut children.places,
        aov_first: &mut result.aov_first,
        truncated: &mut result.truncated,
    };
    g.dispatch(kernel, Grid::Indirect(&list.args), (), bind);
    children
}

/// Two places per path for its continuations.
pub(super) struct Children {
    pub flags: Buf<u32>,
    pub slots: Buf<u32>,
    /// One word: places written.
    pub places: Buf<u32>,
}

impl Children {
    fn new(g: &mut Graph, most: u32) -> Self {
        let mut places = g.buffer("child_places", 1);
        g.fill(&mut places, 0); // without a path nobody writes it
        Self { flags: g.buffer("child_flags", most), slots: g.buffer("child_slots", most), places }
    }
}

/// Closest hits of the rays in the listed slots.
pub(super) fn trace_list(
    g: &mut Graph,
    scene: &SceneBuffers,
    list: &SlotList,
    kernel: TraceList,
    (rays, hits): (&Buf<[f32; 4]>, &mut Buf<[u32; 4]>),
) {
    let bind = TraceListBindings {
        nodes: &scene.nodes,
        triangles: &scene.triangles,
        list: &list.list,
        count: &list.count,
        rays,
        hits,
    };
    g.dispatch(kernel, Grid::Indirect(&list.args), (), bind);
}

/// The same for eye paths, which look through the backs of surfaces with one side as long as they come straight from
/// the camera.
fn trace_camera(g: &mut Graph, scene: &SceneBuffers, list: &SlotList, paths: &mut Paths) {
    let bind = TraceCameraBindings {
        nodes: &scene.nodes,
        triangles: &scene.triangles,
        list: &list.list,
        count: &list.count,
        rays: &paths.rays,
        states: &paths.states,
        hits: &mut paths.hits,
    };
    g.dispatch(TraceCamera, Grid::Indirect(&list.args), (), bind);
}

/// Paths or photons in flight, which are at their hits.
pub(super) struct InFlight<'a> {
    pub rays: &'a Buf<[f32; 4]>,
    pub hits: &'a Buf<[u32; 4]>,
    pub states: &'a mut Buf<u32>,
}

impl<'a> InFlight<'a> {
    fn of(paths: &'a mut Paths) -> Self {
        Self { rays: &paths.rays, hits: &paths.hits, states: &mut paths.states }
    }
}

/// Tells the listed paths in which medium they are, where they do not know.
pub(super) fn trace_medium(g: &mut Graph, scene: &SceneBuffers, list: &SlotList, paths: InFlight<'_>) {
    let InFlight { rays, hits, states } = paths;
    let bind = TraceMediumBindings { scene, list: &list.list, count: &list.count, rays, hits, states };
    g.dispatch(TraceMedium, Grid::Indirect(&list.args), (), bind);
}

/// How the lights of a hit are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LightChoice {
    /// Samples, of a shadow ray each; 0 without lights.
    pub samples: u32,
    /// Candidates by power, of which each sample is chosen by what it brings.
    pub candidates: u32,
}

impl LightChoice {
    /// From so many lights upwards a sample is one of several candidates.
    const MANY: u32 = 16;

    /// For a scene of so many lights, with `samples` samples if there are any.
    pub fn new(lights: u32, samples: u32) -> Self {
        let candidates = if lights >= Self::MANY { 8 } else { 1 };
        Self { samples: if lights > 0 { samples } else { 0 }, candidates }
    }
}

/// Adds the direct light at the hits: lights as they are to be chosen, and a shadow ray for each.
pub fn direct(g: &mut Graph, view: View<'_>, v: Variant, choice: LightChoice, eye: &mut EyeHits) {
    let EyeHits { hits, list, count, args, states, radiance, .. } = eye;
    let samples = LightSamples { count: choice.samples, candidates: choice.candidates, path: None };
    sample_lights(g, view, v, samples, LitHits { list, count, args, hits, states, radiance });
}

/// Finds the boundaries of the surfaces around the listed hits, as far as footprints reach (glsl/lib/boundary.glsl).
pub fn boundaries(
    g: &mut Graph,
    scene: &SceneBuffers,
    reach: Reach,
    (list, count, args): (&Buf<u32>, &Buf<u32>, &Buf<DispatchArgs>),
    hits: &mut Buf<EyeHit>,
) {
    let bind = EyeBoundariesBindings {
        nodes: &scene.nodes,
        triangles: &scene.triangles,
        globals: &scene.globals,
        pass: &scene.pass,
        list,
        count,
        eye_hits: hits,
    };
    let Reach { widest, shrinking, constant } = reach;
    let params = EyeBoundariesParams { widest, shrinking, constant };
    g.dispatch(EyeBoundaries, Grid::Indirect(args), params, bind);
}

/// Samples of lights at each hit.
#[derive(Clone, Copy)]
pub(super) struct LightSamples {
    pub count: u32,
    /// Candidates of which each is chosen.
    pub candidates: u32,
    /// Whether gathered lobes look for lights, too, as in path tracing, and of which kind that is.
    pub path: Option<PathKind>,
}

/// Listed hits that lights are sampled at.
pub(super) struct LitHits<'a> {
    pub list: &'a Buf<u32>,
    pub count: &'a Buf<u32>,
    pub args: &'a Buf<DispatchArgs>,
    pub hits: &'a Buf<EyeHit>,
    /// States of the paths, by slot.
    pub states: &'a Buf<u32>,
    /// Per slot; the light is added here.
    pub radiance: &'a mut Buf<[f32; 4]>,
}

/// Adds the light of samples of lights at the listed hits.
pub(super) fn sample_lights(g: &mut Graph, view: View<'_>, v: Variant, samples: LightSamples, lit: LitHits<'_>) {
    let LitHits { list, count, args, hits, states, radiance } = lit;
    g.tally(SHADOW_RAYS, samples.count, count);
    let kernel = DirectLight {
        light_samples: samples.count,
        candidates: samples.candidates,
        path: samples.path.is_some(),
        told: samples.path == Some(PathKind::Told),
        ..DirectLight::of(&v)
    };
    let bind = DirectLightBindings { view, list, count, eye_hits: hits, radiance, states };
    g.dispatch(kernel, Grid::Indirect(args), (), bind);
}
