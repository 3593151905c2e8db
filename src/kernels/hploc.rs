//! H-PLOC: a tree by locally-ordered clustering along the hierarchy of Morton codes, built on the device.
//!
//! Benthin, Meister, Barczak, Mehalwal, Tsakok and Kensler 2024, "H-PLOC: Hierarchical Parallel Locally-Ordered
//! Clustering for Bounding Volume Hierarchy Construction". The radix tree over the codes (Karras 2012) says which
//! clusters meet; where more than 16 items do, clusters that are each other's nearest within 8 places are merged until
//! at most 16 are left. The paper's numbers: groups of 32, 16 kept, a radius of 8.
//!
//! Three things differ from the paper. A node is called by an item that its second cluster brought along and that no
//! cluster has any more, instead of by a counter, so the numbers do not depend on the order of execution. Equal areas
//! are paired off by place. And clusters may only grow so high: lower by one for each level of the radix tree, so that
//! the tree fits the traversal stack whatever the input; trees of scenes are far from it.
//!
//! A workgroup merges, with barriers that all of it reaches, so subgroups may have any size. No group waits for
//! another.
//! About 160 bytes per box beside the sort.

use super::Items;
use super::collapse::Binary;
use super::compact;
use super::generated::Aabb;
use super::generated::{HplocMerge, HplocMergeBindings, HplocMergeParams};
use super::generated::{HplocRanges, HplocRangesBindings, HplocRangesParams};
use super::lbvh::{self, Codes, Lbvh, Sorted};
use crate::constants::BVH_MAX_DEPTH;
use crate::constants::{HPLOC_KEPT, HPLOC_ROOT_HEIGHT};
use crate::graph::{Buf, Graph, Grid};

/// Edges on the longest path from the root to a leaf, at most: one for every halving of 16 clusters.
pub const MAX_DEPTH: u32 = HPLOC_ROOT_HEIGHT + HPLOC_KEPT.ilog2();
const _: () = assert!(MAX_DEPTH <= BVH_MAX_DEPTH);
/// At each level of the radix tree, clusters have room to be paired once.
const _: () = assert!(lbvh::MAX_DEPTH <= HPLOC_ROOT_HEIGHT);

/// Builds a tree over the valid boxes with one in each leaf. A node has the number of an item, 0 for the root.
///
/// # Panics
/// If there are more than 2^27 boxes.
pub fn binary(g: &mut Graph, boxes: &Buf<Aabb>) -> Binary {
    let capacity = boxes.len();
    g.scope("hploc", |g| {
        let Sorted { scene, codes, items, counts, .. } = lbvh::sorted(g, Items::All, (boxes, Codes::OfPlaces));
        let (mut ranges, mut parents) = (g.buffer("hploc_ranges", capacity), g.buffer("hploc_parents", capacity));
        let (mut clusters, mut cluster_boxes) =
            (g.buffer("hploc_clusters", capacity), g.buffer("hploc_boxes", capacity));
        let (mut starts, mut arrivals) = (g.buffer("hploc_starts", capacity), g.buffer("hploc_arrivals", capacity));
        g.fill(&mut arrivals, 0);
        g.dispatch(
            HplocRanges,
            Grid::Threads(capacity),
            HplocRangesParams { capacity },
            HplocRangesBindings {
                counts: &counts,
                codes: &codes,
                boxes,
                items: &items,
                ranges: &mut ranges,
                parents: &mut parents,
                starts: &mut starts,
                clusters: &mut clusters,
                cluster_boxes: &mut cluster_boxes,
            },
        );
        // A group for each start.
        let starts = compact::indices(g, Items::All, &starts, 1);
        let mut nodes = g.buffer("hploc_nodes", capacity.max(1));
        let mut links = g.buffer("hploc_links", 2 * capacity);
        g.dispatch(
            HplocMerge,
            Grid::Indirect(&starts.args),
            HplocMergeParams { capacity },
            HplocMergeBindings {
                start_count: &starts.count,
                starts: &starts.indices,
                scene: &scene,
                ranges: &ranges,
                parents: &parents,
                arrivals: &mut arrivals,
                clusters: &mut clusters,
                cluster_boxes: &mut cluster_boxes,
                nodes: &mut nodes,
                links: &mut links,
            },
        );
        Binary { tree: Lbvh { nodes, items, counts }, links, scene }
    })
}
