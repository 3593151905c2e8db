//! Density estimation from the k nearest photons (Jensen 2001, "Realistic Image Synthesis Using Photon Mapping"),
//! exact; the definition is in glsl/lib/knn.glsl. Caustic and other photons are searched apart, k of each, as in
//! Jensen's two maps.
//!
//! Jensen's tree is a left-balanced kd-tree. This one has the same shape, implicit and balanced, over photons in the
//! order of the photon map: boxes around their centres, level by level. 9 to 18 bytes a photon beside the map's; a
//! search needs 16 (k + 1) bytes for its heaps.

use super::brute::unfinished;
use super::{Points, Program};
use crate::constants::{KNN_DIGITS, KNN_LEAF};
use crate::graph::{Buf, Graph, Grid};
use crate::kernels::Items;
use crate::kernels::deposits::Deposits;
use crate::kernels::generated::{
    GatherKnn, GatherKnnBindings, GatherKnnParams, KnnKey, KnnLeaves, KnnLeavesBindings, KnnLeavesParams, KnnLevel,
    KnnLevelBindings, KnnLevelParams, KnnNode, KnnSelect, KnnSelectBindings, KnnSelectParams, KnnSum, KnnSumBindings,
    KnnSumParams, Photon,
};
use crate::kernels::lbvh;
use crate::kernels::photon;

/// Largest k.
pub const MAX_NEIGHBOURS: u32 = 512;

/// Photons of one dispatch of the selection, below the shortest loop limit known (65,535) with its other loops.
const WINDOW: u32 = 60_000;

/// What is searched.
#[derive(Debug)]
pub struct KnnMap {
    nodes: Buf<KnnNode>,
    leaves: u32,
    count: Buf<u32>,
    order: Buf<u32>,
    sorted: Buf<Photon>,
}

/// Builds the tree over the photons' centres. `fences` as in [`lbvh::Options`].
pub fn knn_map(g: &mut Graph, deposits: &Deposits, fences: bool) -> KnnMap {
    // Only the order of the leaves is used, which is that of the codes.
    let options = lbvh::Options { leaf_items: 1, fences };
    let tree = lbvh::build(g, Items::Counted(&deposits.count), &deposits.boxes, options);
    let map = photon::in_order(g, deposits, tree, None);
    let leaves = map.photons.len().div_ceil(KNN_LEAF).next_power_of_two();
    let mut nodes = g.buffer("knn_nodes", 2 * leaves);
    let bind = KnnLeavesBindings {
        sorted_count: &map.tree.counts,
        order: &map.tree.items,
        sorted: &map.photons,
        nodes: &mut nodes,
    };
    g.dispatch(KnnLeaves, Grid::Threads(leaves), KnnLeavesParams { leaves }, bind);
    let mut first = leaves / 2;
    while first > 0 {
        g.dispatch(KnnLevel, Grid::Threads(first), KnnLevelParams { first }, KnnLevelBindings { nodes: &mut nodes });
        first /= 2;
    }
    KnnMap { nodes, leaves, count: map.tree.counts, order: map.tree.items, sorted: map.photons }
}

/// Writes the gathered radiance of the listed slots (caustic, then other light) from the `k` nearest photons of each
/// class.
///
/// # Panics
/// If `k` is 0 or more than [`MAX_NEIGHBOURS`].
pub fn knn(
    g: &mut Graph,
    (program, k): (Program, u32),
    points: Points<'_>,
    (map, deposits): (&KnnMap, &Deposits),
    gathered: &mut Buf<[f32; 4]>,
) {
    assert!((1..=MAX_NEIGHBOURS).contains(&k), "{k} photons, from 1 to {MAX_NEIGHBOURS} can be sought");
    let kernel = GatherKnn {
        glossy: program.glossy,
        smooth_normals: program.smooth_normals,
        blinn_phong: program.blinn_phong,
        weight: program.weight.code(),
        count_pairs: program.count_pairs,
        step_limit: step_limit(&program),
        neighbours: k,
    };
    let bind = GatherKnnBindings {
        list: points.list,
        count: points.count,
        eye_hits: points.hits,
        lobes: points.lobes,
        nodes: &map.nodes,
        sorted_count: &map.count,
        order: &map.order,
        sorted: &map.sorted,
        photons: &deposits.photons,
        gathered,
    };
    g.dispatch(kernel, Grid::Indirect(points.args), GatherKnnParams { leaves: map.leaves }, bind);
    // Each photon costs a test and a way through a heap of at most 2^9 entries, each leaf two nodes.
    if program.loop_limit.is_some() && deposits.photons.len() > step_limit(&program) / 16 {
        g.scope("finish", |g| {
            let rest = unfinished(g, points, gathered);
            knn_by_digits(g, (program, k), points.part(&rest), deposits, gathered);
        });
    }
}

/// Iterations after which a walk is given up. The driver counts those of its whole vector of up to 8 lanes, which walk
/// apart: the sum of theirs in the worst case. Some are left for the last leaf and the sums.
fn step_limit(program: &Program) -> u32 {
    program.step_limit() / 5
}

/// The same from all photons by selection, without a tree and with short loops: 17 times the work of [`super::brute`],
/// for the hits at which the walk was given up.
pub fn knn_by_digits(
    g: &mut Graph,
    (program, k): (Program, u32),
    points: Points<'_>,
    deposits: &Deposits,
    gathered: &mut Buf<[f32; 4]>,
) {
    let mut keys: Buf<KnnKey> = g.buffer("knn_keys", 2 * points.list.len());
    let windows = || (0..deposits.photons.len().max(1)).step_by(WINDOW as usize);
    for digit in 0..KNN_DIGITS {
        for first in windows() {
            let bind = KnnSelectBindings {
                list: points.list,
                count: points.count,
                eye_hits: points.hits,
                photon_count: &deposits.count,
                photons: &deposits.photons,
                keys: &mut keys,
            };
            let params = KnnSelectParams { first, most: WINDOW, digit };
            let kernel = KnnSelect { neighbours: k, weight: program.weight.code() };
            g.dispatch(kernel, Grid::Indirect(points.args), params, bind);
        }
    }
    for first in windows() {
        let kernel = KnnSum {
            glossy: program.glossy,
            smooth_normals: program.smooth_normals,
            blinn_phong: program.blinn_phong,
            weight: program.weight.code(),
            count_pairs: program.count_pairs,
        };
        let bind = KnnSumBindings {
            list: points.list,
            count: points.count,
            eye_hits: points.hits,
            lobes: points.lobes,
            photon_count: &deposits.count,
            photons: &deposits.photons,
            keys: &keys,
            gathered: &mut *gathered,
        };
        g.dispatch(kernel, Grid::Indirect(points.args), KnnSumParams { first, most: WINDOW }, bind);
    }
}
