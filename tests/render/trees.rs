//! Builders of the tree of a scene: the same pictures, whoever builds, and whether a tree is refitted or new.

use nephroid::low_level::film::accumulate::Film;
use nephroid::low_level::render::TreeBuild;
use nephroid::{
    Camera, Change, Changes, Instance, InstanceId, Light, Material, Mesh, MeshId, Method, Scene, Session, Settings,
    Step, Transform,
};

use crate::support::device::runtime;

const BALL: InstanceId = InstanceId(1);
const PANEL: InstanceId = InstanceId(2);

/// A floor, a ball with enough triangles for the device, a panel and a small ball that shine, and a lamp.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let materials = [
        Material::lambert([0.6, 0.5, 0.4]),
        Material::glass(1.5),
        Material::emitter([3.0, 2.0, 1.0]),
        Material::emitter([1.0, 2.0, 4.0]),
    ];
    let [floor, glass, panel, glow] = materials.map(|material| scene.add_material(material));
    let meshes = [
        (Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]), floor),
        (Mesh::sphere([0.0; 3], 0.5, 34, 68), glass),
        (Mesh::quad([-0.4, 2.0, -0.4], [0.8, 0.0, 0.0], [0.0, 0.0, 0.8]), panel),
        (Mesh::sphere([1.0, 0.4, 0.8], 0.1, 6, 12), glow),
    ];
    for (mesh, material) in meshes {
        let mesh = scene.add_mesh(Mesh { material, ..mesh });
        scene.add_instance(Instance::of(mesh).at(Transform::translation([0.0, 0.0, 0.0])));
    }
    scene.instances[BALL.index()].transform = Some(Transform::translation([0.3, 0.8, 0.0]));
    scene.add_light(Light::Point { position: [1.0, 1.8, 0.5], intensity: [2.0; 3] });
    scene.add_camera(Camera::look_at([0.0, 1.5, 4.0], [0.0, 0.6, 0.0], [0.0, 1.0, 0.0], 0.8));
    scene
}

fn settings(tree_build: TreeBuild) -> Settings {
    Settings { width: 24, height: 18, photons: Some(3000), tree_build, ..Settings::of(Method::Photons) }
}

fn new_session(scene: &Scene, settings: Settings) -> Session {
    Session::new(runtime().device(), scene.clone(), settings).expect("a session")
}

fn film(session: &mut Session) -> Film {
    (0..2).for_each(|pass| session.run_pass(pass).expect("a pass"));
    session.film().expect("the film")
}

fn same(found: &Film, expected: &Film) -> bool {
    found.passes == expected.passes && found.rejected == expected.rejected && found.sums == expected.sums
}

fn squeezed(scene: &Scene, factor: f32) -> Vec<[f32; 3]> {
    scene.meshes[1].positions.iter().map(|[x, y, z]| [*x, factor * y, *z]).collect()
}

/// Changes one after the other: a place, another vertices, a turn that asks for a new tree, a light, what is hidden.
fn walk(scene: &Scene) -> Vec<Change> {
    let normals = scene.meshes[1].normals.clone();
    let turned = Transform::rotation([0.3, 1.0, 0.1], 2.0).then(Transform::translation([-0.6, 0.9, 0.3]));
    let far = Transform::scaling([-3.0, 0.4, 2.0]).then(Transform::translation([0.4, 1.0, -0.5]));
    vec![
        Change::Transform(BALL, Some(Transform::translation([0.31, 0.82, 0.0]))),
        Change::Vertices(MeshId(1), squeezed(scene, 0.7), normals),
        Change::Transform(BALL, Some(turned)),
        Change::Transform(PANEL, Some(Transform::translation([0.2, -0.3, 0.1]))),
        Change::Transform(BALL, Some(far)),
        Change::Visible(PANEL, false),
        Change::Transform(BALL, Some(Transform::translation([0.3, 0.8, 0.0]))),
        Change::Visible(PANEL, true),
    ]
}

/// The change by hand.
fn make(scene: &mut Scene, change: &Change) {
    match change {
        Change::Transform(id, transform) => scene.instances[id.index()].transform = *transform,
        Change::Visible(id, visible) => scene.instances[id.index()].visible = *visible,
        Change::Vertices(id, positions, _) => scene.meshes[id.index()].positions = positions.clone(),
        other => panic!("{other:?}"),
    }
}

/// Every session that goes through the changes has, after each, the film of a new session of the changed scene, and so
/// has every builder.
#[test]
fn pictures_do_not_depend_on_who_builds_nor_when() {
    let builders = [TreeBuild::Lbvh, TreeBuild::Hploc, TreeBuild::Auto];
    let mut scene = scene();
    let mut sessions = builders.map(|build| new_session(&scene, settings(build)));
    let changes = walk(&scene);
    for (index, change) in changes.iter().enumerate() {
        make(&mut scene, change);
        let expected = film(&mut new_session(&scene, settings(TreeBuild::Hploc)));
        for (session, build) in sessions.iter_mut().zip(builders) {
            let updated = session.update(Changes(vec![change.clone()])).expect("an update");
            assert!(updated.steps.has(Step::Tree), "{build:?}");
            assert!(same(&film(session), &expected), "change {index}, {build:?}: another film");
        }
    }
    // With one light that is a triangle or none, the host's order is that of the others.
    scene.materials[3] = Material::lambert([0.5; 3]);
    scene.instances[PANEL.index()].visible = false;
    let films = [TreeBuild::Sah, TreeBuild::Lbvh].map(|build| film(&mut new_session(&scene, settings(build))));
    assert!(same(&films[0], &films[1]), "the tree can be seen");
}

/// A moved instance plans nothing where the tree is refitted, nor where it is built anew.
#[test]
fn a_device_that_builds_plans_once() {
    let scene = scene();
    for build in [TreeBuild::Lbvh, TreeBuild::Hploc, TreeBuild::Auto] {
        let mut session = new_session(&scene, settings(build));
        session.run_pass(0).expect("a pass");
        let moved = |height: f64| Changes::new().transform(BALL, Transform::translation([0.1, height, 0.2]));
        // The automatic choice takes more memory when it goes to the device for the first time.
        session.update(moved(0.81)).expect("an update");
        for height in [0.82, 0.9, 1.3, 0.9] {
            let updated = session.update(moved(height)).expect("an update");
            let steps = [Step::Film, Step::Lights, Step::Casters, Step::Vertices, Step::Tree];
            assert!(updated.steps.iter().all(|step| steps.contains(&step)), "{build:?}: {:?}", updated.steps);
        }
    }
}

/// Methods that take turns share the tree on the device.
#[test]
fn methods_in_turns_share_a_tree() {
    let mut scene = scene();
    let of_turns = |build| Settings { method: Method::Auto, ..settings(build) };
    let mut session = new_session(&scene, of_turns(TreeBuild::Auto));
    let changes = walk(&scene);
    for change in &changes[..5] {
        make(&mut scene, change);
        session.update(Changes(vec![change.clone()])).expect("an update");
        let expected = film(&mut new_session(&scene, of_turns(TreeBuild::Lbvh)));
        let found = film(&mut session);
        assert!(found.passes == expected.passes && found.sums == expected.sums, "{change:?}");
    }
}

/// The comparison notices a tree that was left where it was.
#[test]
fn a_stale_tree_is_noticed() {
    let mut scene = scene();
    let mut session = new_session(&scene, settings(TreeBuild::Hploc));
    let changes = walk(&scene);
    make(&mut scene, &changes[0]);
    assert!(!same(&film(&mut session), &film(&mut new_session(&scene, settings(TreeBuild::Hploc)))));
}
