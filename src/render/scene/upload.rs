//! A scene on the device: tree, attributes, lights, casters, and the variant of the kernels that it needs.

use super::casters::casters;
use super::lights::LightTable;
use super::memory::Memory;
use super::shading::{Textures, is_flat, vertex_data};
use crate::error::{Error, MemoryCause, Result};
use crate::graph::{DeviceClass, Graph, Persistent, Runtime};
use crate::kernels::bvh_host::{ALPHA_MASKED, TriangleTag, build_sah, pack_triangles};
use crate::kernels::generated::{
    BvhNode, BvhTriangle, Caster, Globals, Light, Material as DeviceMaterial, Pass, TextureUse,
};
use crate::kernels::scene_data::{SceneBuffers, Variant};
use crate::scene::frame::Bounds;
use crate::scene::needs::{FOLLOWED_ROUGHNESS, is_specular};
use crate::scene::{Material, Needs, Scene, World};

/// A scene in device memory.
#[derive(Clone)]
pub struct DeviceScene {
    nodes: Persistent<BvhNode>,
    triangles: Persistent<BvhTriangle>,
    shading_data: Persistent<[f32; 4]>,
    materials: Persistent<DeviceMaterial>,
    texture_uses: Persistent<TextureUse>,
    texels: Persistent<u32>,
    lights: Persistent<Light>,
    globals: Persistent<Globals>,
    environment: Persistent<[f32; 4]>,
    environment_cdf: Persistent<f32>,
    casters: Persistent<Caster>,
    /// What the kernels are specialised for.
    pub variant: Variant,
    /// Number of lights, emissive triangles counted one by one.
    pub light_count: u32,
    /// Whether any light has an extent: emissive triangles or an environment.
    pub(in crate::render) has_wide_lights: bool,
    /// Number of spheres that caustic photons are aimed at; 0: no caustics.
    pub caster_count: u32,
    /// Triangles in the tree.
    pub triangle_count: u32,
    /// Triangles without area or with coordinates that are not finite, left out of the tree.
    pub skipped_triangles: u32,
    /// Whether kernels may use memory barriers in divergent code: not on the software drivers that cut loops.
    pub(in crate::render) fences: bool,
    /// Loop iterations that the driver runs in an invocation, if it ends loops.
    pub(in crate::render) loop_limit: Option<u32>,
    /// Photons that a pass can store.
    pub(in crate::render) most_deposits: u32,
    /// The class of device that it is on.
    pub(in crate::render) device_class: DeviceClass,
    /// Exponents of the powers of two that the film counts radiance and depth in.
    pub(in crate::render) exponents: [i32; 2],
    /// A bound of the power that the photons of a pass carry together: red, green, blue [W].
    pub(in crate::render) light_power: [f64; 3],
    /// Radius of the scene's sphere.
    pub(in crate::render) radius: f32,
    /// Area of all triangles, in square scene units.
    pub(in crate::render) surface_area: f64,
    /// Bytes on the device.
    pub bytes: u64,
}

impl DeviceScene {
    /// Builds and uploads. `full` keeps every feature in the kernels.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] for what does not fit the device.
    pub fn new(runtime: &Runtime, scene: &Scene, full: bool) -> Result<Self> {
        Self::in_memory(Memory::Device(runtime), scene, full)
    }

    /// The same in any memory.
    pub(in crate::render) fn in_memory(memory: Memory<'_>, scene: &Scene, full: bool) -> Result<Self> {
        let world = World::of(scene);
        let bvh = build_sah(&world.positions, &world.triangles);
        check_size(memory, scene, "triangles", bvh.order.len() as u64 * size_of::<BvhTriangle>() as u64)?;
        let triangles = pack_triangles(&world.positions, &world.triangles, &bvh.order, |id| {
            let material = world.material[id as usize];
            let masked = scene.materials[material as usize].alpha_cutoff.is_some();
            TriangleTag { flags: if masked { ALPHA_MASKED } else { 0 }, material }
        });
        // Triangles that the tree leaves out may lie anywhere, at infinity too: they count for nothing.
        let mut kept = vec![false; world.triangles.len()];
        bvh.order.iter().for_each(|&id| kept[id as usize] = true);
        let bounds = bounds(&world, &kept);
        let (center, radius) = bounds.map_or(([0.0; 3], 1.0), |b| (b.center(), b.radius()));
        let radius = if radius > 0.0 { radius } else { 1.0 };
        let table = LightTable::of(scene, &world, &bvh.order, f64::from(radius));
        let used = scene.used_materials();
        let any_specular = scene.materials.iter().zip(used).any(|(m, used)| used && is_specular(m));
        let casters = if any_specular { casters(scene, &world, &kept) } else { vec![] };
        let variant = variant((scene, &world), &table, full);
        let shading = vertex_data(&world, &bvh.order, &variant);
        check_size(memory, scene, "vertex attributes", std::mem::size_of_val(&shading[..]) as u64)?;
        let mut textures = Textures::of(scene);
        for (material, density) in textures.materials.iter_mut().zip(&table.densities) {
            material.light_density = *density;
        }
        check_size(memory, scene, "textures", textures.texels.len() as u64 * 4)?;
        let (width, height) = scene.environment.as_ref().map_or((0, 0), |e| (e.width, e.height));
        let globals = Globals {
            center,
            radius,
            light_count: table.lights.len() as u32,
            caster_count: casters.len() as u32,
            environment_width: if table.has_environment { width } else { 0 },
            environment_height: if table.has_environment { height } else { 0 },
            environment_probability: table.environment_probability(),
            ..Globals::default()
        };
        let mut device = Self {
            nodes: memory.filled("nodes", &bvh.nodes)?,
            triangles: memory.filled("triangles", &triangles)?,
            shading_data: memory.filled("shading_data", &shading)?,
            materials: memory.filled("materials", &textures.materials)?,
            texture_uses: memory.filled("texture_uses", &textures.uses)?,
            texels: memory.filled("texels", &textures.texels)?,
            lights: memory.filled("lights", &table.lights)?,
            globals: memory.filled("globals", &[globals])?,
            environment: memory.filled("environment", &table.environment)?,
            environment_cdf: memory.filled("environment_cdf", &table.environment_cdf)?,
            casters: memory.filled("casters", &casters)?,
            variant,
            light_count: table.lights.len() as u32,
            has_wide_lights: table.has_triangles || table.has_environment,
            caster_count: casters.len() as u32,
            triangle_count: triangles.len() as u32,
            skipped_triangles: bvh.skipped,
            fences: memory.loop_limit().is_none(),
            loop_limit: memory.loop_limit(),
            most_deposits: memory.most_deposits(),
            device_class: memory.device_class(),
            exponents: table.film_exponents(scene, f64::from(radius)),
            light_power: table.greatest_power(),
            radius,
            surface_area: surface_area(&world),
            bytes: 0,
        };
        device.bytes = device.sizes().iter().map(|(_, bytes)| bytes).sum();
        Ok(device)
    }

    /// Name and size in bytes of every buffer.
    pub fn sizes(&self) -> Vec<(&'static str, u64)> {
        vec![
            ("tree nodes", self.nodes.bytes()),
            ("triangles", self.triangles.bytes()),
            ("vertex attributes", self.shading_data.bytes()),
            ("materials", self.materials.bytes() + self.texture_uses.bytes()),
            ("textures", self.texels.bytes()),
            ("lights", self.lights.bytes()),
            ("environment", self.environment.bytes() + self.environment_cdf.bytes()),
            ("casters", self.casters.bytes()),
        ]
    }

    /// The same scene for kernels of another variant; only for plans that nobody runs, because the vertex attributes are
    /// left behind.
    pub(in crate::render) fn with_variant(&self, variant: Variant) -> Self {
        let vectors = (self.triangle_count * variant.shading_stride).max(1);
        let mut other = Self { variant, shading_data: Persistent::detached("shading_data", vectors), ..self.clone() };
        other.bytes = other.sizes().iter().map(|(_, bytes)| bytes).sum();
        other
    }

    /// Imports the scene into a graph; `pass` becomes an input of it.
    pub(in crate::render) fn import(&self, g: &mut Graph, pass: Pass) -> (SceneBuffers, crate::graph::Input<Pass>) {
        let (pass, input) = g.input("pass", &[pass]);
        let buffers = SceneBuffers {
            nodes: g.import_read(&self.nodes),
            triangles: g.import_read(&self.triangles),
            shading_data: g.import_read(&self.shading_data),
            materials: g.import_read(&self.materials),
            texture_uses: g.import_read(&self.texture_uses),
            texels: g.import_read(&self.texels),
            lights: g.import_read(&self.lights),
            globals: g.import_read(&self.globals),
            environment: g.import_read(&self.environment),
            environment_cdf: g.import_read(&self.environment_cdf),
            casters: g.import_read(&self.casters),
            pass,
        };
        (buffers, input)
    }
}

/// Bounds of the triangles that are kept.
fn bounds(world: &World, kept: &[bool]) -> Option<Bounds> {
    let triangles = world.triangles.iter().zip(kept).filter(|(_, kept)| **kept);
    Bounds::around(triangles.flat_map(|(corners, _)| corners.map(|i| world.positions[i as usize])))
}

/// Area of all triangles, in square scene units.
pub(in crate::render) fn surface_area(world: &World) -> f64 {
    let area = |id: u32| {
        let [a, b, c] = world.corners(id).map(|p| glam::Vec3::from(p).as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    };
    (0..world.triangles.len() as u32).map(area).filter(|area| area.is_finite()).sum()
}

/// Kernels address these buffers at random, so one that the device cannot bind as a whole is refused before any work.
fn check_size(memory: Memory<'_>, scene: &Scene, what: &str, bytes: u64) -> Result<()> {
    let limit = memory.longest_binding();
    if bytes <= limit {
        return Ok(());
    }
    Err(Error::OutOfMemory {
        object: format!("{what} of {}", scene.path.display()),
        bytes,
        cause: MemoryCause::SceneTooLarge { part: what.to_owned(), longest: limit },
    })
}

fn variant((scene, world): (&Scene, &World), table: &LightTable, full: bool) -> Variant {
    let needs = Needs::of(scene);
    let mut v = Variant {
        textures: full || needs.textures,
        normal_maps: full || needs.normal_maps,
        alpha_mask: full || needs.alpha_mask,
        glass: full || needs.transmission,
        absorption: full || needs.absorption,
        glossy: full || !needs.lambert_only,
        environment: full || table.has_environment,
        area_lights: full || table.has_triangles,
        delta_lights: full || table.has_delta,
        lens: full,
        smooth_normals: full || needs.normal_maps || has_smooth_normals(scene, world, |_| true),
        gathers_glossy: full || scene.materials.iter().any(gathers_glossy),
        gathers_smooth: full || needs.normal_maps || has_smooth_normals(scene, world, gathers),
        blinn_phong: false,
        shading_stride: 3,
        uv0_at: 0,
        uv1_at: 0,
        color_at: 0,
        tangent_at: 0,
    };
    let mut place = |wanted: bool, vectors: u32| {
        let at = v.shading_stride;
        v.shading_stride += if wanted { vectors } else { 0 };
        if wanted { at } else { 0 }
    };
    let uv0_at = place(!world.uvs[0].is_empty() && needs.uv_sets[0], 1);
    let uv1_at = place(!world.uvs[1].is_empty() && needs.uv_sets[1], 2);
    let color_at = place(!world.colors.is_empty(), 3);
    let tangent_at = place(!world.tangents.is_empty() && needs.normal_maps, 3);
    Variant { uv0_at, uv1_at, color_at, tangent_at, ..v }
}

/// Whether a surface of this material has a lobe that is gathered: not a pure mirror, nor pure glass.
fn gathers(m: &Material) -> bool {
    let textured = m.metallic_roughness_texture.is_some() || m.transmission_texture.is_some();
    let followed_only = (m.metallic >= 1.0 && m.roughness < FOLLOWED_ROUGHNESS) || m.transmission >= 1.0;
    !m.unlit && (textured || !followed_only)
}

fn gathers_glossy(m: &Material) -> bool {
    gathers(m) && (m.specular > 0.0 || m.metallic > 0.0 || m.transmission > 0.0)
}

/// Whether any vertex normal of a chosen material's triangles differs from its triangle's by more than rounding.
fn has_smooth_normals(scene: &Scene, world: &World, chosen: impl Fn(&Material) -> bool) -> bool {
    let chosen: Vec<bool> = scene.materials.iter().map(chosen).collect();
    world.material.iter().enumerate().any(|(id, m)| chosen[*m as usize] && !is_flat(world, id as u32))
}
