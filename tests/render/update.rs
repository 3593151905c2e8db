//! A session whose scene changes renders what a new session of the changed scene renders, to the bit, and does no more
//! for it than the change asks for.
//!
//! `NEPHROID_TEST_DEVICE` and `NEPHROID_VALIDATE` as in the other device tests.

use std::sync::Arc;

use nephroid::low_level::film::accumulate::Film;
use nephroid::{
    Camera, CameraId, Change, Changes, Device, Instance, InstanceId, Lens, Light, LightId, Material, MaterialId, Mesh,
    MeshId, Method, Scene, Session, Settings, Step, Steps, Transform,
};

use crate::support::device::runtime;
use crate::support::lab::asset;

const FLOOR: MaterialId = MaterialId(0);
const GLASS: MaterialId = MaterialId(1);
const PANEL: MaterialId = MaterialId(2);
const BALL: InstanceId = InstanceId(1);
const LIT: InstanceId = InstanceId(2);
const LAMP: LightId = LightId(0);
const FRONT: CameraId = CameraId(0);
const SIDE: CameraId = CameraId(1);

/// A floor, a ball of glass above it, a panel that shines, a lamp, and two cameras.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let materials = [Material::lambert([0.6, 0.5, 0.4]), Material::glass(1.5), Material::emitter([3.0, 2.0, 1.0])];
    let [floor, glass, panel] = materials.map(|material| scene.add_material(material));
    let meshes = [
        (Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]), floor),
        (Mesh::sphere([0.0; 3], 0.5, 8, 16), glass),
        (Mesh::quad([-0.4, 2.0, -0.4], [0.8, 0.0, 0.0], [0.0, 0.0, 0.8]), panel),
    ];
    let [floor, ball, panel] = meshes.map(|(mesh, material)| scene.add_mesh(Mesh { material, ..mesh }));
    scene.add_instance(Instance::of(floor));
    scene.add_instance(Instance::of(ball).at(Transform::translation([0.3, 0.8, 0.0])).named("ball"));
    scene.add_instance(Instance::of(panel));
    scene.add_light(Light::Point { position: [1.0, 1.8, 0.5], intensity: [2.0; 3] });
    scene.add_camera(Camera::look_at([0.0, 1.5, 4.0], [0.0, 0.6, 0.0], [0.0, 1.0, 0.0], 0.8));
    scene.add_camera(Camera::look_at([3.0, 1.0, 1.0], [0.0, 0.6, 0.0], [0.0, 1.0, 0.0], 0.9));
    scene
}

fn settings() -> Settings {
    Settings { width: 24, height: 18, photons: Some(3000), ..Settings::of(Method::Photons) }
}

fn film(session: &mut Session) -> Film {
    (0..2).for_each(|pass| session.run_pass(pass).expect("a pass"));
    session.film().expect("the film")
}

/// The same film: passes, values that count, exponents, sums.
fn assert_same(found: &Film, expected: &Film, what: &str) {
    assert!(found.passes == expected.passes && found.rejected == expected.rejected, "{what}: other passes");
    assert!(found.sums == expected.sums, "{what}: another film");
    assert!(found.layers == expected.layers, "{what}: other layers");
}

/// A session that is already in the middle of another picture.
fn running(device: &Arc<Device>, scene: &Scene, settings: &Settings) -> Session {
    let mut session = Session::new(device, scene.clone(), settings.clone()).expect("a session");
    session.run_pass(7).expect("a pass");
    session
}

/// Makes changes and compares with a new session of the scene and the settings that are named by `by_hand`; then takes
/// them back by `back`.
fn check(what: &str, there: Changes, back: Changes, by_hand: impl Fn(&mut Scene, &mut Settings), expected: &[Step]) {
    let (runtime, scene, settings) = (runtime(), scene(), settings());
    let device = runtime.device();
    let first = film(&mut Session::new(device, scene.clone(), settings.clone()).expect("a session"));
    let mut session = running(device, &scene, &settings);
    let invalid = there.invalidates();
    let updated = session.update(there).expect("an update");
    assert_eq!(updated.steps, Steps::of(expected.iter().copied()), "{what}");
    assert!(updated.steps.iter().all(|step| invalid.has(step)), "{what}: {:?} of {invalid:?}", updated.steps);
    assert_eq!(session.film().expect("the film").passes.count(), 0, "{what}: the film is cleared");
    assert_eq!(session.statistics().expect("statistics").photons, 0, "{what}: statistics start again");
    let (mut other, mut others) = (scene.clone(), settings.clone());
    by_hand(&mut other, &mut others);
    let wanted = film(&mut Session::new(device, other, others).expect("a session"));
    assert_same(&film(&mut session), &wanted, what);
    assert!(wanted.sums != first.sums, "{what}: the change can be seen");
    session.update(back).expect("an update");
    assert_same(&film(&mut session), &first, &format!("{what}, taken back"));
}

#[test]
fn another_camera_plans_nothing() {
    let steps = [Step::Film, Step::Camera];
    let moved = Camera::look_at([-1.0, 2.0, 3.5], [0.2, 0.5, 0.0], [0.0, 1.0, 0.0], 0.7);
    let there = Changes::new().camera(FRONT, moved.clone());
    let back = Changes::new().camera(FRONT, scene().cameras[0].clone());
    check("camera", there, back, |s, _| s.cameras[0] = moved.clone(), &steps);
    let (there, back) = (Change::View(SIDE), Change::View(FRONT));
    check("view", Changes(vec![there]), Changes(vec![back]), |_, s| s.camera = 1, &steps);
}

#[test]
fn another_lens_plans_only_where_there_was_none() {
    let (wide, narrow) = (Lens { radius: 0.2, focus: 3.0 }, Lens { radius: 0.1, focus: 4.0 });
    let set = |lens| Changes(vec![Change::Lens(lens)]);
    check("lens", set(Some(wide)), set(None), |_, s| s.lens = Some(wide), &[Step::Film, Step::Camera, Step::Plan]);
    let runtime = runtime();
    let device = runtime.device();
    let with = |lens| Settings { lens: Some(lens), ..settings() };
    let mut session = running(device, &scene(), &with(wide));
    let updated = session.update(set(Some(narrow))).expect("an update");
    assert_eq!(updated.steps, Steps::of([Step::Film, Step::Camera]));
    let expected = film(&mut Session::new(device, scene(), with(narrow)).expect("a session"));
    assert_same(&film(&mut session), &expected, "another lens");
}

#[test]
fn another_seed_only_clears_the_film() {
    let set = |seed| Changes(vec![Change::Seed(seed)]);
    check("seed", set(9), set(0), |_, s| s.seed = 9, &[Step::Film]);
}

#[test]
fn a_moved_light_builds_no_tree() {
    let light = |position, intensity| Light::Point { position, intensity };
    let moved = light([-1.0, 1.5, 0.2], [2.0; 3]);
    let back = || Changes::new().light(LAMP, scene().lights[0]);
    let steps = [Step::Film, Step::Lights];
    check("moved light", Changes::new().light(LAMP, moved), back(), |s, _| s.lights[0] = moved, &steps);
    // Another intensity is another share of the light for the panel, whose material knows it.
    let dimmed = light([1.0, 1.8, 0.5], [1.9; 3]);
    let steps = [Step::Film, Step::Lights, Step::Materials];
    check("dimmed light", Changes::new().light(LAMP, dimmed), back(), |s, _| s.lights[0] = dimmed, &steps);
}

/// All that follows from other triangles.
const TREE: [Step; 6] = [Step::Film, Step::Lights, Step::Casters, Step::Vertices, Step::Tree, Step::Materials];

#[test]
fn a_moved_instance_plans_nothing() {
    let turned = Transform::rotation([0.0, 1.0, 0.0], 0.5).then(Transform::translation([-0.6, 0.9, 0.3]));
    let there = Changes::new().transform(BALL, turned);
    let back = Changes::new().transform(BALL, scene().instances[1].transform.expect("a transform"));
    let by_hand = |s: &mut Scene, _: &mut Settings| s.instances[1].transform = Some(turned);
    check("instance", there, back, by_hand, &TREE[..5]);
}

#[test]
fn hidden_instances_come_back() {
    let set = |visible| Changes::new().visible(LIT, visible);
    let all = [&TREE[..], &[Step::Plan]].concat();
    check("hidden light", set(false), set(true), |s, _| s.instances[2].visible = false, &all);
    let set = |visible| Changes::new().visible(BALL, visible);
    let without_materials = [&TREE[..5], &[Step::Plan]].concat();
    check("hidden ball", set(false), set(true), |s, _| s.instances[1].visible = false, &without_materials);
}

#[test]
fn vertices_move() {
    let mesh = scene().meshes[1].clone();
    let squeezed: Vec<_> = mesh.positions.iter().map(|[x, y, z]| [*x, 0.7 * y, *z]).collect();
    let set =
        |positions: &[[f32; 3]]| Changes(vec![Change::Vertices(MeshId(1), positions.to_vec(), mesh.normals.clone())]);
    let by_hand = |s: &mut Scene, _: &mut Settings| s.meshes[1].positions = squeezed.clone();
    check("vertices", set(&squeezed), set(&mesh.positions), by_hand, &TREE[..5]);
}

#[test]
fn materials_plan_only_where_kernels_differ() {
    let scene = scene();
    let of = |id: MaterialId| scene.materials[id.index()].clone();
    let set = |id, material: Material| Changes::new().material(id, material);
    let factors = [Step::Film, Step::Lights, Step::Casters, Step::Materials];
    let painted = Material { base_color: [0.2, 0.3, 0.9, 1.0], ..of(FLOOR) };
    let by_hand = |s: &mut Scene, _: &mut Settings| s.materials[0] = painted.clone();
    check("colour", set(FLOOR, painted.clone()), set(FLOOR, of(FLOOR)), by_hand, &factors);
    let denser = Material { ior: 1.7, ..of(GLASS) };
    let by_hand = |s: &mut Scene, _: &mut Settings| s.materials[1] = denser.clone();
    check("glass", set(GLASS, denser.clone()), set(GLASS, of(GLASS)), by_hand, &factors);
    let warmer = Material { emissive: [3.0, 2.0, 0.9], ..of(PANEL) };
    let by_hand = |s: &mut Scene, _: &mut Settings| s.materials[2] = warmer.clone();
    check("emission", set(PANEL, warmer.clone()), set(PANEL, of(PANEL)), by_hand, &factors);
    let tinted = Material { absorption: [0.5, 1.0, 2.0], ..of(GLASS) };
    let by_hand = |s: &mut Scene, _: &mut Settings| s.materials[1] = tinted.clone();
    let planned = [&factors[..], &[Step::Plan]].concat();
    check("tinted glass", set(GLASS, tinted.clone()), set(GLASS, of(GLASS)), by_hand, &planned);
    // Another number of path slots gives the film other bands.
    let dull = Material::lambert([0.3, 0.7, 0.3]);
    let by_hand = |s: &mut Scene, _: &mut Settings| s.materials[1] = dull.clone();
    check("a dull ball", set(GLASS, dull.clone()), set(GLASS, of(GLASS)), by_hand, &planned);
}

/// Glossy light is gathered from it, which no other material here asks for.
fn brass() -> Material {
    Material::metal([0.9, 0.7, 0.4], 0.5)
}

#[test]
fn changes_are_made_together_and_in_order() {
    let lamp = Light::Point { position: [0.0, 1.0, 1.0], intensity: [4.0, 3.0, 2.0] };
    let first = Light::Point { position: [9.0, 9.0, 9.0], intensity: [9.0; 3] };
    let there = Changes::new()
        .light(LAMP, first)
        .camera(FRONT, scene().cameras[1].clone())
        .transform(BALL, Transform::translation([0.0, 1.0, 0.0]))
        .light(LAMP, lamp)
        .material(FLOOR, brass())
        .with(Change::Seed(3));
    let back = Changes::new()
        .with(Change::Seed(0))
        .material(FLOOR, scene().materials[0].clone())
        .light(LAMP, scene().lights[0])
        .transform(BALL, scene().instances[1].transform.expect("a transform"))
        .camera(FRONT, scene().cameras[0].clone());
    let by_hand = |scene: &mut Scene, settings: &mut Settings| {
        scene.lights[0] = lamp;
        scene.cameras[0] = scene.cameras[1].clone();
        scene.instances[1].transform = Some(Transform::translation([0.0, 1.0, 0.0]));
        scene.materials[0] = brass();
        settings.seed = 3;
    };
    let everything = [&TREE[..], &[Step::Camera, Step::Plan]].concat();
    check("many changes", there, back, by_hand, &everything);
}

#[test]
fn what_cannot_be_seen_leaves_the_film_alone() {
    let runtime = runtime();
    let mut session = running(runtime.device(), &scene(), &settings());
    let before = session.film().expect("the film");
    let unseen = Changes::new()
        .camera(SIDE, scene().cameras[0].clone())
        .light(LAMP, scene().lights[0])
        .visible(BALL, true)
        .material(FLOOR, scene().materials[0].clone());
    let updated = session.update(unseen).expect("an update");
    assert!(updated.steps.is_empty(), "{:?}", updated.steps);
    assert_same(&session.film().expect("the film"), &before, "nothing has changed");
}

#[test]
fn changes_at_fault_change_nothing() {
    let runtime = runtime();
    let mut session = running(runtime.device(), &scene(), &settings());
    let before = session.film().expect("the film");
    let flat = Transform::scaling([1.0, 0.0, 0.0]);
    let dark = Light::Point { position: [0.0; 3], intensity: [f32::NAN; 3] };
    let lens = Lens { radius: 0.1, focus: -1.0 };
    let moved = Changes::new().camera(FRONT, scene().cameras[1].clone());
    let cases = [
        (Changes::new().transform(InstanceId(3), Transform::IDENTITY), "there is no instance 3"),
        (Changes::new().transform(BALL, flat), "is flat in two"),
        (moved.clone().light(LAMP, dark), "change 1: intensity NaN"),
        (moved.clone().with(Change::Lens(Some(lens))), "-1"),
        (moved.clone().with(Change::Vertices(MeshId(0), vec![[0.0; 3]], vec![])), "1 positions and 0 normals for 4"),
        (moved.with(Change::View(CameraId(2))), "there is no camera 2"),
    ];
    for (changes, text) in cases {
        let error = session.update(changes).expect_err(text).to_string();
        assert!(error.contains(text), "{error}");
        assert_eq!(session.scene().cameras, scene().cameras);
    }
    assert_same(&session.film().expect("the film"), &before, "nothing has changed");
}

#[test]
fn a_reset_session_begins_again() {
    let runtime = runtime();
    let device = runtime.device();
    let expected = film(&mut Session::new(device, scene(), settings()).expect("a session"));
    let mut session = running(device, &scene(), &settings());
    session.reset();
    assert_eq!(session.film().expect("the film").passes.count(), 0);
    assert_same(&film(&mut session), &expected, "after a reset");
}

/// Light tracing has a camera of its own for connections, path tracing has no photons.
#[test]
fn other_methods_follow_the_camera() {
    use nephroid::Method;
    let runtime = runtime();
    let device = runtime.device();
    for method in [Method::Light, Method::Path] {
        let settings = Settings { method, ..settings() };
        let mut session = running(device, &scene(), &settings);
        session.update(Changes(vec![Change::View(SIDE)])).expect("an update");
        let expected = Settings { camera: 1, ..settings };
        let expected = film(&mut Session::new(device, scene(), expected).expect("a session"));
        assert_same(&film(&mut session), &expected, "another camera");
    }
}

/// Instances of a file: the chess men stand where they stand, bit for bit, after a walk.
#[test]
fn instances_of_files_move_and_come_back() {
    let (runtime, scene) = (runtime(), asset("cornell-glass"));
    let device = runtime.device();
    let mut session = Session::new(device, scene.clone(), settings()).expect("a session");
    let first = film(&mut session);
    let id = InstanceId(scene.instances.len() as u32 - 1);
    let place = scene.instances[id.index()].transform.expect("a file places by transforms");
    let moved = place.then(Transform::translation([0.0, 0.05, 0.0]));
    session.update(Changes::new().transform(id, moved)).expect("an update");
    let mut other = scene.clone();
    other.instances[id.index()].transform = Some(moved);
    let expected = film(&mut Session::new(device, other, settings()).expect("a session"));
    assert_same(&film(&mut session), &expected, "moved");
    session.update(Changes::new().transform(id, place)).expect("an update");
    assert_same(&film(&mut session), &first, "back");
}
