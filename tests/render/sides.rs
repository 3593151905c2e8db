//! Surfaces that are there in part, that have one side or two: known answers, the same for every method.

use nephroid::low_level::render::{Method, Session, Settings};
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Alpha, Camera, Light, Material, Projection, Scene};

use crate::support::device::runtime;
use crate::support::proof;

pub const METHODS: [Method; 3] = [Method::Photons, Method::Path, Method::Light];

/// Mean of the green channel of a small picture, late in the render.
pub fn mean(scene: &Scene, method: Method, passes: u64) -> f64 {
    let settings = Settings { width: 16, height: 16, method, photons: Some(8192), ..Settings::default() };
    let pixels = f64::from(settings.pixels());
    let runtime = runtime();
    let mut session = Session::new(runtime.device(), scene.clone(), settings).expect("a session");
    proof::ran(session.plan_text());
    // Late passes: small footprints, so that what they blur at edges is below the noise.
    (256..256 + passes).for_each(|index| session.run_pass(index).expect("a pass"));
    assert_eq!(session.statistics().expect("counts").rejected, 0, "pixels that are not finite");
    session.moments().expect("the film").iter().map(|m| m[1]).sum::<f64>() / (pixels * passes as f64)
}

#[track_caller]
pub fn assert_near(what: &str, value: f64, expected: f64, tolerance: f64) {
    println!("{what}: {value:.4}, expected {expected:.4}");
    assert!((value / expected - 1.0).abs() <= tolerance, "{what}: {value}, expected {expected} within {tolerance}");
}

/// A square of half width `size` at height `y` that faces up.
fn sheet(y: f32, size: f32) -> Mesh {
    Mesh::quad([-size, y, size], [2.0 * size, 0.0, 0.0], [0.0, 0.0, -2.0 * size])
}

/// Straight down on the middle of the floor.
fn from_above() -> Camera {
    let mut camera = Camera::look_at([0.0, 5.0, 0.0], [0.0; 3], [0.0, 0.0, -1.0], 1.0);
    camera.projection = Projection::Orthographic { xmag: 0.5, ymag: 0.5 };
    camera
}

fn partly(material: Material, share: f32) -> Material {
    let [r, g, b, _] = material.base_color;
    Material { base_color: [r, g, b, share], alpha: Alpha::Blend, ..material }
}

/// A black sheet of which 0.3 is there, above a floor in parallel light: both the light and the view lose 0.3.
#[test]
fn blending_covers_its_share_of_light_and_view() {
    let lambert = Material::lambert([0.8; 3]);
    let parts = vec![(sheet(0.0, 9.0), lambert), (sheet(1.0, 9.0), partly(Material::lambert([0.0; 3]), 0.3))];
    let irradiance = [std::f32::consts::PI; 3];
    let sun = Light::Directional { direction: [0.0, -1.0, 0.0], irradiance };
    let scene = Scene::from_parts(parts, vec![sun], from_above());
    for method in METHODS {
        assert_near(&format!("{method:?}"), mean(&scene, method, 64), 0.8 * 0.7 * 0.7, 0.02);
    }
}

/// In a closed shell of albedo 1/2 that emits 1 the radiance is 2 everywhere, whatever lossless thing is in it: also
/// one that is there in part, whose inside is reached through what is missing. Glass that is there in part is left as
/// it was entered: by refraction twice or not at all. Light tracing does not see the walls through it.
#[test]
fn what_is_there_in_part_vanishes_in_a_furnace() {
    let wall = Material { emissive: [1.0; 3], double_sided: false, ..Material::lambert([0.5; 3]) };
    let camera = Camera::look_at([0.0, 0.4, 3.0], [0.0; 3], [0.0, 1.0, 0.0], 0.5);
    let shell = Mesh::sphere([0.0; 3], 4.0, 12, 24).flipped();
    for (name, material, methods) in
        [("white", Material::lambert([1.0; 3]), &METHODS[..]), ("glass", Material::glass(1.5), &METHODS[..2])]
    {
        let ball = (Mesh::sphere([0.0; 3], 1.0, 12, 24), partly(material, 0.4));
        let scene = Scene::from_parts(vec![(shell.clone(), wall.clone()), ball], vec![], camera.clone());
        for method in methods {
            assert_near(&format!("{name}, {method:?}"), mean(&scene, *method, 12), 2.0, 0.03);
        }
    }
}

/// A lamp of two sides above a floor, or of one that faces away with the opposite beside it: the same light.
#[test]
fn both_sides_of_a_double_sided_lamp_shine() {
    let scene = |lamps: Vec<(Mesh, Material)>| {
        let parts = std::iter::once((sheet(0.0, 4.0), Material::lambert([0.5; 3])));
        let ceiling = (sheet(3.0, 4.0), Material::lambert([0.5; 3]));
        let mut camera = from_above();
        camera.position = [0.0, 0.9, 0.0];
        Scene::from_parts(parts.chain([ceiling]).chain(lamps).collect(), vec![], camera)
    };
    let lamp = Material { emissive: [4.0; 3], ..Material::lambert([0.0; 3]) };
    let one = scene(vec![(sheet(1.0, 0.5), Material { double_sided: true, ..lamp.clone() })]);
    let single = Material { double_sided: false, ..lamp };
    let two = scene(vec![(sheet(1.0, 0.5), single.clone()), (sheet(0.999, 0.5).flipped(), single)]);
    for method in METHODS {
        let expected = mean(&two, Method::Path, 64);
        assert_near(&format!("{method:?}"), mean(&one, method, 64), expected, 0.03);
    }
}

/// The camera looks through the backs of surfaces with one side at what is behind; light does not pass them. The lids
/// are lit, unlit and emissive, next to each other, over the middle of the floor; their fronts face down.
#[test]
fn backs_are_not_there_for_the_camera_alone() {
    let one_sided = Material { double_sided: false, ..Material::lambert([0.0; 3]) };
    let unlit = Material { unlit: true, base_color: [1.0; 4], ..one_sided.clone() };
    let emitter = Material { emissive: [1e-9; 3], ..one_sided.clone() };
    for (direction, expected) in [([0.0, -1.0, 0.0], 0.0), ([0.8, -0.6, 0.0], 0.8 * 0.6)] {
        let lids = [one_sided.clone(), unlit.clone(), emitter.clone()].into_iter().zip([-0.6f32, -0.2, 0.2]);
        let lid = |(material, z)| (Mesh::quad([-0.6, 1.0, z], [1.2, 0.0, 0.0], [0.0, 0.0, 0.4]), material);
        let parts = std::iter::once((sheet(0.0, 9.0), Material::lambert([0.8; 3]))).chain(lids.map(lid)).collect();
        let sun = Light::Directional { direction, irradiance: [std::f32::consts::PI; 3] };
        let scene = Scene::from_parts(parts, vec![sun], from_above());
        for method in METHODS {
            let value = mean(&scene, method, 2);
            assert!((value - expected).abs() <= 0.01, "{method:?} {direction:?}: {value}, expected {expected}");
        }
    }
    proof::by_answer(&["trace_camera"]);
}
