//! Leaving out what a scene does not need changes no bit: kernels specialised for the scene against kernels with every
//! feature.

use nephroid::low_level::render::Settings;
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Camera, Environment, Image, Light, Material, Scene, Texture, TextureRef, Wrap};

use crate::support::lab::{Shot, assert_same, difference, settings};

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
        let [a, b, c] = t.map(|i| glam_of(block.positions[i as usize]));
        let normal = (b - a).cross(c - a).normalize();
        t.iter().for_each(|&i| block.normals[i as usize] = normal.into());
    }
    let camera = Camera::look_at([1.5, 1.6, 3.0], [0.0, 0.6, 0.0], [0.0, 1.0, 0.0], 0.8);
    let parts =
        vec![(floor, Material::lambert([0.7, 0.6, 0.5])), (wall, Material::lambert([0.3, 0.6, 0.8])), (block, object)];
    Scene::from_parts(parts, lights, camera)
}

fn glam_of(p: [f32; 3]) -> glam::Vec3 {
    p.into()
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

#[test]
fn the_lean_program_equals_the_full_one() {
    let mut failures = Vec::new();
    for (name, scene) in kinds() {
        println!("{name}");
        let lean = settings(20, 16, 4_000);
        let full = Settings { full_program: true, ..lean.clone() };
        let (a, b) = (Shot::take(&scene, &lean, 0..2).bits(), Shot::take(&scene, &full, 0..2).bits());
        if let Some(at) = difference(&a, &b) {
            let count = a.iter().zip(&b).filter(|(a, b)| a != b).count();
            let (x, y) = (f32::from_bits(a[at]), f32::from_bits(b[at]));
            failures.push(format!("{name}: {count} of {} differ, first number {at}: {x:e} {y:e}", a.len()));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    // The comparison is not blind: another seed changes the picture.
    let (_, scene) = kinds().swap_remove(0);
    let other = Settings { seed: 1, ..settings(20, 16, 4_000) };
    let (a, b) = (Shot::take(&scene, &settings(20, 16, 4_000), 0..2), Shot::take(&scene, &other, 0..2));
    assert!(difference(&a.bits(), &b.bits()).is_some());
    assert_same(&a.bits(), &a.bits(), "a picture and itself");
}
