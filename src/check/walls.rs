//! Footprints at walls: cases 37 and 38.

use super::lab::{Lab, Shot, settings};
use super::scenes::cube;
use super::{Case, Within};
use crate::error::Result;
use crate::render::Settings;
use crate::scene::shapes::Mesh;
use crate::scene::{Camera, Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 37,
        title: "thin wall lit from one side",
        reason: "light on the other side is what footprints carry through the wall: folds keep 98 % of it back",
        parameter: None,
        run: wall,
    },
    Case {
        number: 38,
        title: "edges and corners of an evenly lit room",
        reason: "a cube that is a furnace is even up to its edges, and where three walls meet",
        parameter: None,
        run: edges,
    },
];

/// Wide footprints, so that a boundary matters.
fn wide(fold: bool) -> Settings {
    Settings { fold, largest_footprint: 0.2, global_smoothing: 12.0, ..settings(24, 24, 20_000) }
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

/// A quarter of the furnace's radiance comes by photons.
fn edges(lab: &mut Lab) -> Result<()> {
    let wall = Material { emissive: [0.5; 3], ..Material::lambert([0.5; 3]) };
    let camera = Camera::look_at([0.2, 0.3, 0.1], [-1.0, -1.0, -1.0], [0.0, 1.0, 0.0], 1.2);
    let scene = Scene::from_parts(cube(&wall), vec![], camera);
    let folded = lab.shot(&scene, &wide(true), 0..12)?;
    let open = lab.shot(&scene, &wide(false), 0..12)?;
    let (with, without) = (error(&folded, 0.25), error(&open, 0.25));
    lab.found("error of blocks without folds", without, 0.02, Within::AtLeast);
    lab.found("error with folds over that without", with / without, 0.35, Within::AtMost);
    let [lost, lost_open] = [&folded, &open].map(|shot| 1.0 - shot.mean("indirect") / 0.25);
    lab.found("light lost with folds over that without", lost / lost_open, 0.35, Within::AtMost);
    Ok(())
}

fn wall(lab: &mut Lab) -> Result<()> {
    let white = || Material::lambert([0.8; 3]);
    // A screen over the wall sends the lamp's light down to the lit half; the dark half is in the shadow of the wall.
    let floor = Mesh::quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]);
    let wall = Mesh::cuboid([-0.004, 0.0, -1.0], [0.004, 2.0, 1.0]);
    let screen = Mesh::quad([-1.0, 0.0, 1.0], [0.0, 0.0, -2.0], [0.0, 2.0, 0.0]);
    let camera = Camera::look_at([0.35, 1.2, 0.0], [0.35, 0.0, 0.0], [0.0, 0.0, -1.0], 0.5);
    let lamp = Light::Point { position: [-0.5, 0.7, 0.0], intensity: [1.0; 3] };
    let scene = Scene::from_parts(vec![(floor, white()), (wall, white()), (screen, white())], vec![lamp], camera);
    let folded = lab.shot(&scene, &wide(true), 0..8)?.mean("indirect");
    let open = lab.shot(&scene, &wide(false), 0..8)?.mean("indirect");
    lab.found("light behind the wall without folds", open, 1e-4, Within::AtLeast);
    lab.found("light behind it with folds over that without", folded / open, 0.02, Within::AtMost);
    Ok(())
}
