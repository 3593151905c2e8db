//! Light from infinity is guided to what is seen: the picture and the balance of light are what they are without that,
//! and far more of the photons are of use.

use std::f64::consts::PI;
use std::ops::Range;

use nephroid::low_level::render::{Method, Session, Settings};
use nephroid::low_level::scene::{Camera, Environment, Light, Material, Mesh, Scene};

use crate::support::device::{Shared, runtime};

/// Half the side of the ground.
const HALF: f32 = 60.0;
/// Direction in which the light of the sun travels; its irradiance.
const SUN: ([f32; 3], f32) = ([0.6, -0.64, -0.48], 3.0);
/// Radiance of the sky.
const SKY: f32 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq)]
enum From {
    Inside,
    FarAbove,
}

/// A house of 4 x 3 x 4 units on a large ground, under sun and sky. Its wall towards the sun has an opening of
/// 1.2 x 1 units.
fn house(albedo: f32, from: From) -> Scene {
    let quad = |corner: [f32; 3], a: [f32; 3], b: [f32; 3]| (Mesh::quad(corner, a, b), Material::lambert([albedo; 3]));
    let parts = vec![
        quad([-HALF, 0.0, HALF], [2.0 * HALF, 0.0, 0.0], [0.0, 0.0, -2.0 * HALF]),
        quad([-2.0, 3.0, -2.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]),
        quad([2.0, 0.0, -2.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]),
        quad([-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
        quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
        quad([-2.0, 0.0, -2.0], [0.0, 1.0, 0.0], [0.0, 0.0, 4.0]),
        quad([-2.0, 2.0, -2.0], [0.0, 1.0, 0.0], [0.0, 0.0, 4.0]),
        quad([-2.0, 1.0, -2.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.4]),
        quad([-2.0, 1.0, 0.6], [0.0, 1.0, 0.0], [0.0, 0.0, 1.4]),
    ];
    let up = [0.0, 1.0, 0.0];
    let camera = match from {
        From::Inside => Camera::look_at([1.7, 1.5, 1.7], [-1.0, 0.8, -1.0], up, 1.2),
        From::FarAbove => Camera::look_at([0.0, 3.0 * HALF, 1.0], [0.0; 3], up, 1.0),
    };
    let lights = vec![Light::Directional { direction: SUN.0, irradiance: [SUN.1; 3] }];
    let environment = Some(Environment { width: 16, height: 8, radiance: vec![[SKY; 3]; 128] });
    Scene { environment, ..Scene::from_parts(parts, lights, camera) }
}

fn rendered(runtime: &Shared, scene: &Scene, settings: Settings, passes: Range<u64>) -> Session {
    let settings = Settings { width: 24, height: 18, ..settings };
    let mut session = Session::new(runtime.device(), scene.clone(), settings).expect("a session");
    passes.for_each(|index| session.run_pass(index).expect("a pass without validation message"));
    session
}

fn photons(count: u32) -> Settings {
    Settings { photons: Some(count), ..Settings::of(Method::Photons) }
}

/// Mean of the green channel.
fn mean(session: &Session) -> f64 {
    let moments = session.moments().expect("the film");
    moments.iter().map(|m| m[1]).sum::<f64>() / (moments.len() as f64 * session.passes().count() as f64)
}

#[test]
fn far_more_photons_get_through_the_window() {
    let runtime = runtime();
    // What meets two surfaces is in the house, next to nothing else does.
    let of_use = |from| {
        let session = rendered(&runtime, &house(0.6, from), photons(20_000), 0..1);
        session.statistics().expect("counts").deposits
    };
    let (inside, far) = (of_use(From::Inside), of_use(From::FarAbove));
    println!("{inside} photons where the house is seen, {far} where all is");
    assert!(inside > 1000 && inside > 40 * far, "{inside} and {far}");
}

#[test]
fn the_room_is_as_bright_as_by_plain_path_tracing() {
    let runtime = runtime();
    let scene = house(0.6, From::Inside);
    let mean = |settings, passes| mean(&rendered(&runtime, &scene, settings, passes));
    // Late passes have small footprints, so what they miss at edges is below the noise.
    let found = mean(photons(20_000), 1000..1064);
    let paths = mean(Settings::of(Method::Path), 0..250);
    println!("photons {found:.4}, paths {paths:.4}");
    assert!((found / paths - 1.0).abs() < 0.03, "photons {found}, paths {paths}");
}

/// A black ground takes the light that falls on it, whatever part of it is seen.
#[test]
fn the_ground_takes_the_same_light() {
    const PASSES: u64 = 8;
    let runtime = runtime();
    let area = 4.0 * f64::from(HALF) * f64::from(HALF);
    // The sky shines from below, too.
    let expected = area * (f64::from(SUN.1) * f64::from(-SUN.0[1]) + 2.0 * PI * f64::from(SKY));
    for from in [From::Inside, From::FarAbove] {
        let session = rendered(&runtime, &house(0.0, from), photons(40_000), 0..PASSES);
        let ledger = session.statistics().expect("counts").energies[1];
        let ratio = ledger.absorbed / (PASSES as f64 * expected);
        println!("{from:?}: {ratio:.4}");
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }
}
