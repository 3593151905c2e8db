//! Scenes that move: frames of one session, and passes at moments of an open shutter.
//!
//! `NEPHROID_TEST_DEVICE` and `NEPHROID_VALIDATE` as in the other device tests.

use nephroid::low_level::film::accumulate::Film;
use nephroid::low_level::graph::Runtime;
use nephroid::{Change, Changes, InstanceId, MaterialId, MeshId, Method, Scene, Session, Settings, Shutter};
use serde_json::{Value, json};

use crate::support::device::runtime;
use crate::support::files::floats;
use crate::support::moving::Moving;

/// A document of one mesh for each list of corners (three to a triangle), its material beside it, one node each, with a
/// camera that looks along -z from (0, 0, 5): parallel, and half as high as `half`.
fn document(meshes: &[(Vec<[f32; 3]>, Value)], half: [f32; 2]) -> Moving {
    let mut file = Moving::of(
        json!({
            "asset": {"version": "2.0"}, "buffers": [{"byteLength": 0}], "bufferViews": [], "accessors": [],
            "meshes": [], "nodes": [], "materials": [], "scenes": [{"nodes": []}],
            "cameras": [{"type": "orthographic",
                "orthographic": {"xmag": half[0], "ymag": half[1], "znear": 0.1, "zfar": 100}}],
        }),
        floats(&[]),
    );
    for (i, (corners, material)) in meshes.iter().enumerate() {
        let positions = file.accessor("VEC3", corners.as_flattened());
        file = file
            .with("/meshes/-", json!({"primitives": [{"attributes": {"POSITION": positions}, "material": i}]}))
            .with("/materials/-", material.clone())
            .with("/nodes/-", json!({"mesh": i}))
            .with("/scenes/0/nodes/-", json!(i));
    }
    let camera = meshes.len();
    file.with("/nodes/-", json!({"camera": 0, "translation": [0, 0, 5]})).with("/scenes/0/nodes/-", json!(camera))
}

/// A disc about the origin that faces +z.
fn disc(radius: f32) -> Vec<[f32; 3]> {
    const SIDES: usize = 96;
    let corner = |i: usize| {
        let angle = i as f32 / SIDES as f32 * std::f32::consts::TAU;
        [radius * angle.cos(), radius * angle.sin(), 0.0]
    };
    (0..SIDES).flat_map(|i| [[0.0; 3], corner(i), corner(i + 1)]).collect()
}

fn quad(half: f32, z: f32) -> Vec<[f32; 3]> {
    let [a, b, c, d] = [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]];
    vec![a, b, c, a, c, d]
}

fn matt(color: [f32; 3]) -> Value {
    json!({"pbrMetallicRoughness": {"baseColorFactor": [color[0], color[1], color[2], 1], "metallicFactor": 0}})
}

/// A wall, a small disc before it that moves and turns, a lamp that brightens, and a glossy square that is there in the
/// second half of each second.
fn room() -> Moving {
    let gloss = json!({"pbrMetallicRoughness": {"roughnessFactor": 0.15}});
    let lamp = json!({"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 20}]}});
    let shown = "/nodes/2/extensions/KHR_node_visibility/visible";
    let mut file = document(
        &[(quad(3.0, 0.0), matt([0.7, 0.6, 0.5])), (disc(0.5), matt([0.2, 0.5, 0.8])), (quad(0.5, 0.5), gloss)],
        [2.0, 1.5],
    )
    .with("/extensions", lamp)
    .with("/nodes/-", json!({"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [1, 1, 3]}))
    .with("/scenes/0/nodes/-", json!(4))
    .pointer(shown, &[0.0, 0.5, 1.0], "SCALAR", &[0.0, 1.0, 0.0])
    .node(1, "translation", &[0.0, 2.0], "VEC3", &[-1.0, 0.0, 1.0, 1.0, 0.5, 1.0])
    .node(1, "rotation", &[0.0, 2.0], "VEC4", &[0.0, 0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.95])
    .pointer("/extensions/KHR_lights_punctual/lights/0/intensity", &[0.0, 2.0], "SCALAR", &[20.0, 24.0]);
    file.json["animations"][0]["samplers"][0]["interpolation"] = json!("STEP");
    file
}

fn settings(method: Method) -> Settings {
    let photons = (method != Method::Path).then_some(2000);
    Settings { width: 24, height: 18, photons, ..Settings::of(method) }
}

/// A session on the device, which the test holds for as long.
fn session(runtime: &Runtime, scene: Scene, settings: &Settings) -> Session {
    Session::new(runtime.device(), scene, settings.clone()).expect("a session")
}

fn film(session: &mut Session, passes: impl IntoIterator<Item = u64>) -> Film {
    passes.into_iter().for_each(|pass| session.run_pass(pass).expect("a pass"));
    session.film().expect("the film")
}

#[track_caller]
fn assert_same(found: &Film, expected: &Film, what: &str) {
    assert!(found.passes == expected.passes && found.rejected == expected.rejected, "{what}: other passes");
    assert!(found.exponents == expected.exponents, "{what}: other units");
    assert!(found.sums == expected.sums && found.layers == expected.layers, "{what}: another film");
    assert!(found.mix == expected.mix, "{what}: other passes of the other method");
}

#[test]
fn frames_of_one_session_are_those_of_new_ones() {
    let runtime = &runtime();
    let file = room();
    for method in [Method::Photons, Method::Path, Method::Auto] {
        let first = settings(method);
        let mut shown = session(runtime, file.at(0.0), &first);
        film(&mut shown, 0..2);
        let frames = [(0.3, 0.0), (0.75, 0.0), (0.4, 0.2), (0.6, 0.2), (0.6, 0.0), (9.0, 0.0), (0.1, 0.0)];
        for (time, open) in frames {
            let shutter = (open > 0.0).then_some(Shutter { open: time, close: time + open });
            shown.show(time, shutter).expect("shown");
            let mut fresh = session(runtime, file.at(time), &Settings { shutter, ..first.clone() });
            let what = format!("{method:?} at {time} s, open for {open} s");
            assert_same(&film(&mut shown, 0..4), &film(&mut fresh, 0..4), &what);
        }
        // Another change while the shutter is open counts from when it opens.
        let shutter = Some(Shutter { open: 0.4, close: 0.9 });
        shown.show(0.4, shutter).expect("shown");
        film(&mut shown, 0..3);
        let wall = nephroid::Material::lambert([0.1, 0.2, 0.3]);
        let change = Changes::new().material(MaterialId(0), wall.clone()).with(Change::Seed(5));
        shown.update(change).expect("changed");
        let mut scene = file.at(0.4);
        scene.materials[0] = wall;
        let mut fresh = session(runtime, scene, &Settings { shutter, seed: 5, ..first });
        assert_same(&film(&mut shown, 0..4), &film(&mut fresh, 0..4), &format!("{method:?}, changed while open"));
    }
}

/// The film of an open shutter is the sum of films of the scene at the moments of its passes, whatever their order; and
/// it goes on from where it was stopped.
#[test]
fn each_pass_is_the_scene_at_its_moment() {
    let runtime = &runtime();
    let file = room();
    let shutter = Shutter { open: 0.2, close: 0.9 };
    for method in [Method::Photons, Method::Path] {
        let still = settings(method);
        let open = Settings { shutter: Some(shutter), ..still.clone() };
        let whole = film(&mut session(runtime, file.at(0.2), &open), 0..6);
        let mut sum: Option<Film> = None;
        for pass in 0..6 {
            let moment = shutter.moment(pass, still.seed);
            let mut one = film(&mut session(runtime, file.at(moment), &still), [pass]);
            one.exponents = whole.exponents;
            match &mut sum {
                Some(sum) => sum.merge(&one).expect("another pass of the same film"),
                None => sum = Some(one),
            }
        }
        let sum = sum.expect("passes");
        let apart = |a: &Film, b: &Film| {
            let (a, b) = (a.picture(), b.picture());
            let pairs = a.layers[0].data.iter().zip(&b.layers[0].data);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        assert_same(&whole, &sum, &format!("{method:?}, moments"));
        assert_same(
            &film(&mut session(runtime, file.at(7.0), &open), [3, 1, 5, 0, 4, 2]),
            &whole,
            &format!("{method:?}, order"),
        );
        let half = film(&mut session(runtime, file.at(0.2), &open), [0, 4, 5]);
        let mut resumed = session(runtime, file.at(0.2), &open);
        resumed.restore(&half).expect("of the same render");
        assert_same(&film(&mut resumed, [1, 2, 3]), &whole, &format!("{method:?}, resumed"));
        let shut = film(&mut session(runtime, file.at(0.2), &still), 0..6);
        assert!(apart(&shut, &whole) > 0.05, "{method:?}: blurred or not makes a difference");
    }
}

#[test]
fn a_shutter_over_what_does_not_move_makes_no_difference() {
    let runtime = &runtime();
    let file = room();
    for method in [Method::Photons, Method::Auto] {
        let still = settings(method);
        // Beyond the last key, and in a scene without motion.
        let open = Settings { shutter: Some(Shutter { open: 5.0, close: 6.0 }), ..still.clone() };
        let expected = film(&mut session(runtime, file.at(5.0), &still), 0..4);
        assert_same(&film(&mut session(runtime, file.at(5.0), &open), 0..4), &expected, "beyond the last key");
        let mut scene = file.at(5.0);
        scene.motion = None;
        assert_same(&film(&mut session(runtime, scene, &open), 0..4), &expected, "no motion");
    }
}

/// A white disc of radius r crosses the picture at constant speed: a point at height y sees it for the time that its
/// chord, of half length sqrt(r^2 - y^2), takes to pass.
#[test]
fn a_disc_in_motion_is_smeared_over_its_way() {
    let runtime = &runtime();
    const SIZE: [u32; 2] = [48, 16];
    let radius = 0.8;
    let bright = json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}, "emissiveFactor": [1, 1, 1]});
    let file = document(&[(disc(radius), bright)], [3.0, 1.0]);
    let file = file.node(0, "translation", &[0.0, 1.0], "VEC3", &[-1.5, 0.0, 0.0, 1.5, 0.0, 0.0]);
    let base = Settings { width: SIZE[0], height: SIZE[1], ..Settings::of(Method::Path) };
    let taken = |shutter, passes| {
        let mut session = session(runtime, file.at(0.25), &Settings { shutter, ..base.clone() });
        film(&mut session, 0..passes).picture().layers[0].data.iter().step_by(3).copied().collect::<Vec<f32>>()
    };
    let open = Shutter { open: 0.25, close: 0.75 };
    // The centre goes from -0.75 to 0.75.
    let [start, way] = [-0.75f64, 1.5];
    let expected = |x: u32, y: u32| {
        const SUB: u32 = 16;
        let at = |pixel: u32, sub: u32, size: u32, half: f64| {
            ((f64::from(pixel) + (f64::from(sub) + 0.5) / f64::from(SUB)) / f64::from(size) * 2.0 - 1.0) * half
        };
        let points = (0..SUB * SUB).map(|i| (at(x, i % SUB, SIZE[0], 3.0), at(y, i / SUB, SIZE[1], 1.0)));
        let time = |(x, y): (f64, f64)| {
            let chord = (f64::from(radius).powi(2) - y * y).max(0.0).sqrt();
            let [first, last] = [-chord, chord].map(|edge| ((x + edge - start) / way).clamp(0.0, 1.0));
            last - first
        };
        points.map(time).sum::<f64>() / f64::from(SUB * SUB)
    };
    let error = |picture: &[f32]| {
        let each = (0..SIZE[0] * SIZE[1]).map(|i| f64::from(picture[i as usize]) - expected(i % SIZE[0], i / SIZE[0]));
        let (mut worst, mut squares) = (0.0f64, 0.0);
        for difference in each {
            worst = worst.max(difference.abs());
            squares += difference * difference / f64::from(SIZE[0] * SIZE[1]);
        }
        (worst, squares.sqrt())
    };
    let (worst, rms) = error(&taken(Some(open), 500));
    println!("smeared disc: largest error {worst:.4}, root mean square {rms:.5}");
    assert!(worst < 0.05 && rms < 0.006, "{worst} {rms}");
    for wrong in [None, Some(Shutter { close: 0.7, ..open }), Some(Shutter { open: 0.2, close: 0.7 })] {
        let (worst, rms) = error(&taken(wrong, 150));
        assert!(worst > 0.08 && rms > 0.015, "{wrong:?} is told from the right one: {worst} {rms}");
    }
}

/// Changes of a pose reach the scene that is rendered, and none are left.
#[test]
fn a_pose_is_a_list_of_changes() {
    let runtime = &runtime();
    let file = room();
    let mut session = session(runtime, file.at(0.0), &settings(Method::Photons));
    let changes = session.changes_to(0.75);
    assert!(changes.0.iter().any(|c| matches!(c, Change::Visible(InstanceId(2), true))), "{changes:?}");
    assert!(changes.0.iter().any(|c| matches!(c, Change::Transform(InstanceId(1), _))), "{changes:?}");
    assert!(changes.0.iter().any(|c| matches!(c, Change::Light(..))), "{changes:?}");
    session.update(changes).expect("changed");
    assert_eq!(session.changes_to(0.75), Changes::new());
    let few = Changes(vec![Change::Tangents(MeshId(0), vec![[1.0, 0.0, 0.0, 1.0]])]);
    let error = session.update(few).expect_err("refused").to_string();
    assert!(error.contains("1 tangents for 6 vertices"), "{error}");
    let far = Settings { shutter: Some(Shutter { open: 1.0, close: 0.5 }), ..settings(Method::Photons) };
    let error = Session::new(runtime.device(), file.at(0.0), far).err().expect("refused").to_string();
    assert!(error.contains("shutter") && error.contains("in order"), "{error}");
}
