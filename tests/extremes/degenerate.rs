//! Broken and empty scenes: cases 33 and 40, and the presence of 34 to 36.

use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Camera, Environment, Light, Material, Scene};

use crate::support::lab::{Shot, assert_close, assert_same, settings};
use crate::variants::{lamp, room};

fn triangle(corners: [[f32; 3]; 3]) -> Mesh {
    Mesh {
        positions: corners.to_vec(),
        normals: vec![[0.0, 1.0, 0.0]; 3],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    }
}

/// Case 33: triangles without area, of size 1e-20 and with numbers that are not finite are skipped and counted; as
/// emitters they are never lights. The picture is that of the scene without them, bit for bit.
#[test]
fn case_33_degenerate_triangles() {
    let clean = room(Material::lambert([0.5; 3]), vec![lamp()]);
    let expected = Shot::take(&clean, &settings(16, 12, 3_000), 0..2);
    assert_eq!((expected.skipped, expected.lights), (0, 1));
    let bad = [
        [[0.0, 1.0, 0.0]; 3],
        [[0.0, 1.0, 0.0], [0.5, 1.0, 0.0], [1.0, 1.0, 0.0]],
        [[0.0; 3], [1e-20, 0.0, 0.0], [0.0, 1e-20, 0.0]],
        [[f32::NAN, 1.0, 0.0], [0.5, 1.0, 0.0], [0.0, 1.5, 0.0]],
        [[0.0, 1.0, 0.0], [0.5, f32::NAN, 0.0], [0.0, 1.5, 0.0]],
        [[0.0, 1.0, 0.0], [0.5, 1.0, f32::INFINITY], [0.0, 1.5, 0.0]],
        [[f32::NEG_INFINITY, 1.0, 0.0], [0.5, 1.0, 0.0], [0.0, 1.5, 0.0]],
    ];
    for material in [Material::emitter([1.0; 3]), Material::lambert([0.5; 3])] {
        let mut scene = clean.clone();
        bad.iter().for_each(|corners| _ = scene.add(&triangle(*corners), material.clone()));
        let found = Shot::take(&scene, &settings(16, 12, 3_000), 0..2);
        assert_eq!((found.skipped, found.lights), (bad.len() as u32, 1));
        assert_same(&found.bits(), &expected.bits(), "with degenerate triangles");
    }
    let mut mirrors = clean.clone();
    bad.iter().for_each(|corners| _ = mirrors.add(&triangle(*corners), Material::mirror()));
    assert_eq!(Shot::take(&mirrors, &settings(16, 12, 3_000), 0..2).skipped, bad.len() as u32);
}

/// Case 33: a needle is no point: it is kept, and shines with what area it has.
#[test]
fn case_33_needles_are_kept() {
    let mut scene = room(Material::lambert([0.5; 3]), vec![lamp()]);
    let needle = triangle([[-1.0, 2.0, 0.0], [1.0, 2.0, 0.0], [1.0, 2.0, 1e-6]]).flipped();
    scene.add(&needle, Material::emitter([1e6; 3]));
    let found = Shot::take(&scene, &settings(16, 12, 3_000), 0..2);
    assert_eq!((found.skipped, found.lights), (0, 2));
}

fn view() -> Camera {
    Camera::look_at([0.0, 1.0, 3.0], [0.0; 3], [0.0, 1.0, 0.0], 0.8)
}

fn assert_black(shot: &Shot, what: &str) {
    for layer in ["", "direct", "indirect", "caustic"] {
        assert!(shot.red(layer).iter().all(|x| *x == 0.0), "{what}: '{layer}' is black");
    }
}

/// Case 40: scenes without triangles, with every light.
#[test]
fn case_40_no_triangles() {
    assert_black(
        &Shot::take(&Scene::from_parts(vec![], vec![], view()), &settings(8, 8, 1_000), 0..2),
        "nothing at all",
    );
    let sun = Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [1.0; 3] };
    let lit = Scene::from_parts(vec![], vec![lamp(), sun], view());
    assert_black(&Shot::take(&lit, &settings(8, 8, 1_000), 0..2), "lights alone");
    let mut sky = Scene::from_parts(vec![], vec![], view());
    sky.environment = Some(Environment::constant([0.25, 0.5, 0.75]));
    let shot = Shot::take(&sky, &settings(8, 8, 1_000), 0..2);
    let background = shot.picture.beauty().expect("beauty");
    assert!(background.data.chunks(3).all(|pixel| pixel == [0.25, 0.5, 0.75]), "the background, exactly");
}

/// Case 40: without light the picture is black.
#[test]
fn case_40_no_lights() {
    for object in [Material::lambert([0.5; 3]), Material::mirror(), Material::glass(1.5)] {
        let dark = room(object, vec![]);
        assert_black(&Shot::take(&dark, &settings(16, 12, 1_000), 0..2), "no light");
    }
    let mut scene = room(Material::mirror(), vec![Light::Point { position: [0.0, 2.0, 0.0], intensity: [0.0; 3] }]);
    scene.environment = Some(Environment::constant([0.0; 3]));
    assert_black(&Shot::take(&scene, &settings(16, 12, 1_000), 0..2), "lights of no power");
}

/// Case 40: without photons only direct light is left, and it is that of the render with photons.
#[test]
fn case_40_no_photons() {
    let scene = room(Material::glass(1.5), vec![lamp()]);
    let without = Shot::take(&scene, &settings(16, 12, 0), 0..2);
    assert!(without.mean("direct") > 0.0 && without.statistics.photons == 0);
    assert!(without.red("indirect").iter().chain(&without.red("caustic")).all(|x| *x == 0.0));
    let with = Shot::take(&scene, &settings(16, 12, 1_000), 0..2);
    assert_eq!(without.red("direct"), with.red("direct"));
    let one = Shot::take(&scene, &settings(16, 12, 1), 0..2);
    assert_eq!(one.statistics.photons, 2);
}

/// Case 40: images of one pixel, of one column and of one row.
#[test]
fn case_40_thin_images() {
    let scene = room(Material::glass(1.5), vec![lamp()]);
    for (width, height) in [(1, 1), (1, 16_384), (16_384, 1)] {
        let shot = Shot::take(&scene, &settings(width, height, 500), 0..1);
        assert_eq!(shot.moments.len(), (width * height) as usize);
        assert!(width * height > 1 || shot.mean("") > 0.0, "a pixel in the middle of the room");
    }
}

/// Case 40: a camera inside of glass sees the room through it. In a uniform sky of radiance 1 it sees n^2 everywhere:
/// radiance over the squared index is constant along a ray, and what total reflection keeps inside came in somewhere
/// else.
#[test]
fn case_40_camera_inside_of_glass() {
    let mut scene = room(Material::lambert([0.5; 3]), vec![lamp()]);
    scene.add(&Mesh::sphere([1.5, 1.6, 3.0], 0.5, 24, 48), Material::glass(1.5));
    let shot = Shot::take(&scene, &settings(16, 12, 2_000), 0..2);
    assert!(shot.mean("") > 0.0, "light comes in");
    let ball = Mesh::sphere([0.0, 1.0, 3.0], 0.5, 24, 48);
    let mut sky = Scene::from_parts(vec![(ball, Material::glass(1.5))], vec![], view());
    sky.environment = Some(Environment::constant([1.0; 3]));
    let shot = Shot::take(&sky, &settings(24, 24, 0), 0..8);
    assert_close(shot.mean(""), 2.25, 0.01, "radiance inside of glass");
}

/// Cases 34 to 36 are tests of traversal, without pictures.
#[test]
fn cases_34_to_36_are_tested() {
    let traversal = include_str!("../kernels/trace.rs");
    for case in ["Case 34", "Case 35", "Case 36"] {
        let found = traversal.find(&format!("/// {case}")).unwrap_or_else(|| panic!("{case} is missing"));
        assert!(traversal[found..].lines().nth(1).is_some_and(|line| line == "#[test]"), "{case} is no test");
    }
}
