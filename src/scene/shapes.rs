//! Scenes built in memory: simple shapes, materials by name, and a camera that looks at a point.
//!
//! For tests with an analytic answer, for generators and for embedders. Every shape is wound counter-clockwise seen
//! from the side its normals point to; [`Mesh::flipped`] turns it inside out.

use std::f32::consts::{PI, TAU};

pub use super::Mesh;
use super::{Camera, Material, Projection};
use glam::Vec3;

impl Mesh {
    /// A parallelogram from `corner` along `edge_u` and `edge_v`; its front faces `edge_u x edge_v`.
    pub fn quad(corner: [f32; 3], edge_u: [f32; 3], edge_v: [f32; 3]) -> Self {
        Self::grid(corner, edge_u, edge_v, [1, 1])
    }

    /// Like [`Mesh::quad`], cut into `cells[0] * cells[1]` equal parts (at least one each way).
    pub fn grid(corner: [f32; 3], edge_u: [f32; 3], edge_v: [f32; 3], cells: [u32; 2]) -> Self {
        let [corner, edge_u, edge_v] = [corner, edge_u, edge_v].map(Vec3::from);
        let normal = edge_u.cross(edge_v).normalize_or_zero();
        Self::patch(cells, |u, v| (corner + edge_u * u + edge_v * v, normal))
    }

    /// A flat regular polygon of `segments` corners (at least 3) on a circle, a fan around `center`.
    /// Its area is that of the circle times sin(x)/x, x = 2 pi / segments.
    pub fn disc(center: [f32; 3], normal: [f32; 3], radius: f32, segments: u32) -> Self {
        let (normal, center) = (Vec3::from(normal).normalize_or_zero(), Vec3::from(center));
        let (x, y) = perpendicular(normal);
        let segments = segments.max(3);
        let mut mesh = Self::default();
        mesh.push(center, normal, [0.5, 0.5]);
        for i in 0..segments {
            let (sin, cos) = (TAU * i as f32 / segments as f32).sin_cos();
            mesh.push(center + (x * cos + y * sin) * radius, normal, [0.5 + 0.5 * cos, 0.5 + 0.5 * sin]);
            mesh.triangles.push([0, 1 + i, 1 + (i + 1) % segments]);
        }
        mesh
    }

    /// A sphere with smooth outward normals: `rings` bands between the poles (at least 2) on the Y axis and
    /// `segments` around (at least 3). Corners lie on the sphere.
    pub fn sphere(center: [f32; 3], radius: f32, rings: u32, segments: u32) -> Self {
        let (rings, segments, center) = (rings.max(2), segments.max(3), Vec3::from(center));
        let mut mesh = Self::patch([segments, rings], |u, v| {
            // Multiples of a full turn are closed exactly, so that the seam and the poles are watertight.
            let (sin_p, cos_p) = if u == 1.0 { (0.0, 1.0) } else { (TAU * u).sin_cos() };
            let (sin_t, cos_t) = if v == 1.0 { (0.0, 1.0) } else { (PI * (1.0 - v)).sin_cos() };
            let sin_t = if v == 0.0 { 0.0 } else { sin_t };
            let normal = Vec3::new(sin_t * cos_p, cos_t, -sin_t * sin_p);
            (center + normal * radius, normal)
        });
        let positions = &mesh.positions;
        mesh.triangles.retain(|t| {
            let [a, b, c] = t.map(|i| positions[i as usize]);
            a != b && b != c && c != a
        });
        mesh
    }

    /// The side of a cylinder, open at both ends, with smooth outward normals: from the circle around `base` to the
    /// one around `base + axis`, `segments` around (at least 3) and `rows` along the axis.
    pub fn cylinder(base: [f32; 3], axis: [f32; 3], radius: f32, cells: CylinderCells) -> Self {
        let (base, axis) = (Vec3::from(base), Vec3::from(axis));
        let (x, y) = perpendicular(axis.normalize_or_zero());
        Self::patch([cells.segments.max(3), cells.rows], |u, v| {
            let (sin, cos) = if u == 1.0 { (0.0, 1.0) } else { (TAU * u).sin_cos() };
            let normal = x * cos + y * sin;
            (base + axis * v + normal * radius, normal)
        })
    }

    /// An axis-aligned box with flat outward normals.
    pub fn cuboid(min: [f32; 3], max: [f32; 3]) -> Self {
        let (lo, size) = (Vec3::from(min), Vec3::from(max) - Vec3::from(min));
        let mut mesh = Self::default();
        for axis in 0..3 {
            let edge = |k: usize| Vec3::AXES[k] * size;
            let (u, v) = (edge((axis + 1) % 3), edge((axis + 2) % 3));
            mesh.append(&Self::quad((lo + edge(axis)).into(), u.into(), v.into()));
            mesh.append(&Self::quad(lo.into(), v.into(), u.into()));
        }
        mesh
    }

    /// The same surface with its front on the other side.
    pub fn flipped(mut self) -> Self {
        for triangle in &mut self.triangles {
            triangle.swap(1, 2);
        }
        for normal in &mut self.normals {
            *normal = normal.map(|x| -x);
        }
        self
    }

    /// Adds the triangles of `other`.
    pub fn append(&mut self, other: &Mesh) {
        let first = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.uvs[0].extend_from_slice(&other.uvs[0]);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| first + i)));
    }

    /// A grid over the unit square, mapped by `surface` to position and normal; dp/du x dp/dv is the front.
    fn patch(cells: [u32; 2], surface: impl Fn(f32, f32) -> (Vec3, Vec3)) -> Self {
        let [nu, nv] = cells.map(|n| n.max(1));
        let mut mesh = Self::default();
        for j in 0..=nv {
            for i in 0..=nu {
                let (u, v) = (i as f32 / nu as f32, j as f32 / nv as f32);
                let (position, normal) = surface(u, v);
                mesh.push(position, normal, [u, v]);
            }
        }
        for j in 0..nv {
            for i in 0..nu {
                let a = j * (nu + 1) + i;
                let (b, c, d) = (a + 1, a + nu + 2, a + nu + 1);
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }

    fn push(&mut self, position: Vec3, normal: Vec3, uv: [f32; 2]) {
        self.positions.push(position.into());
        self.normals.push(normal.into());
        self.uvs[0].push(uv);
    }
}

/// Tessellation of [`Mesh::cylinder`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CylinderCells {
    /// Flat parts around the axis.
    pub segments: u32,
    /// Parts along the axis.
    pub rows: u32,
}

/// Two unit vectors that form a right-handed frame with the unit vector `n` as the third.
fn perpendicular(n: Vec3) -> (Vec3, Vec3) {
    let helper = if n.x.abs() < 0.5 { Vec3::X } else { Vec3::Z };
    let x = (helper - n * n.dot(helper)).normalize_or_zero();
    (x, n.cross(x))
}

impl Material {
    /// Pure Lambert reflection of the given albedo, on both sides.
    pub fn lambert(albedo: [f32; 3]) -> Self {
        Self { base_color: opaque(albedo), metallic: 0.0, specular: 0.0, double_sided: true, ..Self::default() }
    }

    /// A perfect mirror on both sides.
    pub fn mirror() -> Self {
        Self::metal([1.0; 3], 0.0)
    }

    /// GGX metal with reflectance `f0` at normal incidence and perceptual roughness (alpha is its square).
    pub fn metal(f0: [f32; 3], roughness: f32) -> Self {
        Self { base_color: opaque(f0), metallic: 1.0, roughness, double_sided: true, ..Self::default() }
    }

    /// Smooth clear glass that bounds a volume; the mesh's normals point to the outside.
    pub fn glass(ior: f32) -> Self {
        let base = Self::default();
        Self { metallic: 0.0, roughness: 0.0, transmission: 1.0, ior, volume: true, double_sided: true, ..base }
    }

    /// A black Lambertian emitter of the given radiance, on the front; the camera looks through its back.
    pub fn emitter(radiance: [f32; 3]) -> Self {
        Self { emissive: radiance, double_sided: false, ..Self::lambert([0.0; 3]) }
    }
}

fn opaque([r, g, b]: [f32; 3]) -> [f32; 4] {
    [r, g, b, 1.0]
}

impl Camera {
    /// A pinhole camera at `position` that looks at `target`; `yfov` is the full vertical field of view, in radians.
    /// Where `up` is parallel to the view another one is chosen.
    pub fn look_at(position: [f32; 3], target: [f32; 3], up: [f32; 3], yfov: f32) -> Self {
        let forward = (Vec3::from(target) - Vec3::from(position)).try_normalize().unwrap_or(Vec3::NEG_Z);
        let right = forward.cross(Vec3::from(up)).try_normalize().unwrap_or_else(|| perpendicular(forward).0);
        Self {
            name: String::new(),
            position,
            right: right.into(),
            up: right.cross(forward).into(),
            forward: forward.into(),
            projection: Projection::Perspective { yfov, aspect: None },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faces(mesh: &Mesh) -> impl Iterator<Item = (Vec3, Vec3, Vec3)> + '_ {
        mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| Vec3::from(mesh.positions[i as usize]));
            let normal: Vec3 = t.iter().map(|&i| Vec3::from(mesh.normals[i as usize])).sum();
            ((b - a).cross(c - a), normal, (a + b + c) / 3.0)
        })
    }

    fn area(mesh: &Mesh) -> f32 {
        faces(mesh).map(|(cross, _, _)| 0.5 * cross.length()).sum()
    }

    #[test]
    fn winding_agrees_with_normals() {
        let cells = CylinderCells { segments: 12, rows: 3 };
        for mesh in [
            Mesh::quad([0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
            Mesh::disc([1.0; 3], [0.0, 1.0, 1.0], 2.0, 17),
            Mesh::sphere([1.0, 2.0, 3.0], 0.5, 8, 16),
            Mesh::cylinder([0.0; 3], [0.0, 0.0, 2.0], 1.0, cells),
            Mesh::cuboid([-1.0; 3], [1.0, 2.0, 3.0]),
        ] {
            for mesh in [mesh.clone(), mesh.flipped()] {
                assert!(faces(&mesh).all(|(cross, normal, _)| cross.dot(normal) > 0.0));
                assert!(mesh.normals.iter().all(|n| (Vec3::from(*n).length() - 1.0).abs() < 1e-6));
                assert_eq!(mesh.uvs[0].len(), mesh.positions.len());
            }
        }
    }

    #[test]
    fn areas_are_those_of_the_shapes() {
        let close = |x: f32, y: f32| assert!((x / y - 1.0).abs() < 1e-5, "{x} {y}");
        close(area(&Mesh::grid([0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [4, 5])), 6.0);
        let step = TAU / 24.0;
        close(area(&Mesh::disc([0.0; 3], [0.0, 1.0, 0.0], 1.0, 24)), PI * step.sin() / step);
        close(area(&Mesh::cuboid([0.0; 3], [1.0, 2.0, 3.0])), 22.0);
        let sphere = area(&Mesh::sphere([0.0; 3], 1.0, 64, 128));
        assert!(sphere < 4.0 * PI && sphere > 4.0 * PI * 0.998);
    }

    #[test]
    fn outward_shapes_face_away_from_their_middle() {
        let cells = CylinderCells { segments: 9, rows: 1 };
        let cylinder = Mesh::cylinder([0.0; 3], [0.0, 1.0, 0.0], 1.0, cells);
        assert!(faces(&cylinder).all(|(cross, _, middle)| cross.dot(middle - Vec3::Y * middle.y) > 0.0));
        assert!(faces(&Mesh::sphere([0.0; 3], 1.0, 5, 7)).all(|(cross, _, middle)| cross.dot(middle) > 0.0));
    }

    #[test]
    fn the_sphere_is_closed() {
        // Every directed edge, by position, has its opposite exactly once.
        let mesh = Mesh::sphere([0.1, 0.2, 0.3], 0.7, 6, 10);
        let key = |i: u32| mesh.positions[i as usize].map(|x| x.to_bits());
        let mut edges = std::collections::HashMap::new();
        for t in &mesh.triangles {
            for k in 0..3 {
                *edges.entry((key(t[k]), key(t[(k + 1) % 3]))).or_insert(0) += 1;
            }
        }
        assert!(edges.iter().all(|(&(a, b), &n)| n == 1 && edges.get(&(b, a)) == Some(&1)));
    }
}
