//! Meshes and their instances: every primitive of the file that is placed becomes a mesh.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use glam::DMat4;

use super::Limits;
use super::accessor::{Reader, Use};
use super::animation::Animations;
use super::deform::{self, Placement};
use super::document::Document;
use super::instancing;
use super::material::UvSets;
use super::nodes::Hierarchy;
use super::notes::{Notes, Outcome};
use super::part::Part;
use super::primitive::{self, Primitive, PrimitiveReader, Target};
use super::variants::Chosen;
use crate::scene::flatten::Tangents;
use crate::scene::motion::{Body, Displacement, Moving, Skin, displace};
use crate::scene::transform::spans_a_plane;
use crate::scene::world::Needed;
use crate::scene::{Instance, MaterialId, Mesh, MeshId, Scene};

/// A place of a mesh.
#[derive(Clone)]
pub(super) struct Spot {
    /// Place of its node.
    pub place: u32,
    /// Index of that in the file.
    pub node: u32,
    pub skin: Option<u32>,
    pub to_world: DMat4,
    /// Before the transform of a node that moves (EXT_mesh_gpu_instancing).
    pub offset: Option<Box<DMat4>>,
    /// The name of the node, shared by its instances.
    pub name: Arc<str>,
}

/// A primitive as it is placed, and how it is shown most recently.
pub(super) struct Shown<'a> {
    pub primitive: &'a Primitive,
    /// Morph weights of the mesh in the file.
    pub weights: &'a [f32],
    /// The mesh of instances that are neither bent nor morphed.
    pub plain: Option<MeshId>,
    /// The mesh of the last node that bends or morphs it, and that node: its copies share it.
    pub own: Option<(u32, MeshId)>,
    /// What moves its vertices, if something does.
    pub body: Option<Arc<Body>>,
}

/// The materials that placed primitives use, in file order; `None` is the default material.
pub(super) fn used_materials(document: &Document, hierarchy: &Hierarchy, chosen: &Chosen) -> Vec<Option<u32>> {
    let mut mesh_used = vec![false; document.meshes.len()];
    for mesh in hierarchy.placed.iter().filter_map(|placed| placed.holds.mesh) {
        if let Some(used) = mesh_used.get_mut(mesh as usize) {
            *used = true;
        }
    }
    let quiet = &mut Notes::default();
    let mut materials = Vec::new();
    for mesh in (0..mesh_used.len()).filter(|mesh| mesh_used[*mesh]).filter_map(|mesh| document.meshes.part(mesh).ok())
    {
        let primitives = mesh.list("primitives", quiet).into_iter();
        let primitives = primitives.filter_map(|json| Part::of(String::new(), json).ok());
        materials.extend(primitives.map(|part| chosen.material(document, &part, &mut Notes::default())));
        materials.sort_unstable();
        materials.dedup();
    }
    materials
}

/// Reads the meshes of a document.
pub(super) struct MeshReader<'a> {
    pub(super) document: &'a Document<'a>,
    pub(super) reader: Reader<'a>,
    pub(super) animations: &'a Animations,
    /// What moves of all that was read.
    pub(super) moving: Moving,
    /// Skins that were read.
    pub(super) skins: HashMap<u32, Arc<Skin>>,
    /// Whether joints of a skin move.
    pub(super) bends: HashMap<u32, bool>,
    limits: &'a Limits,
    used_materials: &'a [Option<u32>],
    /// Sets of texture coordinates of each of them.
    uv_sets: &'a [UvSets],
    chosen: &'a Chosen,
    /// Triangles of all instances so far, skipped ones included: they cost time as well.
    triangles: u64,
}

/// Bytes that an instance takes in the end.
const INSTANCE_BYTES: u64 = 320;

impl<'a> MeshReader<'a> {
    pub fn new(
        (document, animations): (&'a Document<'a>, &'a Animations),
        limits: &'a Limits,
        (used_materials, uv_sets): (&'a [Option<u32>], &'a [UvSets]),
        chosen: &'a Chosen,
    ) -> Self {
        Self {
            document,
            reader: Reader::new(document, limits),
            animations,
            moving: Moving::default(),
            skins: HashMap::new(),
            bends: HashMap::new(),
            limits,
            used_materials,
            uv_sets,
            chosen,
            triangles: 0,
        }
    }

    /// Adds every instance of every mesh, mesh by mesh, each decoded once.
    pub fn add_all(&mut self, hierarchy: &Hierarchy, scene: &mut Scene, notes: &mut Notes) -> Outcome<()> {
        let spots = self.spots(hierarchy, notes)?;
        self.refuse_early(&spots)?;
        let needed = Needed::of(scene);
        for (m, list) in spots.iter().enumerate().filter(|(_, list)| !list.is_empty()) {
            let Some(mesh) = notes.or_lost(self.document.meshes.part(m)) else { continue };
            let name: Arc<str> = mesh.text("name", notes).unwrap_or_default().into();
            let weights = mesh.list_of_numbers("weights", notes).unwrap_or_default();
            for (p, json) in mesh.list("primitives", notes).into_iter().enumerate() {
                let part = Part::of(format!("mesh {m}, primitive {p}"), json);
                let read = part.and_then(|part| self.primitive(&part, (list, &needed), scene, notes));
                let Some(mut primitive) = notes.or_lost(read).flatten() else { continue };
                primitive.mesh.name = name.clone();
                primitive::clean(&mut primitive.mesh, notes);
                let shown = Shown { primitive: &primitive, weights: &weights, plain: None, own: None, body: None };
                self.show_all(shown, list, hierarchy, (scene, &needed), notes)?;
            }
        }
        Ok(())
    }

    /// The places of each mesh of the file.
    fn spots(&mut self, hierarchy: &Hierarchy, notes: &mut Notes) -> Outcome<Vec<Vec<Spot>>> {
        let mut spots: Vec<Vec<Spot>> = vec![Vec::new(); self.document.meshes.len()];
        let mut total = 0;
        for (place, placed) in hierarchy.placed.iter().enumerate() {
            let Some(mesh) = placed.holds.mesh else { continue };
            let Some(list) = spots.get_mut(mesh as usize) else {
                notes.loss(format!("node {}: mesh {mesh} does not exist", placed.node));
                continue;
            };
            let transforms = instancing::transforms(self.document, &self.reader, placed, self.limits, notes);
            let Some(transforms) = notes.or_lost(transforms) else { continue };
            let count = transforms.as_ref().map_or(1, Vec::len) as u64;
            total += count;
            if total > self.limits.nodes {
                return Err(format!("more than {} instances", self.limits.nodes));
            }
            self.document.buffers.charge(INSTANCE_BYTES * count)?;
            let node = notes.or_fault(self.document.nodes.part(placed.node as usize));
            let name: Arc<str> = node.and_then(|node| node.text("name", notes)).unwrap_or_default().into();
            let spot = |to_world, offset| {
                let (place, node, skin) = (place as u32, placed.node, placed.holds.skin);
                Spot { place, node, skin, to_world, offset, name: name.clone() }
            };
            let moves = placed.life.moves;
            match transforms {
                None => list.push(spot(placed.to_world, None)),
                Some(all) => {
                    list.extend(all.into_iter().map(|own| spot(placed.to_world * own, moves.then(|| Box::new(own)))))
                }
            }
        }
        Ok(spots)
    }

    /// Refuses too many triangles before anything is read.
    fn refuse_early(&self, spots: &[Vec<Spot>]) -> Outcome<()> {
        let mut total = 0u64;
        for (m, list) in spots.iter().enumerate().filter(|(_, list)| !list.is_empty()) {
            let Ok(mesh) = self.document.meshes.part(m) else { continue };
            let primitives = mesh.list("primitives", &mut Notes::default());
            let parts = primitives.into_iter().filter_map(|json| Part::of(String::new(), json).ok());
            let once: u64 = parts.map(|part| primitive::announced_triangles(self.document, &part)).sum();
            total = total.saturating_add(once.saturating_mul(list.len() as u64));
        }
        if total > self.limits.triangles {
            return Err(format!("{total} triangles, more than the limit of {}", self.limits.triangles));
        }
        Ok(())
    }

    /// Decodes a primitive; `None` for points and lines, which are counted, and where nothing is left.
    fn primitive(
        &self,
        part: &Part<'a>,
        (list, needed): (&[Spot], &Needed),
        scene: &mut Scene,
        notes: &mut Notes,
    ) -> Outcome<Option<Primitive>> {
        let material = self.chosen.material(self.document, part, notes);
        let material = self.used_materials.binary_search(&material).unwrap_or(0) as u32;
        let skinned = list.iter().any(|spot| spot.skin.is_some());
        let uv_sets = self.uv_sets.get(material as usize).copied().unwrap_or_default().of_file();
        let reader = PrimitiveReader { document: self.document, reader: &self.reader, needed, uv_sets, skinned };
        let at = |cause| format!("{}: {cause}", part.place);
        let Some(primitive) = reader.read(part, MaterialId(material), notes).map_err(at)? else {
            scene.skipped.non_triangle_primitives += 1;
            return Ok(None);
        };
        let mut refs = scene.materials[material as usize].texture_refs();
        if let Some(r) = refs.find(|r| primitive.mesh.uvs[r.uv_set as usize].is_empty()) {
            notes.note(format!(
                "a mesh lacks texture coordinates {} that its material uses",
                uv_sets[r.uv_set as usize]
            ));
        }
        Ok(Some(primitive).filter(|primitive| !primitive.mesh.triangles.is_empty()))
    }

    fn show_all(
        &mut self,
        mut shown: Shown,
        list: &[Spot],
        hierarchy: &Hierarchy,
        (scene, needed): (&mut Scene, &Needed),
        notes: &mut Notes,
    ) -> Outcome<()> {
        for spot in list {
            self.count(shown.primitive.mesh.triangles.len(), scene)?;
            if self.is_moving(&shown, spot, hierarchy) {
                let placed = self.show_moving(&mut shown, spot, hierarchy, scene, notes);
                notes.or_lost(placed);
                continue;
            }
            let placement = self.placement(spot, hierarchy, notes);
            let Some(placement) = notes.or_fault(placement) else { continue };
            let placed = self.show(&mut shown, spot, &placement, (scene, needed), notes);
            notes.or_lost(placed);
        }
        Ok(())
    }

    /// Counts an instance of so many triangles before anything is done for it.
    fn count(&mut self, triangles: usize, scene: &Scene) -> Outcome<()> {
        self.triangles += triangles as u64;
        if self.triangles > self.limits.triangles {
            return Err(format!("more than {} triangles", self.limits.triangles));
        }
        if scene.instances.len() as u64 >= self.limits.nodes {
            return Err(format!("more than {} instances", self.limits.nodes));
        }
        Ok(())
    }

    /// Adds an instance, and its mesh if that is not there yet. What is bent gets a mesh in world space.
    fn show(
        &self,
        shown: &mut Shown,
        spot: &Spot,
        placement: &Placement,
        (scene, needed): (&mut Scene, &Needed),
        notes: &mut Notes,
    ) -> Outcome<()> {
        let primitive = shown.primitive;
        let known = shown.own.filter(|(owner, _)| *owner == spot.node);
        let mesh = if let Some((_, mesh)) = known {
            mesh
        } else {
            let shape = self.shape(shown, spot, notes)?;
            let is_plain = matches!((placement, &shape), (Placement::Rigid(_), Cow::Borrowed(_)));
            let mesh = match (placement, shown.plain) {
                (Placement::Rigid(_), Some(plain)) if is_plain => plain,
                (Placement::Rigid(_), _) => self.add(scene, shape.into_owned())?,
                (Placement::Skinned(joints), _) => {
                    let tangents = Tangents(scene.materials[primitive.mesh.material.index()].normal_texture);
                    let tangents = needed.tangents.then_some(&tangents);
                    let (mesh, rest) = deform::bent(primitive, &shape, joints, tangents);
                    scene.skipped.add(rest.skipped);
                    notes.replaced_normals(rest.replaced_normals);
                    self.add(scene, mesh)?
                }
            };
            if is_plain {
                shown.plain = Some(mesh);
            } else {
                shown.own = Some((spot.node, mesh));
            }
            mesh
        };
        let transform = match placement {
            Placement::Rigid(transform) => Some(*transform),
            Placement::Skinned(_) => None,
        };
        scene.add_instance(Instance { name: spot.name.clone(), mesh, transform, visible: true });
        Ok(())
    }

    /// The mesh as a node has it, at its weights or those of the mesh.
    pub(super) fn shape<'p>(&self, shown: &Shown<'p>, spot: &Spot, notes: &mut Notes) -> Outcome<Cow<'p, Mesh>> {
        if shown.primitive.targets.is_empty() {
            return Ok(Cow::Borrowed(&shown.primitive.mesh));
        }
        Ok(self.morphed(shown.primitive, &self.weights(shown, spot.node, notes)?, notes))
    }

    /// The morph weights of a node at rest.
    pub(super) fn weights(&self, shown: &Shown, node: u32, notes: &mut Notes) -> Outcome<Vec<f32>> {
        let own = self.document.nodes.part(node as usize)?.list_of_numbers("weights", notes);
        Ok(own.unwrap_or_else(|| shown.weights.to_vec()))
    }

    /// Adds a mesh to the scene within the memory that the file may ask for.
    pub(super) fn add(&self, scene: &mut Scene, mesh: Mesh) -> Outcome<MeshId> {
        let vertex = [12, if mesh.normals.is_empty() { 0 } else { 12 }, if mesh.tangents.is_empty() { 0 } else { 16 }];
        let vertex = vertex.iter().sum::<u64>() + if mesh.colors.is_empty() { 0 } else { 16 };
        self.document.buffers.charge(vertex * mesh.positions.len() as u64 + 12 * mesh.triangles.len() as u64)?;
        Ok(scene.add_mesh(mesh))
    }

    /// The mesh of a primitive at the given morph weights; missing and non-finite weights count as zero. A displacement
    /// that cannot be read is left out.
    fn morphed<'p>(&self, primitive: &'p Primitive, weights: &[f32], notes: &mut Notes) -> Cow<'p, Mesh> {
        let mut mesh = Cow::Borrowed(&primitive.mesh);
        let active = primitive.targets.iter().zip(weights).filter(|(_, w)| w.is_finite() && **w != 0.0);
        for (target, &weight) in active {
            let Displacement { positions, normals, tangents } = self.displacement(primitive, target, notes);
            let mesh = mesh.to_mut();
            displace(&mut mesh.positions, &positions, weight);
            displace(&mut mesh.normals, &normals, weight);
            displace(&mut mesh.tangents, &tangents, weight);
        }
        mesh
    }

    /// What a morph target adds; lists that cannot be read are left out.
    pub(super) fn displacement(&self, primitive: &Primitive, target: &Target, notes: &mut Notes) -> Displacement {
        let mut read = |accessor, role| {
            let read = primitive.displacements(&self.reader, accessor, role, notes);
            notes.or_fault(read.map_err(|cause| format!("a morph target is ignored: {cause}"))).unwrap_or_default()
        };
        let positions = read(target.positions, Use::Position);
        let normals = read(target.normals, Use::Normal);
        Displacement { positions, normals, tangents: read(target.tangents, Use::Normal) }
    }

    /// Where an instance goes.
    fn placement(&self, spot: &Spot, hierarchy: &Hierarchy, notes: &mut Notes) -> Outcome<Placement> {
        if let Some(skin) = spot.skin {
            let joints = self.joints(skin, hierarchy, notes);
            let joints = joints.map_err(|cause| format!("skin {skin} is ignored: {cause}"));
            if let Some(joints) = notes.or_lost(joints) {
                return Ok(Placement::Skinned(joints));
            }
        }
        let to_world = &spot.to_world;
        if !to_world.is_finite() || !spans_a_plane(to_world) {
            return Err(format!("node {}: its transform leaves no surface; its mesh was skipped", spot.node));
        }
        Ok(Placement::Rigid((*to_world).into()))
    }

    /// The matrices of a skin's joints.
    fn joints(&self, skin: u32, hierarchy: &Hierarchy, notes: &mut Notes) -> Outcome<Vec<DMat4>> {
        let joint = |(node, inverse)| {
            let world = hierarchy.to_world(node).ok_or_else(|| format!("node {node} does not exist"))?;
            Ok(world * inverse)
        };
        self.bound(skin, notes)?.into_iter().map(joint).collect()
    }

    /// The nodes of a skin's joints, and what brings the mesh to each.
    pub(super) fn bound(&self, skin: u32, notes: &mut Notes) -> Outcome<Vec<(u32, DMat4)>> {
        let part = self.document.skins.part(skin as usize)?;
        let nodes = part.indices("joints", notes);
        let inverse = match part.index("inverseBindMatrices")? {
            Some(accessor) => self.reader.floats::<16>(&self.reader.open(accessor, Use::Matrix, notes)?, None)?,
            None => vec![DMat4::IDENTITY.as_mat4().to_cols_array(); nodes.len()],
        };
        if inverse.len() < nodes.len() {
            return Err(format!("it has {} matrices for {} joints", inverse.len(), nodes.len()));
        }
        let matrices = inverse.iter().map(|inverse| DMat4::from_cols_array(&inverse.map(f64::from)));
        Ok(nodes.into_iter().zip(matrices).collect())
    }
}
