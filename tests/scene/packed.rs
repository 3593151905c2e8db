//! Files as today's tools write them: one scene, packed in several ways by gltf-transform 4.

use std::path::PathBuf;

use nephroid::low_level::scene::{Choices, Limits, Scene, World, load, load_with};
use serde_json::json;

use crate::support::files::{Files, glb, set, triangle, triangle_bin, with};
use crate::support::repository;

fn file(name: &str) -> PathBuf {
    repository(&format!("tests/scene/files/{name}.glb"))
}

fn loaded(name: &str) -> Scene {
    // Nothing in these files is wrong.
    load(&file(name), &Limits { strict: true, ..Limits::default() }).unwrap_or_else(|error| panic!("{error}"))
}

/// The corners of all triangles, each as position, normal and texture coordinates, in an order that does not depend on
/// that of the file.
fn corners(scene: &Scene) -> Vec<[f32; 8]> {
    let world = World::of(scene);
    // Texture coordinates may be stored scaled: the material's transform takes that back.
    let [u, v] = scene.materials[0].base_color_texture.expect("a texture").transform;
    let corner = |vertex: &u32| {
        let vertex = *vertex as usize;
        let ([x, y, z], [a, b, c]) = (world.positions[vertex], world.normals[vertex]);
        let [s, t] = world.uvs[0][vertex];
        [x, y, z, a, b, c, u[0] * s + u[1] * t + u[2], v[0] * s + v[1] * t + v[2]]
    };
    let mut corners: Vec<[f32; 8]> = world.triangles.iter().flatten().map(corner).collect();
    let key = |corner: &[f32; 8]| [corner[0], corner[2]].map(|x| (x * 16.0).round() as i32);
    corners.sort_by_key(key);
    corners
}

#[test]
fn quantized_and_packed_meshes_are_the_same_mesh() {
    let whole = corners(&loaded("wave"));
    assert_eq!(whole.len(), 384);
    for name in ["wave-quantized", "wave-meshopt", "wave-draco"] {
        let packed = corners(&loaded(name));
        assert_eq!(packed.len(), whole.len(), "{name}");
        for (a, b) in packed.iter().zip(&whole) {
            // Normals have eight bits at least, positions more.
            let tolerance = |k: usize| if (3..6).contains(&k) { 0.02 } else { 1e-3 };
            assert!((0..8).all(|k| (a[k] - b[k]).abs() <= tolerance(k)), "{name}: {a:?} for {b:?}");
        }
    }
}

#[test]
fn packed_pictures_are_the_same_picture() {
    let whole = loaded("wave");
    for (name, tolerance) in [("wave-webp", 0), ("wave-etc1s", 24), ("wave-uastc", 8)] {
        let packed = loaded(name);
        assert_eq!((packed.images.len(), packed.images[0].width, packed.images[0].height), (1, 16, 16), "{name}");
        let texels = packed.images[0].rgba.iter().zip(&whole.images[0].rgba);
        let worst = texels.flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(tolerance), "{name}: off by {worst:?}");
    }
}

#[test]
fn a_damaged_stream_loses_its_mesh_alone() {
    let bytes = std::fs::read(file("wave-meshopt")).unwrap();
    let at = bytes.iter().rposition(|byte| *byte == 0xa0 || *byte == 0xa1 || *byte == 0xe1).unwrap();
    let mut damaged = bytes.clone();
    damaged[at] = 7;
    let files = Files::new();
    match files.load("scene.glb", &damaged) {
        Ok(scene) => assert!(scene.warnings.iter().any(|w| w.contains("another header")), "{:?}", scene.warnings),
        Err(error) => assert!(error.to_string().contains("another header"), "{error}"),
    }
}

#[test]
fn a_variant_is_chosen_by_name_or_number() {
    let mut json = triangle();
    let mapped = json!({"mappings": [{"material": 1, "variants": [0, 2]}, {"material": 2, "variants": [1]}]});
    set(&mut json, "/meshes/0/primitives/0/extensions", json!({"KHR_materials_variants": mapped}));
    let names = json!([{"name": "red"}, {"name": "green"}, {"name": "7"}, {"name": "bare"}]);
    set(&mut json, "/extensions", json!({"KHR_materials_variants": {"variants": names}}));
    set(&mut json, "/materials", json!([{"name": "a"}, {"name": "b"}, {"name": "c"}]));
    let files = Files::new();
    let path = files.write("scene.glb", &glb(&json, &triangle_bin()));
    let shown = |variant: Option<&str>| {
        let choices = Choices { variant: variant.map(Into::into), ..Choices::default() };
        load_with(&path, &choices, &Limits::default()).map(|scene| scene.materials[0].name.clone())
    };
    for (variant, material) in [
        (None, "a"),
        (Some("red"), "b"),
        (Some("green"), "c"),
        (Some("7"), "b"),
        (Some("0"), "b"),
        (Some("1"), "c"),
        (Some("bare"), "a"),
    ] {
        assert_eq!(shown(variant).unwrap(), material, "{variant:?}");
    }
    let error = shown(Some("blue")).unwrap_err().to_string();
    assert!(error.ends_with("no variant 'blue'; the scene has 'red', 'green', '7', 'bare'"), "{error}");
    assert_eq!(load(&path, &Limits::default()).unwrap().variants, ["red", "green", "7", "bare"]);
}

#[test]
fn hidden_nodes_are_left_out_with_all_below_them() {
    let hidden = |visible: bool| json!({"KHR_node_visibility": {"visible": visible}});
    let nodes = json!([
        {"mesh": 0, "children": [1]},
        {"children": [2], "extensions": hidden(false)},
        {"mesh": 0, "extensions": hidden(true)},
        {"mesh": 0, "extensions": hidden(true)}
    ]);
    let mut json = with("/nodes", nodes);
    set(&mut json, "/scenes/0/nodes", json!([0, 3]));
    set(&mut json, "/extensionsRequired", json!(["KHR_node_visibility"]));
    let scene = Files::new().load("scene.glb", &glb(&json, &triangle_bin())).unwrap();
    assert_eq!(World::of(&scene).triangles.len(), 2);
    assert!(scene.warnings[0].contains("1 node(s) are hidden"), "{:?}", scene.warnings);
}
