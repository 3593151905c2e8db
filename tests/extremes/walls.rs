//! Footprints at walls: cases 37 and 38.

use nephroid::low_level::render::Settings;
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Camera, Light, Material, Scene};

use crate::support::lab::{Shot, settings};
use crate::support::proof;

/// Wide footprints, so that a boundary matters.
fn wide(fold: bool) -> Settings {
    Settings { fold, largest_footprint: 0.2, global_smoothing: 12.0, ..settings(24, 24, 20_000) }
}

/// A cube from -1 to 1, seen from inside.
fn cube(material: &Material) -> Vec<(Mesh, Material)> {
    let side = |corner: [f32; 3], u: [f32; 3], v: [f32; 3]| (Mesh::quad(corner, u, v), material.clone());
    let (x, y, z) = ([2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]);
    vec![
        side([-1.0; 3], z, x),
        side([-1.0; 3], y, z),
        side([-1.0; 3], x, y),
        side([-1.0, 1.0, -1.0], x, z),
        side([1.0, -1.0, -1.0], z, y),
        side([-1.0, -1.0, 1.0], y, x),
    ]
}

/// Root of the mean squared error of blocks of 3 x 3 pixels against `expected`.
fn error(shot: &Shot, expected: f64) -> f64 {
    let red = shot.red("indirect");
    let block = |b: usize| {
        let (x, y) = (b % 8 * 3, b / 8 * 3);
        (0..9).map(|i| red[(y + i / 3) * 24 + x + i % 3]).sum::<f64>() / 9.0
    };
    ((0..64).map(|b| (block(b) / expected - 1.0).powi(2)).sum::<f64>() / 64.0).sqrt()
}

/// Case 38 for concave edges: in a cube that is a furnace the radiance is the same up to every edge and corner. A
/// quarter of it comes by photons.
#[test]
fn light_is_even_up_to_the_edges_of_a_room() {
    let wall = Material { emissive: [0.5; 3], ..Material::lambert([0.5; 3]) };
    let camera = Camera::look_at([0.2, 0.3, 0.1], [-1.0, -1.0, -1.0], [0.0, 1.0, 0.0], 1.2);
    let scene = Scene::from_parts(cube(&wall), vec![], camera);
    let [folded, open] = [true, false].map(|fold| Shot::take(&scene, &wide(fold), 0..12));
    let (with, without) = (error(&folded, 0.25), error(&open, 0.25));
    println!("error of blocks: {with:.4} with folds, {without:.4} without");
    assert!(without > 0.02, "footprints are wide enough for the check to mean something: {without}");
    assert!(with < 0.35 * without, "{with} with folds, {without} without");
    // What is left is lost in the corner, where a footprint meets three walls and has one fold.
    let [lost, lost_open] = [&folded, &open].map(|shot| 1.0 - shot.mean("indirect") / 0.25);
    assert!(lost < 0.35 * lost_open, "{lost} of the light is lost with folds, {lost_open} without");
}

/// Case 37: a thin wall on a floor, lit from one side. What reaches the other side is the light that footprints carry
/// through the wall, and folds keep it back.
#[test]
fn a_wall_keeps_the_light_on_its_side() {
    let white = || Material::lambert([0.8; 3]);
    // A screen over the wall sends the lamp's light down to the lit half; the dark half is in the shadow of the wall.
    let floor = Mesh::quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]);
    let wall = Mesh::cuboid([-0.004, 0.0, -1.0], [0.004, 2.0, 1.0]);
    let screen = Mesh::quad([-1.0, 0.0, 1.0], [0.0, 0.0, -2.0], [0.0, 2.0, 0.0]);
    let camera = Camera::look_at([0.35, 1.2, 0.0], [0.35, 0.0, 0.0], [0.0, 0.0, -1.0], 0.5);
    let lamp = Light::Point { position: [-0.5, 0.7, 0.0], intensity: [1.0; 3] };
    let scene = Scene::from_parts(vec![(floor, white()), (wall, white()), (screen, white())], vec![lamp], camera);
    let [folded, open] = [true, false].map(|fold| Shot::take(&scene, &wide(fold), 0..8).mean("indirect"));
    println!("light behind the wall: {folded:.6} with folds, {open:.6} without");
    assert!(open > 1e-4, "footprints reach through the wall without folds: {open}");
    assert!(folded < 0.02 * open, "{folded} with folds, {open} without");
    proof::by_answer(&["photon_fold"]);
}
