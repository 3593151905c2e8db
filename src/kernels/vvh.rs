//! Photon BVH by the voxel volume heuristic, on the host: the slow and good builder beside [`super::lbvh`].
//!
//! Fabianowski and Dingliana 2009, section 5.1, after Wald, Guenther and Slusallek 2004, "Balancing considered
//! harmful": a point meets a node with a probability proportional to the node's volume, so every node is split where `C
//! = V_L N_L + V_R N_R` (eq. 14) is least. A plane is swept over the centres along each axis, which tries every split
//! of the three sorted orders. Nodes of at most `leaf_items` boxes are leaves: by the paper, stopping earlier by cost
//! (section 5.3) only makes queries slower.
//!
//! Where volumes say nothing: a node whose box is flat is split by area, one that is a line by length. Splits of equal
//! cost are decided by balance, then by axis, then by position, so boxes that are all equal give a balanced tree and
//! the result is the same on every machine. Splits that could lead below [`MAX_DEPTH`] nodes are not considered.
//!
//! Time: n log n for the three sorts, which are kept through all splits, and n for each level of the tree.

use super::generated::{Aabb, BvhNode};
use super::lbvh::{COUNTED_LEAF, LEAF, MAX_DEPTH};
use super::lbvh_reference::Tree;
use super::reduce::{is_valid, reference_bounds};
use crate::constants::BVH_COUNT_SHIFT;

/// Most boxes of one tree: what a leaf reference can address.
pub const MOST_BOXES: usize = 1 << 27;

/// The tree over the valid boxes (`min <= max`, finite) with leaves of at most `leaf_items`. Others are left out and
/// counted. The layout is that of [`super::lbvh::build`]: nodes depth first, leaves in the order of their items.
///
/// # Panics
/// If `leaf_items` is 0 or over [`COUNTED_LEAF`], or there are more than [`MOST_BOXES`].
pub fn build(boxes: &[Aabb], leaf_items: u32) -> Tree {
    assert!((1..=COUNTED_LEAF).contains(&leaf_items), "leaves of {leaf_items} boxes");
    assert!(boxes.len() <= MOST_BOXES, "{} boxes do not fit into one tree", boxes.len());
    let valid: Vec<u32> = boxes.iter().zip(0..).filter(|(b, _)| is_valid(b)).map(|(_, i)| i).collect();
    let count = valid.len();
    let mut builder = Builder {
        boxes,
        orders: [0, 1, 2].map(|axis| sorted(boxes, &valid, axis)),
        left: vec![0.0; count],
        goes_left: vec![false; boxes.len()],
        spare: Vec::with_capacity(count),
        leaf_items: leaf_items as usize,
        nodes: Vec::with_capacity(2 * count / leaf_items as usize + 1),
    };
    let bounds = reference_bounds(boxes);
    if count <= leaf_items as usize {
        let reference = if count == 0 { LEAF } else { leaf(0, count) };
        builder.nodes.push(join([(reference, bounds), (LEAF, EMPTY)]));
    } else {
        builder.inner(Part { first: 0, count, bounds, levels: MAX_DEPTH });
    }
    let [items, ..] = builder.orders;
    Tree { nodes: builder.nodes, items, degenerate: (boxes.len() - count) as u32 }
}

/// What a query meets on average, at points that are uniform in the root's box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// Inner nodes visited, the root included.
    pub nodes: f64,
    /// Photons tested.
    pub photons: f64,
}

/// Volumes of the nodes, and of the leaves times their counts, over the volume of the root; NaN if that is 0.
pub fn expected_work(tree: &Tree) -> Work {
    let volume = |b: &Aabb| Measure::Volume.of(b);
    let [(_, a), (_, b)] = children(&tree.nodes[0]);
    let root = volume(&union(&a, &b));
    let mut work = Work { nodes: root, photons: 0.0 };
    for (reference, bounds) in tree.nodes.iter().flat_map(children) {
        if reference & LEAF == 0 {
            work.nodes += volume(&bounds);
        } else if bounds.min[0] <= bounds.max[0] {
            work.photons += f64::from((reference >> 27 & 15) + 1) * volume(&bounds);
        }
    }
    Work { nodes: work.nodes / root, photons: work.photons / root }
}

/// References and boxes of a node's children.
pub fn children(node: &BvhNode) -> [(u32, Aabb); 2] {
    let corner = |v: [f32; 4]| [v[0], v[1], v[2]];
    [
        (node.min0[3].to_bits(), Aabb { min: corner(node.min0), max: corner(node.max0) }),
        (node.max0[3].to_bits(), Aabb { min: corner(node.min1), max: corner(node.max1) }),
    ]
}

const EMPTY: Aabb = Aabb { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

fn union(a: &Aabb, b: &Aabb) -> Aabb {
    let (least, most) = (|x: f32, y: f32| if y < x { y } else { x }, |x: f32, y: f32| if y > x { y } else { x });
    Aabb {
        min: std::array::from_fn(|k| least(a.min[k], b.min[k])),
        max: std::array::from_fn(|k| most(a.max[k], b.max[k])),
    }
}

fn leaf(first: usize, count: usize) -> u32 {
    LEAF | (count as u32 - 1) << BVH_COUNT_SHIFT | first as u32
}

fn join([(child0, a), (child1, b)]: [(u32, Aabb); 2]) -> BvhNode {
    let with = |[x, y, z]: [f32; 3], bits: u32| [x, y, z, f32::from_bits(bits)];
    BvhNode { min0: with(a.min, child0), max0: with(a.max, child1), min1: with(b.min, 0), max1: with(b.max, 0) }
}

/// The boxes `chosen` by their centres along `axis`, then by index.
fn sorted(boxes: &[Aabb], chosen: &[u32], axis: usize) -> Vec<u32> {
    let key = |index: u32| {
        let b = &boxes[index as usize];
        // Halves first: the sum of two finite corners may overflow. Adding zero makes -0 and 0 one place.
        let bits = (0.5 * b.min[axis] + 0.5 * b.max[axis] + 0.0).to_bits();
        let ascending = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
        u64::from(ascending) << 32 | u64::from(index)
    };
    let mut keys: Vec<u64> = chosen.iter().map(|&index| key(index)).collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}

/// What stands for the probability that a point is in a box.
#[derive(Debug, Clone, Copy)]
enum Measure {
    Volume,
    Area,
    Length,
}

impl Measure {
    /// The one that tells the parts of a node apart.
    fn within(bounds: &Aabb) -> Self {
        match (0..3).filter(|&k| bounds.max[k] > bounds.min[k]).count() {
            3 => Self::Volume,
            2 => Self::Area,
            _ => Self::Length,
        }
    }

    /// Rounded down to 24 bits, so that its products with counts, and their sums, are exact: equal boxes cost the same
    /// however they are split, and balance decides. Double precision has room for the products of any extents.
    fn of(self, b: &Aabb) -> f64 {
        let [x, y, z] = std::array::from_fn(|k| f64::from(b.max[k]) - f64::from(b.min[k]));
        let size = match self {
            Self::Volume => x * y * z,
            Self::Area => x * y + y * z + z * x,
            Self::Length => x + y + z,
        };
        f64::from_bits(size.to_bits() & !((1 << 29) - 1))
    }
}

/// A node to be made over the items `first..first + count` of all three orders.
#[derive(Clone, Copy)]
struct Part {
    first: usize,
    count: usize,
    bounds: Aabb,
    /// Nodes that a path from here may still have, this one included.
    levels: u32,
}

/// The first `count` items of the order along `axis` go left.
#[derive(Clone, Copy)]
struct Split {
    axis: usize,
    count: usize,
    cost: f64,
    imbalance: usize,
}

struct Builder<'a> {
    boxes: &'a [Aabb],
    /// The items by their centres along each axis; every node has the same range in all of them.
    orders: [Vec<u32>; 3],
    /// Cost of the left part, by position.
    left: Vec<f64>,
    /// By box.
    goes_left: Vec<bool>,
    spare: Vec<u32>,
    leaf_items: usize,
    nodes: Vec<BvhNode>,
}

impl Builder<'_> {
    /// Makes the subtree of a part with more items than a leaf holds; returns its index.
    fn inner(&mut self, part: Part) -> u32 {
        let split = self.best_split(&part);
        let [left, right] = self.divide(&part, &split);
        let node = self.nodes.len();
        self.nodes.push(BvhNode::default());
        let children = [left, right].map(|child| {
            let reference =
                if child.count <= self.leaf_items { leaf(child.first, child.count) } else { self.inner(child) };
            (reference, child.bounds)
        });
        self.nodes[node] = join(children);
        node as u32
    }

    /// Most items that a child may have so that halving it still ends in time.
    fn largest_child(&self, part: &Part) -> usize {
        let levels = part.levels - 1;
        if levels >= 32 { part.count - 1 } else { (self.leaf_items << levels).min(part.count - 1) }
    }

    fn best_split(&mut self, part: &Part) -> Split {
        let measure = Measure::within(&part.bounds);
        let largest = self.largest_child(part);
        let mut best: Option<Split> = None;
        for axis in 0..3 {
            let split = self.sweep(part, axis, measure, largest);
            if best.is_none_or(|b| is_better(&split, &b)) {
                best = Some(split);
            }
        }
        best.expect("three axes were tried")
    }

    /// The cheapest split of one order with at most `largest` items on either side.
    fn sweep(&mut self, part: &Part, axis: usize, measure: Measure, largest: usize) -> Split {
        let count = part.count;
        let order = &self.orders[axis][part.first..part.first + count];
        let left = &mut self.left[..count];
        let mut bounds = EMPTY;
        for (i, &item) in order[..largest].iter().enumerate() {
            bounds = union(&bounds, &self.boxes[item as usize]);
            left[i] = measure.of(&bounds) * (i + 1) as f64;
        }
        let mut best = Split { axis, count: 0, cost: f64::INFINITY, imbalance: usize::MAX };
        let mut bounds = EMPTY;
        for i in (count - largest..count).rev() {
            bounds = union(&bounds, &self.boxes[order[i] as usize]);
            // Items before i go left. Too many of them: their cost was not swept.
            if i > largest {
                continue;
            }
            let cost = left[i - 1] + measure.of(&bounds) * (count - i) as f64;
            let split = Split { axis, count: i, cost, imbalance: (2 * i).abs_diff(count) };
            if is_better(&split, &best) {
                best = split;
            }
        }
        best
    }

    /// Moves the items of the left part before those of the right one, in all orders.
    fn divide(&mut self, part: &Part, split: &Split) -> [Part; 2] {
        let range = part.first..part.first + part.count;
        let (mut bounds, middle) = ([EMPTY; 2], part.first + split.count);
        for (i, &item) in self.orders[split.axis][range.clone()].iter().enumerate() {
            let is_left = i < split.count;
            self.goes_left[item as usize] = is_left;
            let side = &mut bounds[usize::from(!is_left)];
            *side = union(side, &self.boxes[item as usize]);
        }
        for axis in (0..3).filter(|&axis| axis != split.axis) {
            let order = &mut self.orders[axis][range.clone()];
            self.spare.clear();
            let mut kept = 0;
            for i in 0..order.len() {
                let item = order[i];
                if self.goes_left[item as usize] {
                    order[kept] = item;
                    kept += 1;
                } else {
                    self.spare.push(item);
                }
            }
            order[kept..].copy_from_slice(&self.spare);
        }
        let levels = part.levels - 1;
        [
            Part { first: part.first, count: split.count, bounds: bounds[0], levels },
            Part { first: middle, count: part.count - split.count, bounds: bounds[1], levels },
        ]
    }
}

/// Strictly better: of equals the one that was found first is kept.
fn is_better(a: &Split, b: &Split) -> bool {
    a.cost < b.cost || (a.cost == b.cost && a.imbalance < b.imbalance)
}
