//! Exclusive prefix sum of `u32`, modulo 2^32.
//!
//! Reduce, then scan: each workgroup sums its share of the tiles, one workgroup scans the sums, each workgroup scans
//! its share from there. No workgroup waits for another one (lavapipe cannot, and Vulkan promises no progress between
//! them). Three dispatches and 12 bytes per item, whatever the count: shares grow instead of levels, so the recursion
//! of the textbook (Blelloch 1990, "Prefix sums and their applications") stays at depth one up to 2^32 - 1 items.

use super::generated::{ScanApply, ScanApplyBindings, ScanApplyParams};
use super::generated::{ScanReduce, ScanReduceBindings, ScanReduceParams};
use super::generated::{ScanSpine, ScanSpineBindings, ScanSpineParams};
use super::{Items, Tiling};
use crate::graph::{Buf, Graph, Grid};

/// `output[i]` becomes the sum of `input[..i]`; `total[0]` the sum of all. Items beyond the count stay as they are.
///
/// # Panics
/// If `output` is shorter than `input`, or `total` is empty.
pub fn exclusive(g: &mut Graph, items: Items<'_>, input: &Buf<u32>, output: &mut Buf<u32>, total: &mut Buf<u32>) {
    assert!(output.len() >= input.len(), "the output holds {} of {} items", output.len(), input.len());
    g.scope("scan", |g| {
        let count = items.buffer(g, input.len());
        let tiling = Tiling::new(g.device_class(), input.len());
        let partial = partial_sums(g, &count, input, false, total);
        g.dispatch(
            ScanApply { items: tiling.items },
            tiling.grid(),
            ScanApplyParams { capacity: input.len() },
            ScanApplyBindings { count: &count, source: input, partial: &partial, target: output },
        );
    });
}

/// For each workgroup of [`Tiling`] the sum of all shares before its own; `nonzero` counts instead of summing.
pub(super) fn partial_sums(
    g: &mut Graph,
    count: &Buf<u32>,
    input: &Buf<u32>,
    nonzero: bool,
    total: &mut Buf<u32>,
) -> Buf<u32> {
    assert!(total.len() >= 1, "the total needs a place");
    let tiling = Tiling::new(g.device_class(), input.len());
    let mut partial = g.buffer("scan_partial", tiling.groups);
    g.dispatch(
        ScanReduce { nonzero, items: tiling.items },
        tiling.grid(),
        ScanReduceParams { capacity: input.len() },
        ScanReduceBindings { count, source: input, partial: &mut partial },
    );
    g.dispatch(
        ScanSpine,
        Grid::Groups([1, 1]),
        ScanSpineParams { count: tiling.groups },
        ScanSpineBindings { partial: &mut partial, total },
    );
    partial
}

/// The specification of [`exclusive`]: the prefix sums and the total.
pub fn reference(input: &[u32]) -> (Vec<u32>, u32) {
    let mut sum = 0u32;
    let mut output = Vec::with_capacity(input.len());
    for &value in input {
        output.push(sum);
        sum = sum.wrapping_add(value);
    }
    (output, sum)
}
