//! One instance of a primitive becomes world-space triangles with normals and tangents.

use glam::{DMat4, DVec3};

use super::Notes;
use super::deform::{Placement, handedness, morphed, normal_matrix, unit};
use super::mesh::Primitive;
use crate::scene::{Geometry, Scene, Skipped, TextureRef};

/// Height over longest edge below which a triangle has no area that single precision can tell from none.
const NEEDLE: f64 = 1.0 / (1 << 24) as f64;

/// Optional attributes that every vertex of the scene must have.
pub(super) struct Needed {
    pub uvs: [bool; 2],
    pub tangents: bool,
    pub colors: bool,
}

/// One placement of a primitive.
pub(super) struct Instance<'a> {
    pub primitive: &'a Primitive,
    /// Morph weights.
    pub weights: &'a [f32],
    pub placement: &'a Placement,
}

/// World-space vertices of one instance; `source` maps them to those of the primitive.
struct Vertices {
    source: Vec<u32>,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// Appends an instance to the scene's geometry.
pub(super) fn add(scene: &mut Scene, instance: &Instance, needed: &Needed, notes: &mut Notes) {
    let Instance { primitive, weights, placement } = *instance;
    let shape = morphed(primitive, weights);
    let matrices: Vec<DMat4> = match placement {
        Placement::Rigid(_) => Vec::new(),
        Placement::Skinned(_) => (0..primitive.positions.len()).map(|v| placement.matrix(primitive, v)).collect(),
    };
    let rigid = if let Placement::Rigid(matrix) = placement { *matrix } else { DMat4::IDENTITY };
    let matrix = |v: u32| matrices.get(v as usize).unwrap_or(&rigid);
    let positions: Vec<[f32; 3]> = (0..primitive.positions.len())
        .map(|v| matrix(v as u32).transform_point3(double(shape.positions[v])).as_vec3().to_array())
        .collect();
    let kept = usable(primitive, &positions, |v| handedness(matrix(v)) < 0.0, &mut scene.skipped);
    if kept.is_empty() {
        return;
    }
    let mut vertices = if shape.normals.is_empty() {
        flat(&positions, &kept)
    } else {
        let normals = shape.normals.iter().enumerate().map(|(v, n)| normal_matrix(matrix(v as u32)) * double(*n));
        smooth(positions, normals, kept, notes)
    };
    // Vertices of skipped triangles stay in the buffers: no NaN may.
    for position in vertices.positions.iter_mut().filter(|p| !p.iter().all(|x| x.is_finite())) {
        *position = [0.0; 3];
    }
    let tangents = if !needed.tangents {
        Vec::new()
    } else if shape.tangents.is_empty() || shape.normals.is_empty() {
        generated_tangents(&vertices, primitive)
    } else {
        let tangents = vertices.source.iter().zip(&vertices.normals).map(|(&v, n)| {
            let [x, y, z, w] = shape.tangents[v as usize].map(f64::from);
            let w = if w < 0.0 { -1.0 } else { 1.0 } * handedness(matrix(v));
            tangent(matrix(v).transform_vector3(DVec3::new(x, y, z)), double(*n), w)
        });
        tangents.collect()
    };
    scene.geometry.tangents.extend(tangents);
    append(&mut scene.geometry, primitive, vertices, needed, notes);
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

/// The triangles that have area, wound to face the way their mesh does; the others are counted.
fn usable(
    primitive: &Primitive,
    positions: &[[f32; 3]],
    mirrored: impl Fn(u32) -> bool,
    skipped: &mut Skipped,
) -> Vec<[u32; 3]> {
    let mut kept = Vec::with_capacity(primitive.triangles.len());
    for &[a, b, c] in &primitive.triangles {
        let corners = [a, b, c].map(|i| double(positions[i as usize]));
        if !corners.iter().all(|p| p.is_finite()) {
            skipped.non_finite_triangles += 1;
        } else if !has_area(corners) {
            skipped.degenerate_triangles += 1;
        } else {
            kept.push(if mirrored(a) { [a, c, b] } else { [a, b, c] });
        }
    }
    kept
}

/// False for zero area, for needles thinner than single precision, and where the area underflows it.
pub(super) fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let doubled_area = (b - a).cross(c - a).length();
    let longest_sq = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    doubled_area > NEEDLE * longest_sq && 0.5 * doubled_area >= f64::from(f32::MIN_POSITIVE)
}

/// Three vertices of its own for every triangle.
fn flat(positions: &[[f32; 3]], kept: &[[u32; 3]]) -> Vertices {
    let source: Vec<u32> = kept.iter().flatten().copied().collect();
    let normals = kept.iter().flat_map(|t| [face_normal(positions, *t).as_vec3().to_array(); 3]).collect();
    Vertices {
        positions: source.iter().map(|&i| positions[i as usize]).collect(),
        normals,
        triangles: (0..kept.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        source,
    }
}

fn face_normal(positions: &[[f32; 3]], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|i| double(positions[i as usize]));
    (b - a).cross(c - a).normalize_or(DVec3::Y)
}

/// The file's normals made unit; those without a direction are replaced by the normal of a triangle at the vertex.
fn smooth(
    positions: Vec<[f32; 3]>,
    normals: impl Iterator<Item = DVec3>,
    triangles: Vec<[u32; 3]>,
    notes: &mut Notes,
) -> Vertices {
    let mut normals: Vec<Option<DVec3>> = normals.map(unit).collect();
    if normals.iter().any(Option::is_none) {
        notes.fault("normals without a direction were replaced by those of the triangles".into());
        for triangle in &triangles {
            for &i in triangle {
                normals[i as usize].get_or_insert_with(|| face_normal(&positions, *triangle));
            }
        }
    }
    let normals = normals.into_iter().map(|n| n.unwrap_or(DVec3::Y).as_vec3().to_array()).collect();
    Vertices { source: (0..positions.len() as u32).collect(), positions, normals, triangles }
}

/// Derivatives of the position along the texture's u axis, weighted by area and made perpendicular to the normal.
fn generated_tangents(vertices: &Vertices, primitive: &Primitive) -> Vec<[f32; 4]> {
    let count = vertices.positions.len();
    let mut sums = vec![(DVec3::ZERO, DVec3::ZERO); count];
    let map = primitive.normal_texture.filter(|r| !primitive.uvs[r.uv_set as usize].is_empty());
    for triangle in vertices.triangles.iter().filter(|_| map.is_some()) {
        let [a, b, c] = triangle.map(|i| double(vertices.positions[i as usize]));
        let [ua, ub, uc] =
            triangle.map(|i| map.map_or([0.0; 2], |r| texture_uv(primitive, &r, vertices.source[i as usize])));
        let (e1, e2) = (b - a, c - a);
        let (u1, v1, u2, v2) = (ub[0] - ua[0], ub[1] - ua[1], uc[0] - ua[0], uc[1] - ua[1]);
        let det = u1 * v2 - u2 * v1;
        if det == 0.0 || !det.is_finite() {
            continue;
        }
        let area = e1.cross(e2).length();
        let (Some(du), Some(dv)) = (unit((e1 * v2 - e2 * v1) / det), unit((e2 * u1 - e1 * u2) / det)) else { continue };
        for &i in triangle {
            sums[i as usize].0 += du * area;
            sums[i as usize].1 += dv * area;
        }
    }
    sums.iter()
        .zip(&vertices.normals)
        .map(|(&(du, dv), n)| {
            let n = double(*n);
            // Normal maps have +Y up the image while v grows downwards: the bitangent is -dp/dv.
            let w = if n.cross(du).dot(-dv) < 0.0 { -1.0 } else { 1.0 };
            tangent(du, n, w)
        })
        .collect()
}

/// Texture coordinates of a vertex as the texture sees them.
fn texture_uv(primitive: &Primitive, texture: &TextureRef, vertex: u32) -> [f64; 2] {
    let [u, v] = primitive.uvs[texture.uv_set as usize][vertex as usize].map(f64::from);
    texture.transform.map(|row| f64::from(row[0]) * u + f64::from(row[1]) * v + f64::from(row[2]))
}

/// Perpendicular to the unit normal, unit, with handedness; any direction where `t` has none.
fn tangent(t: DVec3, n: DVec3, w: f64) -> [f32; 4] {
    let flat = |t: DVec3| unit(t - n * n.dot(t));
    let helper = if n.x.abs() < 0.9 { DVec3::X } else { DVec3::Z };
    let t = flat(t).or_else(|| flat(helper)).unwrap_or(DVec3::X);
    let [x, y, z] = t.as_vec3().to_array();
    [x, y, z, w as f32]
}

/// All attributes but the tangents.
fn append(geometry: &mut Geometry, primitive: &Primitive, vertices: Vertices, needed: &Needed, notes: &mut Notes) {
    let first = geometry.positions.len() as u32;
    for (set, uvs) in primitive.uvs.iter().enumerate().filter(|(set, _)| needed.uvs[*set]) {
        let uv = |&v: &u32| uvs.get(v as usize).copied().unwrap_or_default();
        geometry.uvs[set].extend(vertices.source.iter().map(uv).map(|uv| cleaned(uv, f32::MIN, f32::MAX, notes)));
    }
    if needed.colors {
        let color = |&v: &u32| primitive.colors.get(v as usize).copied().unwrap_or([1.0; 4]);
        geometry.colors.extend(vertices.source.iter().map(color).map(|c| cleaned(c, 0.0, 1.0, notes)));
    }
    geometry.positions.extend(vertices.positions);
    geometry.normals.extend(vertices.normals);
    geometry.triangles.extend(vertices.triangles.iter().map(|t| t.map(|i| first + i)));
    geometry.material.resize(geometry.triangles.len(), primitive.material);
}

/// Values within bounds, NaN as zero.
fn cleaned<const N: usize>(values: [f32; N], low: f32, high: f32, notes: &mut Notes) -> [f32; N] {
    values.map(|value| {
        if value >= low && value <= high {
            return value;
        }
        notes.fault("vertex colours or texture coordinates out of range were clamped".into());
        if value.is_nan() { 0.0 } else { value.clamp(low, high) }
    })
}
