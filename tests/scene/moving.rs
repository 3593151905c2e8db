//! Scenes that move: the samples against a second reader, damage, and the cases that files can ask for.

use std::path::PathBuf;

use nephroid::low_level::scene::{Choices, Light, Limits, Projection, Scene, World, load, load_with};
use serde_json::{Value, json};

use crate::second_reader::{Point, Reader};
use crate::support::files::Files;
use crate::support::moving::Moving;
use crate::support::{repository, shared};

/// The samples that move, with the animations that are played.
const SAMPLES: [(&str, &[usize]); 11] = [
    ("AnimatedCube/AnimatedCube.gltf", &[0]),
    ("AnimatedMorphCube/AnimatedMorphCube.glb", &[0]),
    ("BoxAnimated/BoxAnimated.glb", &[0]),
    ("InterpolationTest/InterpolationTest.glb", &[0, 1, 2, 3, 4, 5, 6, 7, 8]),
    ("RiggedSimple/RiggedSimple.gltf", &[0]),
    ("RiggedFigure/RiggedFigure.glb", &[0]),
    ("Fox/Fox.glb", &[0]),
    ("SimpleMorph/SimpleMorph.gltf", &[0]),
    ("SimpleSkin/SimpleSkin.gltf", &[0]),
    ("assets/pendulum.glb", &[0]),
    ("assets/banner.glb", &[0]),
];

fn sample(name: &str) -> Option<PathBuf> {
    if name.starts_with("assets/") {
        return Some(repository(name));
    }
    shared::path("assets/khronos").map(|folder| folder.join(name)).filter(|path| path.exists())
}

/// Corners of all triangles of a scene at a time.
fn corners(scene: &Scene, time: f64) -> Vec<[Point; 3]> {
    let mut scene = scene.clone();
    scene.move_to(time);
    scene.validate().unwrap();
    let world = World::of(&scene);
    (0..world.triangles.len() as u32).map(|t| world.corners(t).map(|p| p.map(f64::from))).collect()
}

/// The largest distance of corners that should be the same, by the size of the scene.
fn distance(a: &[[Point; 3]], b: &[[Point; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let points = |all: &[[Point; 3]]| all.iter().flatten().copied().collect::<Vec<Point>>();
    let (a, b) = (points(a), points(b));
    let size = a.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let apart = |(p, q): (&Point, &Point)| (0..3).map(|k| (p[k] - q[k]).abs()).fold(0.0, f64::max);
    a.iter().zip(&b).map(apart).fold(0.0, f64::max) / size
}

#[test]
fn samples_are_where_a_second_reader_has_them() {
    for (name, played) in SAMPLES {
        let Some(path) = sample(name) else { continue };
        let (scene, reader) = (load(&path, &Limits::default()).unwrap(), Reader::open(&path));
        let motion = scene.motion.clone().expect("it moves");
        let on: Vec<usize> = (0..motion.animations().len()).filter(|i| motion.animations()[*i].1).collect();
        assert_eq!(on, played, "{name}");
        let [start, end] = reader.span(played);
        assert_eq!(motion.span(), [start, end], "{name}");
        let mut sabotaged = 0.0f64;
        for share in [0.0, 0.21, 0.5, 0.77, 1.0, -0.5, 1.5] {
            let time = start + share * (end - start);
            let ours = corners(&scene, time);
            let error = distance(&ours, &reader.corners(played, time));
            assert!(error < 2e-6, "{name} at {time} s: {error:.1e}");
            let later = reader.corners(played, time + 0.03 * (end - start));
            sabotaged = sabotaged.max(distance(&ours, &later));
        }
        println!("{name}: {start} s to {end} s, {} triangles", corners(&scene, start).len());
        assert!(sabotaged > 1e-3, "{name}: a later time is told from the right one: {sabotaged:.1e}");
    }
}

/// Poses do not depend on those before them, and the second of two equal ones changes nothing.
#[test]
fn poses_depend_on_the_time_alone() {
    for (name, _) in SAMPLES {
        let Some(path) = sample(name) else { continue };
        let mut scene = load(&path, &Limits::default()).unwrap();
        let motion = scene.motion.clone().expect("it moves");
        let mut fresh = scene.clone();
        for time in [0.9, 0.1, 100.0, 0.4] {
            scene.move_to(time);
        }
        fresh.move_to(0.4);
        assert_eq!((&scene.meshes, &scene.instances), (&fresh.meshes, &fresh.instances), "{name}");
        assert!(motion.pose(0.4, &scene).is_empty(), "{name}");
        assert!(!motion.pose(0.5, &scene).is_empty(), "{name}");
    }
}

#[test]
fn an_animation_is_chosen_by_name_or_index() {
    let Some(path) = sample("Fox/Fox.glb") else { return };
    let chosen = |animation: &str| {
        let choices = Choices { animation: Some(animation.into()), ..Choices::default() };
        load_with(&path, &choices, &Limits::default()).map(|scene| scene.motion.expect("it moves"))
    };
    for (wanted, played) in [("Walk", 1), ("2", 2), ("Survey", 0)] {
        let motion = chosen(wanted).unwrap();
        let on: Vec<bool> = motion.animations().iter().map(|(_, on)| *on).collect();
        assert_eq!(on, [0, 1, 2].map(|i| i == played), "{wanted}");
    }
    let error = chosen("Sleep").unwrap_err().to_string();
    assert!(error.ends_with("no animation 'Sleep'; the scene has 'Survey', 'Walk', 'Run'"), "{error}");
}

/// The corner of the only triangle that is at (1, 0, 0) in its mesh.
fn tip(scene: &Scene) -> [f32; 3] {
    World::of(scene).corners(0)[1]
}

fn visible(scene: &Scene) -> bool {
    scene.instances[0].visible
}

#[test]
fn children_follow_what_moves_them() {
    let file = Moving::triangle()
        .with("/nodes", json!([{"children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "translation": [0, 5, 0]}]))
        .node(0, "translation", &[1.0, 3.0], "VEC3", &[0.0, 0.0, 0.0, 10.0, 0.0, 0.0]);
    assert_eq!(tip(&file.load().unwrap()), [2.0, 10.0, 0.0], "at rest");
    assert_eq!(tip(&file.at(2.0)), [7.0, 10.0, 0.0]);
    assert_eq!((tip(&file.at(-9.0)), tip(&file.at(99.0))), ([2.0, 10.0, 0.0], [12.0, 10.0, 0.0]));
    let scene = file.load().unwrap();
    assert_eq!(scene.motion.unwrap().span(), [1.0, 3.0]);
    assert!(file.load().unwrap().warnings.iter().all(|w| w.contains("the scene has no")));
}

#[test]
fn copies_of_a_node_follow_it() {
    let mut file = Moving::triangle();
    let places = file.accessor("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 5.0]);
    let file = file
        .with("/nodes/0/extensions", json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}}))
        .node(0, "scale", &[0.0, 1.0], "VEC3", &[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]);
    let world = World::of(&file.at(1.0));
    assert_eq!((world.corners(0)[1], world.corners(1)[1]), ([3.0, 0.0, 0.0], [3.0, 0.0, 15.0]));
    assert_eq!(file.at(1.0).meshes.len(), 1, "they share their mesh");
}

#[test]
fn what_is_scaled_to_nothing_is_hidden_and_what_is_mirrored_faces_on() {
    let file = Moving::triangle().node(0, "scale", &[0.0, 2.0], "VEC3", &[1.0, 1.0, 1.0, -1.0, -1.0, -1.0]);
    assert!(!visible(&file.at(1.0)) && World::of(&file.at(1.0)).triangles.is_empty());
    // Through its own origin: what was in front is behind, and so is its front.
    let turned = World::of(&file.at(2.0));
    assert_eq!((turned.corners(0)[2], turned.normals[0]), ([-1.0, 0.0, 0.0], [-0.0, -0.0, -1.0]));
    let mirrored = Moving::triangle().node(0, "scale", &[0.0, 2.0], "VEC3", &[1.0, 1.0, 1.0, -1.0, 1.0, 1.0]);
    assert_eq!(World::of(&mirrored.at(2.0)).normals[0], [0.0, 0.0, 1.0]);
    assert!(World::of(&mirrored.at(1.0)).triangles.is_empty(), "seen from its edge");
    // At rest it is nothing, later it is there.
    let born = Moving::triangle().with("/nodes/0/scale", json!([0, 0, 0]));
    let born = born.node(0, "scale", &[0.0, 2.0], "VEC3", &[0.0, 0.0, 0.0, 4.0, 4.0, 4.0]);
    assert!(!visible(&born.load().unwrap()) && visible(&born.at(1.0)));
    assert_eq!(tip(&born.at(1.0)), [2.0, 0.0, 0.0]);
    let huge = Moving::triangle().node(0, "scale", &[0.0, 1.0], "VEC3", &[1.0, 1.0, 1.0, 1e6, 1e6, 1e6]);
    assert_eq!(tip(&huge.at(1.0)), [1e6, 0.0, 0.0]);
}

#[test]
fn nodes_appear_and_vanish_with_all_below_them() {
    let nodes = json!([{"children": [1]}, {"mesh": 0}]);
    let pointer = "/nodes/0/extensions/KHR_node_visibility/visible";
    let mut file = Moving::triangle().with("/nodes", nodes).pointer(pointer, &[0.0, 1.0], "SCALAR", &[0.0, 1.0]);
    file.json["animations"][0]["samplers"][0]["interpolation"] = json!("STEP");
    assert!(visible(&file.load().unwrap()) && !visible(&file.at(0.5)) && visible(&file.at(1.0)));
    // Hidden in the file, shown later.
    let hidden = file.with("/nodes/0/extensions", json!({"KHR_node_visibility": {"visible": false}}));
    assert!(!visible(&hidden.load().unwrap()) && visible(&hidden.at(1.0)));
    assert!(hidden.load().unwrap().warnings.iter().all(|w| !w.contains("hidden")));
}

#[test]
fn lights_cameras_and_materials_change() {
    let lights = json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "intensity": 0, "color": [1, 0.5, 0.25], "spot": {"outerConeAngle": 0.5}}]}});
    let file = Moving::triangle()
        .with("/extensions", lights)
        .with("/cameras", json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]))
        .with("/nodes", json!([{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}, {"camera": 0}]))
        .with("/scenes/0/nodes", json!([0, 1, 2]))
        .with("/materials/0/emissiveFactor", json!([1, 1, 0]))
        .pointer("/extensions/KHR_lights_punctual/lights/0/intensity", &[0.0, 1.0], "SCALAR", &[0.0, 8.0])
        .pointer("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", &[0.0], "SCALAR", &[1.0])
        .pointer("/cameras/0/perspective/yfov", &[0.0, 1.0], "SCALAR", &[0.5, 1.5])
        .pointer(
            "/materials/0/pbrMetallicRoughness/baseColorFactor",
            &[0.0, 1.0],
            "VEC4",
            &[1.0, 1.0, 1.0, 1.0, 0.0, 0.5, 1.0, 1.0],
        )
        .pointer(
            "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength",
            &[0.0, 1.0],
            "SCALAR",
            &[1.0, 3.0],
        )
        .node(1, "translation", &[0.0, 1.0], "VEC3", &[0.0, 0.0, 0.0, 0.0, 4.0, 0.0])
        .node(2, "rotation", &[0.0, 1.0], "VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0]);
    let (rest, half) = (file.load().unwrap(), file.at(0.5));
    let Light::Spot { intensity, position, outer_angle, .. } = half.lights[0] else { panic!("{:?}", half.lights) };
    assert_eq!((intensity, position, outer_angle), ([4.0, 2.0, 1.0], [0.0, 2.0, 0.0], 1.0));
    assert!(matches!(rest.lights[0], Light::Spot { intensity: [0.0, 0.0, 0.0], outer_angle: 0.5, .. }));
    assert_eq!(half.cameras[0].projection, Projection::Perspective { yfov: 1.0, aspect: None });
    assert!(half.cameras[0].forward[0] < -0.999, "a quarter turn about Y: {:?}", half.cameras[0]);
    assert_eq!(half.materials[0].base_color, [0.5, 0.75, 1.0, 1.0]);
    assert_eq!((rest.materials[0].emissive, half.materials[0].emissive), ([1.0, 1.0, 0.0], [2.0, 2.0, 0.0]));
    assert!(rest.warnings.is_empty(), "{:?}", rest.warnings);
}

/// A chain of 500 joints, each a step along x after the one before, that bends about z; the last corner hangs on the
/// last joint with a weight of 3, the others on the first one. Bent by nothing it is where it was.
#[test]
fn a_skin_of_many_joints_whose_weights_are_not_one() {
    const JOINTS: usize = 500;
    let mut file = Moving::triangle();
    let joint = |i: usize| match i {
        0 => json!({"children": [2]}),
        _ if i + 1 < JOINTS => json!({"children": [i + 2], "translation": [0.01, 0, 0]}),
        _ => json!({"translation": [0.01, 0, 0]}),
    };
    let nodes: Vec<Value> = [json!({"mesh": 0, "skin": 0})].into_iter().chain((0..JOINTS).map(joint)).collect();
    let inverse: Vec<f32> = (0..JOINTS)
        .flat_map(|i| [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -0.01 * i as f32, 0.0, 0.0, 1.0])
        .collect();
    let matrices = file.accessor("MAT4", &inverse);
    let weights = file.accessor("VEC4", &[1.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.25, 0.25, 0.0, 0.0]);
    let last = (JOINTS - 1) as u16;
    let view = file.json["bufferViews"].as_array().unwrap().len();
    let joints: Vec<u8> =
        [[0, 0, 0, 0], [last, 0, 0, 0], [0, last, 0, 0]].concat().into_iter().flat_map(u16::to_le_bytes).collect();
    let (offset, length) = (file.bin.len(), joints.len());
    file.bin.extend(joints);
    let total = file.bin.len();
    let skin = json!([{"joints": (1..=JOINTS).collect::<Vec<_>>(), "inverseBindMatrices": matrices}]);
    let file = file
        .with("/buffers/0/byteLength", json!(total))
        .with("/bufferViews/-", json!({"buffer": 0, "byteOffset": offset, "byteLength": length}))
        .with("/accessors/-", json!({"bufferView": view, "componentType": 5123, "count": 3, "type": "VEC4"}))
        .with("/meshes/0/primitives/0/attributes/JOINTS_0", json!(weights + 1))
        .with("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(weights))
        .with("/nodes", json!(nodes))
        .with("/scenes/0/nodes", json!([0, 1]))
        .with("/skins", skin)
        // A quarter turn of the whole chain, and a shift of the last joint.
        .node(1, "rotation", &[0.0, 1.0], "VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5f32.sqrt(), 0.5f32.sqrt()])
        .node(JOINTS, "translation", &[0.0, 1.0], "VEC3", &[0.01, 0.0, 0.0, 1.01, 0.0, 0.0]);
    let near = |found: [f32; 3], expected: [f32; 3]| {
        let error = (0..3).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f32::max);
        assert!(error < 1e-5, "{found:?}, not {expected:?}");
    };
    let rest = World::of(&file.at(0.0)).corners(0);
    [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
        .into_iter()
        .zip(rest)
        .for_each(|(expected, found)| near(found, expected));
    let bent = World::of(&file.at(1.0)).corners(0);
    near(bent[1], [0.0, 2.0, 0.0]);
    // Half of either joint: (-1, 0, 0) and (-1, 1, 0).
    near(bent[2], [-1.0, 0.5, 0.0]);
}

/// What is wrong with a channel is told with its place and cause, and all else moves on.
#[test]
fn damaged_channels_are_named_and_left_out() {
    let nan = f32::NAN;
    let good = || {
        let nodes = json!([{"mesh": 0}, {"mesh": 0}]);
        let file = Moving::triangle().with("/nodes", nodes).with("/scenes/0/nodes", json!([0, 1]));
        file.node(1, "translation", &[0.0, 1.0], "VEC3", &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0])
    };
    let keys = |times: &[f32], values: &[f32]| good().node(0, "translation", times, "VEC3", values);
    let six = &[0.0f32, 0.0, 0.0, 9.0, 9.0, 9.0];
    let unknown = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/0/name"}}});
    let to = |target: Value| good().channel(target, ("LINEAR", &[0.0, 1.0]), ("VEC3", six));
    let cases: Vec<(&str, Moving)> = vec![
        ("the time of key 1 is not finite", keys(&[0.0, nan], six)),
        ("key 1 at 1 s is before key 0 at 2 s", keys(&[2.0, 1.0], six)),
        ("a value of key 1 is not finite", keys(&[0.0, 1.0], &[0.0, 0.0, 0.0, nan, 0.0, 0.0])),
        ("its values have 4 numbers and not 3", good().node(0, "translation", &[0.0], "VEC4", &[0.0; 4])),
        ("3 x F32 cannot be read as Rotation", good().node(0, "rotation", &[0.0, 1.0], "VEC3", six)),
        ("3 x F32 cannot be read as Time", keys(&[0.0, 1.0], six).with("/animations/0/samplers/1/input", json!(0))),
        (
            "the interpolation CURVY is unknown",
            keys(&[0.0, 1.0], six).with("/animations/0/samplers/1/interpolation", json!("CURVY")),
        ),
        ("sampler 7 does not exist", keys(&[0.0, 1.0], six).with("/animations/0/channels/1/sampler", json!(7))),
        ("accessor 99 does not exist", keys(&[0.0, 1.0], six).with("/animations/0/samplers/1/output", json!(99))),
        ("it has no target", keys(&[0.0, 1.0], six).with("/animations/0/channels/1", json!({"sampler": 1}))),
        ("node 9 does not exist", to(json!({"node": 9, "path": "translation"}))),
        ("its path sideways is unknown", to(json!({"node": 0, "path": "sideways"}))),
        ("its node has no morph targets", to(json!({"node": 0, "path": "weights"}))),
        ("its target has no pointer", to(json!({"path": "pointer"}))),
        ("another channel moves the same", to(json!({"node": 1, "path": "translation"}))),
        ("animation of /nodes/0/name is not supported", to(unknown)),
    ];
    for (cause, file) in cases {
        let scene = file.load().unwrap_or_else(|error| panic!("{cause}: {error}"));
        let told: Vec<_> = scene.warnings.iter().filter(|w| w.contains("animation 0, channel 1: ")).collect();
        assert!(told.len() == 1 && told[0].contains(cause), "{cause}: {:?}", scene.warnings);
        let moved = World::of(&file.at(1.0));
        assert_eq!((moved.corners(0)[1], moved.corners(1)[1]), ([1.0, 0.0, 0.0], [3.0, 0.0, 0.0]), "{cause}");
    }
    let short = keys(&[0.0, 1.0, 2.0], six);
    assert!(short.load().unwrap().warnings.iter().any(|w| w.contains("6 numbers for 3 keys of 3")));
    assert_eq!(World::of(&short.at(1.0)).corners(0)[1], [10.0, 9.0, 9.0], "keys with values count");
}

/// A strict reader refuses what another reads around; a lamp that is hidden is dark; and a surface that comes to shine
/// is a light from the beginning.
#[test]
fn strict_readers_dark_lamps_and_surfaces_that_come_to_shine() {
    let file = Moving::triangle().node(0, "translation", &[1.0, 0.0], "VEC3", &[0.0; 6]);
    let folder = Files::new();
    let path = folder.write("scene.glb", &file.bytes());
    let strict = Limits { strict: true, ..Limits::default() };
    let error = load(&path, &strict).unwrap_err().to_string();
    assert!(error.contains("animation 0, channel 0: sampler 0: key 1 at 0 s is before key 0 at 1 s"), "{error}");
    let lights = json!({"KHR_lights_punctual": {"lights": [{"type": "directional", "intensity": 2}]}});
    let shown = "/nodes/1/extensions/KHR_node_visibility/visible";
    let extensions = json!({"KHR_lights_punctual": {"light": 0}, "KHR_node_visibility": {"visible": false}});
    let lamp = Moving::triangle()
        .with("/extensions", lights)
        .with("/nodes/-", json!({"extensions": extensions}))
        .with("/scenes/0/nodes", json!([0, 1]))
        .pointer(shown, &[0.0, 1.0], "SCALAR", &[0.0, 1.0]);
    let irradiance = |scene: Scene| match scene.lights[0] {
        Light::Directional { irradiance, .. } => irradiance,
        other => panic!("{other:?}"),
    };
    assert_eq!(irradiance(lamp.load().unwrap()), [0.0; 3]);
    assert_eq!((irradiance(lamp.at(0.0)), irradiance(lamp.at(1.0))), ([0.0; 3], [2.0; 3]));
    let glow =
        Moving::triangle().pointer("/materials/0/emissiveFactor", &[0.0, 1.0], "VEC3", &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    assert!(glow.load().unwrap().environment.is_none(), "no sky in place of what comes to shine");
    assert_eq!(glow.at(0.5).materials[0].emissive, [0.5; 3]);
}

/// Vertices beyond single precision hide their mesh for that time.
#[test]
fn a_mesh_that_is_not_finite_is_hidden() {
    let mut file = Moving::triangle();
    let moved = file.accessor("VEC3", &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let file = file.with("/meshes/0/primitives/0/targets", json!([{"POSITION": moved}])).node(
        0,
        "weights",
        &[0.0, 1.0, 2.0],
        "SCALAR",
        &[0.0, 1.0, 3e38],
    );
    assert_eq!((tip(&file.at(0.5)), tip(&file.at(1.0))), ([2.0, 0.0, 0.0], [3.0, 0.0, 0.0]));
    assert!(!visible(&file.at(2.0)) && visible(&file.at(0.0)));
}

/// A scene that is read in another unit moves in it as well.
#[test]
fn scenes_in_units_of_their_own_move_in_them() {
    let size = 2f32.powi(60);
    let file = Moving::triangle().with("/nodes/0/scale", json!([size, size, size])).node(
        0,
        "translation",
        &[0.0, 1.0],
        "VEC3",
        &[0.0, 0.0, 0.0, size, 0.0, 0.0],
    );
    let (start, end) = (tip(&file.at(0.0)), tip(&file.at(1.0)));
    assert!(start[0] < 4.0 && (end[0] / start[0] - 2.0).abs() < 1e-6, "{start:?} {end:?}");
}
