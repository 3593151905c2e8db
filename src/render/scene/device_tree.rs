//! The tree of a scene whose triangles move, built and refitted on the device.
//!
//! The host keeps a copy of every tree: it traces the few rays of the view and of the guide in it. Scenes that share
//! their buffers (the methods that take turns) may each bring a tree of their own; they notice, and send theirs again.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::host::Host;
use crate::error::Result;
use crate::graph::{DeviceClass, Graph, Persistent, Runtime};
use crate::kernels::bvh_host::{HostBvh, hittable};
use crate::kernels::generated::{BvhNode, BvhTriangle};
use crate::kernels::triangles::{self, Builder, Leaves, Mesh};
use crate::kernels::{lbvh::Lbvh, refit};
use crate::render::settings::TreeBuild;
use crate::scene::{InstanceId, Scene};

/// Fewer triangles than this are sorted by the host before a device has been told what to do.
const FEWEST: u32 = 4096;

/// Who makes new trees where trees are refitted on the device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Maker {
    Device(Builder),
    /// The host, by the surface-area heuristic: as fast as clustering on a software device, and better.
    Host,
}

/// Who makes the tree of a world that is new, or that was moved, if the device has a part in it.
pub(super) fn maker(build: TreeBuild, new: bool, triangles: u32, class: DeviceClass) -> Option<Maker> {
    match build {
        TreeBuild::Lbvh if triangles > 0 => Some(Maker::Device(Builder::Lbvh)),
        TreeBuild::Hploc if triangles > 0 => Some(Maker::Device(Builder::Hploc)),
        TreeBuild::Auto if !new && triangles >= FEWEST => Some(match class {
            DeviceClass::Cpu => Maker::Host,
            DeviceClass::Gpu => Maker::Device(Builder::Hploc),
        }),
        _ => None,
    }
}

/// Counts the changes of the tree in buffers that several scenes may share.
#[derive(Debug, Clone, Default)]
pub(super) struct TreeUpdates(Arc<AtomicU64>);

impl TreeUpdates {
    /// The number of an update that begins.
    pub fn next(&self) -> u64 {
        self.0.fetch_add(1, Ordering::Relaxed)
    }
}

/// Triangles on the device, and what the tree over them has beside its nodes.
#[derive(Clone)]
pub(super) struct DeviceTree {
    positions: Persistent<[f32; 3]>,
    corners: Persistent<[u32; 3]>,
    tags: Persistent<[u32; 2]>,
    items: Persistent<u32>,
    counts: Persistent<u32>,
    /// Surface-area cost of the tree when it was built.
    built_cost: f32,
    fences: bool,
    /// The update of [`TreeUpdates`] that brought the tree of this host.
    known: Option<u64>,
}

/// The buffers that rays read.
type Target<'a> = (&'a Persistent<BvhNode>, &'a Persistent<BvhTriangle>);

impl DeviceTree {
    /// The triangles of a world; the tree, if there is one over them, is sent when it is refitted.
    pub fn new(runtime: &Runtime, scene: &Scene, host: &Host, fences: bool) -> Result<Self> {
        let count = host.world.triangles.len() as u32;
        let tags = triangles::tags((0..count).map(|id| host.tag(scene, id)));
        Ok(Self {
            positions: runtime.persistent_from("tree_positions", &host.world.positions)?,
            corners: runtime.persistent_from("tree_corners", &host.world.triangles)?,
            tags: runtime.persistent_from("tree_tags", &tags)?,
            items: runtime.persistent("tree_items", count)?,
            counts: runtime.persistent("tree_counts", 3)?,
            built_cost: refit::host_cost(&host.tree.bvh.nodes, host.tree.bvh.order.len() as u32),
            fences,
            known: None,
        })
    }

    /// Brings the tree up to date, by update number `update` of the buffers: refits the tree of `host` where some
    /// instances have `moved` and it stays good; makes a new one otherwise. Returns the tree, which is on the device;
    /// `None` if the host is to make it. `host` has the world as it is now and the tree as it was.
    ///
    /// # Errors
    /// Those of the device.
    pub fn update(
        &mut self,
        (runtime, maker, update): (&Runtime, Maker, u64),
        host: &Host,
        moved: Option<&[InstanceId]>,
        target: Target<'_>,
    ) -> Result<Option<HostBvh>> {
        let is_theirs = self.known.is_none_or(|known| known + 1 != update);
        self.send_triangles(runtime, host, moved.filter(|_| !is_theirs))?;
        // A tree holds what could be hit when it was built.
        let same = moved.is_some() && hittable(&host.world.positions, &host.world.triangles) == host.tree.kept;
        let mut refitted = None;
        if same {
            if is_theirs {
                self.send_tree(runtime, host, target)?;
            }
            let (tree, cost) = self.run(runtime, None, target)?;
            refitted = Some(tree).filter(|_| !refit::asks_for_rebuild(self.built_cost, cost));
        }
        self.known = Some(update);
        match (refitted, maker) {
            (None, Maker::Host) => Ok(None),
            (None, Maker::Device(builder)) => {
                let (tree, cost) = self.run(runtime, Some(builder), target)?;
                self.built_cost = cost;
                Ok(Some(tree))
            }
            (refitted, _) => Ok(refitted),
        }
    }

    /// The triangles that moved, or all.
    fn send_triangles(&self, runtime: &Runtime, host: &Host, moved: Option<&[InstanceId]>) -> Result<()> {
        let world = &host.world;
        let Some(moved) = moved else {
            runtime.overwrite(&self.positions, &world.positions)?;
            return runtime.overwrite(&self.corners, &world.triangles);
        };
        for id in moved {
            let part = &world.parts[id.index()];
            let (vertices, triangles) = (part.vertices.clone(), part.triangles.clone());
            let positions = &world.positions[vertices.start as usize..vertices.end as usize];
            let corners = &world.triangles[triangles.start as usize..triangles.end as usize];
            runtime.overwrite_from(&self.positions, vertices.start, positions)?;
            runtime.overwrite_from(&self.corners, triangles.start, corners)?;
        }
        Ok(())
    }

    /// The tree as this host has it.
    fn send_tree(&self, runtime: &Runtime, host: &Host, (nodes, _): Target<'_>) -> Result<()> {
        let HostBvh { nodes: known, order, skipped, .. } = &host.tree.bvh;
        runtime.overwrite(nodes, known)?;
        runtime.overwrite(&self.items, order)?;
        runtime.overwrite(&self.counts, &[order.len() as u32, *skipped, known.len() as u32])
    }

    /// Builds, or refits if there is no builder; returns the tree and its cost.
    fn run(&self, runtime: &Runtime, builder: Option<Builder>, target: Target<'_>) -> Result<(HostBvh, f32)> {
        let mut g = Graph::new().with_device_class(runtime.device().info().kind.into());
        let (positions, corners) = (g.import_read(&self.positions), g.import_read(&self.corners));
        let tags = g.import_read(&self.tags);
        let mesh = Mesh { positions: &positions, triangles: &corners, tags: &tags };
        let (mut nodes, mut packed) = (g.import(target.0), g.import(target.1));
        let (mut items, mut counts) = (g.import(&self.items), g.import(&self.counts));
        let boxes = triangles::boxes(&mut g, mesh);
        match builder {
            Some(builder) => {
                let Lbvh { nodes: built, items: order, counts: sizes } =
                    triangles::tree(&mut g, &boxes, builder, self.fences);
                g.copy(&built, &mut nodes);
                g.copy(&order, &mut items);
                g.copy(&sizes, &mut counts);
            }
            None => {
                let tree = refit::Target { nodes: &mut nodes, items: &items, counts: &counts };
                refit::boxes(&mut g, tree, &boxes, self.fences);
            }
        }
        triangles::pack(&mut g, mesh, &boxes, Leaves { items: &items, counts: &counts }, &mut packed);
        let mut cost = g.buffer("tree_cost", 1);
        refit::cost(&mut g, &nodes, &counts, &mut cost);
        g.keep(&packed);
        let (nodes, items, counts) = (g.readback(&nodes), g.readback(&items), g.readback(&counts));
        let cost = g.readback(&cost);
        let plan = g.plan().unwrap_or_else(|error| panic!("the update of a tree is declared wrong: {error}"));
        let mut executable = runtime.prepare(&plan)?;
        executable.run()?;
        let (mut nodes, mut order, counts) =
            (executable.read(&nodes), executable.read(&items), executable.read(&counts));
        order.truncate(counts[0] as usize);
        nodes.truncate(counts[2] as usize);
        Ok((HostBvh { nodes, order, skipped: counts[1], depth: 0 }, executable.read(&cost)[0]))
    }
}
