//! Footprints at their limits: cases 15, 16 and 25.

use std::f64::consts::PI;

use super::lab::{Lab, settings, worse};
use super::scenes::{floor, from_above, sun};
use super::{Case, Within};
use crate::error::Result;
use crate::kernels::generated::Photon;
use crate::render::Settings;
use crate::scene::shapes::Mesh;
use crate::scene::{Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 15,
        title: "photons that graze a receiver, 80 to 90 degrees",
        reason: "E cos t; footprints grow by 1 / cos t and their ratio of semiaxes stays below 1000; at 90 degrees \
                 nothing arrives",
        parameter: Some("degrees from the normal"),
        run: grazing,
    },
    Case {
        number: 16,
        title: "beam without spread",
        reason: "its footprint is the least disc, of 1e-4 scene radii, and no flux is lost",
        parameter: None,
        run: beam,
    },
    Case {
        number: 25,
        title: "radius schedule over 10^6 passes",
        reason: "the product of (k + 2/3) / (k + 1) in double precision",
        parameter: Some("pass"),
        run: schedule,
    },
];

/// The sun by way of an upright mirror that is as high as the beam needs to cover one unit of the floor.
fn grazing(lab: &mut Lab) -> Result<()> {
    for (degrees, tolerance) in [(80.0f64, 0.02), (89.0, 0.02), (89.9, 0.1)] {
        let above = (90.0 - degrees).to_radians();
        let height = above.tan();
        let scene = grazed(above, height as f32);
        let settings = Settings { caustic_smoothing: 2.0, ..settings(16, 16, 200_000) };
        let shot = lab.shot(&scene, &settings, 0..lab.pick(4, 12))?;
        let expected = 0.5 / PI * above.sin();
        let what = format!("light at {degrees} degrees");
        lab.found(what, shot.mean("caustic"), expected, Within::Part(tolerance)).at(degrees).not(0.5 / PI);
    }
    let shot = lab.shot(&grazed(0.0, 0.01), &settings(16, 16, 20_000), 0..2)?;
    lab.found("light at 90 degrees", shot.mean("caustic"), 0.0, Within::Exact).at(90.0);
    Ok(())
}

fn grazed(above: f64, height: f32) -> Scene {
    let mirror = Mesh::quad([0.0, 0.0, 0.3], [0.0, 0.0, -0.6], [0.0, height, 0.0]);
    let light = sun([-above.cos() as f32, -above.sin() as f32, 0.0]);
    let parts = vec![(floor(3.0, 0.0), Material::lambert([0.5; 3])), (mirror, Material::mirror())];
    Scene::from_parts(parts, vec![light], from_above([0.5, 0.5, 0.0], 0.1))
}

/// Semiaxes of a stored photon's footprint: the dual vectors have their reciprocals.
fn semiaxes(photon: &Photon) -> [f64; 2] {
    let length =
        |words: [u32; 4]| 1.0 / words[..3].iter().map(|w| f64::from(f32::from_bits(*w)).powi(2)).sum::<f64>().sqrt();
    [length(photon.c), length(photon.d)]
}

/// A spotlight of a hundredth of a radian by way of a mirror: neighbouring photons are nearer than the least footprint.
fn beam(lab: &mut Lab) -> Result<()> {
    // Hardly wider than the beam: caustic photons are aimed at all of it.
    let mirror = Mesh::quad([-0.015, 4.0, -0.015], [0.03, 0.0, 0.0], [0.0, 0.0, 0.03]);
    let light = Light::Spot {
        position: [0.0, 3.0, 0.0],
        direction: [0.0, 1.0, 0.0],
        intensity: [1.0; 3],
        inner_angle: 0.005,
        outer_angle: 0.01,
    };
    let parts = vec![(floor(10.0, 0.0), Material::lambert([0.5; 3])), (mirror, Material::mirror())];
    let scene = Scene::from_parts(parts, vec![light], from_above([0.0, 2.0, 0.0], 0.1));
    let radius = 1e-4 * scene.bounds().map_or(0.0, |bounds| f64::from(bounds.radius()));
    // Two bounces: the mirror and the floor, so that only caustic photons are stored.
    let settings =
        Settings { read_photons: true, caustic_smoothing: 0.1, photon_bounces: 2, ..settings(8, 8, 200_000) };
    let shot = lab.shot(&scene, &settings, 0..1)?;
    let off = |photon: &Photon| semiaxes(photon).map(|axis| (axis / radius - 1.0).abs()).into_iter().fold(0.0, worse);
    let worst = shot.photons.iter().map(off).fold(0.0, worse);
    lab.found("photons stored", shot.photons.len() as f64, 1000.0, Within::AtLeast);
    lab.found("largest difference of a semiaxis from 1e-4 scene radii", worst, 1e-4, Within::AtMost);
    let raised = shot.guard("footprints_raised_to_minimum") as f64;
    lab.found("footprints raised to the least radius", raised, shot.photons.len() as f64, Within::Exact);
    let energy = shot.statistics.energies[0];
    let flux: f64 = shot.photons.iter().map(|photon| f64::from(f32::from_bits(photon.b[0]))).sum();
    lab.found("stored flux, of what was emitted", flux / energy.emitted, 1.0, Within::Part(1e-4));
    // Within the inner cone all of it, between the cones the square of the falloff, whose mean is a third.
    let cosine = |angle: f32| f64::from(f64::from(angle).cos() as f32);
    let (inner, outer) = (cosine(0.005), cosine(0.01));
    let expected = 2.0 * PI * ((1.0 - inner) + (inner - outer) / 3.0);
    lab.found("emitted flux [W]", energy.emitted, expected, Within::Part(0.02));
    Ok(())
}

fn schedule(lab: &mut Lab) -> Result<()> {
    let settings = Settings::default();
    let mut squared = 1.0f64;
    for index in 0..1_000_001u64 {
        if index > 0 {
            squared *= (index as f64 + settings.alpha) / (index as f64 + 1.0);
        }
        if [0, 1, 10, 100, 1_000, 10_000, 100_000, 1_000_000].contains(&index) {
            let found = f64::from(settings.radius_scale(index));
            lab.found(format!("scale of pass {index}"), found, squared.sqrt(), Within::Part(1e-6)).at(index as f64);
        }
    }
    Ok(())
}
