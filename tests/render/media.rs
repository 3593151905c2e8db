//! Absorption inside of bodies, of index 1 so that ways are straight: known answers, the same for every method.

use nephroid::low_level::render::Method;
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Alpha, Camera, Light, Material, Projection, Scene};

use super::sides::{METHODS, assert_near, mean};
use crate::support::proof;

/// Straight down from `height` on the middle of the floor.
fn from_above(height: f32) -> Camera {
    let mut camera = Camera::look_at([0.0, height, 0.0], [0.0; 3], [0.0, 0.0, -1.0], 1.0);
    camera.projection = Projection::Orthographic { xmag: 0.1, ymag: 0.1 };
    camera
}

fn absorbing(absorption: f32) -> Material {
    Material { absorption: [absorption; 3], ..Material::glass(1.0) }
}

fn floor(material: Material) -> (Mesh, Material) {
    (Mesh::quad([-9.0, 0.0, 9.0], [18.0, 0.0, 0.0], [0.0, 0.0, -18.0]), material)
}

/// A body of this height range, wide.
fn body([low, high]: [f32; 2], material: Material) -> (Mesh, Material) {
    (Mesh::cuboid([-7.0, low, -7.0], [7.0, high, 7.0]), material)
}

/// A lamp and a camera in a body, and a clear body between the lamp and both floor and camera: it takes its height off
/// the way of the light, and what absorbs goes on behind it. With it the light is a caustic, which path tracing cannot
/// find by a point light.
#[test]
fn absorption_goes_on_behind_a_body_in_a_body() {
    let lamp = Light::Point { position: [0.0, 3.0, 0.0], intensity: [std::f32::consts::PI; 3] };
    let scene = |clear: Option<[f32; 2]>| {
        let mut parts = vec![floor(Material::lambert([0.8; 3])), body([-1.0, 5.0], absorbing(0.3))];
        parts.extend(clear.map(|range| body(range, Material::glass(1.0))));
        Scene::from_parts(parts, vec![lamp], from_above(0.4))
    };
    let expected = |clear: f64| 0.8 / 9.0 * (-0.3 * (3.0 - clear + 0.4)).exp();
    for method in METHODS {
        assert_near(&format!("{method:?}, one body"), mean(&scene(None), method, 2), expected(0.0), 0.01);
    }
    for method in [Method::Photons, Method::Light] {
        let value = mean(&scene(Some([0.5, 1.5])), method, 24);
        assert_near(&format!("{method:?}, two bodies"), value, expected(1.0), 0.03);
    }
    proof::by_answer(&["trace_medium"]);
}

/// Emission seen from inside of a body, through another.
#[test]
fn emission_is_absorbed_on_all_of_its_way() {
    let lamp = Material { emissive: [1.0; 3], ..Material::lambert([0.0; 3]) };
    let parts = vec![floor(lamp), body([-1.0, 5.0], absorbing(0.3)), body([0.5, 1.5], Material::glass(1.0))];
    let scene = Scene::from_parts(parts, vec![], from_above(2.5));
    let value = mean(&scene, Method::Path, 2);
    assert_near("lamp", value, (-0.3f64 * 1.5).exp(), 0.001);
}

/// A body fills what its surface encloses, also where that is cut away: sunlight comes in and is seen through the hole
/// that all of the surface is.
#[test]
fn holes_let_light_into_a_body_and_not_past_it() {
    let cut = Material { base_color: [1.0, 1.0, 1.0, 0.0], alpha: Alpha::Mask(0.5), ..absorbing(0.3) };
    let inner = Material { base_color: [1.0, 1.0, 1.0, 0.0], alpha: Alpha::Mask(0.5), ..Material::glass(1.0) };
    let parts = vec![floor(Material::lambert([0.8; 3])), body([-1.0, 3.0], cut), body([0.5, 1.5], inner)];
    let sun = Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [std::f32::consts::PI; 3] };
    let scene = Scene::from_parts(parts, vec![sun], from_above(4.0));
    for method in METHODS {
        assert_near(&format!("{method:?}"), mean(&scene, method, 2), 0.8 * (-0.3f64 * 4.0).exp(), 0.01);
    }
}
