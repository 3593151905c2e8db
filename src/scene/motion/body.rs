//! Vertices that move: morph targets, then joints (glTF 2.0, sections 3.7.2.2 and 3.7.3).

use std::sync::Arc;

use glam::{DMat3, DMat4, DVec3};

use crate::scene::flatten::{handedness, normal_matrix};

/// Four joints and weights per vertex.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::scene) struct Influence {
    /// Indices into the joints of the skin, as the file's integers.
    pub joints: Vec<[f32; 4]>,
    pub weights: Vec<[f32; 4]>,
}

/// What a morph target adds to each vertex; each list is empty or has one entry per vertex.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::scene) struct Displacement {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub tangents: Vec<[f32; 3]>,
}

/// Vertices of a mesh, as many as it has.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Vertices {
    /// [`Mesh::positions`](crate::scene::Mesh::positions).
    pub positions: Vec<[f32; 3]>,
    /// [`Mesh::normals`](crate::scene::Mesh::normals).
    pub normals: Vec<[f32; 3]>,
    /// [`Mesh::tangents`](crate::scene::Mesh::tangents).
    pub tangents: Vec<[f32; 4]>,
}

/// A mesh at rest, and all that may move its vertices.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::scene) struct Body {
    pub rest: Vertices,
    pub targets: Vec<Displacement>,
    pub influences: Arc<Vec<Influence>>,
}

impl Body {
    /// The vertices at these morph weights (missing ones and such that are not finite count as zero), and bent by joint
    /// matrices where there are any: then they are in the world. `None` if a coordinate is not finite.
    pub fn at(&self, weights: &[f32], joints: Option<&[DMat4]>) -> Option<Vertices> {
        let mut vertices = self.rest.clone();
        for (target, &weight) in self.targets.iter().zip(weights).filter(|(_, w)| w.is_finite() && **w != 0.0) {
            displace(&mut vertices.positions, &target.positions, weight);
            displace(&mut vertices.normals, &target.normals, weight);
            displace(&mut vertices.tangents, &target.tangents, weight);
        }
        if let Some(joints) = joints {
            vertices.bend(&vertex_matrices(&self.influences, vertices.positions.len(), joints));
        }
        vertices.is_finite().then_some(vertices)
    }
}

impl Vertices {
    fn bend(&mut self, matrices: &[DMat4]) {
        let vec3 = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        for (position, matrix) in self.positions.iter_mut().zip(matrices) {
            *position = matrix.transform_point3(vec3(*position)).as_vec3().to_array();
        }
        for (normal, matrix) in self.normals.iter_mut().zip(matrices) {
            *normal = direction(normal_matrix(matrix), vec3(*normal));
        }
        for (tangent, matrix) in self.tangents.iter_mut().zip(matrices) {
            let [x, y, z, w] = *tangent;
            let [x, y, z] = direction(DMat3::from_mat4(*matrix), vec3([x, y, z]));
            *tangent = [x, y, z, w * handedness(matrix) as f32];
        }
    }

    fn is_finite(&self) -> bool {
        let Self { positions, normals, tangents } = self;
        let threes = positions.iter().chain(normals).flatten();
        threes.chain(tangents.iter().flatten()).all(|x| x.is_finite())
    }
}

/// A direction through a map, of length 1; zero where it has none: the world then takes that of a triangle.
fn direction(map: DMat3, v: DVec3) -> [f32; 3] {
    (map * v).normalize_or_zero().as_vec3().to_array()
}

/// Adds displacements to the first three components.
pub(in crate::scene) fn displace<const N: usize>(values: &mut [[f32; N]], displacements: &[[f32; 3]], weight: f32) {
    for (value, displacement) in values.iter_mut().zip(displacements) {
        for (x, d) in value.iter_mut().zip(displacement) {
            *x += weight * d;
        }
    }
}

/// The transform of each of `count` vertices: the mean of the joints' by their weights, whatever these sum to.
pub(in crate::scene) fn vertex_matrices(influences: &[Influence], count: usize, joints: &[DMat4]) -> Vec<DMat4> {
    let one = |vertex: usize| {
        let mut sum = DMat4::ZERO;
        let mut total = 0.0;
        for influence in influences {
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
    (0..count).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body() -> Body {
        let rest = Vertices {
            positions: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 2],
            tangents: vec![[1.0, 0.0, 0.0, 1.0]; 2],
        };
        let up = Displacement { positions: vec![[0.0, 0.0, 2.0]; 2], ..Displacement::default() };
        let tilt = Displacement {
            normals: vec![[1.0, 0.0, 0.0]; 2],
            tangents: vec![[0.0, 1.0, 0.0]; 2],
            ..Displacement::default()
        };
        let influence = Influence { joints: vec![[0.0, 1.0, 9.0, 0.0]; 2], weights: vec![[3.0, 1.0, 5.0, 0.0]; 2] };
        Body { rest, targets: vec![up, tilt], influences: Arc::new(vec![influence]) }
    }

    #[test]
    fn morph_targets_add_up() {
        let body = body();
        assert_eq!(body.at(&[], None), Some(body.rest.clone()));
        assert_eq!(body.at(&[0.0, f32::NAN], None), Some(body.rest.clone()));
        let half = body.at(&[0.5, 0.25, 9.0], None).expect("finite");
        assert_eq!(half.positions[0], [1.0, 0.0, 1.0]);
        assert_eq!((half.normals[1], half.tangents[1]), ([0.25, 0.0, 1.0], [1.0, 0.25, 0.0, 1.0]));
        assert_eq!(body.at(&[f32::MAX], None), None, "beyond single precision");
    }

    /// Weights of 3 and 1 are three quarters and one quarter, and a joint that does not exist counts for nothing.
    #[test]
    fn weights_need_not_sum_to_one() {
        let joints = [DMat4::IDENTITY, DMat4::from_translation(DVec3::new(0.0, 4.0, 0.0))];
        let bent = body().at(&[], Some(&joints)).expect("finite");
        assert_eq!(bent.positions, [[1.0, 1.0, 0.0], [0.0, 2.0, 0.0]]);
        let mirrored = [DMat4::from_scale(DVec3::new(-1.0, 2.0, 1.0)); 2];
        let bent = body().at(&[0.0, 1.0], Some(&mirrored)).expect("finite");
        assert_eq!(bent.positions, [[-1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
        let half = 0.5f32.sqrt();
        assert_eq!(bent.normals[0], [-half, 0.0, half]);
        assert_eq!(bent.tangents[0][3], -1.0);
        assert_eq!(body().at(&[], Some(&[DMat4::ZERO; 2])).expect("a point").normals, [[0.0; 3]; 2]);
        assert_eq!(body().at(&[], Some(&[DMat4::IDENTITY * 1e300; 2])), None);
    }
}
