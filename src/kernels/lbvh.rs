//! Linear bounding-volume hierarchy over boxes, built on the device.
//!
//! Morton codes of the centres, a radix sort, links from the common prefixes of neighbours (Karras 2012, "Maximizing
//! parallelism in the construction of BVHs, octrees, and k-d trees"), boxes from the items up. Equal codes are told
//! apart by their place in the order, so a tree over equal boxes is balanced. Subtrees of at most `leaf_items` boxes
//! become one leaf (Fabianowski and Dingliana 2009: two leaves are fused while their joint count is at most T).
//!
//! About 340 bytes per box. The codes are the same bits on every device, in every unit of length.

use super::collapse::Binary;
use super::compact::dispatch_args;
use super::generated::{Aabb, BvhNode, LBVH_BOXES_INFO, LBVH_LINKS_INFO, LBVH_PACK_INFO};
use super::generated::{LbvhBoxes, LbvhBoxesBindings, LbvhBoxesParams};
use super::generated::{LbvhCodes, LbvhCodesBindings, LbvhCodesParams};
use super::generated::{LbvhCount, LbvhCountBindings, LbvhCountParams};
use super::generated::{LbvhLinks, LbvhLinksBindings, LbvhLinksParams};
use super::generated::{LbvhPack, LbvhPackBindings, LbvhPackParams};
use super::generated::{LbvhPlaces, LbvhPlacesBindings, LbvhPlacesParams};
use super::{Items, reduce, scan, sort};
use crate::constants::{BVH_COUNT_MASK, BVH_COUNT_ONE, BVH_MAX_DEPTH, MORTON_BITS};
pub use crate::constants::{BVH_LEAF as LEAF, LBVH_END as END};
use crate::graph::{Buf, Graph, Grid};

/// Bits of a code that the sort looks at: those of size and position, and one that moves degenerate boxes to the end.
const CODE_BITS: u32 = MORTON_BITS + 1;

/// Most inner nodes on a path from the root: along a path the common prefix of (code, index) grows with every node, and
/// it has 30 bits of code and at most 27 of index. A traversal stack of this many entries never overflows.
pub const MAX_DEPTH: u32 = 57;
const _: () = assert!(MAX_DEPTH <= BVH_MAX_DEPTH);

/// Largest leaf whose size fits a child reference; larger ones end at a flag.
pub const COUNTED_LEAF: u32 = BVH_COUNT_MASK / BVH_COUNT_ONE + 1;

/// How to build.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Most boxes in a leaf, at least 1.
    pub leaf_items: u32,
    /// Whether kernels may use memory barriers where invocations diverge. Lavapipe of Mesa 22.3.6 loses invocations at
    /// them and does not need them; everything else needs them. The versions that cut long loops
    /// ([`crate::vk::Device::loop_limit`]) are those that lose invocations.
    pub fences: bool,
}

/// A tree on the device.
#[derive(Debug)]
pub struct Lbvh {
    /// Nodes; the root is node 0. See glsl/shared/bvh.glsl.
    pub nodes: Buf<BvhNode>,
    /// Indices of the boxes in the order of the leaves; as many as `counts[0]`. If `leaf_items` was over
    /// [`COUNTED_LEAF`], the last item of every leaf carries [`END`] and the count in leaf references is unused (zero).
    pub items: Buf<u32>,
    /// Three words: boxes in the tree, degenerate boxes left out, nodes.
    pub counts: Buf<u32>,
}

/// Builds a tree over the valid boxes (`min <= max`, finite) with leaves of at most `leaf_items` boxes.
///
/// Without valid boxes the root has two inverted boxes; with a single one, its second box is inverted.
///
/// # Panics
/// If `leaf_items` is 0, or there is room for more than 2^27 boxes.
pub fn build(g: &mut Graph, items: Items<'_>, boxes: &Buf<Aabb>, options: Options) -> Lbvh {
    assert!(options.leaf_items >= 1, "a leaf holds at least one box");
    g.scope("lbvh", |g| {
        let (mut tree, linked) = linked(g, items, (boxes, Codes::OfSizes), options);
        if options.leaf_items > 1 {
            pack(g, &linked.inner, &linked.kept, &mut tree);
        }
        tree
    })
}

/// Builds a tree over the valid boxes with one in each leaf, and what leads from there to another tree over them.
///
/// # Panics
/// As [`build`].
pub fn binary(g: &mut Graph, boxes: &Buf<Aabb>, fences: bool) -> Binary {
    g.scope("lbvh", |g| {
        let options = Options { leaf_items: 1, fences };
        let (tree, Linked { links, scene, .. }) = linked(g, Items::All, (boxes, Codes::OfPlaces), options);
        Binary { tree, links, scene }
    })
}

/// What comes first in the codes of boxes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Codes {
    /// Their sizes: footprints of photons differ a thousandfold.
    OfSizes,
    /// Their places: triangles of one surface are to stay together.
    OfPlaces,
}

/// Boxes in the order of their codes.
pub(super) struct Sorted {
    /// The box of all.
    pub scene: Buf<Aabb>,
    /// Codes in ascending order.
    pub codes: Buf<u32>,
    /// Indices of the boxes in this order.
    pub items: Buf<u32>,
    /// Three words as in [`Lbvh::counts`], every inner node counted.
    pub counts: Buf<u32>,
    /// One word: inner nodes of a binary tree, at least the root.
    inner: Buf<u32>,
}

/// Sorts the boxes by their codes, those that are not valid to the end, and counts them.
pub(super) fn sorted(g: &mut Graph, items: Items<'_>, (boxes, codes): (&Buf<Aabb>, Codes)) -> Sorted {
    let capacity = boxes.len();
    assert!(capacity <= 1 << 27, "{capacity} boxes, at most 2^27 fit a child reference");
    let count = items.buffer(g, capacity);
    let (scene, codes, order) = sorted_codes(g, &count, (boxes, codes));
    let (mut counts, mut inner) = (g.buffer("lbvh_counts", 3), g.buffer("lbvh_inner", 1));
    g.dispatch(
        LbvhCount,
        Grid::Threads(capacity.max(1)),
        LbvhCountParams { capacity },
        LbvhCountBindings { count: &count, codes: &codes, counts: &mut counts, inner: &mut inner },
    );
    Sorted { scene, codes, items: order, counts, inner }
}

/// What stays of the making of a tree beside the tree.
struct Linked {
    links: Buf<u32>,
    kept: Buf<u32>,
    inner: Buf<u32>,
    scene: Buf<Aabb>,
}

fn linked(g: &mut Graph, items: Items<'_>, (boxes, codes): (&Buf<Aabb>, Codes), options: Options) -> (Lbvh, Linked) {
    let Sorted { scene, codes, items, counts, inner } = sorted(g, items, (boxes, codes));
    let mut tree = Lbvh { nodes: g.buffer("lbvh_nodes", inner_capacity(boxes.len())), items, counts };
    let (kept, links) = link(g, boxes, &codes, &inner, options, &mut tree);
    (tree, Linked { links, kept, inner, scene })
}

fn inner_capacity(capacity: u32) -> u32 {
    capacity.max(2) - 1
}

/// The box of all; Morton codes in ascending order with the indices of their boxes.
fn sorted_codes(
    g: &mut Graph,
    count: &Buf<u32>,
    (boxes, kind): (&Buf<Aabb>, Codes),
) -> (Buf<Aabb>, Buf<u32>, Buf<u32>) {
    let capacity = boxes.len();
    let mut scene = g.buffer("lbvh_scene", 1);
    reduce::bounds(g, Items::Counted(count), boxes, &mut scene);
    let (mut codes, mut index) = (g.buffer("lbvh_codes", capacity), g.buffer("lbvh_index", capacity));
    let grid = Grid::Threads(capacity);
    match kind {
        Codes::OfSizes => {
            let bind = LbvhCodesBindings { count, boxes, scene: &scene, codes: &mut codes, index: &mut index };
            g.dispatch(LbvhCodes, grid, LbvhCodesParams { capacity }, bind);
        }
        Codes::OfPlaces => {
            let bind = LbvhPlacesBindings { count, boxes, scene: &scene, codes: &mut codes, index: &mut index };
            g.dispatch(LbvhPlaces, grid, LbvhPlacesParams { capacity }, bind);
        }
    }
    let (codes, order) = sort::pairs(g, Items::Counted(count), codes, index, CODE_BITS);
    (scene, codes, order)
}

/// Children and boxes of all inner nodes; returns which of them are not inside of a leaf, and the links to parents.
fn link(
    g: &mut Graph,
    boxes: &Buf<Aabb>,
    codes: &Buf<u32>,
    inner: &Buf<u32>,
    options: Options,
    tree: &mut Lbvh,
) -> (Buf<u32>, Buf<u32>) {
    let capacity = boxes.len();
    let mut links = g.buffer("lbvh_links", capacity + inner_capacity(capacity));
    let mut arrivals = g.buffer("lbvh_arrivals", inner_capacity(capacity));
    let mut kept = g.buffer("lbvh_kept", inner_capacity(capacity));
    let per_node = dispatch_args(g, inner, inner_capacity(capacity), LBVH_LINKS_INFO.local_size[0]);
    let per_item = dispatch_args(g, &tree.counts, capacity, LBVH_BOXES_INFO.local_size[0]);
    g.dispatch(
        LbvhLinks { leaf_items: options.leaf_items, end_flags: options.leaf_items > COUNTED_LEAF },
        Grid::Indirect(&per_node),
        LbvhLinksParams { capacity },
        LbvhLinksBindings {
            counts: &tree.counts,
            codes,
            boxes,
            items: &mut tree.items,
            nodes: &mut tree.nodes,
            links: &mut links,
            arrivals: &mut arrivals,
            kept: &mut kept,
        },
    );
    g.dispatch(
        LbvhBoxes { fences: options.fences },
        Grid::Indirect(&per_item),
        LbvhBoxesParams { capacity },
        LbvhBoxesBindings {
            counts: &tree.counts,
            boxes,
            items: &tree.items,
            links: &links,
            arrivals: &mut arrivals,
            nodes: &mut tree.nodes,
        },
    );
    (kept, links)
}

/// Replaces the nodes by those that are kept, without gaps.
fn pack(g: &mut Graph, inner: &Buf<u32>, kept: &Buf<u32>, tree: &mut Lbvh) {
    let capacity = kept.len();
    let (mut places, mut kept_count) = (g.buffer("lbvh_places", capacity), g.buffer("lbvh_kept_count", 1));
    scan::exclusive(g, Items::Counted(inner), kept, &mut places, &mut kept_count);
    let mut packed = g.buffer("lbvh_packed", capacity);
    let per_node = dispatch_args(g, inner, capacity, LBVH_PACK_INFO.local_size[0]);
    g.dispatch(
        LbvhPack,
        Grid::Indirect(&per_node),
        LbvhPackParams { capacity },
        LbvhPackBindings {
            inner,
            kept,
            places: &places,
            kept_count: &kept_count,
            nodes: &tree.nodes,
            packed: &mut packed,
            counts: &mut tree.counts,
        },
    );
    tree.nodes = packed;
}
