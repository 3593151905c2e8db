//! Diffuse scenes with known answers: cases 1, 4, 5 and 7.

use std::f64::consts::PI;

use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Camera, Light, Material, Scene};

use crate::support::lab::{Shot, assert_close, close, from_above, settings};
use crate::support::proof;

/// Means over `n` x `n` blocks of a square image.
fn blocks(pixels: &[f64], n: usize) -> Vec<f64> {
    let side = (pixels.len() as f64).sqrt() as usize;
    let cell = side / n;
    let block = |bx: usize, by: usize| {
        let inside = (0..cell * cell).map(|i| pixels[(by * cell + i / cell) * side + bx * cell + i % cell]);
        inside.sum::<f64>() / (cell * cell) as f64
    };
    (0..n * n).map(|i| block(i % n, i / n)).collect()
}

/// Case 1: in a closed room whose walls emit Le and reflect a, the radiance is Le / (1 - a) everywhere, whatever the
/// shape.
#[test]
fn case_01_furnace() {
    let wall = Material { emissive: [0.5; 3], ..Material::lambert([0.5; 3]) };
    let camera = Camera::look_at([0.3, 0.1, -0.2], [-1.0, -0.3, 0.4], [0.0, 1.0, 0.0], 1.5);
    let sphere = Mesh::sphere([0.0; 3], 1.0, 32, 64).flipped();
    let scene = Scene::from_parts(vec![(sphere, wall)], vec![], camera);
    let shot = Shot::take(&scene, &settings(32, 32, 40_000), 0..16);
    assert_close(shot.mean(""), 1.0, 0.005, "radiance in the furnace");
    assert_close(shot.mean("indirect"), 0.25, 0.01, "light after two reflections and more, by photons");
    // By place: no dark seams. Noise of a block with 1/16 of the samples is below 1 %.
    for block in blocks(&shot.red(""), 4) {
        assert_close(block, 1.0, 0.02, "a sixteenth of the furnace's image");
    }
    let dark = Shot::take(&scene, &settings(32, 32, 0), 0..4);
    assert!(close(dark.mean(""), 1.0, 0.005).is_err(), "without photons the comparison must fail");
    proof::by_answer(&["list_select", "photon_advance", "photon_append", "trace_list"]);
}

/// Case 4: the light of an isotropic source after its first reflection in a sphere is uniform wherever the source is:
/// irradiance a P / (4 pi R^2 (1 - a)), P = 4 pi I. The wall shows a / pi of it as radiance.
#[test]
fn case_04_integrating_sphere() {
    let (albedo, radius, intensity) = (0.6, 2.0, 3.0);
    let camera = Camera::look_at([0.0, 0.0, 0.0], [0.0, -0.5, -1.0], [0.0, 1.0, 0.0], 1.8);
    let sphere = Mesh::sphere([0.0; 3], radius as f32, 48, 96).flipped();
    let light = Light::Point { position: [0.9, 0.5, 0.3], intensity: [intensity as f32; 3] };
    let scene = Scene::from_parts(vec![(sphere, Material::lambert([albedo as f32; 3]))], vec![light], camera);
    let shot = Shot::take(&scene, &settings(32, 32, 60_000), 0..20);
    let irradiance = albedo * 4.0 * PI * intensity / (4.0 * PI * radius * radius * (1.0 - albedo));
    let expected = albedo / PI * irradiance;
    assert_close(shot.mean("indirect"), expected, 0.01, "indirect light");
    for block in blocks(&shot.red("indirect"), 4) {
        assert_close(block, expected, 0.02, "a sixteenth of the image, more noise and as uniform");
    }
    let direct = blocks(&shot.red("direct"), 4);
    assert!(
        direct.iter().any(|b| close(*b, direct[0], 0.1).is_err()),
        "direct light is not uniform: the check can fail"
    );
    proof::by_answer(&["photon_sort"]);
}

/// Case 5, first half: irradiance I h / (h^2 + x^2)^1.5 of a plane by shadow rays, at points: each image is one pixel
/// of 1e-6 units.
#[test]
fn case_05_point_light_by_shadow_rays() {
    let (h, intensity) = (1.5f64, 2.0);
    let floor = Mesh::quad([-4.0, 0.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]);
    let light = Light::Point { position: [0.0, h as f32, 0.0], intensity: [intensity as f32; 3] };
    let mut scene =
        Scene::from_parts(vec![(floor, Material::lambert([1.0; 3]))], vec![light], from_above([0.0, 1.0, 0.0], 1e-6));
    let places = [0.0, 0.5, 1.25, 3.0];
    scene.cameras = places.iter().map(|x| from_above([*x, 1.0, 0.25], 1e-6)).collect();
    for (camera, x) in places.iter().enumerate() {
        let shot = Shot::take(&scene, &nephroid::low_level::render::Settings { camera, ..settings(1, 1, 0) }, 0..2);
        let d2 = h * h + f64::from(x * x) + 0.0625;
        assert_close(shot.mean("direct"), intensity * h / d2.powf(1.5) / PI, 1e-5, "direct light");
    }
    proof::by_answer(&["direct_light", "eye_generate"]);
}

/// Case 5, second half: the renderer leaves direct light to shadow rays, so photons show the light's image in a plane
/// mirror above it, which lights the floor from h' = 2 * 1 - 0.5 by the same law.
#[test]
fn case_05_point_light_by_photons() {
    let intensity = 2.0;
    let h = 1.5f64;
    let floor = Mesh::quad([-3.0, 0.0, 3.0], [6.0, 0.0, 0.0], [0.0, 0.0, -6.0]);
    let ceiling = Mesh::quad([-1.5, 1.0, -1.5], [3.0, 0.0, 0.0], [0.0, 0.0, 3.0]);
    let light = Light::Point { position: [0.0, 0.5, 0.0], intensity: [intensity as f32; 3] };
    let parts = vec![(floor, Material::lambert([1.0; 3])), (ceiling, Material::mirror())];
    let scene = Scene::from_parts(parts, vec![light], from_above([0.0, 0.25, 0.0], 1.0));
    let shot = Shot::take(&scene, &settings(32, 32, 200_000), 0..20);
    let at = |x: f64, z: f64| intensity * h / (h * h + x * x + z * z).powf(1.5) / PI;
    let grid: Vec<f64> = (0..256)
        .flat_map(|j| (0..256).map(move |i| at((f64::from(i) - 127.5) / 128.0, (f64::from(j) - 127.5) / 128.0)))
        .collect();
    assert_close(
        shot.mean("caustic"),
        grid.iter().sum::<f64>() / grid.len() as f64,
        0.005,
        "light by way of the mirror",
    );
    for (found, expected) in blocks(&shot.red("caustic"), 4).iter().zip(blocks(&grid, 4)) {
        assert_close(*found, expected, 0.005, "a sixteenth of the floor");
    }
    proof::by_answer(&["photon_emit"]);
}

/// Share of the light that leaves a point of the floor and meets the unit square that stands at distance `c`, from its
/// side `z`: the configuration factor of a rectangle perpendicular to the receiver, for the parts on both sides of the
/// point.
fn perpendicular_factor(c: f64, z: f64) -> f64 {
    let s = (1.0 + c * c).sqrt();
    let part = |b: f64| ((b / c).atan() - c / s * (b / s).atan()) / (2.0 * PI);
    part(z) + part(1.0 - z)
}

/// Case 7: unit squares. The receiver is the floor, the emitter a wall that shares an edge with it: form factor
/// 0.200044 by shadow rays. A mirror on the diagonal between them shows the emitter as the parallel square at distance
/// 1: 0.199825, by photons.
///
/// Shadow rays at uniform points of the emitter have infinite variance where the squares touch, so the quarter of the
/// receiver at the edge has no useful error bound; there only the analytic factors enter, whose mean over the whole
/// square is the form factor.
#[test]
fn case_07_form_factors() {
    let albedo = 0.8;
    // The floor goes on beyond the square, where footprints reach; light and mirror are as wide as the square's photons
    // need.
    let floor = Mesh::quad([-0.5, 0.0, 1.5], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]);
    let wall = Mesh::quad([1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]);
    let mirror = Mesh::quad([0.0, 0.0, 1.5], [1.0, 1.0, 0.0], [0.0, 0.0, -2.0]);
    let material = Material::lambert([albedo as f32; 3]);
    let parts = vec![(floor, material), (wall, Material::emitter([1.0; 3])), (mirror, Material::mirror())];
    let scene = Scene::from_parts(parts, vec![], from_above([0.5, 1e-4, 0.5], 0.5));
    let grid: Vec<f64> = (0..512 * 512)
        .map(|i| perpendicular_factor(1.0 - (f64::from(i % 512) + 0.5) / 512.0, (f64::from(i / 512) + 0.5) / 512.0))
        .collect();
    assert_close(grid.iter().sum::<f64>() / grid.len() as f64, 0.200044, 2e-4, "mean of the configuration factors");
    let shot = Shot::take(&scene, &settings(32, 32, 0), 0..64);
    let far = |pixels: &[f64]| {
        let blocks = blocks(pixels, 4);
        (0..12).map(|i| blocks[i / 3 * 4 + i % 3]).sum::<f64>() / 12.0
    };
    assert_close(far(&shot.red("direct")), albedo * far(&grid), 0.005, "perpendicular squares by shadow rays");
    // A frame of 1.5 x 1 units: footprints carry flux over the borders at the mirror and at the wall.
    let shot = Shot::take(&scene, &settings(48, 32, 200_000), 0..10);
    assert_close(shot.mean("caustic") * 1.5, albedo * 0.199825, 0.005, "parallel squares by photons");
}

/// The same parallel squares by shadow rays.
#[test]
fn case_07_parallel_squares() {
    let floor = Mesh::quad([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let lamp = Mesh::quad([0.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]).flipped();
    let parts = vec![(floor, Material::lambert([1.0; 3])), (lamp, Material::emitter([1.0; 3]))];
    let scene = Scene::from_parts(parts, vec![], from_above([0.5, 0.5, 0.5], 0.5));
    let shot = Shot::take(&scene, &settings(32, 32, 0), 0..32);
    assert_close(shot.mean("direct"), 0.199825, 0.005, "parallel squares by shadow rays");
    assert!(close(shot.mean("direct"), 0.200044 * 1.01, 0.005).is_err(), "one percent is noticed");
}
