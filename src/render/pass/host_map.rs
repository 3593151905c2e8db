//! A photon map that the host builds between the two halves of a pass: photons go out, nodes and order come back.

use crate::error::Result;
use crate::graph::{Graph, Persistent, Readback, Runtime};
use crate::kernels::deposits::Deposits;
use crate::kernels::generated::{Aabb, BvhNode, Photon};
use crate::kernels::lbvh::Lbvh;
use crate::kernels::photon::{self, PhotonMap};
use crate::kernels::records::{self, Record};
use crate::kernels::vvh;
use crate::render::scene::memory::Memory;

/// What both halves share.
pub struct HostMap {
    photons: Persistent<Photon>,
    count: Persistent<u32>,
    nodes: Persistent<BvhNode>,
    items: Persistent<u32>,
    counts: Persistent<u32>,
}

impl HostMap {
    /// Memory for `capacity` photons.
    ///
    /// # Errors
    /// [`crate::error::Error::OutOfMemory`] where it does not fit.
    pub fn new(memory: Memory<'_>, capacity: u32) -> Result<Self> {
        Ok(Self {
            photons: memory.zeroed("stored_photons", capacity)?,
            count: memory.zeroed("stored_count", 1)?,
            nodes: memory.zeroed("host_nodes", capacity.max(2) - 1)?,
            items: memory.zeroed("host_items", capacity)?,
            counts: memory.zeroed("host_counts", 3)?,
        })
    }

    /// The end of the first half: keeps the photons and brings their boxes, or those of their records, to the host.
    pub fn store(&self, g: &mut Graph, deposits: &mut Deposits, packed: bool) -> Readback<Aabb> {
        let (mut photons, mut count) = (g.import(&self.photons), g.import(&self.count));
        g.copy(&deposits.photons, &mut photons);
        g.copy(&deposits.count, &mut count);
        g.keep(&photons);
        g.keep(&count);
        if packed {
            records::pack(g, deposits, Record::Packed20);
        }
        g.readback(&deposits.boxes)
    }

    /// Between the halves: builds the tree over `boxes` with leaves of at most `leaf_items`.
    ///
    /// # Errors
    /// Those of the device.
    pub fn build(&self, runtime: &Runtime, boxes: &[Aabb], leaf_items: u32) -> Result<()> {
        let tree = vvh::build(boxes, leaf_items);
        runtime.overwrite(&self.nodes, &tree.nodes)?;
        runtime.overwrite(&self.items, &tree.items)?;
        let counts = [tree.items.len() as u32, tree.degenerate, tree.nodes.len() as u32];
        runtime.overwrite(&self.counts, &counts)
    }

    /// The start of the second half: the photons as they were stored, and in the order of the tree's leaves.
    pub fn map(&self, g: &mut Graph, packed: bool) -> (Deposits, PhotonMap) {
        let tree = Lbvh { nodes: g.import(&self.nodes), items: g.import(&self.items), counts: g.import(&self.counts) };
        let mut deposits = Deposits {
            photons: g.import(&self.photons),
            boxes: g.buffer("deposit_boxes", self.photons.len()),
            count: g.import(&self.count),
            ..Deposits::new(g, 1)
        };
        let record = if packed { Record::Packed20 } else { Record::Full };
        let records = records::pack(g, &mut deposits, record);
        let map = photon::in_order(g, &deposits, tree, records.as_ref());
        (deposits, map)
    }

    /// Size in bytes.
    pub fn bytes(&self) -> u64 {
        self.photons.bytes() + self.count.bytes() + self.nodes.bytes() + self.items.bytes() + self.counts.bytes()
    }
}
