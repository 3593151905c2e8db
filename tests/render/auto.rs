//! Photons and paths in turns: films are those of either method alone, and go on, add up and change as all films do.
//! What follows the opening is the same in each part of a render.

use nephroid::low_level::film::accumulate::Film;
use nephroid::low_level::film::mix::{Round, Turns};
use nephroid::low_level::render::{Changes, Choice, Footprint, Method, Sampling, Session, Settings};
use nephroid::low_level::scene::{Camera, CameraId, Environment, Light, LightId, Material, Mesh, Scene};

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

/// Passes of an opening, and of that where paths have no photons.
const OPENING: u64 = 3;
const LONG_OPENING: u64 = 8;

/// The seed of the passes of paths of a render with seed 0: with one seed for all, both methods would err alike.
const SEED_OF_PATHS: u32 = 0x5bd1_e995;

#[test]
fn films_are_those_of_either_method() {
    let runtime = runtime();
    for name in ["cornell", "cornell-glass"] {
        let scene = asset(name);
        let mut running = session(&runtime, &scene, Method::Auto);
        let film = run(&mut running, 0..LONG_OPENING + 5);
        let choice = running.choice().expect("a choice");
        let opening = if choice.paths == Method::Path { LONG_OPENING } else { OPENING };
        assert!(choice.turns.then.is_some() && choice.turns.opening.passes() == opening, "{choice:?}");
        let of_method = film.split_passes().map(|passes| passes.count());
        let photons = run(&mut session(&runtime, &scene, Method::Photons), 0..of_method[0]);
        let paths = Settings { seed: SEED_OF_PATHS, ..settings(choice.paths) };
        let mut paths = Session::new(runtime.device(), scene.clone(), paths).expect("a session");
        let paths = run(&mut paths, 0..of_method[1]);
        let mix = film.mix.as_ref().expect("a second method");
        assert!(film.sums == photons.sums && film.layers == photons.layers, "{name}: photons");
        assert!(mix.sums == paths.sums && mix.layers == paths.layers, "{name}: paths");
        assert_eq!(of_method[0] + of_method[1], LONG_OPENING + 5);
        // Each pixel is between those of the two.
        let [p, t, m] = [&photons, &paths, &film].map(|film| film.picture().layers[0].data.clone());
        let between = |((p, t), m): ((&f32, &f32), &f32)| *m >= p.min(*t) - 1e-4 * m && *m <= p.max(*t) + 1e-4 * m;
        assert!(p.iter().zip(&t).zip(&m).all(between), "{name}: beyond both");
        // What light is made of adds up to it.
        let picture = film.picture();
        let parts = ["direct", "indirect", "caustic"].map(|name| &picture.layer(name).expect("a layer").data);
        let sum = |i: usize| parts.iter().map(|part| part[i]).sum::<f32>();
        assert!((0..m.len()).all(|i| (sum(i) - m[i]).abs() <= 1e-3 * m[i] + 1e-6), "{name}: layers");
    }
}

#[test]
fn films_go_on_and_add_up_bit_for_bit() {
    let runtime = runtime();
    let scene = asset("cornell-glass");
    let settings = || Settings {
        width: 8,
        height: 6,
        photons: Some(500),
        photon_bounces: 6,
        eye_depth: 6,
        ..settings(Method::Auto)
    };
    let new = || Session::new(runtime.device(), scene.clone(), settings()).expect("a session");
    let last = Turns::SECOND_LOOK + 3;
    let mut running = new();
    let whole = run(&mut running, 0..last);
    // Stopped in the opening, after it, and after the second look: what follows is found out anew, or known.
    for middle in [1, OPENING, OPENING + 2, LONG_OPENING, Turns::SECOND_LOOK, Turns::SECOND_LOOK + 1] {
        running.reset();
        let begin = run(&mut running, 0..middle);
        let mut other = new();
        other.restore(&begin).expect("the same render");
        assert!(run(&mut other, middle..last) == whole, "resumed at {middle}");
        other.reset();
        let mut sum = run(&mut other, middle..last);
        let photons = other.statistics().expect("counts").photons;
        let passes = sum.split_passes().map(|passes| passes.count());
        sum.merge(&begin).expect("apart");
        assert!(sum == whole, "merged at {middle}");
        // The passes that a part renders to find out what follows are none of its film.
        let of_paths = if other.choice().expect("a choice").paths == Method::Hybrid { 250 } else { 0 };
        assert_eq!(photons, 500 * passes[0] + of_paths * passes[1], "counts of a part from {middle}");
    }
    assert!(run(&mut running, Turns::SECOND_LOOK + 1..last + 1) != whole, "the check can fail");
    let mut alone = Session::new(runtime.device(), scene.clone(), Settings { method: Method::Photons, ..settings() });
    let alone = run(alone.as_mut().expect("a session"), 0..2);
    assert!(running.restore(&alone).is_err(), "a film of one method");
}

#[test]
fn films_of_other_turns_are_refused() {
    let runtime = runtime();
    let scene = asset("cornell");
    let film = run(&mut session(&runtime, &scene, Method::Auto), 0..OPENING + 1);
    let mut elsewhere = run(&mut session(&runtime, &scene, Method::Auto), OPENING + 1..OPENING + 2);
    let mix = elsewhere.mix.as_mut().expect("a second method");
    mix.turns.then = Some(Round { first: 7, second: 9 });
    let refusal = film.clone().merge(&elsewhere).expect_err("other turns").to_string();
    assert!(refusal.contains("in other turns"), "{refusal}");
}

#[test]
fn what_only_photons_have_is_rendered_by_photons() {
    let runtime = runtime();
    let scene = asset("cornell");
    let of = |change: fn(&mut Settings)| {
        let mut settings = settings(Method::Auto);
        change(&mut settings);
        Session::new(runtime.device(), scene.clone(), settings).expect("a session").choice().is_some()
    };
    assert!(of(|_| ()));
    for change in [
        (|s| s.blinn_phong = true) as fn(&mut Settings),
        |s| s.sampling = Sampling::Regular(2),
        |s| s.footprint = Footprint::Fixed(0.1),
        |s| s.count_pairs = true,
        |s| s.read_photons = true,
        |s| s.lambert_estimate = true,
    ] {
        assert!(!of(change));
    }
}

#[test]
fn a_change_reaches_both_methods() {
    let runtime = runtime();
    let mut scene = asset("light-point");
    let mut running = session(&runtime, &scene, Method::Auto);
    run(&mut running, 0..2);
    let (mut light, mut camera) = (scene.lights[0], scene.cameras[0].clone());
    // Footprints overlap in another way from there, so the work of a pass is another.
    if let Light::Point { position, .. } = &mut light {
        position[1] *= 0.6;
    }
    camera.position = [0, 1, 2].map(|k| camera.position[k] + 0.5 * camera.forward[k]);
    let changes = [Changes::new().light(LightId(0), light), Changes::new().camera(CameraId(0), camera.clone())];
    for (name, changes) in ["light", "camera"].into_iter().zip(changes) {
        running.update(changes).expect("an update");
        match name {
            "light" => scene.lights[0] = light,
            _ => scene.cameras[0] = camera.clone(),
        }
        let found = run(&mut running, 0..OPENING + 1);
        let expected = run(&mut session(&runtime, &scene, Method::Auto), 0..OPENING + 1);
        let turns = |film: &Film| film.mix.as_ref().map(|mix| mix.turns);
        assert_eq!(turns(&found), turns(&expected), "{name}");
        assert!(found == expected, "{name}");
    }
}

#[test]
fn counts_are_those_of_all_passes() {
    let runtime = runtime();
    let mut running = session(&runtime, &asset("cornell-glass"), Method::Auto);
    run(&mut running, 0..OPENING);
    let statistics = running.statistics().expect("counts");
    assert_eq!((statistics.passes, running.passes().count()), (OPENING, OPENING));
    // Two thousand in a pass of photons, and the thousand that are aimed in each of the others, if there are any.
    let [photons, paths] = running.film().expect("a film").split_passes().map(|passes| passes.count());
    let of_paths = if running.choice().expect("a choice").paths == Method::Hybrid { 1000 * paths } else { 0 };
    assert_eq!(statistics.photons, 2000 * photons + of_paths);
    let estimate = running.error_estimate().expect("an estimate");
    assert!(estimate.relative.is_some_and(|error| error > 0.0), "{:?}", estimate.relative);
}

/// A grey ground of this half side, seen from above, with a ball of glass over it.
fn glass_on_ground(half: f32, lights: Vec<Light>, environment: Option<Environment>) -> Scene {
    let ground = Mesh::quad([-half, 0.0, half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, -2.0 * half]);
    let ball = Mesh::sphere([0.0, 0.6, 0.0], 0.5, 12, 24);
    let objects = vec![(ground, Material::lambert([0.5; 3])), (ball, Material::glass(1.5))];
    let camera = Camera::look_at([0.0, 4.0, 4.0], [0.0, 0.3, 0.0], [0.0, 1.0, 0.0], 0.7);
    Scene { environment, ..Scene::from_parts(objects, lights, camera) }
}

#[test]
fn each_scene_gets_what_serves_it() {
    let runtime = runtime();
    let choice = |scene: &Scene| {
        let settings = Settings { width: 32, height: 24, photons: Some(4000), ..Settings::default() };
        let mut session = Session::new(runtime.device(), scene.clone(), settings).expect("a session");
        run(&mut session, 0..LONG_OPENING + 1);
        session.choice().expect("a choice")
    };
    let sky = || Some(Environment { width: 2, height: 2, radiance: vec![[1.0; 3]; 4] });
    let lamp = Light::Point { position: [1.0, 3.0, 0.0], intensity: [10.0; 3] };
    let share = |choice: &Choice| {
        let then = choice.turns.then.expect("known");
        f64::from(then.second) / f64::from(then.first + then.second)
    };
    // Paths find a sky through glass; on a large ground they find all there is, and photons are dear.
    let under_sky = choice(&glass_on_ground(200.0, vec![], sky()));
    assert!(under_sky.paths == Method::Path && share(&under_sky) > 0.6, "{under_sky:?}");
    // No path finds a lamp without extent through glass.
    let under_lamp = choice(&glass_on_ground(4.0, vec![lamp], None));
    assert_eq!(under_lamp.paths, Method::Hybrid, "{under_lamp:?}");
    // A sky besides does not change that.
    assert_eq!(choice(&glass_on_ground(4.0, vec![lamp], sky())).paths, Method::Hybrid);
    // A closed box with a small lamp and a ball of glass: few paths, and these need photons.
    let boxed = choice(&asset("cornell-glass"));
    assert!(boxed.paths == Method::Hybrid && share(&boxed) < 0.4, "{boxed:?}");
}
