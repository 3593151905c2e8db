//! Photons: emission, bounces, and the map of their deposits.
//!
//! One bounce a dispatch, survivors compacted, deposits appended in a fixed order, so that a map has the same bits in
//! every run. Sources: Fabianowski and Dingliana 2009 (differentials, footprints), Yao et al. 2010 (aiming), Igehy
//! 1999.

use super::deposits::{Deposits, Energies};
use super::eye::{InFlight, LOCAL, SlotList, trace_list, trace_medium};
use super::generated::{
    Aabb, Differential, LightAppend, LightAppendBindings, LightAppendParams, Photon, PhotonAdvance,
    PhotonAdvanceBindings, PhotonAdvanceParams, PhotonAppend, PhotonAppendBindings, PhotonAppendParams, PhotonBounce,
    PhotonBounceBindings, PhotonBounceParams, PhotonEmit, PhotonEmitBindings, PhotonEmitParams, PhotonSort,
    PhotonSortBindings, TraceList,
};
use super::maps::{self, Maps, Search};
use super::records::{self, Record, Records};
use super::scene_data::{SceneBuffers, Variant};
use super::{Items, compact, energy, lbvh};
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
    /// Discs between two radii [scene units, at the first pass] by the density of the photon's path (Mara, Luebke and
    /// McGuire 2013, equations 4 and 5): small after mirrors and glass, large after diffuse surfaces.
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
    /// How far footprints reach: the longest semiaxis, `largest` as in [`Emission`].
    pub fn reach(self, largest: f32) -> Reach {
        match self {
            Self::Differential => Reach { widest: largest, ..Reach::default() },
            Self::Density { min, max } => Reach { shrinking: max.max(min), ..Reach::default() },
            Self::Fixed(radius) => Reach { constant: radius, ..Reach::default() },
        }
    }

    /// FOOTPRINT_* of photon_bounce.comp, smallest and largest radius.
    fn code(self, largest: f32) -> (u32, f32, f32) {
        match self {
            Self::Differential => (FOOTPRINT_DIFFERENTIAL, 0.0, largest),
            Self::Density { min, max } => (FOOTPRINT_DENSITY, min, max),
            Self::Fixed(radius) => (FOOTPRINT_FIXED, radius, radius),
        }
    }
}

/// The longest semiaxis of footprints: the largest of three, of which others than those in use are 0.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reach {
    /// In lengths by which footprints of a view are limited; it shrinks from pass to pass.
    pub widest: f32,
    /// In scene units at the first pass; it shrinks alike.
    pub shrinking: f32,
    /// In scene units in every pass.
    pub constant: f32,
}

/// What photons leave where they meet a gathering surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Leaves {
    /// Footprints, for density estimation.
    Footprints,
    /// Light vertices, for connections to the camera.
    Vertices,
}

/// One class of photons in a scene.
#[derive(Clone, Copy)]
struct PhotonTrace<'a> {
    scene: &'a SceneBuffers,
    how: Tracing<'a>,
    variant: Variant,
    emission: Emission,
    leaves: Leaves,
}

/// What kernels are specialised for, and what photons are traced in: maps, or the tree of the scene.
#[derive(Clone, Copy)]
pub struct Tracing<'a> {
    /// What the kernels are specialised for.
    pub variant: Variant,
    /// Maps to trace in, and how.
    pub maps: Option<(Maps<'a>, Search)>,
}

/// Kind of work for [`Graph::tally`]: rays of photons with what is done where they end.
pub const PHOTON_RAYS: &str = "photon rays";

/// Photons in flight, by index of emission.
struct Flight {
    rays: Buf<[f32; 4]>,
    flux: Buf<[f32; 4]>,
    states: Buf<u32>,
    differentials: Buf<Differential>,
    hits: Buf<[u32; 4]>,
}

impl Flight {
    fn photons(&self) -> energy::Photons<'_> {
        energy::Photons { rays: &self.rays, flux: &self.flux, states: &self.states }
    }
}

/// What the photons of a list left at a bounce, by place in the list.
struct Pending {
    /// 1 where something was left.
    stored: Buf<u32>,
    photons: Buf<Photon>,
    /// Boxes of footprints; a single unused one with light vertices.
    boxes: Buf<Aabb>,
}

/// Emits one class of photons and follows them to the end.
pub fn trace(g: &mut Graph, scene: &SceneBuffers, how: Tracing<'_>, emission: Emission, deposits: &mut Deposits) {
    follow(g, PhotonTrace { scene, how, variant: how.variant, emission, leaves: Leaves::Footprints }, deposits);
}

/// The same photons, which leave light vertices instead of footprints in the room of [`Deposits::vertices`].
pub fn trace_vertices(
    g: &mut Graph,
    scene: &SceneBuffers,
    how: Tracing<'_>,
    emission: Emission,
    deposits: &mut Deposits,
) {
    follow(g, PhotonTrace { scene, how, variant: how.variant, emission, leaves: Leaves::Vertices }, deposits);
}

fn follow(g: &mut Graph, photons: PhotonTrace<'_>, deposits: &mut Deposits) {
    let n = photons.emission.count;
    let mut flight = Flight {
        rays: g.buffer("photon_rays", 2 * n),
        flux: g.buffer("photon_flux", n),
        states: g.buffer("photon_states", n),
        differentials: g.buffer("photon_differentials", n),
        hits: g.buffer("photon_hits", n),
    };
    let mut list = g.scope("photon emit", |g| emit(g, photons, &mut flight));
    let emitted = g.scope("photon energy", |g| energy::sum(g, flight.photons()));
    for step in 0..photons.emission.max_bounces {
        g.scope("photon bounce", |g| {
            g.tally(PHOTON_RAYS, 1, &list.count);
            meet(g, photons, &list, &mut flight);
            if photons.variant.absorption {
                let Flight { rays, hits, states, .. } = &mut flight;
                trace_medium(g, photons.scene, &list, InFlight { rays, hits, states });
            }
            let (pending, alive) = bounce(g, photons, step, &list, (&mut flight, &mut deposits.counters));
            append(g, photons.leaves, &list, &pending, deposits);
            list = SlotList::select(g, Items::Counted(&list.count), &alive, &list.list, n);
        });
    }
    let ended = g.scope("photon energy", |g| {
        energy::cut(g, (&list.list, &list.count), Grid::Indirect(&list.args), &mut flight.states);
        energy::sum(g, flight.photons())
    });
    deposits.energies.push(Energies { caustic: photons.emission.caustic, emitted, ended });
    deposits.truncated.push(list.count);
}

/// Finds where the listed photons meet a surface.
fn meet(g: &mut Graph, photons: PhotonTrace<'_>, list: &SlotList, flight: &mut Flight) {
    let Flight { rays, hits, states, .. } = flight;
    match photons.how.maps {
        Some(maps) => maps::trace(g, &photons.scene.triangles, maps, list, (rays, hits, states)),
        None => trace_list(g, photons.scene, list, TraceList { photons: true }, (rays, hits)),
    }
}

fn emit(g: &mut Graph, photons: PhotonTrace<'_>, flight: &mut Flight) -> SlotList {
    let PhotonTrace { scene, variant, emission: Emission { count, caustic, .. }, .. } = photons;
    let mut list = g.buffer("photon_first_list", count);
    let bind = PhotonEmitBindings {
        scene,
        rays: &mut flight.rays,
        flux: &mut flight.flux,
        states: &mut flight.states,
        differentials: &mut flight.differentials,
        list: &mut list,
    };
    let kernel = PhotonEmit { caustic, ..PhotonEmit::of(&variant) };
    g.dispatch(kernel, Grid::Threads(count), PhotonEmitParams { count }, bind);
    SlotList::full(g, list, count)
}

/// One bounce of the listed photons, which are at their hits: what they leave there, and 1 for each that goes on.
fn bounce(
    g: &mut Graph,
    photons: PhotonTrace<'_>,
    step: u32,
    list: &SlotList,
    (flight, counters): (&mut Flight, &mut Buf<u32>),
) -> (Pending, Buf<u32>) {
    let PhotonTrace { scene, variant, emission, leaves, .. } = photons;
    let n = emission.count;
    let (boxed, (footprint, radius_min, radius_max)) = match leaves {
        Leaves::Footprints => (n, emission.footprint.code(emission.largest)),
        Leaves::Vertices => (1, (FOOTPRINT_NONE, 0.0, 0.0)),
    };
    let (mut alive, stored) = (g.buffer("photon_alive", n), g.buffer("photon_stored", n));
    let mut pending = Pending { stored, photons: g.buffer("pending", n), boxes: g.buffer("pending_boxes", boxed) };
    let kernel = PhotonBounce { caustic: emission.caustic, footprint, ..PhotonBounce::of(&variant) };
    let bind = PhotonBounceBindings {
        scene,
        list: &list.list,
        count: &list.count,
        rays: &mut flight.rays,
        hits: &flight.hits,
        flux: &mut flight.flux,
        states: &mut flight.states,
        differentials: &mut flight.differentials,
        alive: &mut alive,
        stored: &mut pending.stored,
        pending: &mut pending.photons,
        pending_boxes: &mut pending.boxes,
        counters,
    };
    let params = PhotonBounceParams { smoothing: emission.smoothing, bounce: step, radius_min, radius_max };
    g.dispatch(kernel, Grid::Indirect(&list.args), params, bind);
    (pending, alive)
}

/// Adds what is pending to the deposits.
fn append(g: &mut Graph, leaves: Leaves, list: &SlotList, left: &Pending, deposits: &mut Deposits) {
    let capacity = deposits.photons.len();
    let kept = compact::indices(g, Items::Counted(&list.count), &left.stored, LOCAL);
    let (list, count, photon_count) = (&kept.indices, &kept.count, &deposits.count);
    let (grid, photons, pending) = (Grid::Indirect(&kept.args), &mut deposits.photons, &left.photons);
    match leaves {
        Leaves::Footprints => {
            let (pending_boxes, boxes) = (&left.boxes, &mut deposits.boxes);
            let bind = PhotonAppendBindings { list, count, pending, pending_boxes, photon_count, photons, boxes };
            g.dispatch(PhotonAppend, grid, PhotonAppendParams { capacity }, bind);
        }
        Leaves::Vertices => {
            let bind = LightAppendBindings { list, count, pending, photon_count, vertices: photons };
            g.dispatch(LightAppend, grid, LightAppendParams { capacity }, bind);
        }
    }
    let bind = PhotonAdvanceBindings {
        count: &kept.count,
        photon_count: &mut deposits.count,
        overflow: &mut deposits.overflow,
    };
    g.dispatch(PhotonAdvance, Grid::Groups([1, 1]), PhotonAdvanceParams { capacity }, bind);
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

/// Builds the map on the device; `packed` of records of 20 bytes, which turns the deposits into discs
/// ([`records::pack`]).
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
