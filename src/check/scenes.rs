//! Scenes that cases share.

use glam::Vec3;

use crate::scene::shapes::Mesh;
use crate::scene::{Camera, Environment, Image, Light, Material, Projection, Scene, Texture, TextureRef, Wrap};

/// A camera that looks along `forward` in parallel; the image shows `2 height` scene units from bottom to top.
pub fn parallel(position: [f32; 3], forward: [f32; 3], up: [f32; 3], height: f32) -> Camera {
    let target = std::array::from_fn(|k| position[k] + forward[k]);
    let camera = Camera::look_at(position, target, up, 1.0);
    Camera { position, projection: Projection::Orthographic { xmag: height, ymag: height }, ..camera }
}

/// A parallel camera that looks down at the floor; the top of the image is -z.
pub fn from_above([x, y, z]: [f32; 3], height: f32) -> Camera {
    parallel([x, y, z], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], height)
}

/// A square floor of `2 half` units around the origin at height `y`.
pub fn floor(half: f32, y: f32) -> Mesh {
    Mesh::quad([-half, y, half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, -2.0 * half])
}

/// Light that falls along `direction`, of which a plane that faces it receives 1.
pub fn sun(direction: [f32; 3]) -> Light {
    Light::Directional { direction: Vec3::from(direction).normalize().into(), irradiance: [1.0; 3] }
}

/// A surface of revolution about the Y axis through points (distance from the axis, height) with their normals; its
/// front is where the normals point. A point on the axis is the first or the last.
pub fn revolved(profile: &[[[f64; 2]; 2]], segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for (row, [[r, y], [nr, ny]]) in profile.iter().enumerate() {
        for i in 0..=segments {
            let (sine, cosine) = (std::f64::consts::TAU * f64::from(i % segments) / f64::from(segments)).sin_cos();
            mesh.positions.push([(r * cosine) as f32, *y as f32, (r * sine) as f32]);
            let normal = Vec3::new((nr * cosine) as f32, *ny as f32, (nr * sine) as f32);
            mesh.normals.push(normal.normalize().into());
            mesh.uvs[0].push([i as f32 / segments as f32, row as f32]);
        }
    }
    for row in 1..profile.len() as u32 {
        for i in 0..segments {
            let (a, b) = ((row - 1) * (segments + 1) + i, row * (segments + 1) + i);
            mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
    }
    let at = |i: u32| Vec3::from(mesh.positions[i as usize]);
    let (mut kept, mut turned) = (vec![], vec![]);
    for t in &mesh.triangles {
        let cross = (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]));
        if cross.length_squared() > 0.0 {
            kept.push(*t);
            turned.push(cross.dot(t.iter().map(|&i| Vec3::from(mesh.normals[i as usize])).sum()) < 0.0);
        }
    }
    kept.iter_mut().zip(turned).filter(|(_, turned)| *turned).for_each(|(t, _)| t.swap(1, 2));
    mesh.triangles = kept;
    mesh
}

/// The part of a sphere within `angle` of the pole in direction +Y (or -Y for a negative radius), normals outwards.
pub fn cap([x, y, z]: [f32; 3], radius: f64, angle: f64, [rings, segments]: [u32; 2]) -> Mesh {
    let point = |i: u32| {
        let (sine, cosine) = (angle * f64::from(i) / f64::from(rings)).sin_cos();
        let r = radius.abs();
        [[r * sine, radius * cosine], [sine, radius.signum() * cosine]]
    };
    let profile: Vec<_> = (0..=rings).map(point).collect();
    let mut mesh = revolved(&profile, segments);
    mesh.positions.iter_mut().for_each(|p| *p = [p[0] + x, p[1] + y, p[2] + z]);
    mesh
}

/// A sky of `width` x `height` texels.
pub fn sky(width: u32, height: u32, radiance: impl Fn(u32, u32) -> f32) -> Environment {
    let radiance = (0..width * height).map(|i| [radiance(i % width, i / width); 3]).collect();
    Environment { width, height, radiance }
}

/// A cube from -1 to 1, seen from inside.
pub fn cube(material: &Material) -> Vec<(Mesh, Material)> {
    let side = |corner: [f32; 3], u: [f32; 3], v: [f32; 3]| (Mesh::quad(corner, u, v), material.clone());
    let (x, y, z) = ([2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]);
    vec![
        side([-1.0; 3], z, x),
        side([-1.0; 3], y, z),
        side([-1.0; 3], x, y),
        side([-1.0, 1.0, -1.0], x, z),
        side([1.0, -1.0, -1.0], z, y),
        side([-1.0, -1.0, 1.0], y, x),
    ]
}

/// A slanted box in front of a wall, on a floor, so that nothing is aligned with the axes; `object` is the box's
/// material.
pub fn room(object: Material, lights: Vec<Light>) -> Scene {
    let floor = Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.3], [0.2, 0.1, -4.0]);
    let wall = Mesh::quad([-2.0, 0.0, -1.5], [4.0, 0.0, 0.3], [0.1, 3.0, 0.2]);
    let mut block = Mesh::cuboid([-0.5, 0.3, -0.4], [0.6, 1.1, 0.5]);
    let (sine, cosine) = 0.4f32.sin_cos();
    let turn = |[x, y, z]: [f32; 3]| [cosine * x + sine * z, y + 0.1 * x, cosine * z - sine * x];
    block.positions = block.positions.iter().map(|p| turn(*p)).collect();
    for t in &block.triangles {
        let [a, b, c] = t.map(|i| Vec3::from(block.positions[i as usize]));
        let normal = (b - a).cross(c - a).normalize();
        t.iter().for_each(|&i| block.normals[i as usize] = normal.into());
    }
    let camera = Camera::look_at([1.5, 1.6, 3.0], [0.0, 0.6, 0.0], [0.0, 1.0, 0.0], 0.8);
    let parts =
        vec![(floor, Material::lambert([0.7, 0.6, 0.5])), (wall, Material::lambert([0.3, 0.6, 0.8])), (block, object)];
    Scene::from_parts(parts, lights, camera)
}

/// A point light in front and above.
pub fn lamp() -> Light {
    Light::Point { position: [0.8, 2.5, 1.5], intensity: [3.0, 2.5, 2.0] }
}

/// A square that shines downwards.
pub fn panel(scene: &mut Scene) {
    let panel = Mesh::quad([-0.5, 2.5, 0.0], [1.0, 0.0, 0.2], [0.0, 0.0, 0.8]);
    scene.add(&panel, Material::emitter([5.0, 4.0, 3.0]));
}

fn textured() -> Scene {
    let mut scene = room(Material::lambert([0.5; 3]), vec![lamp()]);
    let reference = TextureRef { texture: 0, uv_set: 0, transform: [[2.0, 0.3, 0.1], [0.0, 3.0, 0.2]] };
    let rgba = (0..64u8).map(|i| [i * 4, 255 - i * 3, (i % 8) * 30, 255]).collect();
    scene.images.push(Image { width: 8, height: 8, rgba });
    scene.textures.push(Texture { image: 0, wrap: [Wrap::Repeat, Wrap::Mirror], linear: true });
    let board = Mesh::quad([-1.8, 0.2, -1.0], [1.2, 0.0, 0.2], [0.1, 1.5, 0.0]);
    scene.add(&board, Material { base_color_texture: Some(reference), ..Material::lambert([0.9; 3]) });
    scene
}

/// Every kind of scene: what it is, and the scene.
pub fn kinds() -> Vec<(&'static str, Scene)> {
    let mut lit_by_panel = room(Material::lambert([0.5; 3]), vec![]);
    panel(&mut lit_by_panel);
    let mut lit_by_sky = room(Material::lambert([0.5; 3]), vec![]);
    lit_by_sky.environment = Some(Environment::default_sky());
    let mut curved = room(Material::mirror(), vec![lamp()]);
    curved.add(&Mesh::sphere([-0.9, 0.6, 0.8], 0.35, 8, 16), Material::lambert([0.8, 0.2, 0.2]));
    let sun = Light::Directional { direction: [0.0, -0.8, -0.6], irradiance: [2.0; 3] };
    vec![
        ("lambert, point light", room(Material::lambert([0.5; 3]), vec![lamp()])),
        ("lambert, area light", lit_by_panel),
        ("lambert, environment", lit_by_sky),
        ("textured", textured()),
        ("mirror, sun", room(Material::mirror(), vec![sun])),
        ("mirror, smooth normals", curved),
        ("rough metal", room(Material::metal([0.9, 0.7, 0.4], 0.5), vec![lamp()])),
        ("glass", room(Material::glass(1.5), vec![lamp()])),
        ("tinted glass", room(Material { absorption: [0.5, 1.0, 2.0], ..Material::glass(1.5) }, vec![lamp()])),
    ]
}
