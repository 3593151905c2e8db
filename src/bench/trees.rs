//! Builders of trees over triangles: the time of a build, the surface-area cost, rays; and refitted trees beside new
//! ones.

use glam::Vec3;

use super::rays::rays;
use super::{Effort, MEASURED, device_class, median, planned, time_plan};
use crate::error::Result;
use crate::graph::{Graph, Persistent, Runtime};
use crate::kernels::bvh_host::{HostBvh, build_sah};
use crate::kernels::generated::{BvhNode, BvhTriangle};
use crate::kernels::triangles::{self, Builder, Leaves, Mesh};
use crate::kernels::{lbvh::Lbvh, refit};
use crate::scene::{Scene, World};

/// What was measured on a scene.
#[derive(Debug, Clone)]
pub struct TreesReport {
    /// Its file, or a description of a generated one.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// The builders, that of the host first.
    pub rows: Vec<TreeRow>,
    /// Trees of the mesh twisted more and more; none where nobody asked.
    pub deformed: Vec<DeformedRow>,
}

/// A tree and its builder.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeRow {
    /// The builder.
    pub builder: &'static str,
    /// Median seconds of a build, triangles in the order of the leaves included where the device does it.
    pub build: f64,
    /// Median seconds of a refit of this tree on the device, triangles included.
    pub refit: f64,
    /// Surface-area cost over that of the host's tree.
    pub cost: f64,
    /// Nodes.
    pub nodes: usize,
    /// Primary rays a second; `None` without a camera.
    pub primary: Option<f64>,
    /// Diffuse rays a second; `None` where no primary ray hits.
    pub diffuse: Option<f64>,
}

/// A refitted tree beside a new one.
#[derive(Debug, Clone, PartialEq)]
pub struct DeformedRow {
    /// Twist of the mesh from its lowest to its highest point, in degrees.
    pub degrees: f64,
    /// Surface-area cost of the refitted tree over what it cost when it was built.
    pub growth: f64,
    /// The same over that of a new tree by H-PLOC.
    pub cost: f64,
    /// Diffuse rays a second over those in the new tree.
    pub diffuse: Option<f64>,
}

/// Twists of the mesh, in degrees.
const TWISTS: [f64; 6] = [0.0, 15.0, 45.0, 90.0, 180.0, 360.0];

/// Measures on `scene`; with `deform` the mesh twisted as well. `begin` hears what comes next.
///
/// # Errors
/// Those of the device.
pub fn trees(
    runtime: &Runtime,
    (scene, deform): (&Scene, bool),
    effort: Effort,
    begin: &mut dyn FnMut(&str),
) -> Result<TreesReport> {
    let world = World::of(scene);
    let bench = Bench { runtime, effort, scene };
    begin("tree on the host");
    let mut sah = HostBvh::default();
    let times = (0..effort.repeats.clamp(1, 3)).map(|_| {
        let start = std::time::Instant::now();
        sah = build_sah(&world.positions, &world.triangles);
        start.elapsed().as_secs_f64()
    });
    let seconds = median(times.collect());
    let best = cost(&sah);
    let mut rows = vec![bench.row(&world, ("sah", &sah, seconds), best, begin)?];
    for (name, builder) in [("lbvh", Builder::Lbvh), ("hploc", Builder::Hploc)] {
        begin("tree on the device");
        let (tree, seconds) = bench.build(&world, builder)?;
        rows.push(bench.row(&world, (name, &tree, seconds), best, begin)?);
    }
    let mut deformed = Vec::new();
    for degrees in TWISTS.into_iter().filter(|_| deform) {
        deformed.push(bench.deformed(&world, &sah, degrees, begin)?);
    }
    let name = scene.path.display().to_string();
    Ok(TreesReport { name, triangles: world.triangles.len(), rows, deformed })
}

fn cost(tree: &HostBvh) -> f64 {
    f64::from(refit::host_cost(&tree.nodes, tree.order.len() as u32))
}

struct Bench<'a> {
    runtime: &'a Runtime,
    effort: Effort,
    scene: &'a Scene,
}

/// Triangles in device memory.
struct Resident {
    positions: Persistent<[f32; 3]>,
    corners: Persistent<[u32; 3]>,
    tags: Persistent<[u32; 2]>,
}

impl Bench<'_> {
    fn row(
        &self,
        world: &World,
        (builder, tree, build): (&'static str, &HostBvh, f64),
        best: f64,
        begin: &mut dyn FnMut(&str),
    ) -> Result<TreeRow> {
        let (refitted, seconds) = self.refit(world, tree)?;
        debug_assert_eq!(refitted.nodes.len(), tree.nodes.len());
        let (primary, diffuse) = self.rates(world, tree, begin)?;
        let (cost, nodes) = (cost(tree) / best, tree.nodes.len());
        Ok(TreeRow { builder, build, refit: seconds, cost, nodes, primary, diffuse })
    }

    /// Primary and diffuse rays a second.
    fn rates(&self, world: &World, tree: &HostBvh, begin: &mut dyn FnMut(&str)) -> Result<(Option<f64>, Option<f64>)> {
        let rates = rays(self.runtime, self.effort, (self.scene, world), tree, begin)?;
        let rate = |name: &str| rates.iter().find(|rate| rate.name == name).map(|rate| rate.per_second());
        Ok((rate("primary rays"), rate("diffuse rays")))
    }

    fn deformed(&self, world: &World, sah: &HostBvh, degrees: f64, begin: &mut dyn FnMut(&str)) -> Result<DeformedRow> {
        begin("twisted trees");
        let twisted = twisted(world, degrees);
        let refitted = self.refit(&twisted, sah)?.0;
        let new = self.build(&twisted, Builder::Hploc)?.0;
        let (old_rate, new_rate) = (self.rates(&twisted, &refitted, begin)?.1, self.rates(&twisted, &new, begin)?.1);
        let diffuse = old_rate.zip(new_rate).map(|(old, new)| old / new);
        let now = cost(&refitted);
        Ok(DeformedRow { degrees, growth: now / cost(sah), cost: now / cost(&new), diffuse })
    }

    fn resident(&self, world: &World) -> Result<Resident> {
        let tags = vec![[0; 2]; world.triangles.len()];
        Ok(Resident {
            positions: self.runtime.persistent_from("positions", &world.positions)?,
            corners: self.runtime.persistent_from("corners", &world.triangles)?,
            tags: self.runtime.persistent_from("tags", &tags)?,
        })
    }

    /// Builds on the device; the tree and the median seconds.
    fn build(&self, world: &World, builder: Builder) -> Result<(HostBvh, f64)> {
        let fences = self.runtime.device().loop_limit().is_none();
        self.run(world, |g, mesh| {
            let boxes = triangles::boxes(g, mesh);
            let tree = triangles::tree(g, &boxes, builder, fences);
            let mut packed = g.buffer::<BvhTriangle>("packed", mesh.triangles.len());
            triangles::pack(g, mesh, &boxes, Leaves { items: &tree.items, counts: &tree.counts }, &mut packed);
            g.keep(&packed);
            tree
        })
    }

    /// Refits on the device; the tree and the median seconds.
    fn refit(&self, world: &World, tree: &HostBvh) -> Result<(HostBvh, f64)> {
        let fences = self.runtime.device().loop_limit().is_none();
        let nodes: Persistent<BvhNode> = self.runtime.persistent_from("nodes", &tree.nodes)?;
        let items = self.runtime.persistent_from("items", &tree.order)?;
        let counts = [tree.order.len() as u32, tree.skipped, tree.nodes.len() as u32];
        let counts = self.runtime.persistent_from("counts", &counts)?;
        self.run(world, |g, mesh| {
            let mut tree = Lbvh { nodes: g.import(&nodes), items: g.import(&items), counts: g.import(&counts) };
            let boxes = triangles::boxes(g, mesh);
            let target = refit::Target { nodes: &mut tree.nodes, items: &tree.items, counts: &tree.counts };
            refit::boxes(g, target, &boxes, fences);
            let mut packed = g.buffer::<BvhTriangle>("packed", mesh.triangles.len());
            triangles::pack(g, mesh, &boxes, Leaves { items: &tree.items, counts: &tree.counts }, &mut packed);
            g.keep(&packed);
            tree
        })
    }

    /// Times what makes a tree.
    fn run(&self, world: &World, make: impl FnOnce(&mut Graph, Mesh<'_>) -> Lbvh) -> Result<(HostBvh, f64)> {
        let resident = self.resident(world)?;
        let mut g = Graph::new().with_device_class(device_class(self.runtime));
        let (positions, corners) = (g.import_read(&resident.positions), g.import_read(&resident.corners));
        let tags = g.import_read(&resident.tags);
        let mesh = Mesh { positions: &positions, triangles: &corners, tags: &tags };
        let tree = g.scope(MEASURED, |g| make(g, mesh));
        let (nodes, items, counts) = (g.readback(&tree.nodes), g.readback(&tree.items), g.readback(&tree.counts));
        let (seconds, executable) = time_plan(self.runtime, self.effort.repeats, &planned(g))?;
        let (mut nodes, mut order, counts) =
            (executable.read(&nodes), executable.read(&items), executable.read(&counts));
        nodes.truncate(counts[2] as usize);
        order.truncate(counts[0] as usize);
        Ok((HostBvh { nodes, order, skipped: counts[1], depth: 0 }, seconds))
    }
}

/// The world turned about the vertical axis through its middle, the more the higher.
fn twisted(world: &World, degrees: f64) -> World {
    let Some(bounds) = world.bounds() else { return world.clone() };
    let (low, height) = (bounds.min[1], (bounds.max[1] - bounds.min[1]).max(f32::MIN_POSITIVE));
    let center = Vec3::from(bounds.center());
    let mut twisted = world.clone();
    for position in &mut twisted.positions {
        let angle = degrees.to_radians() as f32 * (position[1] - low) / height;
        let (sin, cos) = angle.sin_cos();
        let (x, z) = (position[0] - center.x, position[2] - center.z);
        (position[0], position[2]) = (center.x + cos * x + sin * z, center.z + cos * z - sin * x);
    }
    twisted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::blobs;

    #[test]
    fn a_twist_turns_what_is_high_and_keeps_lengths() {
        let world = World::of(&blobs(8, 16));
        let same = twisted(&world, 0.0);
        let other = twisted(&world, 180.0);
        let bounds = world.bounds().expect("triangles");
        let center = bounds.center();
        for (before, (still, after)) in world.positions.iter().zip(same.positions.iter().zip(&other.positions)) {
            let radius = |p: &[f32; 3]| (p[0] - center[0]).hypot(p[2] - center[2]);
            assert!((radius(before) - radius(after)).abs() < 1e-4 && before[1] == after[1]);
            assert!((0..3).all(|k| (before[k] - still[k]).abs() < 1e-5));
        }
        let highest = world.positions.iter().position(|p| p[1] == bounds.max[1]).expect("a highest point");
        let (before, after) = (world.positions[highest], other.positions[highest]);
        assert!((before[0] - center[0] + after[0] - center[0]).abs() < 1e-4, "half a turn");
    }
}
