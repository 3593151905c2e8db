//! Light tracing: the vertices of light paths, connected to the camera, and the sums of what each pixel sees of them.
//!
//! Photons make the vertices ([`super::photon::trace_vertices`]), a splat each. A stable sort by pixel and class puts
//! the splats of a pixel together in the order of the photons, so that sums have the same bits in every run, without
//! atomics.

use super::deposits::Deposits;
use super::eye::{LOCAL, View};
use super::generated::{
    Camera, LightBlocks, LightBlocksBindings, LightConnect, LightConnectBindings, LightSum, LightSumBindings,
};
use super::scene_data::Variant;
use super::{Items, compact, sort};
use crate::graph::{Buf, Graph, Grid};

/// Splats of a block whose sum is known: a loop over the 2^24 that a pass can have takes 2^15 steps over blocks, within
/// what drivers run that end loops after 65,535.
const BLOCK: u32 = 512;

/// What the light vertices of a pass send to the pixels, by pixel and class.
#[derive(Debug)]
pub struct Splats {
    /// 2 * pixel (in device order) + class (0 caustic, 1 other), ascending; behind all pixels what is not seen.
    keys: Buf<u32>,
    /// Splats in the order of the keys.
    order: Buf<u32>,
    /// Radiance of the pixel, by vertex.
    splats: Buf<[f32; 4]>,
    /// Sums of whole blocks in that order.
    blocks: Buf<[f32; 4]>,
}

/// Connects the vertices to a pinhole or parallel camera of `pixels` pixels.
pub fn connect(g: &mut Graph, view: View<'_>, v: Variant, pixels: u32, vertices: &Deposits) -> Splats {
    let capacity = vertices.photons.len();
    let (mut keys, mut indices) = (g.buffer("splat_keys", capacity), g.buffer("splat_indices", capacity));
    let mut splats = g.buffer("splats", capacity);
    let bind = LightConnectBindings {
        view,
        count: &vertices.count,
        vertices: &vertices.photons,
        keys: &mut keys,
        indices: &mut indices,
        splats: &mut splats,
    };
    let args = compact::dispatch_args(g, &vertices.count, capacity, LOCAL);
    g.dispatch(LightConnect::of(&v), Grid::Indirect(&args), (), bind);
    let bits = u32::BITS - (2 * pixels).leading_zeros();
    let (keys, order) = sort::pairs(g, Items::Counted(&vertices.count), keys, indices, bits);
    let whole = (capacity / BLOCK).max(1);
    let mut blocks = g.buffer("splat_blocks", whole);
    let bind = LightBlocksBindings { count: &vertices.count, order: &order, splats: &splats, blocks: &mut blocks };
    g.dispatch(LightBlocks { block: BLOCK }, Grid::Threads(whole), (), bind);
    Splats { keys, order, splats, blocks }
}

/// Writes what a band of `pixels` pixels sees to the first slot of each, caustic and other light; `count` is that of
/// the vertices.
pub fn sum(
    g: &mut Graph,
    (camera, pixels): (&Buf<Camera>, u32),
    splats: &Splats,
    count: &Buf<u32>,
    gathered: &mut Buf<[f32; 4]>,
) {
    let Splats { keys, order, splats, blocks } = splats;
    let bind = LightSumBindings { camera, count, keys, order, splats, blocks, gathered };
    g.dispatch(LightSum { block: BLOCK }, Grid::Threads(2 * pixels), (), bind);
}
