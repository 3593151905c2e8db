//! Stream compaction: the indices of the items to keep, in order, with their count and the grid for the next dispatch.
//!
//! A scan of the flags whose last step writes indices instead of sums: four dispatches, 8 bytes per item read and 4 per
//! survivor written, up to 2^32 - 1 items.

use super::generated::{CompactScatter, CompactScatterBindings, CompactScatterParams};
use super::generated::{DispatchArgs as WriteArgs, DispatchArgsBindings, DispatchArgsParams};
use super::scan::partial_sums;
use super::{Items, Tiling};
use crate::constants::{GROUPS_OF_ROW, MOST_GROUPS};
use crate::graph::{Buf, DispatchArgs, Graph, Grid};

/// What [`indices`] leaves.
#[derive(Debug)]
pub struct Survivors {
    /// Indices of the kept items, ascending; as many as `count` says.
    pub indices: Buf<u32>,
    /// One word: how many.
    pub count: Buf<u32>,
    /// Groups for an indirect dispatch with one invocation per survivor.
    pub args: Buf<DispatchArgs>,
}

/// Keeps the items whose flag is not zero. `local` is the workgroup size of the kernel that will run over them.
pub fn indices(g: &mut Graph, items: Items<'_>, flags: &Buf<u32>, local: u32) -> Survivors {
    g.scope("compact", |g| {
        let mut count = g.buffer("survivor_count", 1);
        let mut survivors = g.buffer("survivors", flags.len());
        let all = items.buffer(g, flags.len());
        let tiling = Tiling::new(g.device_class(), flags.len());
        let partial = partial_sums(g, &all, flags, true, &mut count);
        g.dispatch(
            CompactScatter { items: tiling.items },
            tiling.grid(),
            CompactScatterParams { capacity: flags.len() },
            CompactScatterBindings { count: &all, flags, partial: &partial, survivors: &mut survivors },
        );
        let args = dispatch_args(g, &count, flags.len(), local);
        Survivors { indices: survivors, count, args }
    })
}

/// Group counts for an indirect dispatch with one invocation per item, `local` to a group, for the count that the GPU
/// finds in `count[0]`, at most `capacity`.
pub fn dispatch_args(g: &mut Graph, count: &Buf<u32>, capacity: u32, local: u32) -> Buf<DispatchArgs> {
    let mut args = g.buffer("dispatch_args", 1);
    g.dispatch(
        WriteArgs { local },
        Grid::Groups([1, 1]),
        DispatchArgsParams { capacity },
        DispatchArgsBindings { count, args: &mut args },
    );
    args
}

/// The specification of [`indices`].
pub fn reference(flags: &[u32]) -> Vec<u32> {
    (0..flags.len() as u32).filter(|&i| flags[i as usize] != 0).collect()
}

/// The specification of [`dispatch_args`]: one row up to 65,535 groups, then rows of 32,768.
pub fn reference_args(count: u32, local: u32) -> DispatchArgs {
    let groups = count.div_ceil(local);
    if groups <= MOST_GROUPS {
        DispatchArgs { x: groups, y: 1, z: 1 }
    } else {
        DispatchArgs { x: GROUPS_OF_ROW, y: groups.div_ceil(GROUPS_OF_ROW), z: 1 }
    }
}
