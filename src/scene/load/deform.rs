//! Where vertices go that do not move: rigid instances, skins in the pose of the file.

use glam::DMat4;

use super::primitive::Primitive;
use crate::scene::flatten::{self, Flat, Tangents};
use crate::scene::motion::vertex_matrices;
use crate::scene::{Mesh, Transform};

/// Mesh space to world.
pub(super) enum Placement {
    /// One transform for all vertices.
    Rigid(Transform),
    /// Joint matrices; the node's own transform does not count (glTF 2.0, section 3.7.3.3).
    Skinned(Vec<DMat4>),
}

/// The mesh of a primitive bent by its joints, in world space, with what was left out of it; with tangents where they
/// are wanted.
pub(super) fn bent(primitive: &Primitive, shape: &Mesh, joints: &[DMat4], tangents: Option<&Tangents>) -> (Mesh, Flat) {
    let matrices = vertex_matrices(&primitive.influences, primitive.mesh.positions.len(), joints);
    let mut flat = flatten::place(shape, &flatten::Placement::Bent(&matrices), tangents);
    let vertices = std::mem::take(&mut flat.vertices);
    let mesh = Mesh {
        positions: vertices.positions,
        normals: vertices.normals,
        tangents: std::mem::take(&mut flat.tangents),
        uvs: [0, 1].map(|set| gathered(&shape.uvs[set], &vertices.source)),
        colors: gathered(&shape.colors, &vertices.source),
        triangles: vertices.triangles,
        name: shape.name.clone(),
        material: shape.material,
    };
    (mesh, flat)
}

fn gathered<T: Copy>(values: &[T], source: &[u32]) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { source.iter().map(|&v| values[v as usize]).collect() }
}
