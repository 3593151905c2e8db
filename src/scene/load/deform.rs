//! Where vertices go: rigid instances, skins in the pose of the file, morph targets at their default weights.

use std::borrow::Cow;

use glam::{DMat3, DMat4, DVec3};

use super::mesh::Primitive;

/// Displacements of a morph target; each list is empty or one per vertex.
pub(super) struct Morph {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub tangents: Vec<[f32; 3]>,
}

/// Four joints and weights per vertex.
pub(super) struct Influence {
    /// Indices into the joints of the skin, as the file's integers.
    pub joints: Vec<[f32; 4]>,
    pub weights: Vec<[f32; 4]>,
}

/// Mesh space to world.
pub(super) enum Placement {
    /// One transform for all vertices.
    Rigid(DMat4),
    /// Joint matrices; the node's own transform does not count (glTF 2.0, section 3.7.3.3).
    Skinned(Vec<DMat4>),
}

impl Placement {
    /// The transform of one vertex.
    pub fn matrix(&self, primitive: &Primitive, vertex: usize) -> DMat4 {
        let joints = match self {
            Self::Rigid(matrix) => return *matrix,
            Self::Skinned(joints) => joints,
        };
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
    }
}

/// Determinant times inverse transpose of the linear part, with the sign that keeps normals on their side.
pub(super) fn normal_matrix(m: &DMat4) -> DMat3 {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.truncate());
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    cofactors * handedness(m)
}

/// -1 for a transform that mirrors, otherwise 1.
pub(super) fn handedness(m: &DMat4) -> f64 {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.truncate());
    if x.cross(y).dot(z) < 0.0 { -1.0 } else { 1.0 }
}

/// Positions, normals and tangents with the morph targets applied.
pub(super) struct Shape<'a> {
    pub positions: Cow<'a, [[f32; 3]]>,
    pub normals: Cow<'a, [[f32; 3]]>,
    pub tangents: Cow<'a, [[f32; 4]]>,
}

/// The primitive at the given morph weights; missing and non-finite weights count as zero.
pub(super) fn morphed<'a>(primitive: &'a Primitive, weights: &[f32]) -> Shape<'a> {
    let mut shape = Shape {
        positions: Cow::Borrowed(&primitive.positions),
        normals: Cow::Borrowed(&primitive.normals),
        tangents: Cow::Borrowed(&primitive.tangents),
    };
    let active = primitive.morphs.iter().zip(weights).filter(|(_, w)| w.is_finite() && **w != 0.0);
    for (morph, &weight) in active {
        add(&mut shape.positions, &morph.positions, weight);
        add(&mut shape.normals, &morph.normals, weight);
        add(&mut shape.tangents, &morph.tangents, weight);
    }
    shape
}

/// Adds to the first three components.
fn add<const N: usize>(values: &mut Cow<[[f32; N]]>, displacements: &[[f32; 3]], weight: f32) {
    if values.is_empty() || displacements.is_empty() {
        return;
    }
    for (value, displacement) in values.to_mut().iter_mut().zip(displacements) {
        for (x, d) in value.iter_mut().zip(displacement) {
            *x += weight * d;
        }
    }
}

/// A unit vector, or `None` where the length is zero or not finite.
pub(super) fn unit(v: DVec3) -> Option<DVec3> {
    let length = v.length();
    (length > 0.0 && length.is_finite()).then(|| v / length)
}
