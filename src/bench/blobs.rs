//! A scene to measure on where the user gives none.

use glam::Vec3;

use crate::scene::shapes::Mesh;
use crate::scene::{Camera, Material, Scene};

/// Four displaced spheres on a floor under a square lamp: 4 (2 `segments` (`rings` - 1)) + 4 triangles.
pub fn blobs(rings: u32, segments: u32) -> Scene {
    let floor = Mesh::quad([-6.0, 0.0, 6.0], [12.0, 0.0, 0.0], [0.0, 0.0, -12.0]);
    let lamp = Mesh::quad([-1.0, 7.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
    let mut parts = vec![(floor, Material::lambert([0.7; 3])), (lamp, Material::emitter([20.0; 3]))];
    let colors = [[0.8, 0.3, 0.2], [0.3, 0.7, 0.3], [0.2, 0.4, 0.8], [0.8, 0.7, 0.3]];
    for (index, color) in colors.into_iter().enumerate() {
        let center = Vec3::new(if index % 2 == 0 { -1.6 } else { 1.6 }, 1.4, if index < 2 { -1.6 } else { 1.6 });
        let wave = 3.0 + index as f32;
        parts.push((blob(center, wave, rings, segments), Material::lambert(color)));
    }
    let camera = Camera::look_at([5.0, 4.5, 7.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], 0.7);
    let mut scene = Scene::from_parts(parts, vec![], camera);
    scene.path = "four displaced spheres (generated)".into();
    scene
}

/// A sphere of radius 1.2 with waves on it; normals are the means of the faces around.
fn blob(center: Vec3, wave: f32, rings: u32, segments: u32) -> Mesh {
    let mut mesh = Mesh::sphere([0.0; 3], 1.0, rings, segments);
    for position in &mut mesh.positions {
        let d = Vec3::from(*position);
        let waves = (wave * d * std::f32::consts::TAU).map(f32::sin).element_sum();
        *position = (center + d * (1.2 + 0.06 * waves)).into();
    }
    let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|corner| Vec3::from(mesh.positions[corner as usize]));
        corners.iter().for_each(|&corner| normals[corner as usize] += (b - a).cross(c - a));
    }
    // A vertex of the poles that no triangle uses keeps the normal of the sphere.
    for (normal, sum) in mesh.normals.iter_mut().zip(normals) {
        *normal = sum.try_normalize().map_or(*normal, Vec3::into);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::World;

    #[test]
    fn as_many_triangles_as_said_and_above_the_floor() {
        let scene = blobs(128, 256);
        let world = World::of(&scene);
        assert_eq!(world.triangles.len(), 4 * 2 * 256 * 127 + 4);
        let bounds = world.bounds().expect("triangles");
        assert!(bounds.min[1] >= 0.0 && bounds.max[1] <= 7.0, "{bounds:?}");
        assert!(world.normals.iter().all(|n| (Vec3::from(*n).length() - 1.0).abs() < 1e-5));
        assert!(scene.has_light());
    }
}
