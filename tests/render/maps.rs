//! Photons traced in environment maps instead of the tree (Yao et al. 2010).

use nephroid::low_level::render::{Change, Changes, MapSettings, Method, Session, Settings, Tracer};
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Camera, Instance, InstanceId, Light, Material, Scene, Transform};

use crate::support::device::runtime;
use crate::support::harness::Harness;
use crate::support::lab::{Shot, assert_same, asset};
use crate::support::{lab, proof};

fn settings(maps: Option<MapSettings>) -> Settings {
    let tracer = maps.map_or(Tracer::Tree, Tracer::Maps);
    Settings { method: Method::Photons, tracer, layers: true, ..lab::settings(32, 24, 20_000) }
}

fn small() -> MapSettings {
    MapSettings { centres: 6, candidates: 24, resolution: 64, ..MapSettings::default() }
}

/// A closed box with a lamp in it, empty or with a block.
fn room(block: bool) -> Scene {
    let white = Material::lambert([0.7; 3]);
    let mut parts = vec![(Mesh::cuboid([-2.0, 0.0, -2.0], [2.0, 3.0, 2.0]).flipped(), white.clone())];
    if block {
        parts.push((Mesh::cuboid([-1.0, 0.0, -1.0], [0.0, 1.2, 0.0]), white));
    }
    let camera = Camera::look_at([1.6, 1.6, 1.8], [-0.5, 0.8, -0.5], [0.0, 1.0, 0.0], 1.0);
    let lamp = Light::Point { position: [0.3, 2.4, 0.4], intensity: [2.0; 3] };
    Scene::from_parts(parts, vec![lamp], camera)
}

/// Part of the emitted light that was lost.
fn lost(shot: &Shot) -> f64 {
    let sum = |of: fn(&nephroid::low_level::kernels::energy::Ledger) -> f64| -> f64 {
        shot.statistics.energies.iter().map(of).sum()
    };
    sum(|ledger| ledger.lost) / sum(|ledger| ledger.emitted)
}

/// The paper's search loses light even in an empty room: near the wall that a ray leaves at a small angle, the steps of
/// distance from texel to texel hide the ray.
#[test]
fn a_room_is_as_bright_as_by_the_tree() {
    if Harness::skips_drawing() {
        return;
    }
    for (block, steps, most_lost, tolerance) in
        [(false, false, 0.2, 0.2), (false, true, 0.01, 0.02), (true, false, 0.25, 0.25), (true, true, 0.01, 0.02)]
    {
        let scene = room(block);
        let tree = Shot::take(&scene, &settings(None), 0..6);
        let maps = Shot::take(&scene, &settings(Some(MapSettings { steps, ..small() })), 0..6);
        let ratio = maps.mean("indirect") / tree.mean("indirect");
        println!("block {block}, steps {steps}: indirect light {ratio:.3}, lost {:.4}", lost(&maps));
        assert!((ratio - 1.0).abs() < tolerance, "block {block}, steps {steps}: {ratio}");
        assert!(lost(&maps) < most_lost && lost(&tree) == 0.0, "{} lost", lost(&maps));
        assert!(!tree.plan.contains("maps_"), "the tree needs no maps");
    }
    // One centre in a corner does not know what is behind the block.
    let scene = room(true);
    let few = MapSettings { centres: 1, candidates: 1, ..small() };
    assert!(lost(&Shot::take(&scene, &settings(Some(few)), 0..2)) > 0.04, "what no map sees is lost");
    proof::by_answer(&["maps_trace"]);
}

#[test]
fn a_scene_that_changes_is_mapped_anew() {
    if Harness::skips_drawing() {
        return;
    }
    let runtime = runtime();
    let mut scene = room(true);
    // An instance in a space of its own, which can be moved.
    scene.instances[1] = Instance { transform: Some(Transform::IDENTITY), ..scene.instances[1].clone() };
    let moved = Transform::translation([0.7, 0.0, 0.9]);
    let mut session = Session::new(runtime.device(), scene.clone(), settings(Some(small()))).expect("a session");
    session.run_pass(0).expect("a pass");
    let before = session.film().expect("a film");
    let centres = session.device_scene().maps.as_ref().expect("maps").about.centres.clone();
    session.update(Changes(vec![Change::Transform(InstanceId(1), Some(moved))])).expect("an update");
    session.run_pass(0).expect("a pass");
    scene.instances[1].transform = Some(moved);
    let mut fresh = Session::new(runtime.device(), scene, settings(Some(small()))).expect("a session");
    fresh.run_pass(0).expect("a pass");
    let film = session.film().expect("a film");
    assert!(film == fresh.film().expect("a film"), "as in a new session");
    assert!(film != before, "the check can fail");
    assert_eq!(centres.len(), 6);
}

/// The same in every run, and in glass and mirrors.
#[test]
fn maps_are_the_same_in_every_run() {
    if Harness::skips_drawing() {
        return;
    }
    let scene = asset("cornell-glass");
    let take = |passes| Shot::take(&scene, &settings(Some(small())), passes).bits();
    let first = take(0..2);
    assert_same(&take(0..2), &first, "photons in maps");
    assert!(lab::difference(&take(1..3), &first).is_some(), "other passes are another picture");
}
