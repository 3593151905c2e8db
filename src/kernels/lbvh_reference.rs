//! The specification of [`super::lbvh`], as plain recursion.

use super::generated::{Aabb, BvhNode};
use super::lbvh::{COUNTED_LEAF, END, LEAF};
use super::reduce::{is_valid, reference_bounds};
use crate::constants::{BVH_COUNT_SHIFT, MORTON_NONE};

/// A tree on the host.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Nodes in the order of the device.
    pub nodes: Vec<BvhNode>,
    /// Indices of the valid boxes in the order of the leaves.
    pub items: Vec<u32>,
    /// Boxes left out.
    pub degenerate: u32,
}

/// 30-bit code of a box: three bits of size, then the Morton code of its centre in cubic cells whose edge is a power of
/// two.
pub fn morton(b: &Aabb, scene: &Aabb) -> u32 {
    if !is_valid(b) {
        return MORTON_NONE;
    }
    let (place, exponent) = morton_place(b, scene, 9);
    let half_size = (0..3).map(|k| 0.5 * b.max[k] - 0.5 * b.min[k]).fold(0f32, f32::max);
    let class = (exponent - ((half_size.to_bits() >> 23) as i32 - 126) - 2).clamp(0, 7) as u32;
    class << 27 | place
}

/// The 30-bit Morton code of a box's centre alone, in cells half as long.
pub fn morton_of_place(b: &Aabb, scene: &Aabb) -> u32 {
    if is_valid(b) { morton_place(b, scene, 10).0 } else { MORTON_NONE }
}

/// Morton code of so many bits along each axis, and the exponent of the scene's size.
fn morton_place(b: &Aabb, scene: &Aabb, bits: i32) -> (u32, i32) {
    let longest = (0..3).map(|k| 0.5 * scene.max[k] - 0.5 * scene.min[k]).fold(0f32, f32::max);
    let exponent = ((longest.to_bits() >> 23) as i32 - 126).max(-100);
    let cells = f32::from_bits(((127 + bits - exponent) as u32) << 23);
    let axis = |k: usize| {
        let offset = (0.25 * b.min[k] + 0.25 * b.max[k]) - 0.5 * scene.min[k];
        (offset * cells).clamp(0.0, ((1 << bits) - 1) as f32) as u32
    };
    let (x, y, z) = (axis(0), axis(1), axis(2));
    let code = (0..bits).fold(0, |code, bit| {
        code | (x >> bit & 1) << (3 * bit) | (y >> bit & 1) << (3 * bit + 1) | (z >> bit & 1) << (3 * bit + 2)
    });
    (code, exponent)
}

/// The tree over the valid boxes with leaves of at most `leaf_items`.
pub fn build(boxes: &[Aabb], leaf_items: u32) -> Tree {
    build_by(morton, boxes, leaf_items)
}

/// The same in the order of other codes of a box in a scene.
pub fn build_by(code: fn(&Aabb, &Aabb) -> u32, boxes: &[Aabb], leaf_items: u32) -> Tree {
    let scene = reference_bounds(boxes);
    let mut order: Vec<(u32, u32)> = boxes.iter().zip(0..).map(|(b, i)| (code(b, &scene), i)).collect();
    order.sort_unstable();
    let valid = order.iter().filter(|(code, _)| *code != MORTON_NONE).count();
    let mut builder =
        Builder { boxes, order: &order[..valid], leaf_items, nodes: vec![None; valid.max(2) - 1], ends: vec![] };
    builder.nodes[0] = Some(node([(LEAF, reference_bounds(&[])); 2]));
    match valid {
        0 => {}
        1 => {
            builder.ends.push(0);
            builder.nodes[0] = Some(node([(LEAF, builder.bounds(0, 0)), (LEAF, reference_bounds(&[]))]));
        }
        _ => builder.inner(0, valid - 1, 0),
    }
    builder.finish((boxes.len() - valid) as u32)
}

struct Builder<'a> {
    boxes: &'a [Aabb],
    /// (code, index) in order.
    order: &'a [(u32, u32)],
    leaf_items: u32,
    /// Nodes where Karras's numbering puts them; `None` inside of a leaf.
    nodes: Vec<Option<BvhNode>>,
    /// Last items of leaves.
    ends: Vec<usize>,
}

impl Builder<'_> {
    /// Makes node `index` over the items `first..=last`, at least two.
    fn inner(&mut self, first: usize, last: usize, index: usize) {
        let key = |i: usize| u64::from(self.order[i].0) << 32 | i as u64;
        // The highest bit in which the items differ splits them.
        let bit = 63 - (key(first) ^ key(last)).leading_zeros();
        let split = (first..last).rfind(|&i| key(i) >> bit & 1 == 0).expect("the first item has the bit clear");
        let child0 = self.child(first, split, split);
        let child1 = self.child(split + 1, last, split + 1);
        self.nodes[index] = Some(node([child0, child1]));
    }

    fn child(&mut self, first: usize, last: usize, index: usize) -> (u32, Aabb) {
        let count = (last - first + 1) as u32;
        if count > self.leaf_items {
            self.inner(first, last, index);
            return (index as u32, self.bounds(first, last));
        }
        self.ends.push(last);
        let size = if self.leaf_items > COUNTED_LEAF { 0 } else { (count - 1) << BVH_COUNT_SHIFT };
        (LEAF | size | first as u32, self.bounds(first, last))
    }

    fn bounds(&self, first: usize, last: usize) -> Aabb {
        let covered: Vec<_> = self.order[first..=last].iter().map(|&(_, i)| self.boxes[i as usize]).collect();
        reference_bounds(&covered)
    }

    /// Closes the gaps between the nodes and redirects the references.
    fn finish(self, degenerate: u32) -> Tree {
        let mut place = 0;
        let places: Vec<u32> = self
            .nodes
            .iter()
            .map(|node| {
                place += u32::from(node.is_some());
                place.wrapping_sub(1)
            })
            .collect();
        let redirect = |bits: f32| match bits.to_bits() {
            leaf if leaf & LEAF != 0 => bits,
            inner => f32::from_bits(places[inner as usize]),
        };
        let mut nodes: Vec<BvhNode> = self.nodes.into_iter().flatten().collect();
        for node in &mut nodes {
            node.min0[3] = redirect(node.min0[3]);
            node.max0[3] = redirect(node.max0[3]);
        }
        let mut items: Vec<u32> = self.order.iter().map(|&(_, i)| i).collect();
        if self.leaf_items > COUNTED_LEAF {
            self.ends.iter().for_each(|&end| items[end] |= END);
        }
        Tree { nodes, items, degenerate }
    }
}

fn node([(child0, a), (child1, b)]: [(u32, Aabb); 2]) -> BvhNode {
    let with = |[x, y, z]: [f32; 3], bits: u32| [x, y, z, f32::from_bits(bits)];
    BvhNode { min0: with(a.min, child0), max0: with(a.max, child1), min1: with(b.min, 0), max1: with(b.max, 0) }
}
