//! The specification of [`super::hploc`], as plain recursion.

use super::generated::{Aabb, BvhNode, Cluster};
use super::lbvh_reference::morton_of_place;
use super::reduce::reference_bounds;
use super::refit::{tree_area, tree_unit};
use crate::constants::{BVH_LEAF, HPLOC_GROUP, HPLOC_KEPT, HPLOC_RADIUS, HPLOC_ROOT_HEIGHT, MORTON_NONE};

/// The nodes of the binary tree over the valid boxes, with `None` where no node is, and the boxes' indices in the order
/// of their codes.
pub fn binary(boxes: &[Aabb]) -> (Vec<Option<BvhNode>>, Vec<u32>) {
    let scene = reference_bounds(boxes);
    let mut order: Vec<(u32, u32)> = boxes.iter().zip(0..).map(|(b, i)| (morton_of_place(b, &scene), i)).collect();
    order.sort_unstable();
    order.retain(|(code, _)| *code != MORTON_NONE);
    let mut builder = Builder { boxes, order: &order, unit: tree_unit(&scene), nodes: vec![None; order.len()] };
    if order.len() >= 2 {
        builder.root();
    }
    (builder.nodes, order.iter().map(|(_, i)| *i).collect())
}

/// Clusters in the order of the list, with their boxes.
type List = Vec<(Cluster, Aabb)>;

struct Builder<'a> {
    boxes: &'a [Aabb],
    /// (code, index) in order.
    order: &'a [(u32, u32)],
    unit: f32,
    nodes: Vec<Option<BvhNode>>,
}

impl Builder<'_> {
    fn root(&mut self) {
        let mut list = self.children(0, self.order.len() - 1, 0);
        let (mut kept, mut most) = (HPLOC_KEPT, HPLOC_ROOT_HEIGHT);
        while kept > 0 {
            self.reduce(&mut list, kept, most, true);
            (kept, most) = (kept / 2, most + 1);
        }
    }

    /// The clusters that the items `first..=last` hand up, from a node at this depth.
    fn clusters(&mut self, first: usize, last: usize, depth: u32) -> List {
        if last - first < HPLOC_KEPT as usize {
            let item = |k: usize| {
                let cluster = Cluster { reference: BVH_LEAF | k as u32, label: k as u32, height: 0 };
                (cluster, self.boxes[self.order[k].1 as usize])
            };
            return (first..=last).map(item).collect();
        }
        let mut list = self.children(first, last, depth);
        self.reduce(&mut list, HPLOC_KEPT, HPLOC_ROOT_HEIGHT - depth, false);
        list
    }

    /// The clusters of both children of a node.
    fn children(&mut self, first: usize, last: usize, depth: u32) -> List {
        let key = |i: usize| u64::from(self.order[i].0) << 32 | i as u64;
        // The highest bit in which the items differ splits them.
        let bit = 63 - (key(first) ^ key(last)).leading_zeros();
        let split = (first..last).rfind(|&i| key(i) >> bit & 1 == 0).expect("the first item has the bit clear");
        let mut list = self.clusters(first, split, depth + 1);
        list.extend(self.clusters(split + 1, last, depth + 1));
        list
    }

    /// Merges until at most `kept` clusters are left, none higher than `most`.
    fn reduce(&mut self, list: &mut List, kept: u32, most: u32, root: bool) {
        let mut radius = HPLOC_RADIUS;
        while list.len() > kept as usize {
            let merged = self.merge(list, radius, most, root);
            radius = if merged { HPLOC_RADIUS } else { HPLOC_GROUP };
        }
    }

    /// Merges all pairs of clusters that are each other's nearest; false if there is none.
    fn merge(&mut self, list: &mut List, radius: u32, most: u32, root: bool) -> bool {
        let nearest: Vec<_> = (0..list.len()).map(|i| self.nearest(list, i, radius as usize, most)).collect();
        let last = list.len() == 2;
        let mut left = List::new();
        for (i, &(mut cluster, mut around)) in list.iter().enumerate() {
            let mutual = nearest[i].filter(|&j| nearest[j] == Some(i));
            if mutual.is_some_and(|j| j < i) {
                continue;
            }
            if let Some(j) = mutual {
                let other = list[j];
                let index = if root && last { 0 } else { other.0.label };
                self.nodes[index as usize] = Some(self.node((cluster, around), other));
                let height = cluster.height.max(other.0.height) + 1;
                cluster = Cluster { reference: index, label: cluster.label, height };
                around = reference_bounds(&[around, other.1]);
            }
            left.push((cluster, around));
        }
        let merged = left.len() < list.len();
        *list = left;
        merged
    }

    /// The neighbour with the smallest box around both; ties as the kernel says.
    fn nearest(&self, list: &List, i: usize, radius: usize, most: u32) -> Option<usize> {
        let near = list.len().min(i + radius + 1);
        let allowed = |j: &usize| *j != i && list[i].0.height.max(list[*j].0.height) < most;
        let key = |j: &usize| {
            let (first, distance) = (i.min(*j), i.abs_diff(*j));
            let area = tree_area(&reference_bounds(&[list[i].1, list[*j].1]), self.unit);
            (area, distance, first % 2, first)
        };
        let order = |a: &usize, b: &usize| key(a).partial_cmp(&key(b)).expect("areas are numbers");
        (i.saturating_sub(radius)..near).filter(allowed).min_by(order)
    }

    fn node(&self, a: (Cluster, Aabb), b: (Cluster, Aabb)) -> BvhNode {
        let swapped = tree_area(&a.1, self.unit) < tree_area(&b.1, self.unit);
        let ((child0, a), (child1, b)) = if swapped { (b, a) } else { (a, b) };
        let with = |[x, y, z]: [f32; 3], bits: u32| [x, y, z, f32::from_bits(bits)];
        BvhNode {
            min0: with(a.min, child0.reference),
            max0: with(a.max, child1.reference),
            min1: with(b.min, 0),
            max1: with(b.max, 0),
        }
    }
}
