//! What is read from small glTF files: placement, attributes, materials, lights and cameras.

use nephroid::low_level::scene::{
    Alpha, EnvironmentFile, Light, Limits, Needs, Projection, Scene, World, Wrap, load_with_environment,
};
use serde_json::{Value, json};

use crate::support::files::{self, Files, floats, load_glb, set, triangle, triangle_bin, with};

fn loaded(json: &Value) -> Scene {
    load_glb(json, &triangle_bin()).unwrap()
}

fn close(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(x, y)| (x - y).abs() <= 1e-6 * (1.0 + y.abs()))
}

/// The geometric normal of the first triangle.
fn front(scene: &Scene) -> [f32; 3] {
    let [a, b, c] = World::of(scene).corners(0);
    let (u, v): ([f32; 3], [f32; 3]) = (std::array::from_fn(|k| b[k] - a[k]), std::array::from_fn(|k| c[k] - a[k]));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = cross.iter().map(|x| x * x).sum::<f32>().sqrt();
    cross.map(|x| x / length)
}

/// [`triangle`] with a float attribute after the 44 bytes of its buffer.
fn with_attribute(name: &str, kind: &str, values: &[f32]) -> (Value, Vec<u8>) {
    let mut bin = triangle_bin();
    bin.extend(floats(values));
    let mut json = with("/buffers/0/byteLength", json!(bin.len()));
    set(&mut json, "/bufferViews/-", json!({"buffer": 0, "byteOffset": 44, "byteLength": bin.len() - 44}));
    set(&mut json, "/accessors/-", json!({"bufferView": 2, "componentType": 5126, "count": 3, "type": kind}));
    set(&mut json, &format!("/meshes/0/primitives/0/attributes/{name}"), json!(2));
    (json, bin)
}

#[test]
fn flat_normals_and_additions() {
    let scene = loaded(&triangle());
    assert_eq!(World::of(&scene).normals, [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(scene.warnings.len(), 2, "{:?}", scene.warnings);
    assert!(scene.environment.is_some() && scene.cameras.len() == 1);
    let world = World::of(&scene);
    assert!(world.uvs[0].is_empty() && world.tangents.is_empty() && world.colors.is_empty());
}

#[test]
fn transforms_chain_from_the_root() {
    let half = 0.5f64.sqrt();
    let nodes = json!([
        {"children": [1], "translation": [10, 0, 0]},
        {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 3, 4]}
    ]);
    let scene = loaded(&with("/nodes", nodes));
    // Scaled, then a quarter turn about Z, then moved.
    assert!(close(&World::of(&scene).positions[1], &[10.0, 2.0, 0.0]));
    assert!(close(&World::of(&scene).positions[2], &[7.0, 0.0, 0.0]));
    // Columns of a matrix: X to Y, Y to Z, Z to X.
    let matrix = json!([0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 5, 6, 7, 1]);
    let scene = loaded(&with("/nodes/0/matrix", matrix));
    assert_eq!(World::of(&scene).positions, [[5.0, 6.0, 7.0], [5.0, 7.0, 7.0], [5.0, 6.0, 8.0]]);
}

#[test]
fn mirrored_instances_turn_the_winding() {
    let scene = loaded(&with("/nodes/0/scale", json!([-1, 1, 1])));
    assert!(close(&front(&scene), &[0.0, 0.0, 1.0]));
    assert!(close(&World::of(&scene).normals[0], &[0.0, 0.0, 1.0]));
    let scene = loaded(&with("/nodes/0/scale", json!([1, 1, -1])));
    assert!(close(&front(&scene), &[0.0, 0.0, -1.0]));
    let (mut json, bin) = with_attribute("NORMAL", "VEC3", &[0.0, 0.0, 2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 2.0]);
    set(&mut json, "/nodes/0/scale", json!([-2, -3, -4]));
    let scene = load_glb(&json, &bin).unwrap();
    assert_eq!(World::of(&scene).normals, [[0.0, 0.0, -1.0]; 3]);
    assert!(close(&front(&scene), &[0.0, 0.0, -1.0]));
}

#[test]
fn normals_take_the_inverse_transpose() {
    let (mut json, bin) = with_attribute("NORMAL", "VEC3", &[1.0, 1.0, 0.0].repeat(3));
    set(&mut json, "/nodes/0/scale", json!([2, 1, 1]));
    let scene = load_glb(&json, &bin).unwrap();
    let length = 1.25f32.sqrt();
    assert!(close(&World::of(&scene).normals[0], &[0.5 / length, 1.0 / length, 0.0]));
}

#[test]
fn normals_without_direction_are_replaced() {
    let (json, bin) = with_attribute("NORMAL", "VEC3", &[0.0; 9]);
    let scene = load_glb(&json, &bin).unwrap();
    assert_eq!(World::of(&scene).normals, [[0.0, 0.0, 1.0]; 3]);
    assert!(scene.warnings[0].contains("normals"), "{:?}", scene.warnings);
}

#[test]
fn the_default_scene_is_chosen_and_without_scenes_every_root() {
    let mut json = with("/nodes", json!([{"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}]));
    set(&mut json, "/scenes", json!([{"nodes": [0]}, {"nodes": [1]}, {}]));
    set(&mut json, "/scene", json!(1));
    assert_eq!(World::of(&loaded(&json)).positions[0], [5.0, 0.0, 0.0]);
    set(&mut json, "/scene", json!(2));
    assert!(World::of(&loaded(&json)).triangles.is_empty());
    let members = json.as_object_mut().unwrap();
    members.remove("scene");
    members.remove("scenes");
    assert_eq!(World::of(&loaded(&json)).triangles.len(), 2);
}

#[test]
fn vertex_colors_and_coordinates() {
    let (json, bin) = with_attribute("COLOR_0", "VEC3", &[0.25, 0.5, 2.0].repeat(3));
    let scene = load_glb(&json, &bin).unwrap();
    assert_eq!(World::of(&scene).colors, [[0.25, 0.5, 1.0, 1.0]; 3]);
    assert!(Needs::of(&scene).vertex_colors && scene.warnings[0].contains("clamped"));
    // Coordinates that no texture uses are not kept.
    let (json, bin) = with_attribute("TEXCOORD_0", "VEC2", &[0.0; 6]);
    assert!(World::of(&load_glb(&json, &bin).unwrap()).uvs[0].is_empty());
}

#[test]
fn quantized_attributes_are_read_and_missed_in_the_extensions() {
    // Positions as normalized signed bytes with a stride of four.
    let mut bin = vec![0, 0, 0, 0, 127, 0, 0, 0, 0, 0x81, 0x80, 0];
    bin.resize(36, 0);
    bin.extend(&triangle_bin()[36..]);
    let accessor = json!({"bufferView": 0, "componentType": 5120, "normalized": true, "count": 3, "type": "VEC3"});
    let mut json = with("/accessors/0", accessor);
    set(&mut json, "/bufferViews/0/byteStride", json!(4));
    let told = |scene: &Scene| scene.warnings.iter().any(|warning| warning.contains("is not meant for Position"));
    let undeclared = load_glb(&json, &bin).unwrap();
    set(&mut json, "/extensionsRequired", json!(["KHR_mesh_quantization"]));
    let scene = load_glb(&json, &bin).unwrap();
    assert!(told(&undeclared) && !told(&scene));
    for scene in [undeclared, scene] {
        assert_eq!(World::of(&scene).positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, -1.0]]);
    }
}

#[test]
fn sparse_values_replace() {
    let mut bin = triangle_bin();
    bin.extend([2, 0, 0, 0]);
    bin.extend(floats(&[0.0, 7.0, 0.0]));
    let mut json = with("/buffers/0/byteLength", json!(60));
    set(&mut json, "/bufferViews/-", json!({"buffer": 0, "byteOffset": 44, "byteLength": 4}));
    set(&mut json, "/bufferViews/-", json!({"buffer": 0, "byteOffset": 48, "byteLength": 12}));
    let sparse = json!({"count": 1, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 3}});
    set(&mut json, "/accessors/0/sparse", sparse);
    let scene = load_glb(&json, &bin).unwrap();
    assert_eq!(World::of(&scene).positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 7.0, 0.0]]);
}

#[test]
fn instancing_morphs_and_skins() {
    let instanced = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}});
    let scene = loaded(&with("/nodes/0/extensions", instanced));
    assert_eq!(World::of(&scene).triangles.len(), 3);
    assert_eq!(World::of(&scene).positions[3..6], [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);

    let mut json = with("/meshes/0/primitives/0/targets", json!([{"POSITION": 0}]));
    set(&mut json, "/meshes/0/weights", json!([0.5]));
    assert_eq!(World::of(&loaded(&json)).positions[1], [1.5, 0.0, 0.0]);
    set(&mut json, "/nodes/0/weights", json!([1.0]));
    assert_eq!(World::of(&loaded(&json)).positions[1], [2.0, 0.0, 0.0]);

    // Half bound to either joint; the node's own transform does not count.
    let mut bin = triangle_bin();
    bin.extend([0u8, 1, 0, 0].repeat(3));
    bin.extend(floats(&[0.5, 0.5, 0.0, 0.0].repeat(3)));
    let mut json = with("/buffers/0/byteLength", json!(bin.len()));
    set(&mut json, "/bufferViews/-", json!({"buffer": 0, "byteOffset": 44, "byteLength": 12}));
    set(&mut json, "/bufferViews/-", json!({"buffer": 0, "byteOffset": 56, "byteLength": 48}));
    set(&mut json, "/accessors/-", json!({"bufferView": 2, "componentType": 5121, "count": 3, "type": "VEC4"}));
    set(&mut json, "/accessors/-", json!({"bufferView": 3, "componentType": 5126, "count": 3, "type": "VEC4"}));
    let attributes = json!({"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3});
    set(&mut json, "/meshes/0/primitives/0/attributes", attributes);
    set(&mut json, "/skins", json!([{"joints": [1, 2]}]));
    let nodes = json!([
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]}, {"translation": [0, 2, 0]}, {"translation": [0, 0, 4]}
    ]);
    set(&mut json, "/nodes", nodes);
    set(&mut json, "/scenes/0/nodes", json!([0, 1, 2]));
    let scene = load_glb(&json, &bin).unwrap();
    assert_eq!(World::of(&scene).positions, [[0.0, 1.0, 2.0], [1.0, 1.0, 2.0], [0.0, 2.0, 2.0]]);
}

#[test]
fn only_materials_in_use_are_kept() {
    let mut json = with("/materials", json!([{"name": "a"}, {"name": "b", "doubleSided": true}, {"name": "c"}]));
    set(&mut json, "/meshes/0/primitives/0/material", json!(1));
    set(&mut json, "/meshes/0/primitives/-", json!({"attributes": {"POSITION": 0}}));
    let scene = loaded(&json);
    assert_eq!(scene.materials.len(), 2);
    assert_eq!((scene.materials[0].name.as_str(), scene.materials[0].metallic), ("", 1.0));
    assert!(scene.materials[1].name == "b" && scene.materials[1].double_sided);
    assert_eq!(World::of(&scene).material, [1, 0]);
}

#[test]
fn material_extensions() {
    let extensions = json!({
        "KHR_materials_emissive_strength": {"emissiveStrength": 4.0},
        "KHR_materials_ior": {"ior": 1.33},
        "KHR_materials_specular": {"specularFactor": 0.25, "specularColorFactor": [1, 0.5, 0]},
        "KHR_materials_transmission": {"transmissionFactor": 0.75},
        "KHR_materials_unlit": {}
    });
    let mut json = with("/materials/0/extensions", extensions);
    set(&mut json, "/materials/0/emissiveFactor", json!([0.5, 1, 0]));
    set(&mut json, "/materials/0/alphaMode", json!("MASK"));
    set(&mut json, "/materials/0/alphaCutoff", json!(0.75));
    let scene = loaded(&json);
    let m = &scene.materials[0];
    assert_eq!(m.emissive, [2.0, 4.0, 0.0]);
    assert_eq!((m.ior, m.specular, m.specular_color), (1.33, 0.25, [1.0, 0.5, 0.0]));
    assert_eq!((m.transmission, m.unlit, m.volume, m.alpha), (0.75, true, false, Alpha::Mask(0.75)));
    set(&mut json, "/materials/0/alphaMode", json!("BLEND"));
    let scene = loaded(&json);
    assert_eq!(scene.materials[0].alpha, Alpha::Blend);
}

/// A 2 x 1 PNG, made by the image crate: red, then half-transparent blue.
fn png() -> Vec<u8> {
    let image = image::RgbaImage::from_raw(2, 1, vec![255, 0, 0, 255, 0, 0, 255, 128]).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

#[test]
fn textures_samplers_and_tangents() {
    let (mut json, bin) = with_attribute("TEXCOORD_1", "VEC2", &[0.0, 0.0, 0.0, 1.0, 1.0, 0.0]);
    set(&mut json, "/images", json!([{"uri": "unused.png"}, {"uri": "a%20b.png"}]));
    set(&mut json, "/samplers", json!([{"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}]));
    set(&mut json, "/textures", json!([{"source": 0}, {"source": 1}, {"source": 1, "sampler": 0}]));
    let transform = json!({"KHR_texture_transform": {"offset": [0.5, 0], "scale": [2, 3], "texCoord": 1}});
    set(&mut json, "/materials/0/normalTexture", json!({"index": 2, "scale": 0.5, "extensions": transform}));
    let base = json!({"index": 1, "texCoord": 1});
    set(&mut json, "/materials/0/pbrMetallicRoughness/baseColorTexture", base);
    let files = Files::new();
    files.write("a b.png", &png());
    let scene = files.load("scene.glb", &files::glb(&json, &bin)).unwrap();
    assert_eq!(scene.images.len(), 1);
    assert_eq!(scene.images[0].rgba, [[255, 0, 0, 255], [0, 0, 255, 128]]);
    let m = &scene.materials[0];
    let (base, normal) = (m.base_color_texture.unwrap(), m.normal_texture.unwrap());
    assert_eq!((base.uv_set, normal.uv_set, m.normal_scale), (1, 1, 0.5));
    assert_eq!(normal.transform, [[2.0, 0.0, 0.5], [0.0, 3.0, 0.0]]);
    let texture = scene.textures[normal.texture as usize];
    assert_eq!((texture.wrap, texture.linear), ([Wrap::Clamp, Wrap::Mirror], false));
    assert!(scene.textures[base.texture as usize].linear);
    assert!(World::of(&scene).uvs[0].is_empty() && World::of(&scene).uvs[1].len() == 3);
    // u grows along +Y and v along +X: with v pointing down the image this chart is not mirrored.
    assert_eq!(World::of(&scene).tangents, [[0.0, 1.0, 0.0, 1.0]; 3]);
    let needs = Needs::of(&scene);
    assert!(needs.normal_maps && needs.textures && needs.uv_sets == [false, true]);
}

#[test]
fn lights_and_cameras_follow_their_nodes() {
    let lights = json!([
        {"type": "directional", "intensity": 2, "color": [1, 0.5, 0]},
        {"type": "spot", "spot": {"outerConeAngle": 0.5}},
        {"type": "point", "intensity": 0}
    ]);
    let mut json = with("/extensions", json!({"KHR_lights_punctual": {"lights": lights}}));
    let camera = |yfov: f64| json!({"type": "perspective", "perspective": {"yfov": yfov, "znear": 0.1}});
    let parallel = json!({"xmag": 2, "ymag": 3, "znear": 0, "zfar": 1});
    set(&mut json, "/cameras", json!([camera(0.5), {"type": "orthographic", "orthographic": parallel}]));
    let light = |i: u32| json!({"KHR_lights_punctual": {"light": i}});
    let half = 0.5f64.sqrt();
    // A quarter turn about X takes +Y to +Z and -Z to +Y.
    let nodes = json!([
        {"mesh": 0},
        {"camera": 1, "extensions": light(0), "rotation": [half, 0, 0, half]},
        {"camera": 0, "extensions": light(1), "translation": [1, 2, 3], "scale": [5, 5, 5]},
        {"extensions": light(2)}
    ]);
    set(&mut json, "/nodes", nodes);
    set(&mut json, "/scenes/0/nodes", json!([0, 1, 2, 3]));
    let scene = loaded(&json);
    assert_eq!(scene.lights.len(), 2);
    let Light::Directional { direction, irradiance } = scene.lights[0] else { panic!("{:?}", scene.lights) };
    assert!(close(&direction, &[0.0, 1.0, 0.0]) && irradiance == [2.0, 1.0, 0.0]);
    let Light::Spot { position, direction, outer_angle, .. } = scene.lights[1] else { panic!("{:?}", scene.lights) };
    assert_eq!((position, direction, outer_angle), ([1.0, 2.0, 3.0], [0.0, 0.0, -1.0], 0.5));
    assert!(scene.environment.is_none());
    // In the order of the camera list.
    assert_eq!(scene.cameras[0].projection, Projection::Perspective { yfov: 0.5, aspect: None });
    assert_eq!((scene.cameras[0].position, scene.cameras[0].right), ([1.0, 2.0, 3.0], [1.0, 0.0, 0.0]));
    assert_eq!(scene.cameras[1].projection, Projection::Orthographic { xmag: 2.0, ymag: 3.0 });
    assert!(close(&scene.cameras[1].forward, &[0.0, 1.0, 0.0]) && close(&scene.cameras[1].up, &[0.0, 0.0, 1.0]));
}

#[test]
fn an_environment_takes_the_place_of_the_sky() {
    let files = Files::new();
    let path = files.write("scene.glb", &files::glb(&triangle(), &triangle_bin()));
    let map =
        files.write("map.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x80\x80\x80\x81");
    let scene = load_with_environment(&path, Some(&EnvironmentFile::new(map)), &Limits::default()).unwrap();
    assert_eq!(scene.environment.unwrap().width, 2);
    assert_eq!(scene.warnings, ["the scene has no camera: a three-quarter view frames it"]);
    let cut = files.write("cut.hdr", b"#?RADIANCE\n");
    let error = load_with_environment(&path, Some(&EnvironmentFile::new(cut)), &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("cut.hdr") && error.exit_code() == 2);
}
