//! Environment maps that photons are traced in: what the chosen centres cover, and what rays by maps are worth beside
//! rays by the tree.

use glam::Vec3;

use super::rays::Numbers;
use super::{MEASURED, device_class, planned, time_plan};
use crate::error::Result;
use crate::graph::{Graph, Persistent, Runtime};
use crate::kernels::bvh_host::{HostBvh, TriangleTag, build_sah, pack_triangles};
use crate::kernels::generated::{BvhNode, BvhTriangle, Ray, RayHit};
use crate::kernels::maps::{self, MAP_COUNTS, Maps};
use crate::kernels::trace::{self, MISS, Tree};
use crate::render::{MapSettings, SceneMaps, Surfaces, map_candidates};
use crate::scene::{Scene, World};

/// What was measured on a scene.
#[derive(Debug, Clone)]
pub struct MapsReport {
    /// Its file, or what it is.
    pub name: String,
    /// Triangles in the tree.
    pub triangles: u32,
    /// Rays of each row.
    pub rays: u32,
    /// Seconds for these rays by the tree.
    pub tree_seconds: f64,
    /// Part of these rays that meet something.
    pub hits: f64,
    /// One for each kind of maps.
    pub rows: Vec<MapsRow>,
}

/// One kind of maps.
#[derive(Debug, Clone)]
pub struct MapsRow {
    /// The maps.
    pub settings: MapSettings,
    /// Part of the surface that the chosen centres see, by rays.
    pub covered: f64,
    /// The same for as many places without a choice: the first candidates.
    pub covered_at_random: f64,
    /// Exchanges of centres after the first choice.
    pub exchanges: u32,
    /// Seconds of the choice, with the maps of the candidates.
    pub choice_seconds: f64,
    /// Seconds of drawing the maps.
    pub draw_seconds: f64,
    /// Seconds for the rays by the maps, with those of the tree that judge them.
    pub judge_seconds: f64,
    /// What maps said, [`maps::COUNTS`].
    pub counts: [u32; MAP_COUNTS as usize],
}

/// The kinds of maps that are compared: the number of centres, their resolution, layers, and the search.
pub fn kinds() -> Vec<MapSettings> {
    let base = MapSettings::default();
    let centres = [1, 4, 8, 12, 24].map(|centres| MapSettings { centres, ..base });
    let resolutions = [32, 64, 256].map(|resolution| MapSettings { resolution, ..base });
    let others = [
        MapSettings { steps: true, ..base },
        MapSettings { layers: 2, ..base },
        MapSettings { layers: 2, steps: true, ..base },
    ];
    centres.into_iter().chain(resolutions).chain(others).collect()
}

struct Target<'a> {
    runtime: &'a Runtime,
    tree: HostBvh,
    packed: Vec<BvhTriangle>,
    nodes: Persistent<BvhNode>,
    triangles: Persistent<BvhTriangle>,
    rays: Persistent<Ray>,
    radius: f32,
    bounds: [[f32; 3]; 2],
}

/// Measures `kinds` on a scene with so many rays, the median of `repeats` runs; `None` for a scene without triangles.
///
/// # Errors
/// Those of the device.
pub fn maps(
    runtime: &Runtime,
    scene: &Scene,
    (kinds, rays, repeats): (&[MapSettings], u32, u32),
    begin: &mut dyn FnMut(&str),
) -> Result<Option<MapsReport>> {
    let world = World::of(scene);
    let tree = build_sah(&world.positions, &world.triangles);
    let packed = pack_triangles(&world.positions, &world.triangles, &tree.order, |_| TriangleTag::default());
    let Some(bounds) = world.bounds().filter(|_| !packed.is_empty()) else { return Ok(None) };
    let photons = surface_rays(&packed, rays);
    let target = Target {
        runtime,
        nodes: runtime.persistent_from("nodes", &tree.nodes)?,
        triangles: runtime.persistent_from("triangles", &packed)?,
        rays: runtime.persistent_from("rays", &photons)?,
        tree,
        packed,
        radius: bounds.radius(),
        bounds: [bounds.min, bounds.max],
    };
    begin("rays by the tree");
    let (tree_seconds, hits) = target.by_tree(repeats)?;
    let mut rows = Vec::new();
    for kind in kinds {
        begin(&format!("{} centres, {} texels, {} layers", kind.centres, kind.resolution, kind.layers));
        rows.push(target.row(*kind, (&photons, repeats))?);
    }
    let (name, triangles) = (scene.path.display().to_string(), target.packed.len() as u32);
    Ok(Some(MapsReport { name, triangles, rays: photons.len() as u32, tree_seconds, hits, rows }))
}

impl Target<'_> {
    fn by_tree(&self, repeats: u32) -> Result<(f64, f64)> {
        let mut g = Graph::new().with_device_class(device_class(self.runtime));
        let (nodes, triangles) = (g.import_read(&self.nodes), g.import_read(&self.triangles));
        let (rays, mut hits) = (g.import_read(&self.rays), g.buffer::<RayHit>("hits", self.rays.len()));
        let tree = Tree { nodes: &nodes, triangles: &triangles };
        g.scope(MEASURED, |g| trace::closest(g, tree, &rays, &mut hits));
        let readback = g.readback(&hits);
        let (seconds, executable) = time_plan(self.runtime, repeats, &planned(g))?;
        let hits = executable.read(&readback).iter().filter(|hit| hit.triangle != MISS).count();
        Ok((seconds, hits as f64 / f64::from(self.rays.len())))
    }

    fn row(&self, settings: MapSettings, (rays, repeats): (&[Ray], u32)) -> Result<MapsRow> {
        let surfaces = Surfaces {
            triangles: &self.triangles,
            count: self.packed.len() as u32,
            radius: self.radius,
            bounds: self.bounds,
        };
        let made = SceneMaps::on_device(self.runtime, surfaces, settings)?;
        let mut g = Graph::new().with_device_class(device_class(self.runtime));
        let (nodes, triangles) = (g.import_read(&self.nodes), g.import_read(&self.triangles));
        let (centres, texels) = (g.import_read(&made.centres), g.import_read(&made.texels));
        let device_rays = g.import_read(&self.rays);
        let maps = Maps { shape: settings.shape(), centres: &centres, texels: &texels };
        let tree = Tree { nodes: &nodes, triangles: &triangles };
        let (_, counts) = g.scope(MEASURED, |g| maps::judge(g, tree, (maps, settings.search()), &device_rays));
        let counts = g.readback(&counts);
        let (judge_seconds, executable) = time_plan(self.runtime, repeats, &planned(g))?;
        let mut found = [0; MAP_COUNTS as usize];
        found.copy_from_slice(&executable.read(&counts));
        let about = &made.about;
        let at_random = map_candidates(self.bounds, settings.centres);
        Ok(MapsRow {
            settings,
            covered: self.covered(&about.centres, rays),
            covered_at_random: self.covered(&at_random, rays),
            exchanges: about.choice.as_ref().map_or(0, |choice| choice.exchanges),
            choice_seconds: about.seconds[0],
            draw_seconds: about.seconds[1],
            judge_seconds,
            counts: found,
        })
    }

    /// Part of the places where rays begin, which are spread over the surface, that any centre sees.
    fn covered(&self, centres: &[[f32; 3]], rays: &[Ray]) -> f64 {
        let every = (rays.len() / 4096).max(1);
        let sees = |centre: &[f32; 3], place: &[f32; 4]| {
            let to: [f32; 3] = std::array::from_fn(|k| place[k] - centre[k]);
            trace::traverse(&self.tree.nodes, &self.packed, &trace::ray(*centre, to, 0.999)).triangle == MISS
        };
        let places = || rays.iter().step_by(every).map(|ray| &ray.origin);
        places().filter(|place| centres.iter().any(|centre| sees(centre, place))).count() as f64
            / places().count() as f64
    }
}

/// Rays as photons leave surfaces: from places that are spread over the front of all triangles, with a cosine
/// distribution.
fn surface_rays(packed: &[BvhTriangle], count: u32) -> Vec<Ray> {
    let corners = |t: &BvhTriangle| [t.v0, t.v1, t.v2].map(|v| Vec3::new(v[0], v[1], v[2]));
    let area = |t: &BvhTriangle| {
        let [a, b, c] = corners(t);
        f64::from((b - a).cross(c - a).length())
    };
    let sums: Vec<f64> = packed
        .iter()
        .scan(0.0, |sum, t| {
            *sum += area(t);
            Some(*sum)
        })
        .collect();
    let total = sums.last().copied().unwrap_or(0.0);
    let mut numbers = Numbers(1);
    let ray = |index: u32| {
        let wanted = (f64::from(index) + 0.5) / f64::from(count) * total;
        let t = &packed[sums.partition_point(|sum| *sum < wanted).min(packed.len() - 1)];
        let (mut u, mut v) = (numbers.next(), numbers.next());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let [a, b, c] = corners(t);
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        let origin = trace::offset_ray_origin([a, b, c].map(Into::into), [u, v], normal.into());
        let d = numbers.direction(normal);
        trace::ray(origin, d.into(), f32::INFINITY)
    };
    (0..count).map(ray).collect()
}
