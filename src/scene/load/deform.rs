//! Where vertices go: rigid instances, skins in the pose of the file, morph targets at their default weights.

use glam::DMat4;

use super::primitive::Primitive;
use crate::scene::flatten::{self, Flat, Tangents};
use crate::scene::{Mesh, Transform};

/// Four joints and weights per vertex.
pub(super) struct Influence {
    /// Indices into the joints of the skin, as the file's integers.
    pub joints: Vec<[f32; 4]>,
    pub weights: Vec<[f32; 4]>,
}

/// Mesh space to world.
pub(super) enum Placement {
    /// One transform for all vertices.
    Rigid(Transform),
    /// Joint matrices; the node's own transform does not count (glTF 2.0, section 3.7.3.3).
    Skinned(Vec<DMat4>),
}

/// The transform of each vertex of a skinned primitive.
fn vertex_matrices(primitive: &Primitive, joints: &[DMat4]) -> Vec<DMat4> {
    let one = |vertex: usize| {
        let mut sum = DMat4::ZERO;
        let mut total = 0.0;
        for influence in &primitive.influences {
            for (joint, weight) in influence.joints[vertex].iter().zip(&influence.weights[vertex]) {
                let weight = f64::from(*weight);
                if let Some(matrix) = joints.get(*joint as usize).filter(|_| weight > 0.0) {
                    sum += *matrix * weight;
                    total += weight;
                }
            }
        }
        // A vertex without weights stays where the mesh has it.
        if total > 0.0 { sum * (1.0 / total) } else { DMat4::IDENTITY }
    };
    (0..primitive.mesh.positions.len()).map(one).collect()
}

/// The mesh of a primitive bent by its joints, in world space, with what was left out of it; with tangents where they
/// are wanted.
pub(super) fn bent(primitive: &Primitive, shape: &Mesh, joints: &[DMat4], tangents: Option<&Tangents>) -> (Mesh, Flat) {
    let matrices = vertex_matrices(primitive, joints);
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

/// Adds displacements to the first three components.
pub(super) fn displace<const N: usize>(values: &mut [[f32; N]], displacements: &[[f32; 3]], weight: f32) {
    for (value, displacement) in values.iter_mut().zip(displacements) {
        for (x, d) in value.iter_mut().zip(displacement) {
            *x += weight * d;
        }
    }
}
