//! Exclusive prefix sums of `u32` that start anew at every head, modulo 2^32.
//!
//! The shape of [`super::scan`]; 20 bytes per item. In modular arithmetic a segment's sum is the difference of two
//! plain prefix sums, so a tile needs one sum scan and one maximum scan (of the places of heads) instead of a scan of
//! pairs (Sengupta, Harris, Zhang, Owens 2007, "Scan primitives for GPU computing", section 3, state the pair
//! operator).

use super::generated::{SegmentedScanApply, SegmentedScanApplyBindings, SegmentedScanApplyParams};
use super::generated::{SegmentedScanReduce, SegmentedScanReduceBindings, SegmentedScanReduceParams};
use super::generated::{SegmentedScanSpine, SegmentedScanSpineBindings, SegmentedScanSpineParams};
use super::{Items, Tiling};
use crate::graph::{Buf, DeviceClass, Graph, Grid};

/// `output[i]` becomes the sum of the items before `i` that belong to the same segment. A segment starts at item 0 and
/// wherever `heads` is not zero.
///
/// # Panics
/// If `heads` or `output` is shorter than `input`.
pub fn exclusive(g: &mut Graph, items: Items<'_>, input: &Buf<u32>, heads: &Buf<u32>, output: &mut Buf<u32>) {
    let capacity = input.len();
    assert!(heads.len() >= capacity && output.len() >= capacity, "heads and output hold as many items as the input");
    g.scope("segmented scan", |g| {
        let count = items.buffer(g, capacity);
        let groups = Tiling::new(DeviceClass::Gpu, capacity).groups;
        let mut partial = g.buffer("segmented_partial", groups);
        let mut partial_head = g.buffer("segmented_partial_head", groups);
        g.dispatch(
            SegmentedScanReduce,
            Grid::Groups([groups, 1]),
            SegmentedScanReduceParams { capacity },
            SegmentedScanReduceBindings {
                count: &count,
                source: input,
                heads,
                partial: &mut partial,
                partial_head: &mut partial_head,
            },
        );
        g.dispatch(
            SegmentedScanSpine,
            Grid::Groups([1, 1]),
            SegmentedScanSpineParams { count: groups },
            SegmentedScanSpineBindings { partial: &mut partial, partial_head: &partial_head },
        );
        g.dispatch(
            SegmentedScanApply,
            Grid::Groups([groups, 1]),
            SegmentedScanApplyParams { capacity },
            SegmentedScanApplyBindings { count: &count, source: input, heads, partial: &partial, target: output },
        );
    });
}

/// The specification of [`exclusive`].
pub fn reference(input: &[u32], heads: &[u32]) -> Vec<u32> {
    let mut sum = 0u32;
    let mut output = Vec::with_capacity(input.len());
    for (&value, &head) in input.iter().zip(heads) {
        if head != 0 {
            sum = 0;
        }
        output.push(sum);
        sum = sum.wrapping_add(value);
    }
    output
}
