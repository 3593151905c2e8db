//! Meshes and their instances: every primitive of the file that is placed becomes a mesh.

use std::sync::Arc;

use glam::{DMat4, DVec3};
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Mode, Primitive as JsonPrimitive, Semantic};
use gltf::json::scene::Node;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use serde_json::Value;

use super::accessor::{Reader, Use};
use super::deform::{self, Influence, Morph, Placement};
use super::document::Document;
use super::nodes::{self, Hierarchy, Placed};
use super::{Limits, Notes, Outcome};
use crate::scene::flatten::Tangents;
use crate::scene::transform::spans_a_plane;
use crate::scene::world::Needed;
use crate::scene::{Instance, MaterialId, Mesh, MeshId, Scene, TextureRef};

/// A decoded primitive: a mesh in its own space, and what may bend it.
#[derive(Default)]
pub(super) struct Primitive {
    pub mesh: Mesh,
    pub morphs: Vec<Morph>,
    pub influences: Vec<Influence>,
}

/// A primitive as it is placed, and how it is shown most recently.
struct Shown<'a> {
    primitive: &'a Primitive,
    /// Morph weights of the mesh in the file.
    weights: &'a [f32],
    /// The mesh of instances that are neither bent nor morphed.
    plain: Option<MeshId>,
    /// The mesh of the last node that bends or morphs it, and that node: its copies share it.
    own: Option<(usize, MeshId)>,
}

/// The materials that placed primitives use, in file order; `None` is the default material.
pub(super) fn used_materials(root: &Root, hierarchy: &Hierarchy) -> Vec<Option<usize>> {
    let mut mesh_used = vec![false; root.meshes.len()];
    for placed in &hierarchy.placed {
        if let Some(used) = root.nodes[placed.node].mesh.and_then(|m| mesh_used.get_mut(m.value())) {
            *used = true;
        }
    }
    let meshes = root.meshes.iter().zip(mesh_used).filter(|(_, used)| *used);
    let mut materials: Vec<_> =
        meshes.flat_map(|(mesh, _)| &mesh.primitives).map(|p| p.material.map(|m| m.value())).collect();
    materials.sort_unstable();
    materials.dedup();
    materials
}

/// Reads the meshes of a document.
pub(super) struct MeshReader<'a> {
    document: &'a Document,
    reader: Reader<'a>,
    limits: &'a Limits,
    used_materials: &'a [Option<usize>],
    /// Triangles of all instances so far, skipped ones included: they cost time as well.
    triangles: u64,
    /// The names of nodes, shared by their instances.
    names: Vec<Arc<str>>,
}

impl<'a> MeshReader<'a> {
    pub fn new(document: &'a Document, limits: &'a Limits, used_materials: &'a [Option<usize>]) -> Self {
        let name = |node: &Node| Arc::from(node.name.as_deref().unwrap_or_default());
        let names = document.root.nodes.iter().map(name).collect();
        Self { document, reader: Reader::new(document, limits), limits, used_materials, triangles: 0, names }
    }

    /// Adds every instance of every mesh, mesh by mesh, each decoded once.
    pub fn add_all(&mut self, hierarchy: &Hierarchy, scene: &mut Scene, notes: &mut Notes) -> Outcome<()> {
        let root = &self.document.root;
        let mut instances: Vec<Vec<Placed>> = vec![Vec::new(); root.meshes.len()];
        let mut total = 0;
        for placed in &hierarchy.placed {
            let Some(mesh) = root.nodes[placed.node].mesh.map(|m| m.value()) else { continue };
            let list = instances.get_mut(mesh).ok_or_else(|| format!("mesh {mesh} does not exist"))?;
            self.instances(placed, list, &mut total)?;
        }
        let needed = Needed::of(scene);
        for (m, list) in instances.iter().enumerate().filter(|(_, list)| !list.is_empty()) {
            for (p, json) in root.meshes[m].primitives.iter().enumerate() {
                let at = |cause| format!("meshes[{m}].primitives[{p}]: {cause}");
                let Some(mut primitive) = self.primitive(json, scene, notes).map_err(at)? else { continue };
                if primitive.mesh.triangles.is_empty() {
                    continue;
                }
                primitive.mesh.name = root.meshes[m].name.as_deref().unwrap_or_default().into();
                clean(&mut primitive.mesh, &needed, notes);
                let weights = root.meshes[m].weights.as_deref().unwrap_or(&[]);
                let mut shown = Shown { primitive: &primitive, weights, plain: None, own: None };
                for placed in list {
                    self.count(primitive.mesh.triangles.len(), scene)?;
                    let Some(placement) = self.placement(placed, hierarchy, notes).map_err(at)? else { continue };
                    self.show(&mut shown, placed.node, &placement, (scene, &needed), notes);
                }
            }
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
        node: usize,
        placement: &Placement,
        (scene, needed): (&mut Scene, &Needed),
        notes: &mut Notes,
    ) {
        let primitive = shown.primitive;
        let shape =
            deform::morphed(primitive, self.document.root.nodes[node].weights.as_deref().unwrap_or(shown.weights));
        let known = shown.own.filter(|(owner, _)| *owner == node).map(|(_, mesh)| mesh);
        let (mesh, transform) = match placement {
            Placement::Rigid(transform) if matches!(shape, std::borrow::Cow::Borrowed(_)) => {
                (*shown.plain.get_or_insert_with(|| scene.add_mesh(primitive.mesh.clone())), Some(*transform))
            }
            Placement::Rigid(transform) => {
                let mesh = known.unwrap_or_else(|| scene.add_mesh(shape.into_owned()));
                shown.own = Some((node, mesh));
                (mesh, Some(*transform))
            }
            Placement::Skinned(joints) => {
                let tangents = Tangents(scene.materials[primitive.mesh.material.index()].normal_texture);
                let mesh = known.unwrap_or_else(|| {
                    let (mesh, rest) = deform::bent(primitive, &shape, joints, needed.tangents.then_some(&tangents));
                    scene.skipped.add(rest.skipped);
                    notes.replaced_normals(rest.replaced_normals);
                    scene.add_mesh(mesh)
                });
                shown.own = Some((node, mesh));
                (mesh, None)
            }
        };
        scene.add_instance(Instance { name: self.names[node].clone(), mesh, transform, visible: true });
    }

    /// One instance, or those of EXT_mesh_gpu_instancing.
    fn instances(&mut self, placed: &Placed, list: &mut Vec<Placed>, total: &mut u64) -> Outcome<()> {
        let node = &self.document.root.nodes[placed.node];
        let locals = match instancing(node) {
            None => vec![DMat4::IDENTITY],
            Some(attributes) => {
                self.instance_transforms(attributes).map_err(|cause| format!("node {}: {cause}", placed.node))?
            }
        };
        *total += locals.len() as u64;
        if *total > self.limits.nodes {
            return Err(format!("more than {} instances", self.limits.nodes));
        }
        list.extend(locals.iter().map(|local| Placed { node: placed.node, to_world: placed.to_world * *local }));
        Ok(())
    }

    fn instance_transforms(&mut self, attributes: &Value) -> Outcome<Vec<DMat4>> {
        let accessor = |name: &str| match attributes.get(name).map(Value::as_u64) {
            None => Ok(None),
            Some(Some(i)) if i <= u64::from(u32::MAX) => Ok(Some(Index::<Accessor>::new(i as u32))),
            Some(_) => Err(format!("instance attribute {name} is not an accessor")),
        };
        let (translation, rotation, scale) = (accessor("TRANSLATION")?, accessor("ROTATION")?, accessor("SCALE")?);
        let first = translation.or(rotation).or(scale).ok_or("instancing without attributes that place anything")?;
        let count = self.reader.count(first)?;
        if count > self.limits.nodes {
            return Err(format!("{count} instances, more than the limit of {}", self.limits.nodes));
        }
        let mut vectors = |index: Option<_>, default| match index {
            Some(index) => self.reader.floats::<3>(index, Use::Vector),
            None => Ok(vec![default; count as usize]),
        };
        let (translations, scales) = (vectors(translation, [0.0; 3])?, vectors(scale, [1.0; 3])?);
        let rotations = match rotation {
            Some(index) => self.reader.floats::<4>(index, Use::Rotation)?,
            None => vec![[0.0, 0.0, 0.0, 1.0]; count as usize],
        };
        if translations.len() != rotations.len() || scales.len() != rotations.len() {
            return Err("instance attributes of different lengths".into());
        }
        let vec3 = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let transforms = translations.iter().zip(&scales).zip(&rotations).map(|((t, s), r)| {
            DMat4::from_scale_rotation_translation(vec3(*s), nodes::rotation(*r).unwrap_or_default(), vec3(*t))
        });
        Ok(transforms.collect())
    }

    /// Where an instance goes; `None` (with a warning) if it cannot be placed.
    fn placement(&mut self, placed: &Placed, hierarchy: &Hierarchy, notes: &mut Notes) -> Outcome<Option<Placement>> {
        let root = &self.document.root;
        let Some(index) = root.nodes[placed.node].skin.map(|s| s.value()) else {
            if !placed.to_world.is_finite() || !spans_a_plane(&placed.to_world) {
                notes.fault(format!("node {}: its transform leaves no surface; its mesh was skipped", placed.node));
                return Ok(None);
            }
            return Ok(Some(Placement::Rigid(placed.to_world.into())));
        };
        let skin = root.skins.get(index).ok_or_else(|| format!("skin {index} does not exist"))?;
        let inverse_bind = match skin.inverse_bind_matrices {
            Some(accessor) => self.reader.floats::<16>(accessor, Use::Matrix)?,
            None => vec![DMat4::IDENTITY.as_mat4().to_cols_array(); skin.joints.len()],
        };
        if inverse_bind.len() < skin.joints.len() {
            return Err(format!("skin {index} has fewer matrices than joints"));
        }
        let mut joints = Vec::with_capacity(skin.joints.len());
        for (joint, inverse) in skin.joints.iter().zip(&inverse_bind) {
            let world = hierarchy.world.get(joint.value()).ok_or_else(|| format!("skin {index}: no such joint"))?;
            joints.push(*world * DMat4::from_cols_array(&inverse.map(f64::from)));
        }
        Ok(Some(Placement::Skinned(joints)))
    }

    /// Decodes a primitive; `None` for points and lines, which are counted.
    fn primitive(&mut self, json: &JsonPrimitive, scene: &mut Scene, notes: &mut Notes) -> Outcome<Option<Primitive>> {
        let Checked::Valid(mode) = json.mode else { return Err("unknown mode".into()) };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            scene.skipped.non_triangle_primitives += 1;
            return Ok(None);
        }
        let material = json.material.map(|m| m.value());
        let material = self.used_materials.binary_search(&material).map_err(|_| "its material does not exist")? as u32;
        let mut primitive = self.attributes(json)?;
        primitive.mesh.material = MaterialId(material);
        let missing = |r: &&TextureRef| primitive.mesh.uvs[r.uv_set as usize].is_empty();
        if let Some(r) = scene.materials[material as usize].texture_refs().find(missing) {
            notes.note(format!("a mesh lacks texture coordinates {} that its material uses", r.uv_set));
        }
        let count = primitive.mesh.positions.len();
        let indices = match json.indices {
            Some(accessor) => self.reader.indices(accessor)?,
            None => (0..count as u32).collect(),
        };
        if let Some(index) = indices.iter().find(|&&i| i as usize >= count) {
            return Err(format!("vertex index {index} is out of range of {count} vertices"));
        }
        primitive.mesh.triangles = triangles(mode, &indices);
        primitive.drop_unused_vertices();
        Ok(Some(primitive))
    }

    fn attributes(&mut self, json: &JsonPrimitive) -> Outcome<Primitive> {
        let attribute = |semantic| json.attributes.get(&Checked::Valid(semantic)).copied();
        let position = attribute(Semantic::Positions).ok_or("it has no POSITION")?;
        let positions = self.reader.floats::<3>(position, Use::Position)?;
        let count = positions.len();
        let uv = [attribute(Semantic::TexCoords(0)), attribute(Semantic::TexCoords(1))];
        let mesh = Mesh {
            positions,
            normals: self.optional(attribute(Semantic::Normals), Use::Normal, count)?,
            tangents: self.optional(attribute(Semantic::Tangents), Use::Tangent, count)?,
            uvs: [self.optional(uv[0], Use::Uv, count)?, self.optional(uv[1], Use::Uv, count)?],
            colors: self.optional(attribute(Semantic::Colors(0)), Use::Color, count)?,
            ..Mesh::default()
        };
        let mut primitive = Primitive { mesh, ..Primitive::default() };
        for set in 0.. {
            let (joints, weights) = (attribute(Semantic::Joints(set)), attribute(Semantic::Weights(set)));
            let (Some(joints), Some(weights)) = (joints, weights) else { break };
            primitive.influences.push(Influence {
                joints: self.optional(Some(joints), Use::Joints, count)?,
                weights: self.optional(Some(weights), Use::Weights, count)?,
            });
        }
        for target in json.targets.iter().flatten() {
            primitive.morphs.push(Morph {
                positions: self.optional(target.positions, Use::Position, count)?,
                normals: self.optional(target.normals, Use::Normal, count)?,
                tangents: self.optional(target.tangents, Use::Normal, count)?,
            });
        }
        Ok(primitive)
    }

    /// An attribute with `count` elements, or nothing.
    fn optional<const N: usize>(
        &mut self,
        accessor: Option<Index<Accessor>>,
        role: Use,
        count: usize,
    ) -> Outcome<Vec<[f32; N]>> {
        let Some(accessor) = accessor else { return Ok(Vec::new()) };
        let values = self.reader.floats(accessor, role)?;
        if values.len() != count {
            return Err(format!("{} elements of {role:?} for {count} vertices", values.len()));
        }
        Ok(values)
    }
}

fn instancing(node: &Node) -> Option<&Value> {
    node.extensions.as_ref()?.others.get("EXT_mesh_gpu_instancing")?.get("attributes")
}

/// The triangles of a list, strip or fan (glTF 2.0, section 3.7.2.1).
fn triangles(mode: Mode, indices: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let turned =
                |i: usize, w: &[u32]| if i.is_multiple_of(2) { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] };
            indices.windows(3).enumerate().map(|(i, w)| turned(i, w)).collect()
        }
        Mode::TriangleFan => match indices.split_first() {
            Some((first, rest)) => rest.windows(2).map(|w| [w[0], w[1], *first]).collect(),
            None => Vec::new(),
        },
        _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}

impl Primitive {
    /// Keeps only vertices that a triangle uses, so that the limit on triangles bounds the vertices as well.
    fn drop_unused_vertices(&mut self) {
        let mesh = &mut self.mesh;
        let mut used = vec![false; mesh.positions.len()];
        for &i in mesh.triangles.iter().flatten() {
            used[i as usize] = true;
        }
        if used.iter().all(|&u| u) {
            return;
        }
        let mut next = 0;
        let renumbered: Vec<u32> = used
            .iter()
            .map(|&u| {
                if u {
                    next += 1;
                    next - 1
                } else {
                    0
                }
            })
            .collect();
        for i in mesh.triangles.iter_mut().flatten() {
            *i = renumbered[*i as usize];
        }
        keep(&mut mesh.positions, &used);
        keep(&mut mesh.normals, &used);
        keep(&mut mesh.tangents, &used);
        keep(&mut mesh.colors, &used);
        mesh.uvs.iter_mut().for_each(|uvs| keep(uvs, &used));
        for morph in &mut self.morphs {
            keep(&mut morph.positions, &used);
            keep(&mut morph.normals, &used);
            keep(&mut morph.tangents, &used);
        }
        for influence in &mut self.influences {
            keep(&mut influence.joints, &used);
            keep(&mut influence.weights, &used);
        }
    }
}

fn keep<T>(values: &mut Vec<T>, used: &[bool]) {
    let mut used = used.iter();
    values.retain(|_| used.next().is_some_and(|&u| u));
}

/// Texture coordinates and colours that no material or mesh needs are dropped, those out of range are clamped.
fn clean(mesh: &mut Mesh, needed: &Needed, notes: &mut Notes) {
    for (uvs, _) in mesh.uvs.iter_mut().zip(needed.uvs).filter(|(_, needed)| !needed) {
        uvs.clear();
    }
    let mut clamped = false;
    for uv in mesh.uvs.iter_mut().flatten() {
        clamped |= clamp(uv, f32::MIN, f32::MAX);
    }
    for color in &mut mesh.colors {
        clamped |= clamp(color, 0.0, 1.0);
    }
    if clamped {
        notes.fault("vertex colours or texture coordinates out of range were clamped".into());
    }
}

/// Brings values within bounds, NaN to zero; true if any was not.
fn clamp(values: &mut [f32], low: f32, high: f32) -> bool {
    let mut clamped = false;
    for value in values.iter_mut().filter(|value| !(**value >= low && **value <= high)) {
        *value = if value.is_nan() { 0.0 } else { value.clamp(low, high) };
        clamped = true;
    }
    clamped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        assert_eq!(triangles(Mode::TriangleStrip, &[0, 1, 2, 3, 4]), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(triangles(Mode::TriangleFan, &[9, 1, 2, 3]), [[1, 2, 9], [2, 3, 9]]);
        assert_eq!(triangles(Mode::Triangles, &[0, 1, 2, 3, 4]), [[0, 1, 2]]);
        assert!(triangles(Mode::TriangleFan, &[]).is_empty());
    }
}
