//! Photons: emission, bounces, and the map of their deposits.
//!
//! One bounce a dispatch, survivors compacted, deposits appended in a fixed order, so that a map has the same bits in every
//! run. Sources: Fabianowski and Dingliana 2009 (differentials, footprints), Yao et al. 2010 (aiming), Igehy 1999.

use super::deposits::Deposits;
use super::eye::{LOCAL, SlotList, trace_list};
use super::generated::{
    Aabb, Differential, LightAppend, LightAppendBindings, LightAppendParams, Photon, PhotonAdvance,
    PhotonAdvanceBindings, PhotonAdvanceParams, PhotonAppend, PhotonAppendBindings, PhotonAppendParams, PhotonBounce,
    PhotonBounceBindings, PhotonBounceParams, PhotonEmit, PhotonEmitBindings, PhotonEmitParams, PhotonFold,
    PhotonFoldBindings, PhotonSort, PhotonSortBindings,
};
use super::records::{self, Record, Records};
use super::scene_data::{SceneBuffers, Variant};
use super::{Items, compact, lbvh};
use crate::constants::{FOOTPRINT_DENSITY, FOOTPRINT_DIFFERENTIAL, FOOTPRINT_FIXED, FOOTPRINT_NONE};
use crate::graph::{Buf, Graph, Grid};

/// One class of photons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Emission {
    /// Photons emitted per pass.
    pub count: u32,
    /// Caustic photons are aimed at casters and stop at the first diffuse surface.
    pub caustic: bool,
    /// Smoothing factor s: semiaxes in units of the photon spacing.
    pub smoothing: f32,
    /// Surfaces that a photon may meet.
    pub max_bounces: u32,
    /// How large footprints are.
    pub footprint: Footprint,
    /// Largest semiaxis by photon differentials, in scene radii at the first pass.
    pub largest: f32,
}

/// How large the footprints of photons are.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Footprint {
    /// Ellipses by photon differentials (Fabianowski and Dingliana 2009).
    #[default]
    Differential,
    /// Discs between two radii [scene units, at the first pass] by the density of the photon's path (Mara, Luebke and McGuire 2013, equations 4
    /// and 5): small after mirrors and glass, large after diffuse surfaces.
    Density {
        /// After smooth surfaces only.
        min: f32,
        /// After diffuse ones.
        max: f32,
    },
    /// Discs of this radius [scene units] in every pass: blurred however many passes there are, for comparisons.
    Fixed(f32),
}

impl Footprint {
    /// FOOTPRINT_* of photon_bounce.comp, smallest and largest radius.
    fn code(self, largest: f32) -> (u32, f32, f32) {
        match self {
            Self::Differential => (FOOTPRINT_DIFFERENTIAL, 0.0, largest),
            Self::Density { min, max } => (FOOTPRINT_DENSITY, min, max),
            Self::Fixed(radius) => (FOOTPRINT_FIXED, radius, radius),
        }
    }
}

/// What photons leave where they meet a gathering surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leaves {
    /// Footprints, for density estimation.
    Footprints,
    /// Light vertices, for connections to the camera.
    Vertices,
}

/// Photons in flight, by index of emission.
struct Flight {
    rays: Buf<[f32; 4]>,
    flux: Buf<[f32; 4]>,
    states: Buf<u32>,
    differentials: Buf<Differential>,
    hits: Buf<[u32; 4]>,
}

/// Emits one class of photons and follows them to the end.
pub fn trace(g: &mut Graph, scene: &SceneBuffers, v: Variant, emission: Emission, deposits: &mut Deposits) {
    follow(g, (scene, v, emission), Leaves::Footprints, deposits);
}

/// The same photons, which leave light vertices instead of footprints in the room of [`Deposits::vertices`].
pub fn trace_vertices(g: &mut Graph, scene: &SceneBuffers, v: Variant, emission: Emission, deposits: &mut Deposits) {
    follow(g, (scene, v, emission), Leaves::Vertices, deposits);
}

fn follow(
    g: &mut Graph,
    (scene, v, emission): (&SceneBuffers, Variant, Emission),
    leaves: Leaves,
    deposits: &mut Deposits,
) {
    let n = emission.count;
    let mut flight = Flight {
        rays: g.buffer("photon_rays", 2 * n),
        flux: g.buffer("photon_flux", n),
        states: g.buffer("photon_states", n),
        differentials: g.buffer("photon_differentials", n),
        hits: g.buffer("photon_hits", n),
    };
    let mut list = g.scope("photon emit", |g| emit(g, scene, v, emission, &mut flight));
    for step in 0..emission.max_bounces {
        g.scope("photon bounce", |g| {
            trace_list(g, scene, &list, &flight.rays, &mut flight.hits);
            list = bounce(g, (scene, v, emission), (step, leaves), &list, (&mut flight, deposits));
        });
    }
    deposits.truncated.push(list.count);
}

fn emit(g: &mut Graph, scene: &SceneBuffers, v: Variant, emission: Emission, flight: &mut Flight) -> SlotList {
    let mut list = g.buffer("photon_first_list", emission.count);
    let kernel = PhotonEmit {
        textures: v.textures,
        alpha_mask: v.alpha_mask,
        environment: v.environment,
        area_lights: v.area_lights,
        shading_stride: v.shading_stride,
        uv0_at: v.uv0_at,
        uv1_at: v.uv1_at,
        color_at: v.color_at,
        caustic: emission.caustic,
    };
    let bind = PhotonEmitBindings {
        triangles: &scene.triangles,
        shading_data: &scene.shading_data,
        materials: &scene.materials,
        texture_uses: &scene.texture_uses,
        texels: &scene.texels,
        lights: &scene.lights,
        globals: &scene.globals,
        environment: &scene.environment,
        environment_cdf: &scene.environment_cdf,
        casters: &scene.casters,
        pass: &scene.pass,
        rays: &mut flight.rays,
        flux: &mut flight.flux,
        states: &mut flight.states,
        differentials: &mut flight.differentials,
        list: &mut list,
    };
    g.dispatch(kernel, Grid::Threads(emission.count), PhotonEmitParams { count: emission.count }, bind);
    SlotList::full(g, list, emission.count)
}

fn bounce(
    g: &mut Graph,
    (scene, v, emission): (&SceneBuffers, Variant, Emission),
    (step, leaves): (u32, Leaves),
    list: &SlotList,
    (flight, deposits): (&mut Flight, &mut Deposits),
) -> SlotList {
    let n = emission.count;
    let (boxed, (footprint, radius_min, radius_max)) = match leaves {
        Leaves::Footprints => (n, emission.footprint.code(emission.largest)),
        Leaves::Vertices => (1, (FOOTPRINT_NONE, 0.0, 0.0)),
    };
    let (mut alive, mut stored) = (g.buffer("photon_alive", n), g.buffer("photon_stored", n));
    let (mut pending, mut boxes) = (g.buffer("pending", n), g.buffer("pending_boxes", boxed));
    let kernel = PhotonBounce {
        textures: v.textures,
        normal_maps: v.normal_maps,
        alpha_mask: v.alpha_mask,
        glass: v.glass,
        absorption: v.absorption,
        glossy: v.glossy,
        smooth_normals: v.smooth_normals,
        shading_stride: v.shading_stride,
        uv0_at: v.uv0_at,
        uv1_at: v.uv1_at,
        color_at: v.color_at,
        tangent_at: v.tangent_at,
        caustic: emission.caustic,
        footprint,
    };
    let bind = PhotonBounceBindings {
        triangles: &scene.triangles,
        shading_data: &scene.shading_data,
        materials: &scene.materials,
        texture_uses: &scene.texture_uses,
        texels: &scene.texels,
        globals: &scene.globals,
        pass: &scene.pass,
        list: &list.list,
        count: &list.count,
        rays: &mut flight.rays,
        hits: &flight.hits,
        flux: &mut flight.flux,
        states: &mut flight.states,
        differentials: &mut flight.differentials,
        alive: &mut alive,
        stored: &mut stored,
        pending: &mut pending,
        pending_boxes: &mut boxes,
        counters: &mut deposits.counters,
    };
    let params = PhotonBounceParams { smoothing: emission.smoothing, bounce: step, radius_min, radius_max };
    g.dispatch(kernel, Grid::Indirect(&list.args), params, bind);
    let boxes = (leaves == Leaves::Footprints).then_some(&boxes);
    append(g, list, &stored, (&pending, boxes), deposits);
    SlotList::select(g, Items::Counted(&list.count), &alive, &list.list, n)
}

/// Adds the pending deposits whose flag is set, with their boxes if they have any.
fn append(
    g: &mut Graph,
    list: &SlotList,
    stored: &Buf<u32>,
    (pending, boxes): (&Buf<Photon>, Option<&Buf<Aabb>>),
    deposits: &mut Deposits,
) {
    let capacity = deposits.photons.len();
    let kept = compact::indices(g, Items::Counted(&list.count), stored, LOCAL);
    let (list, count, photon_count) = (&kept.indices, &kept.count, &deposits.count);
    let (grid, photons) = (Grid::Indirect(&kept.args), &mut deposits.photons);
    if let Some(pending_boxes) = boxes {
        let boxes = &mut deposits.boxes;
        let bind = PhotonAppendBindings { list, count, pending, pending_boxes, photon_count, photons, boxes };
        g.dispatch(PhotonAppend, grid, PhotonAppendParams { capacity }, bind);
    } else {
        let bind = LightAppendBindings { list, count, pending, photon_count, vertices: photons };
        g.dispatch(LightAppend, grid, LightAppendParams { capacity }, bind);
    }
    g.dispatch(
        PhotonAdvance,
        Grid::Groups([1, 1]),
        PhotonAdvanceParams { capacity },
        PhotonAdvanceBindings {
            count: &kept.count,
            photon_count: &mut deposits.count,
            overflow: &mut deposits.overflow,
        },
    );
}

/// Folds the footprints of all deposits at the boundaries of the surfaces that they lie on (glsl/lib/fold.glsl).
pub fn fold(g: &mut Graph, scene: &SceneBuffers, deposits: &mut Deposits) {
    let args = compact::dispatch_args(g, &deposits.count, deposits.photons.len(), LOCAL);
    let bind = PhotonFoldBindings {
        nodes: &scene.nodes,
        triangles: &scene.triangles,
        count: &deposits.count,
        photons: &mut deposits.photons,
    };
    g.dispatch(PhotonFold, Grid::Indirect(&args), (), bind);
}

/// The photon map: a BVH over the footprints, photons in leaf order.
#[derive(Debug)]
pub struct PhotonMap {
    /// Tree over the footprints' boxes.
    pub tree: lbvh::Lbvh,
    /// Photons in the order of the leaves; a single unused one if there are records.
    pub photons: Buf<Photon>,
    /// Packed photons in the order of the leaves, if they were asked for.
    pub records: Option<Records>,
}

/// Builds the map on the device; `packed` of records of 20 bytes, which turns the deposits into discs ([`records::pack`]).
pub fn map(g: &mut Graph, deposits: &mut Deposits, options: lbvh::Options, packed: bool) -> PhotonMap {
    let record = if packed { Record::Packed20 } else { Record::Full };
    let records = records::pack(g, deposits, record);
    let tree = lbvh::build(g, Items::Counted(&deposits.count), &deposits.boxes, options);
    in_order(g, deposits, tree, records.as_ref())
}

/// The map of a tree over the boxes of the deposits, or of their records.
pub fn in_order(g: &mut Graph, deposits: &Deposits, tree: lbvh::Lbvh, records: Option<&Records>) -> PhotonMap {
    if let Some(records) = records {
        let records = Some(records.sorted(g, &tree.items, &tree.counts));
        let mut photons = g.buffer("no_photons", 1);
        g.fill(&mut photons, 0);
        return PhotonMap { tree, photons, records };
    }
    let mut sorted = g.buffer("photons", deposits.photons.len());
    g.dispatch(
        PhotonSort,
        Grid::Threads(sorted.len()),
        (),
        PhotonSortBindings { order: &tree.items, count: &tree.counts, photons: &deposits.photons, sorted: &mut sorted },
    );
    PhotonMap { tree, photons: sorted, records: None }
}
