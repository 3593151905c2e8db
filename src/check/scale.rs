//! Lengths of every magnitude: cases 31, 45 and 46.

use super::lab::{Lab, Shot, settings};
use super::scenes::{lamp, panel, room};
use super::{Case, Within};
use crate::error::{Error, Result};
use crate::render::Settings;
use crate::scene::shapes::Mesh;
use crate::scene::{Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 31,
        title: "scene moved by 10^3 ... 10^7 of its size",
        reason: "the same picture: corners are rounded by 6e-8 of the distance, which is 0.6 % of the scene at 10^5; \
                 beyond, a refusal or a warning",
        parameter: Some("distance in scene sizes"),
        run: moved,
    },
    Case {
        number: 45,
        title: "units of 10^-15 ... 10^15",
        reason: "the same picture, or a refusal in words; rounding of coordinates moves a few edges",
        parameter: Some("unit"),
        run: units,
    },
    Case {
        number: 46,
        title: "one stray vertex at 10^3 ... 10^12 scene sizes",
        reason: "what is seen stays as it was, within noise",
        parameter: Some("distance in scene sizes"),
        run: stray,
    },
];

/// The scene with all lengths times `unit`, intensities so that radiance stays.
pub(super) fn times(scene: &Scene, unit: f32) -> Scene {
    let far = |p: &mut [f32; 3]| *p = p.map(|x| x * unit);
    let mut scaled = scene.clone();
    scaled.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(far);
    for light in &mut scaled.lights {
        match light {
            Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
                far(position);
                *intensity = intensity.map(|x| x * unit * unit);
            }
            Light::Directional { .. } => {}
        }
    }
    scaled.cameras.iter_mut().for_each(|camera| far(&mut camera.position));
    for material in &mut scaled.materials {
        material.absorption = material.absorption.map(|x| x / unit);
    }
    scaled
}

fn moved_by(scene: &Scene, offset: f32) -> Scene {
    let far = |p: &mut [f32; 3]| *p = [p[0] + offset, p[1] - 0.5 * offset, p[2] + 0.25 * offset];
    let mut moved = scene.clone();
    moved.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(far);
    moved.lights.iter_mut().for_each(|light| match light {
        Light::Point { position, .. } | Light::Spot { position, .. } => far(position),
        Light::Directional { .. } => {}
    });
    moved.cameras.iter_mut().for_each(|camera| far(&mut camera.position));
    moved
}

fn base() -> Scene {
    let mut scene = room(Material::glass(1.5), vec![lamp()]);
    panel(&mut scene);
    scene
}

fn small() -> Settings {
    settings(24, 18, 6_000)
}

/// Part of the pixels that differ by more than a tenth of the picture's mean.
fn part_that_differs(found: &Shot, expected: &Shot) -> f64 {
    let (a, b) = (found.red("direct"), expected.red("direct"));
    let limit = 0.1 * expected.mean("direct");
    a.iter().zip(&b).filter(|(a, b)| (*a - *b).abs() > limit || !a.is_finite()).count() as f64 / b.len() as f64
}

/// A render, or `None` where the scene is refused in words.
fn unless_refused(lab: &mut Lab, scene: &Scene) -> Result<Option<Shot>> {
    match lab.shot(scene, &small(), 0..4) {
        Err(Error::Scene { .. } | Error::Usage(_) | Error::Setting { .. }) => Ok(None),
        other => other.map(Some),
    }
}

/// Compares direct light, which has little noise, by pixels and all light by its mean.
fn compare(lab: &mut Lab, what: &str, parameter: f64, found: Option<&Shot>, expected: &Shot) {
    let Some(found) = found else {
        lab.holds(format!("{what}: refused in words"), true).at(parameter);
        return;
    };
    let mean = expected.mean("");
    let part = part_that_differs(found, expected);
    let rows = [
        ("mean", found.mean(""), mean, Within::Part(0.01)),
        ("part of the pixels that differ", part, 0.01, Within::AtMost),
    ];
    for (name, found, expected, within) in rows {
        let row = lab.found(format!("{what}: {name}"), found, expected, within);
        row.at(parameter);
        if what.starts_with("moved") && parameter > 1e4 {
            row.gap("only scenes from files are brought to the origin; rays of others start on a coarse grid");
        }
    }
}

fn moved(lab: &mut Lab) -> Result<()> {
    // The scene is four units across.
    let scene = base();
    let expected = lab.shot(&scene, &small(), 0..4)?;
    for sizes in [1e1, 1e3] {
        let found = unless_refused(lab, &moved_by(&scene, 4.0 * sizes))?;
        compare(lab, &format!("moved by {sizes:e}"), f64::from(sizes), found.as_ref(), &expected);
    }
    // Corners lie on a grid of their own there: the scene that was meant is not the one that is in the numbers. What
    // they say is compared, near the origin.
    for sizes in lab.pick(vec![1e5f32], vec![1e4, 1e5, 1e7]) {
        let far = moved_by(&scene, 4.0 * sizes);
        let near = moved_by(&far, -4.0 * sizes);
        let expected = lab.shot(&near, &small(), 0..4)?;
        let found = unless_refused(lab, &far)?;
        compare(lab, &format!("moved by {sizes:e}"), f64::from(sizes), found.as_ref(), &expected);
    }
    Ok(())
}

fn units(lab: &mut Lab) -> Result<()> {
    let scene = base();
    let expected = lab.shot(&scene, &small(), 0..4)?;
    let all = [1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e12, 1e15f32];
    for unit in lab.pick(vec![1e-15, 1e-6, 1e6, 1e15], all.to_vec()) {
        let found = unless_refused(lab, &times(&scene, unit))?;
        compare(lab, &format!("unit {unit:e}"), f64::from(unit), found.as_ref(), &expected);
    }
    for unit in lab.pick(vec![1e30], vec![1e18, 1e20, 1e25, 1e30, 1e-20, 1e-30f32]) {
        let found = unless_refused(lab, &times(&scene, unit))?;
        compare(lab, &format!("unit {unit:e}"), f64::from(unit), found.as_ref(), &expected);
    }
    Ok(())
}

fn stray(lab: &mut Lab) -> Result<()> {
    let scene = base();
    let passes = lab.pick(8, 16);
    let expected = lab.shot(&scene, &small(), 0..passes)?;
    let distances = [1e3, 1e5, 1e6, 1e9, 1e12f32];
    for sizes in lab.pick(vec![1e3, 1e12], distances.to_vec()) {
        let far = 4.0 * sizes;
        let speck = Mesh {
            positions: vec![[far, far, far], [far * 1.000_01, far, far], [far, far * 1.000_01, far]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let mut with_it = scene.clone();
        with_it.add(&speck, Material::lambert([0.5; 3]));
        let found = lab.shot(&with_it, &small(), 0..passes)?;
        let at = f64::from(sizes);
        for layer in ["direct", "indirect", "caustic"] {
            let what = format!("{layer}, stray vertex at {sizes:e}");
            let tolerance = if layer == "direct" { 0.01 } else { 0.05 };
            lab.found(what, found.mean(layer), expected.mean(layer), Within::Part(tolerance)).at(at);
        }
        let part = part_that_differs(&found, &expected);
        lab.found("part of the pixels that differ in direct light", part, 0.01, Within::AtMost).at(at);
        let blur = blurred(&found, &expected);
        lab.found("contrast of the caustic, of what it was", blur, 1.0, Within::Part(0.25)).at(at);
    }
    Ok(())
}

/// Root mean square of the caustic over its mean, relative to that of another picture.
fn blurred(found: &Shot, expected: &Shot) -> f64 {
    let contrast = |shot: &Shot| {
        let light = shot.red("caustic");
        (light.iter().map(|x| x * x).sum::<f64>() / light.len() as f64).sqrt() / shot.mean("caustic")
    };
    contrast(found) / contrast(expected)
}
