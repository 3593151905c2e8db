//! A scene on the device: tree, attributes, lights, casters, and the variant of the kernels that it needs.

use std::sync::Arc;

use super::casters::casters;
use super::device_tree::{DeviceTree, TreeUpdates, maker};
use super::guide::Guide;
use super::host::Host;
use super::lights::LightTable;
use super::lobes::Lobes;
use super::maps::SceneMaps;
use super::memory::Memory;
use super::shading::{Textures, vertex_data};
use super::variant::variant;
use super::view::{COARSE, FINE, footprint_unit, seen_points};
use crate::error::{Error, MemoryCause, Result};
use crate::graph::{DeviceClass, Graph, Persistent, Runtime};
use crate::kernels::generated::{
    BvhNode, BvhTriangle, Caster, Globals, Light, Material as DeviceMaterial, Pass, TextureUse,
};
use crate::kernels::scene_data::{SceneBuffers, Variant};
use crate::render::settings::{Settings, TreeBuild};
use crate::scene::needs::is_specular;
use crate::scene::{InstanceId, Scene};

/// Parts of a scene on the device that a change makes stale.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Stale {
    /// Any triangles: the tree and everything that follows from where they are.
    pub geometry: bool,
    /// Instances that are elsewhere, or whose vertices are; as many of them as before.
    pub moved: Vec<InstanceId>,
    /// Which triangles have holes.
    pub masks: bool,
    /// Factors of materials.
    pub materials: bool,
    /// Which textures materials use, and texels.
    pub textures: bool,
    /// Spheres that caustic photons are aimed at.
    pub casters: bool,
    /// Light from infinity.
    pub sky: bool,
}

impl Stale {
    /// Everything: a scene that is not there yet.
    pub fn all() -> Self {
        Self { geometry: true, moved: vec![], masks: true, materials: true, textures: true, casters: true, sky: true }
    }

    /// What is stale by either.
    pub fn and(mut self, other: Self) -> Self {
        self.geometry |= other.geometry;
        self.moved.extend(other.moved);
        self.masks |= other.masks;
        self.materials |= other.materials;
        self.textures |= other.textures;
        self.casters |= other.casters;
        self.sky |= other.sky;
        self
    }
}

/// A scene in device memory.
#[derive(Clone)]
pub struct DeviceScene {
    nodes: Persistent<BvhNode>,
    pub(super) triangles: Persistent<BvhTriangle>,
    shading_data: Persistent<[f32; 4]>,
    materials: Persistent<DeviceMaterial>,
    texture_uses: Persistent<TextureUse>,
    texels: Persistent<u32>,
    lights: Persistent<Light>,
    globals: Persistent<Globals>,
    environment: Persistent<[f32; 4]>,
    environment_cdf: Persistent<f32>,
    casters: Persistent<Caster>,
    guide: Persistent<f32>,
    lobes: Persistent<u32>,
    /// Maps that photons are traced in.
    pub maps: Option<SceneMaps>,
    /// What the host knows of it.
    pub(super) host: Arc<Host>,
    tree_build: TreeBuild,
    /// What the device needs to build and refit the tree, where it does.
    device_tree: Option<DeviceTree>,
    tree_updates: TreeUpdates,
    /// The materials as they are on the device.
    host_materials: Vec<DeviceMaterial>,
    /// The tables as they are on the device.
    host_lobes: Lobes,
    /// The lights that a guide may lead.
    guided_lights: Vec<Light>,
    /// What `globals` holds.
    numbers: Globals,
    /// Keeps every feature in the kernels.
    full: bool,
    /// Counts buffers that were replaced by longer ones: plans that bind the former are of no use.
    pub(in crate::render) generation: u64,
    /// What the kernels are specialised for.
    pub variant: Variant,
    /// Number of lights, emissive triangles counted one by one.
    pub light_count: u32,
    /// Whether any light has an extent: emissive triangles or an environment.
    pub(in crate::render) has_wide_lights: bool,
    /// There are point, spot or directional lights.
    pub(in crate::render) has_lights_without_extent: bool,
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
    /// Greatest part of it that a photon carries where there is most to see, times the number of photons.
    pub(in crate::render) greatest_share: f64,
    /// Radius of the scene's sphere.
    pub(in crate::render) radius: f32,
    /// Length by which footprints are limited, greater than 0.
    pub(in crate::render) footprint_unit: f32,
    /// Area of all triangles, in square scene units.
    pub(in crate::render) surface_area: f64,
    /// Bytes on the device.
    pub bytes: u64,
}

impl DeviceScene {
    /// Builds and uploads for the camera of the settings, with every feature in the kernels if they ask for that.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] for what does not fit the device, [`Error::Scene`] for a scene that is too large or too
    /// small to compute with.
    pub fn new(runtime: &Runtime, scene: &Scene, settings: &Settings) -> Result<Self> {
        Self::in_memory(Memory::Device(runtime), scene, settings)
    }

    /// The same in any memory.
    pub(in crate::render) fn in_memory(memory: Memory<'_>, scene: &Scene, settings: &Settings) -> Result<Self> {
        let mut device = Self::empty(memory, settings);
        device.update(memory, scene, settings.camera, &Stale::all())?;
        Ok(device)
    }

    /// Redoes what is stale, from the triangles to the numbers that follow from everything; lights always.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] for what does not fit the device; the scene is then of no use any more.
    pub(in crate::render) fn update(
        &mut self,
        memory: Memory<'_>,
        scene: &Scene,
        camera: usize,
        stale: &Stale,
    ) -> Result<Redone> {
        if stale.geometry {
            check_count(memory, scene)?;
        }
        let mut host = std::mem::take(&mut self.host);
        let known = Arc::make_mut(&mut host);
        let tree = stale.geometry || !stale.moved.is_empty();
        let all = stale.geometry || (tree && !known.move_instances(scene, &stale.moved));
        if all {
            known.update_world(scene);
        }
        let packed = tree && self.update_tree(memory, scene, known, (all, &stale.moved))?;
        check_radius(scene, known.tree.radius)?;
        if stale.materials {
            known.update_materials(scene);
        }
        if stale.sky {
            known.update_sky(scene);
        }
        self.host = host;
        let table = LightTable::of(scene, &self.host);
        let former = std::mem::replace(&mut self.variant, variant(scene, &self.host, &table, self.full));
        let layout = !former.same_layout(&self.variant);
        if tree {
            self.upload_tree(memory, packed)?;
        }
        if stale.masks || (tree && !packed) {
            self.upload_triangles(memory, scene)?;
        }
        if all || layout {
            self.upload_vertices(memory, scene)?;
        } else {
            stale.moved.iter().try_for_each(|id| self.upload_vertices_of(memory, *id))?;
        }
        let materials = self.upload_materials(memory, scene, stale, &table)?;
        if stale.sky {
            self.upload_sky(memory)?;
        }
        let casters = stale.casters || stale.moved.iter().any(|&id| focuses(scene, id));
        if casters {
            self.upload_casters(memory, scene)?;
        }
        self.upload_lights(memory, scene, &table)?;
        self.look(memory, scene, camera)?;
        self.bytes = self.sizes().iter().map(|(_, bytes)| bytes).sum();
        Ok(Redone { vertices: tree || layout, materials, casters, tree })
    }

    /// Redoes what follows from the view: the limit of footprints, and the guide of light from infinity.
    ///
    /// # Errors
    /// Those of the device.
    pub(in crate::render) fn look(&mut self, memory: Memory<'_>, scene: &Scene, camera: usize) -> Result<()> {
        let seen = |grid| seen_points(scene, &self.host, &scene.cameras[camera], grid);
        self.footprint_unit = footprint_unit(&seen(COARSE), &self.host);
        self.numbers.footprint_unit = self.footprint_unit;
        let leads = !self.guided_lights.is_empty();
        let guide = leads.then(|| Guide::of(scene, &self.host, &self.guided_lights, &seen(FINE))).flatten();
        let leads = |what: fn(&Guide) -> bool| guide.as_ref().is_some_and(what);
        let (photons, samples) = (leads(|guide| guide.leads_photons), leads(|guide| guide.leads_samples));
        (self.variant.guided, self.variant.guided_samples) = (self.full || photons, self.full || samples);
        self.numbers.guide_spheres = guide.as_ref().map_or(0, |guide| guide.spheres);
        self.numbers.guide_halos = guide.as_ref().map_or(0, |guide| guide.halos);
        let far: f64 = self.guided_lights.iter().map(|light| f64::from(light.probability)).sum();
        let greatest = guide.as_ref().filter(|_| photons).map_or(1.0, |guide| guide.greatest);
        self.greatest_share = 1.0 + far * (greatest - 1.0);
        self.numbers.guide_photons = photons.into();
        self.numbers.guide_leaves = guide.as_ref().map_or(0, |guide| guide.leaves);
        self.numbers.guide_samples = samples.into();
        let words = guide.map_or(vec![], |guide| guide.words);
        self.generation += fill(memory, &mut self.guide, "guide", &words)?;
        self.generation += fill(memory, &mut self.globals, "globals", &[self.numbers])?;
        Ok(())
    }

    /// Adds to the variant what the settings ask for.
    pub(in crate::render) fn specialise(&mut self, settings: &Settings) {
        self.variant.blinn_phong = settings.blinn_phong;
        self.variant.lens = self.full || settings.lens.is_some();
        if settings.lambert_estimate {
            (self.variant.gathers_glossy, self.variant.gathers_smooth) = (false, false);
        }
    }

    /// A scene of nothing, to be filled.
    fn empty(memory: Memory<'_>, settings: &Settings) -> Self {
        let lights_by_id = settings.tree_build != TreeBuild::Sah;
        Self {
            nodes: Persistent::detached("nodes", 0),
            triangles: Persistent::detached("triangles", 0),
            shading_data: Persistent::detached("shading_data", 0),
            materials: Persistent::detached("materials", 0),
            texture_uses: Persistent::detached("texture_uses", 0),
            texels: Persistent::detached("texels", 0),
            lights: Persistent::detached("lights", 0),
            globals: Persistent::detached("globals", 0),
            environment: Persistent::detached("environment", 0),
            environment_cdf: Persistent::detached("environment_cdf", 0),
            casters: Persistent::detached("casters", 0),
            guide: Persistent::detached("guide", 0),
            lobes: Persistent::detached("lobes", 0),
            maps: None,
            host: Arc::new(Host::empty(lights_by_id)),
            tree_build: settings.tree_build,
            device_tree: None,
            tree_updates: TreeUpdates::default(),
            host_materials: vec![],
            host_lobes: Lobes::default(),
            guided_lights: vec![],
            numbers: Globals::default(),
            full: settings.full_program,
            generation: 0,
            variant: Variant::default(),
            light_count: 0,
            has_wide_lights: false,
            has_lights_without_extent: false,
            caster_count: 0,
            triangle_count: 0,
            skipped_triangles: 0,
            fences: memory.loop_limit().is_none(),
            loop_limit: memory.loop_limit(),
            most_deposits: memory.most_deposits(),
            device_class: memory.device_class(),
            exponents: [0; 2],
            light_power: [0.0; 3],
            greatest_share: 1.0,
            radius: 1.0,
            footprint_unit: 1.0,
            surface_area: 0.0,
            bytes: 0,
        }
    }

    /// Builds a tree over the world, or refits the one that there is, on the device or on the host as the settings
    /// want it; `moved` are the instances that are elsewhere, unless `all` of the world is another. True if nodes and
    /// triangles are on the device already.
    fn update_tree(
        &mut self,
        memory: Memory<'_>,
        scene: &Scene,
        known: &mut Host,
        (all, moved): (bool, &[InstanceId]),
    ) -> Result<bool> {
        let (count, update) = (known.world.triangles.len() as u32, self.tree_updates.next());
        let (runtime, maker) = match (memory, maker(self.tree_build, all, count, self.device_class)) {
            (Memory::Device(runtime), Some(maker)) => (runtime, maker),
            _ => {
                self.device_tree = None;
                known.build_tree();
                return Ok(false);
            }
        };
        check_size(memory, scene, "tree nodes", u64::from(count) * size_of::<BvhNode>() as u64)?;
        check_size(memory, scene, "triangles", u64::from(count) * size_of::<BvhTriangle>() as u64)?;
        self.generation += grow(memory, &mut self.nodes, "nodes", count)?;
        self.generation += grow(memory, &mut self.triangles, "triangles", count)?;
        let former = self.device_tree.take().filter(|_| !all);
        let mut tree = match former {
            Some(tree) => tree,
            None => DeviceTree::new(runtime, scene, known, self.fences)?,
        };
        let made =
            tree.update((runtime, maker, update), known, (!all).then_some(moved), (&self.nodes, &self.triangles))?;
        let there = made.is_some();
        // A tree that the host makes is sent with the next refit.
        self.device_tree = made.is_some().then_some(tree);
        match made {
            Some(bvh) => known.adopt(bvh),
            None => known.build_tree(),
        }
        Ok(there)
    }

    /// The inner nodes, unless the device has them, and what is known of all triangles.
    fn upload_tree(&mut self, memory: Memory<'_>, there: bool) -> Result<()> {
        let tree = &self.host.tree;
        if !there {
            self.generation += fill_roomy(memory, &mut self.nodes, "nodes", &tree.bvh.nodes)?;
        }
        self.triangle_count = tree.bvh.order.len() as u32;
        self.skipped_triangles = tree.bvh.skipped;
        self.radius = tree.radius;
        self.surface_area = tree.surface_area;
        Ok(())
    }

    /// The triangles in the leaves, with their flags.
    fn upload_triangles(&mut self, memory: Memory<'_>, scene: &Scene) -> Result<()> {
        let bytes = self.host.tree.bvh.order.len() as u64 * size_of::<BvhTriangle>() as u64;
        check_size(memory, scene, "triangles", bytes)?;
        self.generation += fill(memory, &mut self.triangles, "triangles", &self.host.packed_triangles(scene))?;
        // What rides with triangles may be other.
        self.device_tree = None;
        Ok(())
    }

    fn upload_vertices(&mut self, memory: Memory<'_>, scene: &Scene) -> Result<()> {
        let world = &self.host.world;
        let shading = vertex_data(world, 0..world.triangles.len() as u32, &self.variant);
        check_size(memory, scene, "vertex attributes", std::mem::size_of_val(&shading[..]) as u64)?;
        self.generation += fill(memory, &mut self.shading_data, "shading_data", &shading)?;
        Ok(())
    }

    /// The attributes of one instance, in the layout and in the place that they have.
    fn upload_vertices_of(&mut self, memory: Memory<'_>, instance: InstanceId) -> Result<()> {
        let triangles = self.host.world.parts[instance.index()].triangles.clone();
        if triangles.is_empty() {
            return Ok(());
        }
        let first = triangles.start * self.variant.shading_stride;
        memory.overwrite(&self.shading_data, first, &vertex_data(&self.host.world, triangles, &self.variant))
    }

    /// Materials with the densities of the lights that they are; textures where they are stale. True if any material
    /// differs from before.
    fn upload_materials(
        &mut self,
        memory: Memory<'_>,
        scene: &Scene,
        stale: &Stale,
        table: &LightTable,
    ) -> Result<bool> {
        let mut materials = self.host_materials.clone();
        if stale.textures {
            let textures = Textures::of(scene);
            check_size(memory, scene, "textures", textures.texels.len() as u64 * 4)?;
            self.generation += fill(memory, &mut self.texture_uses, "texture_uses", &textures.uses)?;
            self.generation += fill(memory, &mut self.texels, "texels", &textures.texels)?;
            materials = textures.materials;
        } else if stale.materials {
            materials = Textures::without_texels(scene).materials;
        }
        for (material, density) in materials.iter_mut().zip(&table.densities) {
            material.light_density = *density;
        }
        if self.host_lobes.update(scene, &self.variant) || self.lobes.len() == 0 {
            self.generation += fill(memory, &mut self.lobes, "lobes", &self.host_lobes.words)?;
        }
        for (material, boundary) in materials.iter_mut().zip(&self.host_lobes.boundaries) {
            material.boundary = *boundary;
        }
        let bytes = |materials: &[DeviceMaterial]| bytemuck::cast_slice::<_, u8>(materials).to_vec();
        let differ = stale.textures || bytes(&materials) != bytes(&self.host_materials);
        if differ {
            self.generation += fill(memory, &mut self.materials, "materials", &materials)?;
            self.host_materials = materials;
        }
        Ok(differ)
    }

    fn upload_sky(&mut self, memory: Memory<'_>) -> Result<()> {
        let (texels, cdf) = self.host.sky.as_ref().map_or((&[][..], &[][..]), |sky| (&sky.texels, &sky.cdf));
        self.generation += fill(memory, &mut self.environment, "environment", texels)?;
        self.generation += fill(memory, &mut self.environment_cdf, "environment_cdf", cdf)?;
        Ok(())
    }

    fn upload_casters(&mut self, memory: Memory<'_>, scene: &Scene) -> Result<()> {
        let casters = casters(scene, &self.host.world, &self.host.tree.kept);
        self.generation += fill_roomy(memory, &mut self.casters, "casters", &casters)?;
        self.caster_count = casters.len() as u32;
        Ok(())
    }

    /// Lights; works out the numbers that follow from all of the scene.
    fn upload_lights(&mut self, memory: Memory<'_>, scene: &Scene, table: &LightTable) -> Result<()> {
        self.generation += fill_roomy(memory, &mut self.lights, "lights", &table.lights)?;
        self.light_count = table.lights.len() as u32;
        self.guided_lights = table.lights.iter().filter(|light| light.guide > 0).copied().collect();
        let sky = self.host.sky.as_ref();
        self.has_wide_lights = table.has_triangles || sky.is_some();
        self.has_lights_without_extent = table.has_delta;
        self.exponents = table.film_exponents(scene, &self.host);
        self.light_power = table.greatest_power(sky);
        let [environment_width, environment_height] = sky.map_or([0; 2], |sky| sky.size);
        self.numbers = Globals {
            center: self.host.tree.center,
            radius: self.host.tree.radius,
            light_count: self.light_count,
            caster_count: self.caster_count,
            environment_width,
            environment_height,
            environment_probability: table.environment_probability(),
            ..Globals::default()
        };
        Ok(())
    }

    /// Name and size in bytes of every buffer.
    pub fn sizes(&self) -> Vec<(&'static str, u64)> {
        let maps = self.maps.as_ref().map(|maps| ("environment maps", maps.bytes()));
        let sizes = vec![
            ("tree nodes", self.nodes.bytes()),
            ("triangles", self.triangles.bytes()),
            ("vertex attributes", self.shading_data.bytes()),
            ("materials", self.materials.bytes() + self.texture_uses.bytes()),
            ("textures", self.texels.bytes()),
            ("lights", self.lights.bytes()),
            ("environment", self.environment.bytes() + self.environment_cdf.bytes()),
            ("casters", self.casters.bytes()),
            ("guide", self.guide.bytes()),
            ("tables of lobes", self.lobes.bytes()),
        ];
        sizes.into_iter().chain(maps).collect()
    }

    /// The same scene for kernels of another variant; only for plans that nobody runs, because the vertex attributes
    /// are left behind.
    pub(in crate::render) fn with_variant(&self, variant: Variant) -> Self {
        let vectors = (self.host.world.triangles.len() as u32 * variant.shading_stride).max(1);
        let mut other = Self { variant, shading_data: Persistent::detached("shading_data", vectors), ..self.clone() };
        if variant.glossy && !self.variant.glossy {
            other.lobes = Persistent::detached("lobes", Lobes::REFLECTION);
        }
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
            guide: g.import_read(&self.guide),
            lobes: g.import_read(&self.lobes),
            pass,
        };
        (buffers, input)
    }
}

/// Whether an instance can focus light.
fn focuses(scene: &Scene, instance: InstanceId) -> bool {
    let mesh = scene.instances[instance.index()].mesh;
    is_specular(&scene.materials[scene.meshes[mesh.index()].material.index()])
}

/// What an update did beyond what was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Redone {
    /// Vertex attributes have a new layout or new contents.
    pub vertices: bool,
    /// Materials have new contents.
    pub materials: bool,
    /// Casters were found anew.
    pub casters: bool,
    /// The tree was built anew.
    pub tree: bool,
}

/// Writes to a buffer, which is replaced by a longer one where it is too short. Returns how often it was: 0 or 1.
fn fill<T: bytemuck::Pod>(
    memory: Memory<'_>,
    buffer: &mut Persistent<T>,
    name: &'static str,
    data: &[T],
) -> Result<u64> {
    if data.len().max(1) <= buffer.len() as usize {
        memory.overwrite(buffer, 0, data)?;
        return Ok(0);
    }
    *buffer = memory.filled(name, data)?;
    Ok(1)
}

/// The same with room for more: another place of a triangle is another number of nodes, another colour may be a light.
fn fill_roomy<T: bytemuck::Pod>(
    memory: Memory<'_>,
    buffer: &mut Persistent<T>,
    name: &'static str,
    data: &[T],
) -> Result<u64> {
    const LEAST: usize = 16;
    let replaced = data.len() > buffer.len() as usize || buffer.len() == 0;
    if replaced {
        *buffer = memory.zeroed(name, (data.len() + data.len() / 8 + LEAST) as u32)?;
    }
    memory.overwrite(buffer, 0, data)?;
    Ok(u64::from(replaced))
}

/// Replaces a buffer that is too short for `len` elements by one that is not. Returns how often it was: 0 or 1.
fn grow<T: bytemuck::Pod>(memory: Memory<'_>, buffer: &mut Persistent<T>, name: &'static str, len: u32) -> Result<u64> {
    let replaced = len > buffer.len();
    if replaced {
        *buffer = memory.zeroed(name, len)?;
    }
    Ok(u64::from(replaced))
}

/// Areas of the scene and of its sphere, and what is divided by them, stay within single precision.
fn check_radius(scene: &Scene, radius: f32) -> Result<()> {
    const LARGEST: f32 = (1u64 << 60) as f32;
    if (LARGEST.recip()..=LARGEST).contains(&radius) {
        return Ok(());
    }
    let cause = format!("its radius of {radius:e} is not between 2^-60 and 2^60: choose another unit of length");
    scene.named(Err(cause))
}

/// Refuses more triangles than the device can bind before anything is made of them: that would take minutes.
fn check_count(memory: Memory<'_>, scene: &Scene) -> Result<()> {
    let bytes = |triangles: u64| triangles.saturating_mul(size_of::<BvhTriangle>() as u64);
    let all = scene.triangle_count();
    if bytes(all) <= memory.longest_binding() {
        return Ok(());
    }
    // Those without area are left out.
    check_size(memory, scene, "triangles", bytes(all - scene.skipped_triangles().min(all)))
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
