//! Turns a binary tree with an item in each leaf into one whose leaves hold up to four, where that is cheaper.
//!
//! The surface-area heuristic decides, with the costs of [`super::refit::cost`]: a subtree becomes a leaf if testing
//! all of its items costs no more than visiting its nodes. This is decided from the items up. Nodes keep their order,
//! gaps are closed, and the items of leaves follow the order of their nodes. About 250 bytes per item.

use super::generated::{Aabb, BvhNode, Subtree};
use super::generated::{CollapseFuse, CollapseFuseBindings, CollapseFuseParams};
use super::generated::{CollapseInside, CollapseInsideBindings, CollapseInsideParams};
use super::generated::{CollapseWeigh, CollapseWeighBindings, CollapseWeighParams};
use super::generated::{CollapseWrite, CollapseWriteBindings, CollapseWriteParams};
use super::lbvh::Lbvh;
use super::lbvh_reference::Tree;
use super::reduce::reference_bounds;
use super::refit::{children, tree_area, tree_unit};
use super::{Items, scan};
pub use crate::constants::COLLAPSE_LEAF as LEAF_ITEMS;
use crate::constants::{BVH_COUNT_ONE, BVH_FIRST_MASK, BVH_LEAF, BVH_NODE_COST};
use crate::graph::{Buf, Graph, Grid};

/// A tree with an item in each leaf. Nodes that no link leads to do not exist; node 0 is the root.
pub struct Binary {
    /// The tree; `counts` has the items and those left out.
    pub tree: Lbvh,
    /// Parents and sides of as many items as there are boxes, then of the nodes (glsl/lib/lbvh.glsl).
    pub links: Buf<u32>,
    /// The box of all.
    pub scene: Buf<Aabb>,
}

/// Makes leaves of a tree over `boxes`; `fences` as in [`super::lbvh::Options`].
pub fn leaves(g: &mut Graph, boxes: &Buf<Aabb>, binary: Binary, fences: bool) -> Lbvh {
    g.scope("collapse", |g| {
        let Binary { tree: Lbvh { nodes, items, mut counts }, links, scene } = binary;
        let (capacity, node_capacity) = (boxes.len(), nodes.len());
        let (mut arrivals, mut inside) = (g.buffer("arrivals", node_capacity), g.buffer("inside", node_capacity));
        let mut subtrees = g.buffer("subtrees", node_capacity);
        g.fill(&mut arrivals, 0);
        g.fill(&mut inside, 0);
        g.dispatch(
            CollapseFuse { fences },
            Grid::Threads(capacity),
            CollapseFuseParams { capacity },
            CollapseFuseBindings {
                counts: &counts,
                scene: &scene,
                nodes: &nodes,
                links: &links,
                arrivals: &mut arrivals,
                subtrees: &mut subtrees,
            },
        );
        let grid = || Grid::Threads(node_capacity);
        let params = CollapseInsideParams { capacity: node_capacity };
        let bind =
            CollapseInsideBindings { nodes: &nodes, arrivals: &arrivals, subtrees: &subtrees, inside: &mut inside };
        g.dispatch(CollapseInside, grid(), params, bind);
        let (kept, held) = weigh(g, &nodes, (&arrivals, &subtrees, &inside));
        let (mut places, mut kept_count) = (g.buffer("places", node_capacity), g.buffer("kept_count", 1));
        scan::exclusive(g, Items::All, &kept, &mut places, &mut kept_count);
        let (mut firsts, mut held_count) = (g.buffer("firsts", node_capacity), g.buffer("held_count", 1));
        scan::exclusive(g, Items::All, &held, &mut firsts, &mut held_count);
        let (mut finished, mut finished_items) =
            (g.buffer("finished", node_capacity), g.buffer("leaf_items", capacity));
        g.dispatch(
            CollapseWrite,
            grid(),
            CollapseWriteParams { capacity: node_capacity },
            CollapseWriteBindings {
                kept_count: &kept_count,
                boxes,
                items: &items,
                nodes: &nodes,
                subtrees: &subtrees,
                kept: &kept,
                places: &places,
                firsts: &firsts,
                finished: &mut finished,
                finished_items: &mut finished_items,
                counts: &mut counts,
            },
        );
        Lbvh { nodes: finished, items: finished_items, counts }
    })
}

/// Which nodes are kept, and how many items their leaves hold.
fn weigh(
    g: &mut Graph,
    nodes: &Buf<BvhNode>,
    (arrivals, subtrees, inside): (&Buf<u32>, &Buf<Subtree>, &Buf<u32>),
) -> (Buf<u32>, Buf<u32>) {
    let capacity = nodes.len();
    let (mut kept, mut held) = (g.buffer("kept", capacity), g.buffer("held", capacity));
    let bind = CollapseWeighBindings { nodes, arrivals, subtrees, inside, kept: &mut kept, held: &mut held };
    g.dispatch(CollapseWeigh, Grid::Threads(capacity), CollapseWeighParams { capacity }, bind);
    (kept, held)
}

/// The specification of [`leaves`]: `nodes` with `None` where no node is, over `items` in order.
pub fn reference(nodes: &[Option<BvhNode>], items: &[u32], boxes: &[Aabb]) -> Tree {
    let degenerate = (boxes.len() - items.len()) as u32;
    let none = reference_bounds(&[]);
    let small = |b: Aabb| {
        let with = |[x, y, z]: [f32; 3], bits: u32| [x, y, z, f32::from_bits(bits)];
        let (min1, max1) = (with(none.min, 0), with(none.max, 0));
        BvhNode { min0: with(b.min, BVH_LEAF), max0: with(b.max, BVH_LEAF), min1, max1 }
    };
    if items.len() < 2 {
        let b = items.first().map_or(none, |&id| boxes[id as usize]);
        return Tree { nodes: vec![small(b)], items: items.to_vec(), degenerate };
    }
    let mut collapse = Collapse { nodes, unit: tree_unit(&reference_bounds(boxes)), costs: vec![None; nodes.len()] };
    collapse.measure(0);
    collapse.finish(items, degenerate)
}

struct Collapse<'a> {
    nodes: &'a [Option<BvhNode>],
    unit: f32,
    /// Items and cost of each subtree, and whether it is cheaper as a leaf.
    costs: Vec<Option<(u32, f32, bool)>>,
}

impl Collapse<'_> {
    fn node(&self, index: u32) -> &BvhNode {
        self.nodes[index as usize].as_ref().expect("a node that exists")
    }

    fn measure(&mut self, index: u32) -> (u32, f32, bool) {
        let both = children(self.node(index));
        let [a, b] = both.map(|(child, b)| match child & BVH_LEAF {
            0 => self.measure(child),
            _ => (1, tree_area(&b, self.unit), false),
        });
        let area = tree_area(&reference_bounds(&both.map(|(_, b)| b)), self.unit);
        let items = a.0 + b.0;
        let (apart, together) = (BVH_NODE_COST * area + (a.1 + b.1), items as f32 * area);
        let fused = index != 0 && items <= LEAF_ITEMS && together <= apart;
        let subtree = (items, if fused { together } else { apart }, fused);
        self.costs[index as usize] = Some(subtree);
        subtree
    }

    fn is_leaf(&self, child: u32) -> bool {
        child & BVH_LEAF != 0 || self.costs[child as usize].is_some_and(|(_, _, fused)| fused)
    }

    /// Marks the nodes that stay.
    fn keep(&self, index: u32, kept: &mut [bool]) {
        kept[index as usize] = true;
        for (child, _) in children(self.node(index)) {
            if !self.is_leaf(child) {
                self.keep(child, kept);
            }
        }
    }

    fn collect(&self, child: u32, items: &[u32], order: &mut Vec<u32>) {
        if child & BVH_LEAF != 0 {
            order.push(items[(child & BVH_FIRST_MASK) as usize]);
        } else {
            children(self.node(child)).iter().for_each(|(child, _)| self.collect(*child, items, order));
        }
    }

    fn finish(&self, items: &[u32], degenerate: u32) -> Tree {
        let mut kept = vec![false; self.nodes.len()];
        self.keep(0, &mut kept);
        let (places, _) = scan::reference(&kept.iter().map(|kept| u32::from(*kept)).collect::<Vec<_>>());
        let mut order = Vec::with_capacity(items.len());
        let mut nodes = Vec::new();
        for index in (0..self.nodes.len() as u32).filter(|&i| kept[i as usize]) {
            let mut node = *self.node(index);
            let both = children(&node).map(|(child, _)| {
                if !self.is_leaf(child) {
                    return f32::from_bits(places[child as usize]);
                }
                let first = order.len() as u32;
                self.collect(child, items, &mut order);
                f32::from_bits(BVH_LEAF | ((order.len() as u32 - first - 1) * BVH_COUNT_ONE) | first)
            });
            [node.min0[3], node.max0[3]] = both;
            nodes.push(node);
        }
        Tree { nodes, items: order, degenerate }
    }
}
