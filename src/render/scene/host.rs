//! What the host works out of a scene before it goes to the device. Each part is a pure function of the parts before
//! it, so a change of the scene redoes only what follows from it.

use super::lights::{average_emission, luminance};
use super::shading::is_flat;
use super::sky::Sky;
use crate::kernels::bvh_host::{ALPHA_MASKED, BOUNDARY, HostBvh, ONE_SIDED, TriangleTag, build_sah, pack_triangles};
use crate::kernels::generated::BvhTriangle;
use crate::scene::frame::Bounds;
use crate::scene::{Alpha, Instance, InstanceId, Material, Part, Scene, World};

/// A scene as the host knows it.
#[derive(Clone, Default)]
pub struct Host {
    /// All triangles in world space.
    pub world: World,
    /// For each instance whether any of its triangles has shading normals of its own.
    smooth: Vec<bool>,
    pub tree: Tree,
    /// Triangles that shine are listed in the order of the scene instead of that of the leaves, so that no number
    /// depends on the tree.
    pub lights_by_id: bool,
    /// Emission of each material, averaged over its texture.
    pub emission: Vec<[f32; 3]>,
    /// The environment, if it gives light.
    pub sky: Option<Sky>,
    /// Luminance of the brightest texel of the environment.
    pub sky_peak: f64,
}

impl Host {
    /// Nothing yet.
    pub fn empty(lights_by_id: bool) -> Self {
        Self { lights_by_id, ..Self::default() }
    }

    /// Flattens the scene; the tree is that of the former world.
    pub fn update_world(&mut self, scene: &Scene) {
        self.world = World::of(scene);
        self.smooth = self.world.parts.iter().map(|part| is_smooth(&self.world, part)).collect();
    }

    /// Builds the tree over the world.
    pub fn build_tree(&mut self) {
        self.adopt(build_sah(&self.world.positions, &self.world.triangles));
    }

    /// Takes a tree over the world, and works out what follows from its triangles.
    pub fn adopt(&mut self, bvh: HostBvh) {
        self.tree = Tree::of(bvh, &self.world);
    }

    /// Flattens anew where only these instances are elsewhere or have other vertices. False if that has changed the
    /// numbers of triangles or vertices: then everything has to be done.
    pub fn move_instances(&mut self, scene: &Scene, moved: &[InstanceId]) -> bool {
        if !moved.iter().all(|&id| self.world.replace(scene, id)) {
            return false;
        }
        for id in moved {
            self.smooth[id.index()] = is_smooth(&self.world, &self.world.parts[id.index()]);
        }
        true
    }

    /// Whether a material of those that `chosen` accepts has triangles with shading normals of their own.
    pub fn any_smooth(&self, scene: &Scene, chosen: impl Fn(&Material) -> bool) -> bool {
        let material = |instance: &Instance| &scene.materials[scene.meshes[instance.mesh.index()].material.index()];
        scene.instances.iter().zip(&self.smooth).any(|(instance, smooth)| *smooth && chosen(material(instance)))
    }

    /// What follows from the materials.
    pub fn update_materials(&mut self, scene: &Scene) {
        self.emission = average_emission(scene);
    }

    /// What follows from the environment.
    pub fn update_sky(&mut self, scene: &Scene) {
        self.sky = scene.environment.as_ref().and_then(Sky::of);
        let texels = scene.environment.iter().flat_map(|e| &e.radiance);
        self.sky_peak = texels.map(|t| luminance(*t)).filter(|x| x.is_finite()).fold(0.0, f64::max);
    }

    /// The triangles of the tree as the kernels read them, in leaf order.
    pub fn packed_triangles(&self, scene: &Scene) -> Vec<BvhTriangle> {
        let World { positions, triangles, .. } = &self.world;
        pack_triangles(positions, triangles, &self.tree.bvh.order, |id| self.tag(scene, id))
    }

    /// What rides with a triangle.
    pub fn tag(&self, scene: &Scene, triangle: u32) -> TriangleTag {
        let material = self.world.material[triangle as usize];
        TriangleTag { flags: triangle_flags(&scene.materials[material as usize]), material }
    }
}

/// What rays have to know of a triangle with this material.
pub fn triangle_flags(m: &Material) -> u32 {
    let flags = [
        (ALPHA_MASKED, m.alpha != Alpha::Opaque),
        (ONE_SIDED, m.is_one_sided()),
        (BOUNDARY, m.volume && m.transmission > 0.0),
    ];
    flags.iter().filter(|(_, set)| *set).fold(0, |all, (flag, _)| all | flag)
}

/// The tree over a world, and its extent.
#[derive(Clone, Default)]
pub struct Tree {
    pub bvh: HostBvh,
    /// Which triangles of the world are in it. The others may lie anywhere, at infinity too: they count for nothing.
    pub kept: Vec<bool>,
    /// Centre of the scene's sphere.
    pub center: [f32; 3],
    /// Radius of the scene's sphere, greater than 0.
    pub radius: f32,
    /// Radius of the box around where most corners of triangles are, greater than 0 and at most `radius`.
    pub crowd_radius: f32,
    /// Area of all triangles of the world, in square scene units.
    pub surface_area: f64,
}

impl Tree {
    fn of(bvh: HostBvh, world: &World) -> Self {
        let mut kept = vec![false; world.triangles.len()];
        bvh.order.iter().for_each(|&id| kept[id as usize] = true);
        let inside = (0..).zip(&kept).filter(|(_, kept)| **kept);
        // Where no triangle is left because all areas are too small for their numbers, the corners still say how small.
        let bounds = Bounds::around(inside.flat_map(|(id, _)| world.corners(id)));
        let all = || world.positions.iter().copied().filter(|p| p.iter().all(|x| x.is_finite()));
        let bounds = bounds.or_else(|| Bounds::around(all()));
        let (center, radius) = bounds.map_or(([0.0; 3], 1.0), |b| (b.center(), b.radius()));
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let corners = || (0..).zip(&kept).filter(|(_, kept)| **kept).flat_map(|(id, _)| world.corners(id));
        let crowd_radius = crowd_radius(corners).unwrap_or(radius);
        Self { bvh, kept, center, radius, crowd_radius, surface_area: surface_area(world) }
    }
}

/// How many times as far as the middle of the corners others may lie and still count for their crowd.
const FAR: f32 = 30.0;

/// The radius of the scene without corners that lie far beyond all others, such as a stray one. Others are those in the
/// box of the middle three quarters along each axis. `None` where all lie at one place.
fn crowd_radius<I: Iterator<Item = [f32; 3]>>(corners: impl Fn() -> I) -> Option<f32> {
    let ends = [0, 1, 2].map(|axis| {
        let mut along: Vec<f32> = corners().map(|corner| corner[axis]).collect();
        let Some(last) = along.len().checked_sub(1) else { return [0.0; 2] };
        let cut = last / 8;
        let low = *along.select_nth_unstable_by(cut, f32::total_cmp).1;
        [low, *along.select_nth_unstable_by(last - cut, f32::total_cmp).1]
    });
    let middle = Bounds { min: ends.map(|[low, _]| low), max: ends.map(|[_, high]| high) };
    let (center, reach) = (middle.center(), FAR * middle.radius());
    let is_near = |corner: &[f32; 3]| (0..3).all(|k| (corner[k] - center[k]).abs() <= reach);
    Bounds::around(corners().filter(is_near)).map(|bounds| bounds.radius()).filter(|radius| *radius > 0.0)
}

/// Area of all triangles, in square scene units.
pub fn surface_area(world: &World) -> f64 {
    (0..world.triangles.len() as u32).map(|id| world.area(id)).filter(|area| area.is_finite()).sum()
}

/// Whether any vertex normal of an instance differs from its triangle's by more than rounding.
fn is_smooth(world: &World, part: &Part) -> bool {
    part.triangles.clone().any(|id| !is_flat(world, id))
}
