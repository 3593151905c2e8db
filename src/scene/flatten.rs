//! A mesh in its place: world-space triangles with normals and tangents.

use glam::{DMat3, DMat4, DVec3};

use super::{Mesh, Skipped, TextureRef};

/// Height over longest edge below which a triangle has no area that single precision can tell from none.
const NEEDLE: f64 = 1.0 / (1 << 24) as f64;

/// From the space of a mesh to the world.
pub(super) enum Placement<'a> {
    /// The mesh is in the world: everything stays as it is.
    World,
    /// One transform for all vertices.
    Rigid(DMat4),
    /// A transform for each vertex.
    Bent(&'a [DMat4]),
}

impl Placement<'_> {
    fn matrix(&self, vertex: u32) -> DMat4 {
        match self {
            Self::World => DMat4::IDENTITY,
            Self::Rigid(matrix) => *matrix,
            Self::Bent(matrices) => matrices[vertex as usize],
        }
    }
}

/// World-space vertices of a mesh.
#[derive(Default)]
pub(super) struct Vertices {
    /// The vertex of the mesh that each came from.
    pub source: Vec<u32>,
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

/// A mesh in its place.
#[derive(Default)]
pub(super) struct Flat {
    pub vertices: Vertices,
    /// One per vertex, if they were asked for.
    pub tangents: Vec<[f32; 4]>,
    /// Triangles of the mesh that are left, if not all of them are.
    pub kept: Option<Vec<u32>>,
    pub skipped: Skipped,
    /// Some normals had no direction, and have that of a triangle.
    pub replaced_normals: bool,
}

/// What tangents follow: the normal texture of the mesh's material, if it has one.
pub(super) struct Tangents(pub Option<TextureRef>);

/// Places a mesh; `tangents` only if they are wanted.
pub(super) fn place(mesh: &Mesh, placement: &Placement, tangents: Option<&Tangents>) -> Flat {
    let mut flat = match placement {
        Placement::World => in_world(mesh),
        _ => moved(mesh, placement),
    };
    if let Some(Tangents(map)) = tangents {
        flat.tangents = self::tangents(mesh, placement, &flat.vertices, *map);
    }
    flat
}

fn in_world(mesh: &Mesh) -> Flat {
    let vertices = if mesh.normals.is_empty() {
        flat(&mesh.positions, &mesh.triangles)
    } else {
        Vertices {
            source: (0..mesh.positions.len() as u32).collect(),
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            triangles: mesh.triangles.clone(),
        }
    };
    Flat { vertices, ..Flat::default() }
}

fn moved(mesh: &Mesh, placement: &Placement) -> Flat {
    let position = |(v, p): (u32, &[f32; 3])| placement.matrix(v).transform_point3(double(*p)).as_vec3().to_array();
    let positions: Vec<[f32; 3]> = (0..).zip(&mesh.positions).map(position).collect();
    let mirrored = |v: u32| handedness(&placement.matrix(v)) < 0.0;
    let Usable { triangles, sources, skipped } = usable(mesh, &positions, mirrored);
    let kept = (sources.len() < mesh.triangles.len()).then_some(sources);
    if triangles.is_empty() {
        return Flat { kept, skipped, ..Flat::default() };
    }
    let (mut vertices, replaced_normals) = if mesh.normals.is_empty() {
        (flat(&positions, &triangles), false)
    } else {
        let normals = (0..).zip(&mesh.normals).map(|(v, n)| normal_matrix(&placement.matrix(v)) * double(*n));
        smooth(positions, normals, triangles)
    };
    // Vertices of skipped triangles stay in the buffers: no NaN may.
    for position in vertices.positions.iter_mut().filter(|p| !p.iter().all(|x| x.is_finite())) {
        *position = [0.0; 3];
    }
    Flat { vertices, kept, skipped, replaced_normals, ..Flat::default() }
}

/// Those of the mesh, or such that follow the texture coordinates of the normal map.
fn tangents(mesh: &Mesh, placement: &Placement, vertices: &Vertices, map: Option<TextureRef>) -> Vec<[f32; 4]> {
    if mesh.tangents.is_empty() || mesh.normals.is_empty() {
        return generated_tangents(vertices, mesh, map);
    }
    let one = |(&v, n): (&u32, &[f32; 3])| {
        let [x, y, z, w] = mesh.tangents[v as usize].map(f64::from);
        let matrix = placement.matrix(v);
        let w = if w < 0.0 { -1.0 } else { 1.0 } * handedness(&matrix);
        tangent(matrix.transform_vector3(DVec3::new(x, y, z)), double(*n), w)
    };
    match placement {
        Placement::World => mesh.tangents.clone(),
        _ => vertices.source.iter().zip(&vertices.normals).map(one).collect(),
    }
}

fn double(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

/// Determinant times inverse transpose of the linear part, with the sign that keeps normals on their side.
pub(super) fn normal_matrix(m: &DMat4) -> DMat3 {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.truncate());
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    cofactors * handedness(m)
}

/// -1 for a transform that mirrors, otherwise 1, also where it flattens space: the rest of the determinant is rounding.
pub(super) fn handedness(m: &DMat4) -> f64 {
    const ROUNDING: f64 = 1e-14;
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.truncate());
    if x.cross(y).dot(z) < -ROUNDING * (x.length() * y.length() * z.length()) { -1.0 } else { 1.0 }
}

/// A unit vector, or `None` where the length is zero or not finite.
fn unit(v: DVec3) -> Option<DVec3> {
    let length = v.length();
    (length > 0.0 && length.is_finite()).then(|| v / length)
}

/// Triangles of a mesh that have area.
struct Usable {
    triangles: Vec<[u32; 3]>,
    /// Their places in the mesh.
    sources: Vec<u32>,
    skipped: Skipped,
}

/// The triangles that have area, wound to face the way their mesh does; the others are counted.
fn usable(mesh: &Mesh, positions: &[[f32; 3]], mirrored: impl Fn(u32) -> bool) -> Usable {
    let count = mesh.triangles.len();
    let (triangles, sources) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut usable = Usable { triangles, sources, skipped: Skipped::default() };
    for (source, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        let corners = [a, b, c].map(|i| double(positions[i as usize]));
        if !corners.iter().all(|p| p.is_finite()) {
            usable.skipped.non_finite_triangles += 1;
        } else if !has_area(corners) {
            usable.skipped.degenerate_triangles += 1;
        } else {
            usable.triangles.push(if mirrored(a) { [a, c, b] } else { [a, b, c] });
            usable.sources.push(source as u32);
        }
    }
    usable
}

/// False for zero area, for needles thinner than single precision, and where the area underflows it.
fn has_area([a, b, c]: [DVec3; 3]) -> bool {
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

/// The mesh's normals made unit; those without a direction are replaced by the normal of a triangle at the vertex,
/// which is told.
fn smooth(
    positions: Vec<[f32; 3]>,
    normals: impl Iterator<Item = DVec3>,
    triangles: Vec<[u32; 3]>,
) -> (Vertices, bool) {
    let mut normals: Vec<Option<DVec3>> = normals.map(unit).collect();
    let replaced = normals.iter().any(Option::is_none);
    for triangle in triangles.iter().filter(|_| replaced) {
        for &i in triangle {
            normals[i as usize].get_or_insert_with(|| face_normal(&positions, *triangle));
        }
    }
    let normals = normals.into_iter().map(|n| n.unwrap_or(DVec3::Y).as_vec3().to_array()).collect();
    let source = (0..positions.len() as u32).collect();
    (Vertices { source, positions, normals, triangles }, replaced)
}

/// Derivatives of the position along the texture's u axis, weighted by area and made perpendicular to the normal.
fn generated_tangents(vertices: &Vertices, mesh: &Mesh, map: Option<TextureRef>) -> Vec<[f32; 4]> {
    let count = vertices.positions.len();
    let mut sums = vec![(DVec3::ZERO, DVec3::ZERO); count];
    let map = map.filter(|r| !mesh.uvs[r.uv_set as usize].is_empty());
    for triangle in vertices.triangles.iter().filter(|_| map.is_some()) {
        let [a, b, c] = triangle.map(|i| double(vertices.positions[i as usize]));
        let [ua, ub, uc] =
            triangle.map(|i| map.map_or([0.0; 2], |r| texture_uv(mesh, &r, vertices.source[i as usize])));
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
fn texture_uv(mesh: &Mesh, texture: &TextureRef, vertex: u32) -> [f64; 2] {
    let [u, v] = mesh.uvs[texture.uv_set as usize][vertex as usize].map(f64::from);
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
