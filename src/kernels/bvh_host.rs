//! Binary BVH over triangles on the host, for static scenes.
//!
//! Binned surface-area heuristic (Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007): every
//! node is split at the cheapest of `BINS - 1` planes of each axis of its centroids' box. Leaves of one to four
//! triangles by the same cost. Subtrees whose depth could exceed [`MAX_DEPTH`] are split at the median instead.
//! Deterministic: threads work on disjoint ranges and the result does not depend on their timing.
//!
//! Cost: n log n; the layout is that of glsl/shared/bvh.glsl. Triangles that no ray can hit are left out and counted.

use super::generated::{BvhNode, BvhTriangle};
pub use crate::constants::{
    BVH_ALPHA_MASKED as ALPHA_MASKED, BVH_BOUNDARY as BOUNDARY, BVH_COUNT_ONE as COUNT_ONE,
    BVH_FIRST_MASK as FIRST_MASK, BVH_LEAF as LEAF, BVH_ONE_SIDED as ONE_SIDED,
};
use crate::constants::{BVH_MAX_DEPTH, BVH_NODE_COST as NODE_COST};

/// Deepest path from the root to a leaf, in edges; the traversal stack of the kernels has room for it.
pub const MAX_DEPTH: u32 = 60;
const _: () = assert!(MAX_DEPTH <= BVH_MAX_DEPTH);
/// Largest number of triangles of one tree: what a leaf reference can address.
pub const MAX_TRIANGLES: usize = FIRST_MASK as usize;

const BINS: usize = 32;
const MAX_LEAF: usize = 4;
/// Ranges larger than this are worth a thread.
const PARALLEL_MIN: usize = 16_384;

/// A finished tree.
#[derive(Debug, Clone, Default)]
pub struct HostBvh {
    /// Inner nodes, depth first; at least one.
    pub nodes: Vec<BvhNode>,
    /// Original triangle ids in leaf order.
    pub order: Vec<u32>,
    /// Triangles left out: not finite, without area, or too small for the area to be a normal number.
    pub skipped: u32,
    /// Edges on the longest path from the root to a leaf.
    pub depth: u32,
}

/// What rides with a triangle in the tree.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TriangleTag {
    /// Bit set of flags, [`ALPHA_MASKED`], [`BOUNDARY`] and [`ONE_SIDED`].
    pub flags: u32,
    /// Index of its material.
    pub material: u32,
}

/// Axis-aligned box; inverted when empty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub min: [f32; 3],
    /// Largest corner.
    pub max: [f32; 3],
}

impl Aabb {
    /// The box of no points.
    pub const EMPTY: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// Adds a point.
    pub fn grow(&mut self, point: [f32; 3]) {
        self.merge(&Self { min: point, max: point });
    }

    /// Adds a box.
    pub fn merge(&mut self, other: &Self) {
        for axis in 0..3 {
            self.min[axis] = if other.min[axis] < self.min[axis] { other.min[axis] } else { self.min[axis] };
            self.max[axis] = if other.max[axis] > self.max[axis] { other.max[axis] } else { self.max[axis] };
        }
    }

    /// Half of the surface area; 0 when empty.
    pub fn half_area(&self) -> f32 {
        let [x, y, z] = std::array::from_fn(|axis| (self.max[axis] - self.min[axis]).max(0.0));
        x * y + (x + y) * z
    }
}

/// One triangle during the build.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    /// Sum of both corners: twice the centroid of the box.
    centre: [f32; 3],
    id: u32,
}

/// Builds the tree over `triangles`, indices into `positions`. Indices out of range count as not finite.
pub fn build_sah(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> HostBvh {
    assert!(triangles.len() <= MAX_TRIANGLES, "{} triangles do not fit into one tree", triangles.len());
    let mut items: Vec<Item> =
        triangles.iter().enumerate().filter_map(|(id, corners)| item(positions, *corners, id as u32)).collect();
    let skipped = (triangles.len() - items.len()) as u32;
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get()).next_power_of_two().ilog2();
    let mut nodes = Vec::with_capacity(items.len().max(1));
    let absent = Root { reference: LEAF, bounds: Aabb::EMPTY, depth: 0 };
    let mut root = absent;
    if !items.is_empty() {
        let budget = MAX_DEPTH - log2_ceil(items.len());
        root = build(Part { items: &mut items, first: 0, budget, threads }, &mut nodes);
    }
    if nodes.is_empty() {
        nodes.push(join(root, absent));
        root.depth = 1;
    }
    HostBvh { nodes, order: items.iter().map(|item| item.id).collect(), skipped, depth: root.depth }
}

/// The triangles of `order` as the kernels read them; `tag` gives what rides with an original triangle.
pub fn pack_triangles(
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    order: &[u32],
    tag: impl Fn(u32) -> TriangleTag,
) -> Vec<BvhTriangle> {
    let with_bits = |[x, y, z]: [f32; 3], bits: u32| [x, y, z, f32::from_bits(bits)];
    let pack = |&id: &u32| {
        let [a, b, c] = triangles[id as usize].map(|corner| positions[corner as usize]);
        let TriangleTag { flags, material } = tag(id);
        BvhTriangle { v0: with_bits(a, id), v1: with_bits(b, flags), v2: with_bits(c, material) }
    };
    order.iter().map(pack).collect()
}

/// Which triangles a ray can hit: those that a tree holds.
pub fn hittable(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<bool> {
    triangles.iter().map(|corners| item(positions, *corners, 0).is_some()).collect()
}

/// A triangle that a ray can hit. Its area decides in double precision, where the cross product of single-precision
/// corners is nearly exact: collinear corners have none, a needle has.
fn item(positions: &[[f32; 3]], corners: [u32; 3], id: u32) -> Option<Item> {
    let mut bounds = Aabb::EMPTY;
    let mut points = [[0.0f64; 3]; 3];
    for (point, corner) in points.iter_mut().zip(corners) {
        let position = *positions.get(corner as usize)?;
        if !position.iter().all(|x| x.is_finite()) {
            return None;
        }
        bounds.grow(position);
        *point = position.map(f64::from);
    }
    let [a, b, c] = points;
    let (e, f): ([f64; 3], [f64; 3]) = (std::array::from_fn(|i| b[i] - a[i]), std::array::from_fn(|i| c[i] - a[i]));
    let area = (0..3).map(|i| (e[(i + 1) % 3] * f[(i + 2) % 3] - e[(i + 2) % 3] * f[(i + 1) % 3]).abs());
    if area.fold(0.0, f64::max) < f64::from(f32::MIN_POSITIVE) {
        return None;
    }
    // Halves first: the sum of two finite corners may overflow.
    let centre = std::array::from_fn(|axis| 0.5 * bounds.min[axis] + 0.5 * bounds.max[axis]);
    Some(Item { bounds, centre, id })
}

/// Root of a finished subtree: reference and box for the parent, edges to the deepest leaf.
#[derive(Clone, Copy)]
struct Root {
    reference: u32,
    bounds: Aabb,
    depth: u32,
}

/// A run of triangles to be built: the part of the leaf order that starts at `first`.
struct Part<'a> {
    items: &'a mut [Item],
    first: usize,
    /// Levels that may still be lost to unbalanced splits; median splits alone need log2 of the count.
    budget: u32,
    /// Levels of the tree that may still start a thread.
    threads: u32,
}

/// Appends the subtree over `part` to `nodes`.
fn build(part: Part<'_>, nodes: &mut Vec<BvhNode>) -> Root {
    let Part { items, first, budget, threads } = part;
    let mut bounds = Aabb::EMPTY;
    items.iter().for_each(|item| bounds.merge(&item.bounds));
    let Some(middle) = partition(items, &bounds, budget) else {
        let reference = LEAF | ((items.len() as u32 - 1) * COUNT_ONE) | first as u32;
        return Root { reference, bounds, depth: 0 };
    };
    let node = nodes.len();
    nodes.push(BvhNode::default());
    // Levels saved by a part that is smaller than half go back into the budget.
    let levels = budget + log2_ceil(items.len());
    let (left, right) = items.split_at_mut(middle);
    let rest = |items: &[Item]| levels.saturating_sub(1 + log2_ceil(items.len()));
    let (left_budget, right_budget) = (rest(left), rest(right));
    let parallel = threads > 0 && left.len().min(right.len()) > PARALLEL_MIN;
    let threads = threads.saturating_sub(1);
    let left = Part { items: left, first, budget: left_budget, threads };
    let right = Part { items: right, first: first + middle, budget: right_budget, threads };
    let (a, b) = if parallel { build_both(left, right, nodes) } else { (build(left, nodes), build(right, nodes)) };
    // Where rays do not prefer a side (equal entry, any hit), the larger box comes first: it is hit more often.
    nodes[node] = if a.bounds.half_area() >= b.bounds.half_area() { join(a, b) } else { join(b, a) };
    Root { reference: node as u32, bounds, depth: 1 + a.depth.max(b.depth) }
}

/// Builds the right part on a thread of its own and appends its nodes to those of the left part.
fn build_both(left: Part<'_>, right: Part<'_>, nodes: &mut Vec<BvhNode>) -> (Root, Root) {
    std::thread::scope(|scope| {
        let other = scope.spawn(|| {
            let mut nodes = Vec::new();
            (build(right, &mut nodes), nodes)
        });
        let a = build(left, nodes);
        let (mut b, right_nodes) = other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        let offset = nodes.len() as u32;
        nodes.extend(right_nodes.iter().map(|node| shifted(node, offset)));
        b.reference = shifted_reference(b.reference, offset);
        (a, b)
    })
}

fn shifted_reference(reference: u32, offset: u32) -> u32 {
    if reference & LEAF == 0 { reference + offset } else { reference }
}

fn shifted(node: &BvhNode, offset: u32) -> BvhNode {
    let shift = |[x, y, z, w]: [f32; 4]| [x, y, z, f32::from_bits(shifted_reference(w.to_bits(), offset))];
    BvhNode { min0: shift(node.min0), max0: shift(node.max0), ..*node }
}

fn join(child0: Root, child1: Root) -> BvhNode {
    let with_bits = |[x, y, z]: [f32; 3], bits: u32| [x, y, z, f32::from_bits(bits)];
    BvhNode {
        min0: with_bits(child0.bounds.min, child0.reference),
        max0: with_bits(child0.bounds.max, child1.reference),
        min1: with_bits(child1.bounds.min, 0),
        max1: with_bits(child1.bounds.max, 0),
    }
}

fn log2_ceil(count: usize) -> u32 {
    count.next_power_of_two().ilog2()
}

/// Splits the items in place and returns where the second part starts; `None` where a leaf is cheaper.
fn partition(items: &mut [Item], bounds: &Aabb, budget: u32) -> Option<usize> {
    let count = items.len();
    if count == 1 {
        return None;
    }
    let mut centres = Aabb::EMPTY;
    items.iter().for_each(|item| centres.grow(item.centre));
    let split = if budget == 0 { None } else { best_split(items, &centres) };
    let leaf_cost = count as f32 * bounds.half_area();
    let split_cost = split.as_ref().map_or(f32::INFINITY, |s| s.cost + NODE_COST * bounds.half_area());
    // Not the negation of `>`: where areas overflow or vanish the smaller leaf wins.
    if count <= MAX_LEAF && leaf_cost <= split_cost {
        return None;
    }
    match split {
        Some(split) => Some(stable_partition(items, |item| split.binning.bin(item) < split.bin)),
        None => {
            median_split(items, &centres);
            Some(count / 2)
        }
    }
}

/// Half of the items by centre along the longest axis; ties by id.
fn median_split(items: &mut [Item], centres: &Aabb) {
    let axis = longest_axis(centres);
    items.select_nth_unstable_by(items.len() / 2, |a, b| {
        a.centre[axis].total_cmp(&b.centre[axis]).then(a.id.cmp(&b.id))
    });
}

fn longest_axis(bounds: &Aabb) -> usize {
    let size = |axis: usize| bounds.max[axis] - bounds.min[axis];
    (1..3).fold(0, |best, axis| if size(axis) > size(best) { axis } else { best })
}

fn stable_partition(items: &mut [Item], first_part: impl Fn(&Item) -> bool) -> usize {
    let (left, right): (Vec<Item>, Vec<Item>) = items.iter().partition(|item| first_part(item));
    items[..left.len()].copy_from_slice(&left);
    items[left.len()..].copy_from_slice(&right);
    left.len()
}

/// Maps centres to bins along one axis.
struct Binning {
    axis: usize,
    origin: f32,
    scale: f32,
}

impl Binning {
    fn bin(&self, item: &Item) -> usize {
        (((item.centre[self.axis] - self.origin) * self.scale) as usize).min(BINS - 1)
    }
}

/// A plane before bin `bin` and the cost of both sides.
struct Split {
    binning: Binning,
    bin: usize,
    cost: f32,
}

/// The cheapest plane of all axes; `None` if no plane separates the centres.
fn best_split(items: &[Item], centres: &Aabb) -> Option<Split> {
    let mut best: Option<Split> = None;
    for axis in 0..3 {
        let scale = BINS as f32 / (centres.max[axis] - centres.min[axis]);
        if !scale.is_finite() || scale <= 0.0 {
            continue; // all centres at one place, or farther apart than numbers go
        }
        let binning = Binning { axis, origin: centres.min[axis], scale };
        if let Some((bin, cost)) = cheapest_plane(items, &binning)
            && best.as_ref().is_none_or(|b| cost < b.cost)
        {
            best = Some(Split { binning, bin, cost });
        }
    }
    best
}

fn cheapest_plane(items: &[Item], binning: &Binning) -> Option<(usize, f32)> {
    let mut bins = [(Aabb::EMPTY, 0u32); BINS];
    for item in items {
        let bin = &mut bins[binning.bin(item)];
        bin.0.merge(&item.bounds);
        bin.1 += 1;
    }
    // Cost of everything from a bin on, then a sweep from the left.
    let mut right = [(0.0f32, 0u32); BINS];
    let (mut bounds, mut count) = (Aabb::EMPTY, 0);
    for bin in (1..BINS).rev() {
        bounds.merge(&bins[bin].0);
        count += bins[bin].1;
        right[bin] = (bounds.half_area() * count as f32, count);
    }
    let (mut bounds, mut count) = (Aabb::EMPTY, 0);
    let mut best: Option<(usize, f32)> = None;
    for bin in 1..BINS {
        bounds.merge(&bins[bin - 1].0);
        count += bins[bin - 1].1;
        let cost = bounds.half_area() * count as f32 + right[bin].0;
        if count > 0 && right[bin].1 > 0 && best.is_none_or(|(_, lowest)| cost < lowest) {
            best = Some((bin, cost));
        }
    }
    best
}
