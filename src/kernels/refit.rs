//! New boxes for a tree whose triangles have moved, and the surface-area cost that tells when it needs another
//! topology.
//!
//! The tree may come from any builder of binary trees, host or device. Boxes are computed from the leaves up, once
//! each; about 150 bytes per node and 30 per triangle. The cost is that of Goldsmith and Salmon 1987 ("Automatic
//! creation of object hierarchies for ray tracing") and MacDonald and Booth 1990 ("Heuristics for ray tracing using
//! space subdivision"), with [`BVH_NODE_COST`] for a node and one for a triangle.
//!
//! A tree that was refitted holds the triangles that it was built over. One that no ray can hit any more stays as a
//! point with an inverted box; one that can be hit now and could not before asks for a new tree.

use super::generated::{Aabb, BvhNode};
use super::generated::{RefitBoxes, RefitBoxesBindings, RefitBoxesParams};
use super::generated::{RefitLinks, RefitLinksBindings, RefitLinksParams};
use super::generated::{TreeCost, TreeCostBindings, TreeCostParams};
use super::reduce::reference_bounds;
use super::{Items, reduce};
use crate::constants::{BVH_COUNT_MASK, BVH_COUNT_ONE, BVH_FIRST_MASK, BVH_LEAF, BVH_NODE_COST};
use crate::graph::{Buf, Graph, Grid};

/// A tree may cost this many times what it cost when it was built; then it is built anew.
pub const GROWTH_LIMIT: f32 = 1.3;

/// A tree in device memory that is to be refitted; the parts are those of [`super::lbvh::Lbvh`].
pub struct Target<'a> {
    /// Nodes; the root is node 0.
    pub nodes: &'a mut Buf<BvhNode>,
    /// Indices of the triangles in the order of the leaves.
    pub items: &'a Buf<u32>,
    /// Three words: triangles in the tree, those left out, nodes.
    pub counts: &'a Buf<u32>,
}

/// Gives all nodes the boxes that follow from `boxes`, one for each triangle by its id.
///
/// `fences` as in [`super::lbvh::Options`].
pub fn boxes(g: &mut Graph, tree: Target<'_>, boxes: &Buf<Aabb>, fences: bool) {
    let Target { nodes, items, counts } = tree;
    let capacity = nodes.len();
    g.scope("refit", |g| {
        let (mut parents, mut arrivals) = (g.buffer("refit_parents", capacity), g.buffer("refit_arrivals", capacity));
        g.dispatch(
            RefitLinks,
            Grid::Threads(capacity),
            RefitLinksParams { capacity },
            RefitLinksBindings { counts, nodes, parents: &mut parents, arrivals: &mut arrivals },
        );
        g.dispatch(
            RefitBoxes { fences },
            Grid::Threads(capacity),
            RefitBoxesParams { capacity },
            RefitBoxesBindings { counts, boxes, items, parents: &parents, arrivals: &mut arrivals, nodes },
        );
    });
}

/// `cost[0]` becomes the surface-area cost of the tree, 0 of one without triangles.
///
/// # Panics
/// If `cost` is empty.
pub fn cost(g: &mut Graph, nodes: &Buf<BvhNode>, counts: &Buf<u32>, cost: &mut Buf<f32>) {
    let capacity = nodes.len();
    g.scope("tree_cost", |g| {
        let mut costs = g.buffer("tree_costs", capacity);
        g.dispatch(
            TreeCost,
            Grid::Threads(capacity),
            TreeCostParams { capacity },
            TreeCostBindings { counts, nodes, costs: &mut costs },
        );
        reduce::sum_f32(g, Items::All, &costs, cost);
    });
}

/// Whether a tree that cost `built` and costs `now` is to be built anew. A cost that is no number asks for it, too.
pub fn asks_for_rebuild(built: f32, now: f32) -> bool {
    now.is_nan() || now > GROWTH_LIMIT * built
}

/// The specification of [`boxes`].
pub fn reference_boxes(nodes: &mut [BvhNode], items: &[u32], boxes: &[Aabb]) {
    fn refit(nodes: &mut [BvhNode], index: usize, items: &[u32], boxes: &[Aabb]) -> Aabb {
        let node = nodes[index];
        let [child0, child1] = [node.min0[3], node.max0[3]].map(f32::to_bits);
        // A tree that is one leaf has no second child.
        let alone = child1 == BVH_LEAF && child0 & (BVH_LEAF | BVH_FIRST_MASK) == BVH_LEAF;
        let [box0, box1] = [(child0, items.is_empty()), (child1, alone)].map(|(child, absent)| {
            if child & BVH_LEAF == 0 {
                return refit(nodes, child as usize, items, boxes);
            }
            let first = (child & BVH_FIRST_MASK) as usize;
            let held = if absent { &[] } else { &items[first..=first + leaf_extra(child) as usize] };
            reference_bounds(&held.iter().map(|&id| boxes[id as usize]).collect::<Vec<_>>())
        });
        let with = |[x, y, z]: [f32; 3], w: f32| [x, y, z, w];
        nodes[index] = BvhNode {
            min0: with(box0.min, node.min0[3]),
            max0: with(box0.max, node.max0[3]),
            min1: with(box1.min, 0.0),
            max1: with(box1.max, 0.0),
        };
        reference_bounds(&[box0, box1])
    }
    refit(nodes, 0, items, boxes);
}

/// The specification of what each node adds to [`cost`], for a tree of `items` triangles.
pub fn reference_costs(nodes: &[BvhNode], items: u32) -> Vec<f32> {
    let root = reference_bounds(&children(&nodes[0]).map(|(_, b)| b));
    let unit = tree_unit(&root);
    let cost = |(index, node): (usize, &BvhNode)| {
        let [cost0, cost1] = children(node).map(|(child, b)| {
            let weight = if child & BVH_LEAF != 0 { (leaf_extra(child) + 1) as f32 } else { BVH_NODE_COST };
            weight * tree_area(&b, unit)
        });
        match items {
            0 => 0.0,
            _ => (cost0 + cost1) / tree_area(&root, unit) + if index == 0 { BVH_NODE_COST } else { 0.0 },
        }
    };
    nodes.iter().enumerate().map(cost).collect()
}

/// The surface-area cost of a tree on the host; 0 where there is none.
pub fn host_cost(nodes: &[BvhNode], items: u32) -> f32 {
    if nodes.is_empty() {
        return 0.0;
    }
    reference_costs(nodes, items).iter().map(|cost| f64::from(*cost)).sum::<f64>() as f32
}

/// Items of a leaf but one.
fn leaf_extra(leaf: u32) -> u32 {
    (leaf & BVH_COUNT_MASK) / BVH_COUNT_ONE
}

pub(super) fn children(node: &BvhNode) -> [(u32, Aabb); 2] {
    let xyz = |[x, y, z, _]: [f32; 4]| [x, y, z];
    [
        (node.min0[3].to_bits(), Aabb { min: xyz(node.min0), max: xyz(node.max0) }),
        (node.max0[3].to_bits(), Aabb { min: xyz(node.min1), max: xyz(node.max1) }),
    ]
}

/// Mirror of glsl/lib/tree_area.glsl.
pub(super) fn tree_unit(root: &Aabb) -> f32 {
    let longest = (0..3).map(|k| 0.5 * root.max[k] - 0.5 * root.min[k]).fold(f32::NEG_INFINITY, f32::max);
    let exponent = ((longest.to_bits() >> 23) as i32 - 127).clamp(-126, 126);
    f32::from_bits(((127 - exponent) as u32) << 23)
}

/// Mirror of glsl/lib/tree_area.glsl.
pub(super) fn tree_area(b: &Aabb, unit: f32) -> f32 {
    let [x, y, z]: [f32; 3] = std::array::from_fn(|k| (0.5 * b.max[k] - 0.5 * b.min[k]).max(0.0) * unit);
    if b.min[0] <= b.max[0] { x * y + (x + y) * z } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_is_built_anew_when_its_cost_has_grown() {
        assert!(!asks_for_rebuild(10.0, 10.0) && !asks_for_rebuild(10.0, 10.0 * GROWTH_LIMIT));
        assert!(asks_for_rebuild(10.0, 10.1 * GROWTH_LIMIT) && asks_for_rebuild(10.0, f32::NAN));
    }
}
