//! One file per algorithm: graph functions over the generated kernels, with their CPU references and tests.

pub mod bvh_host;
pub mod collapse;
pub mod compact;
pub mod deposits;
pub mod differentials;
pub mod energy;
pub mod eye;
pub mod film;
pub mod gather;
#[allow(clippy::all)]
pub mod generated;
pub mod hploc;
pub mod hploc_reference;
pub mod lbvh;
pub mod lbvh_reference;
pub mod light;
pub mod lobes;
pub mod maps;
pub mod maps_reference;
pub mod path;
pub mod photon;
pub mod records;
pub mod reduce;
pub mod refit;
pub mod scan;
pub mod scene_data;
pub mod segmented_scan;
pub mod sort;
pub mod trace;
pub mod triangles;
pub mod vvh;

use crate::graph::{Buf, DeviceClass, Graph, Grid, ReadBuf};

/// How many items of its buffers an algorithm works on.
#[derive(Clone, Copy)]
pub enum Items<'a> {
    /// All that the first input buffer holds.
    All,
    /// As many as the first word of this buffer says when the pass runs, at most what the first input buffer holds.
    Counted(&'a Buf<u32>),
}

/// The buffer from which kernels read their item count.
pub(crate) enum CountBuffer<'a> {
    Constant(ReadBuf<u32>),
    Given(&'a Buf<u32>),
}

impl<'a> Items<'a> {
    /// The count as a buffer, for kernels that serve both cases.
    pub(crate) fn buffer(self, g: &mut Graph, capacity: u32) -> CountBuffer<'a> {
        match self {
            Items::All => CountBuffer::Constant(g.upload("item_count", &[capacity])),
            Items::Counted(count) => CountBuffer::Given(count),
        }
    }
}

impl std::ops::Deref for CountBuffer<'_> {
    type Target = Buf<u32>;
    fn deref(&self) -> &Buf<u32> {
        match self {
            Self::Constant(count) => count,
            Self::Given(count) => count,
        }
    }
}

/// How the scans and reductions cut their items (glsl/lib/scan.glsl).
#[derive(Clone, Copy)]
pub(crate) struct Tiling {
    /// Consecutive items of an invocation.
    pub items: u32,
    /// Workgroups, each with a share of whole tiles.
    pub groups: u32,
}

impl Tiling {
    /// Workgroups that share `capacity` items. More than 1024 would not be faster on any device, and their partial
    /// results then fit one tile, so that no algorithm here needs recursion.
    pub fn new(class: DeviceClass, capacity: u32) -> Self {
        let (items, most) = match class {
            DeviceClass::Cpu => (64, 64),
            DeviceClass::Gpu => (8, 1024),
        };
        Self { items, groups: capacity.div_ceil(generated::SCAN_REDUCE_INFO.local_size[0] * items).clamp(1, most) }
    }

    /// The grid.
    pub fn grid(&self) -> Grid<'static> {
        Grid::Groups([self.groups, 1])
    }
}
