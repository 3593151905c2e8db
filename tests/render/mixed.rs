//! Photons and paths in turns: films are those of either method alone, and go on, add up and change as all films do.

use nephroid::low_level::film::accumulate::{Film, PassSet};
use nephroid::low_level::render::{Changes, Method, Session, Settings};
use nephroid::low_level::scene::{LightId, Scene};

use crate::support::device::{Shared, runtime};
use crate::support::lab::asset;

fn settings(method: Method) -> Settings {
    Settings { width: 24, height: 18, photons: Some(2000), layers: true, method, ..Settings::default() }
}

fn session(runtime: &Shared, scene: &Scene, method: Method) -> Session {
    Session::new(runtime.device(), scene.clone(), settings(method)).expect("a session")
}

fn run(session: &mut Session, passes: std::ops::Range<u64>) -> Film {
    passes.for_each(|index| session.run_pass(index).expect("a pass without validation message"));
    session.film().expect("a film")
}

#[test]
fn films_are_those_of_either_method() {
    let runtime = runtime();
    for (name, passes, of_photons, of_paths) in [("cornell", 9, 3, 6), ("cornell-glass", 6, 3, 3)] {
        let scene = asset(name);
        let mixed = run(&mut session(&runtime, &scene, Method::Mixed), 0..passes);
        let photons = run(&mut session(&runtime, &scene, Method::Photons), 0..of_photons);
        let paths = run(&mut session(&runtime, &scene, Method::Hybrid), 0..of_paths);
        let mix = mixed.mix.as_ref().expect("a second method");
        assert!(mixed.sums == photons.sums && mixed.layers == photons.layers, "{name}: photons");
        assert!(mix.sums == paths.sums && mix.layers == paths.layers, "{name}: paths");
        assert_eq!(mixed.split_passes(), [PassSet::of(0..of_photons), PassSet::of(0..of_paths)]);
        // Each pixel is between those of the two.
        let [p, t, m] = [&photons, &paths, &mixed].map(|film| film.picture().layers[0].data.clone());
        let between = |((p, t), m): ((&f32, &f32), &f32)| *m >= p.min(*t) - 1e-4 * m && *m <= p.max(*t) + 1e-4 * m;
        assert!(p.iter().zip(&t).zip(&m).all(between), "{name}: beyond both");
        // What light is made of adds up to it.
        let picture = mixed.picture();
        let parts = ["direct", "indirect", "caustic"].map(|name| &picture.layer(name).expect("a layer").data);
        let sum = |i: usize| parts.iter().map(|part| part[i]).sum::<f32>();
        assert!((0..m.len()).all(|i| (sum(i) - m[i]).abs() <= 1e-3 * m[i] + 1e-6), "{name}: layers");
    }
}

#[test]
fn films_go_on_and_add_up_bit_for_bit() {
    let runtime = runtime();
    let scene = asset("cornell-glass");
    let whole = run(&mut session(&runtime, &scene, Method::Mixed), 0..7);
    let begin = run(&mut session(&runtime, &scene, Method::Mixed), 0..3);
    let mut resumed = session(&runtime, &scene, Method::Mixed);
    resumed.restore(&begin).expect("the same render");
    assert!(run(&mut resumed, 3..7) == whole, "resumed");
    let mut sum = run(&mut session(&runtime, &scene, Method::Mixed), 3..7);
    sum.merge(&begin).expect("apart");
    assert!(sum == whole, "merged");
    assert!(run(&mut resumed, 7..8) != whole, "the check can fail");
    resumed.reset();
    assert!(run(&mut resumed, 0..7) == whole, "begun again");
    let alone = run(&mut session(&runtime, &scene, Method::Photons), 0..2);
    assert!(session(&runtime, &scene, Method::Mixed).restore(&alone).is_err(), "a film of one method");
}

#[test]
fn a_change_reaches_both_methods() {
    let runtime = runtime();
    let mut scene = asset("light-point");
    let mut running = session(&runtime, &scene, Method::Mixed);
    run(&mut running, 0..2);
    let mut light = scene.lights[0];
    if let nephroid::low_level::scene::Light::Point { intensity, .. } = &mut light {
        *intensity = intensity.map(|x| 2.0 * x);
    }
    running.update(Changes::new().light(LightId(0), light)).expect("an update");
    let found = run(&mut running, 0..5);
    scene.lights[0] = light;
    assert!(found == run(&mut session(&runtime, &scene, Method::Mixed), 0..5));
}

#[test]
fn counts_are_those_of_all_passes() {
    let runtime = runtime();
    let mut running = session(&runtime, &asset("cornell-glass"), Method::Mixed);
    run(&mut running, 0..4);
    let statistics = running.statistics().expect("counts");
    assert_eq!((statistics.passes, running.passes().count()), (4, 4));
    // Two passes of 2000 photons, and two of the thousand that are aimed.
    assert_eq!(statistics.photons, 6000);
    let estimate = running.error_estimate().expect("an estimate");
    assert!(estimate.relative.is_some_and(|error| error > 0.0 && error < 1.0), "{:?}", estimate.relative);
}
