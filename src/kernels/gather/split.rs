//! Hits at their pixel's place in space, and hits seen by way of mirrors and glass.

use super::Points;
use crate::graph::{Buf, Graph, Grid};
use crate::kernels::Items;
use crate::kernels::eye::SlotList;
use crate::kernels::generated::{GatherSplit, GatherSplitBindings};

/// A list of slots with hits.
pub struct Listed {
    list: SlotList,
}

impl Listed {
    /// The hits of this list, which was split from `all`.
    pub fn points<'a>(&'a self, all: Points<'a>) -> Points<'a> {
        all.part(&self.list)
    }
}

/// Splits the points into those that lie at their pixel's place in space and those that are seen by way of mirrors or
/// glass; each list in the order of `points`. The former are all in the first slot of their pixel.
pub fn split(g: &mut Graph, points: Points<'_>) -> (Listed, Listed) {
    let most = points.list.len();
    let (mut straight, mut bent) = (g.buffer("straight", most), g.buffer("bent", most));
    let bind = GatherSplitBindings {
        list: points.list,
        count: points.count,
        eye_hits: points.hits,
        straight: &mut straight,
        bent: &mut bent,
    };
    g.dispatch(GatherSplit, Grid::Indirect(points.args), (), bind);
    let mut select =
        |flags: &Buf<u32>| Listed { list: SlotList::select(g, Items::Counted(points.count), flags, points.list, most) };
    (select(&straight), select(&bent))
}
