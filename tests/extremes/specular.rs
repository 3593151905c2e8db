//! Glass: case 8.

use std::f64::consts::PI;

use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Light, Material, Scene};

use crate::support::lab::{Shot, assert_close, close, from_above, parallel, settings};
use crate::support::proof;

/// Case 8: a slab of glass between the sun at the zenith and a floor. With R = ((n - 1) / (n + 1))^2 and all
/// reflections inside, T = (1 - R) / (1 + R) = 0.923077. The image holds the whole slab with a margin for footprints,
/// so it counts all flux.
#[test]
fn case_08_slab_transmits() {
    let irradiance = 2.0;
    let floor = Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    let slab = Mesh::cuboid([-1.0, 0.5, -1.0], [1.0, 0.6, 1.0]);
    let sun = Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [irradiance; 3] };
    let parts = vec![(floor, Material::lambert([1.0; 3])), (slab, Material::glass(1.5))];
    let scene = Scene::from_parts(parts, vec![sun], from_above([0.0, 0.25, 0.0], 1.25));
    let shot = Shot::take(&scene, &settings(20, 20, 300_000), 0..10);
    let flux = shot.mean("caustic") * PI * 2.5 * 2.5;
    assert_close(flux / (f64::from(irradiance) * 4.0), 0.923077, 0.002, "transmittance");
    let one_boundary = close(flux / (f64::from(irradiance) * 4.0), 0.96, 0.002);
    assert!(one_boundary.is_err(), "a slab with a single boundary must be noticed");
    proof::by_answer(&["eye_shade", "photon_bounce"]);
}

/// Unpolarised reflectance of one boundary from vacuum, by the sines and tangents of Fresnel's own formulas.
fn fresnel(angle: f64, ior: f64) -> f64 {
    let inside = (angle.sin() / ior).asin();
    let s = ((angle - inside).sin() / (angle + inside).sin()).powi(2);
    let p = ((angle - inside).tan() / (angle + inside).tan()).powi(2);
    0.5 * (s + p)
}

/// R + T = 1, both measured: sun at 20 degrees through a window in a screen, so that the slab's reflection lands beside
/// the window on the screen's lower side.
#[test]
fn case_08_slab_reflects_the_rest() {
    let angle = 20f64.to_radians();
    let (sine, cosine) = (angle.sin(), angle.cos());
    let floor = Mesh::quad([-4.0, 0.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]);
    let slab = Mesh::cuboid([0.4, 1.0, -0.3], [1.05, 1.05, 0.3]);
    // The window is 0.4 x 0.4 in the middle of four plates at y = 3: the reflection moves by 2 * 1.95 * tan = 1.42.
    let plate =
        |x: [f32; 2], z: [f32; 2]| Mesh::quad([x[0], 3.0, z[1]], [x[1] - x[0], 0.0, 0.0], [0.0, 0.0, z[0] - z[1]]);
    let mut screen = plate([-4.0, -0.2], [-4.0, 4.0]);
    for part in [plate([0.2, 4.0], [-4.0, 4.0]), plate([-0.2, 0.2], [-4.0, -0.2]), plate([-0.2, 0.2], [0.2, 4.0])] {
        screen.append(&part);
    }
    let sun = Light::Directional { direction: [sine as f32, -(cosine as f32), 0.0], irradiance: [1.0; 3] };
    let white = Material::lambert([1.0; 3]);
    let up = parallel([1.42, 2.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], 1.0);
    let mut scene =
        Scene::from_parts(vec![(floor, white.clone()), (screen, white), (slab, Material::glass(1.5))], vec![sun], up);
    scene.cameras.push(from_above([1.09, 0.5, 0.0], 1.0));
    let flux = |camera: usize| {
        let shot =
            Shot::take(&scene, &nephroid::low_level::render::Settings { camera, ..settings(64, 64, 200_000) }, 0..6);
        shot.mean("caustic") * PI * 4.0
    };
    let (reflected, transmitted) = (flux(0), flux(1));
    let expected = fresnel(angle, 1.5) * 2.0 / (1.0 + fresnel(angle, 1.5));
    assert_close((reflected + transmitted) / (0.16 * cosine), 1.0, 0.01, "R + T");
    assert_close(reflected / (reflected + transmitted), expected, 0.02, "R / (R + T)");
}
