//! Reductions: sum, minimum and maximum of `u32`, sum of `f32`, union of boxes.
//!
//! Two dispatches of one kernel: each workgroup reduces its share, one workgroup reduces the results; 4 (24 for boxes)
//! bytes per item, up to 2^32 - 1 items. The order of combination is fixed by count and capacity, so float sums are the
//! same bits on every run and every device of one kind ([`DeviceClass`]); [`reference_f32`] repeats that order.

use super::generated::{Aabb, ReduceAabb, ReduceAabbBindings, ReduceAabbParams};
use super::generated::{ReduceF32, ReduceF32Bindings, ReduceF32Params};
use super::generated::{ReduceU32, ReduceU32Bindings, ReduceU32Params};
use super::{Items, Tiling};
use crate::graph::{Buf, DeviceClass, Graph, Grid};

/// What [`u32s`] computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Op {
    /// Sum modulo 2^32; 0 without items.
    Sum = 0,
    /// Minimum; `u32::MAX` without items.
    Min = 1,
    /// Maximum; 0 without items.
    Max = 2,
}

/// Both levels of one reduction.
macro_rules! two_levels {
    ($g:ident, $items:ident, $input:ident, $result:ident, $kernel:expr, $params:ident, $bindings:ident) => {
        $g.scope("reduce", |g| {
            assert!($result.len() >= 1, "the result needs a place");
            let tiling = Tiling::new(g.device_class(), $input.len());
            let count = $items.buffer(g, $input.len());
            let mut partial = g.buffer("reduce_partial", tiling.groups);
            let params = $params { capacity: $input.len() };
            let bind = $bindings { count: &count, source: $input, partial: &mut partial };
            g.dispatch($kernel(tiling.items), tiling.grid(), params, bind);
            let count = Items::All.buffer(g, tiling.groups);
            let params = $params { capacity: tiling.groups };
            let bind = $bindings { count: &count, source: &partial, partial: $result };
            g.dispatch($kernel(tiling.items), Grid::Groups([1, 1]), params, bind);
        })
    };
}

/// `result[0]` becomes the reduction of `input`.
///
/// # Panics
/// If `result` is empty.
pub fn u32s(g: &mut Graph, items: Items<'_>, op: Op, input: &Buf<u32>, result: &mut Buf<u32>) {
    two_levels!(
        g,
        items,
        input,
        result,
        |items| ReduceU32 { op: op as u32, items },
        ReduceU32Params,
        ReduceU32Bindings
    );
}

/// `result[0]` becomes the sum of `input`, 0 without items.
///
/// # Panics
/// If `result` is empty.
pub fn sum_f32(g: &mut Graph, items: Items<'_>, input: &Buf<f32>, result: &mut Buf<f32>) {
    two_levels!(g, items, input, result, |items| ReduceF32 { items }, ReduceF32Params, ReduceF32Bindings);
}

/// `result[0]` becomes the union of the valid boxes of `input`: `min <= max` in every axis, all finite. Without any it
/// is the empty box, `min = +inf` and `max = -inf`.
///
/// # Panics
/// If `result` is empty.
pub fn bounds(g: &mut Graph, items: Items<'_>, input: &Buf<Aabb>, result: &mut Buf<Aabb>) {
    two_levels!(g, items, input, result, |items| ReduceAabb { items }, ReduceAabbParams, ReduceAabbBindings);
}

/// The specification of [`u32s`].
pub fn reference_u32(op: Op, input: &[u32]) -> u32 {
    match op {
        Op::Sum => input.iter().fold(0, |sum, &value| sum.wrapping_add(value)),
        Op::Min => input.iter().copied().min().unwrap_or(u32::MAX),
        Op::Max => input.iter().copied().max().unwrap_or(0),
    }
}

/// The specification of [`sum_f32`], for an input buffer of `capacity` items: the order is part of it.
pub fn reference_f32(class: DeviceClass, input: &[f32], capacity: u32) -> f32 {
    let tiling = Tiling::new(class, capacity);
    let (groups, tile) = (tiling.groups as usize, tiling.items as usize * 256);
    let level = |values: &[f32], groups: usize| -> Vec<f32> {
        let tiles = values.len().div_ceil(tile);
        let share = tiles.div_ceil(groups) * tile;
        (0..groups)
            .map(|group| {
                let (first, end) = ((group * share).min(values.len()), ((group + 1) * share).min(values.len()));
                let mut lanes = [0f32; 256];
                for (i, value) in values[first..end].iter().enumerate() {
                    lanes[i % 256] += value;
                }
                let mut width = 128;
                while width > 0 {
                    (0..width).for_each(|lane| lanes[lane] += lanes[lane + width]);
                    width /= 2;
                }
                lanes[0]
            })
            .collect()
    };
    level(&level(input, groups), 1)[0]
}

/// The specification of [`bounds`].
pub fn reference_bounds(input: &[Aabb]) -> Aabb {
    let empty = Aabb { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };
    input.iter().filter(|b| is_valid(b)).fold(empty, |a, b| Aabb {
        min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
        max: std::array::from_fn(|k| a.max[k].max(b.max[k])),
    })
}

/// Whether a box holds a point and is finite.
pub fn is_valid(b: &Aabb) -> bool {
    (0..3).all(|k| b.min[k] <= b.max[k] && b.min[k] >= f32::MIN && b.max[k] <= f32::MAX)
}
