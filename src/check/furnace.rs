//! Closed rooms, whose light grows by 1 / (1 - albedo): cases 1 to 4 and 47.

use std::f64::consts::PI;

use super::lab::{Lab, blocks, settings};
use super::{Case, Within};
use crate::error::Result;
use crate::render::{CLASSES, Settings};
use crate::scene::shapes::Mesh;
use crate::scene::{Camera, Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 1,
        title: "furnace sphere, albedo 0.5 and emission 0.5",
        reason: "Le / (1 - a) everywhere, whatever the shape; noise of the mean is below 0.2 %",
        parameter: None,
        run: furnace,
    },
    Case {
        number: 2,
        title: "furnace of high albedo",
        reason: "Le / (1 - a); a photon meets 1 / (1 - a) surfaces with a deviation as large, so n photons give it to \
                 n^-1/2. What the limit of bounces cuts is a^limit of the light, and the ledger says so",
        parameter: Some("1 - albedo"),
        run: high_albedo,
    },
    Case {
        number: 3,
        title: "furnace with a hole",
        reason: "Le / (1 - a (1 - f)) with the hole's part f of the area, as every element of a sphere sees all others \
                 alike; facets change form factors by less than 0.5 %",
        parameter: Some("open part"),
        run: with_hole,
    },
    Case {
        number: 4,
        title: "integrating sphere, point light off centre",
        reason: "a P / (4 pi R^2 (1 - a)) of indirect irradiance, wherever the light is",
        parameter: None,
        run: integrating_sphere,
    },
    Case {
        number: 47,
        title: "white room, albedo 0.999, 10^4 bounces allowed",
        reason: "Le / (1 - a) less what the limit of bounces cuts, a^limit of it; deviation as in case 2",
        parameter: None,
        run: white_room,
    },
];

fn inside() -> Camera {
    Camera::look_at([0.3, 0.1, -0.2], [-1.0, -0.3, 0.4], [0.0, 1.0, 0.0], 1.5)
}

/// Lambert's law and emission on the front alone, so that what is emitted is all inside.
fn shining_inwards(albedo: f64, emission: f64) -> Material {
    Material { emissive: [emission as f32; 3], double_sided: false, ..Material::lambert([albedo as f32; 3]) }
}

/// A sphere seen from inside whose walls emit 1 - `albedo`, so that its radiance is 1.
fn closed(albedo: f64) -> Scene {
    let wall = shining_inwards(albedo, 1.0 - albedo);
    // Flat: where shading normals lean, a thousandth of the directions lies below the surface and is lost, which counts
    // as much as the albedo's lack of a thousandth.
    let sphere = Mesh { normals: vec![], ..Mesh::sphere([0.0; 3], 1.0, 32, 64).flipped() };
    Scene::from_parts(vec![(sphere, wall)], vec![], inside())
}

fn furnace(lab: &mut Lab) -> Result<()> {
    let scene = closed(0.5);
    let shot = lab.shot(&scene, &settings(32, 32, 40_000), 0..lab.pick(8, 10))?;
    lab.found("radiance", shot.mean(""), 1.0, Within::Part(0.005)).not(0.75);
    lab.found("light after two reflections and more, by photons", shot.mean("indirect"), 0.25, Within::Part(0.01));
    // By place: no dark seams. Noise of a block with 1/16 of the samples is below 1 %.
    lab.worst("the worst sixteenth of the picture", &blocks(&shot.red(""), 4), &[1.0; 16], 0.02);
    let dark = lab.shot(&scene, &settings(32, 32, 0), 0..4)?;
    lab.found("radiance without photons", dark.mean(""), 0.75, Within::Part(0.005)).not(1.0);
    Ok(())
}

/// Few photons: each is stored once per bounce.
fn long_lived(bounces: u32, photons: u32) -> Settings {
    Settings { photon_bounces: bounces, global_smoothing: 6.0, ..settings(16, 16, photons) }
}

fn high_albedo(lab: &mut Lab) -> Result<()> {
    // Many photons in few passes: a bounce is a handful of dispatches, however few photons are left.
    let trials: &[(f64, u32, u64, f64)] = lab.pick(&[(0.9, 60, 6, 0.01)], &[(0.9, 60, 12, 0.01), (0.99, 500, 2, 0.02)]);
    for &(albedo, bounces, passes, tolerance) in trials {
        let shot = lab.shot(&closed(albedo), &long_lived(bounces, 8_000), 0..passes)?;
        let what = format!("radiance, albedo {albedo}, {bounces} bounces");
        let expected = 1.0 - albedo.powi(bounces as i32 + 1);
        lab.found(what, shot.mean(""), expected, Within::Part(tolerance)).at(1.0 - albedo);
    }
    // With too few bounces the light that is missing is what the ledger calls cut.
    let (albedo, bounces) = (0.999f64, 100);
    let shot = lab.shot(&closed(albedo), &long_lived(bounces, 3_000), 0..lab.pick(2, 4))?;
    let energy = shot.statistics.energies[1];
    let cut = albedo.powi(bounces as i32);
    let what = format!("{} photons' energy cut at {bounces} bounces, albedo {albedo}", CLASSES[1]);
    lab.found(what, energy.cut / energy.emitted, cut, Within::Part(0.01)).at(1.0 - albedo);
    let what = format!("radiance without what was cut, albedo {albedo}");
    // Deposits begin at the second surface: the last of them is the one at which the photon is cut.
    lab.found(what, shot.mean(""), 1.0 - cut * albedo, Within::Part(0.05)).at(1.0 - albedo).not(1.0);
    Ok(())
}

fn with_hole(lab: &mut Lab) -> Result<()> {
    let (albedo, emission) = (0.8, 0.2);
    let openings: &[f32] = lab.pick(&[0.6], &[0.95, 0.6, 0.0]);
    for &height in openings {
        let wall = shining_inwards(albedo, emission);
        let mut sphere = Mesh::sphere([0.0; 3], 1.0, 32, 64).flipped();
        let whole = area(&sphere);
        let positions = sphere.positions.clone();
        sphere.triangles.retain(|t| t.iter().any(|&i| positions[i as usize][1] < height));
        let open = 1.0 - area(&sphere) / whole;
        let camera = Camera::look_at([0.2, -0.1, 0.1], [-0.3, -1.0, 0.2], [0.0, 0.0, 1.0], 1.2);
        let scene = Scene::from_parts(vec![(sphere, wall)], vec![], camera);
        let settings = Settings { photon_bounces: 64, ..settings(24, 24, 30_000) };
        let shot = lab.shot(&scene, &settings, 0..8)?;
        let expected = emission / (1.0 - albedo * (1.0 - open));
        lab.found(format!("radiance, {:.1} % open", 100.0 * open), shot.mean(""), expected, Within::Part(0.02))
            .at(open)
            .not(emission / (1.0 - albedo));
        let energy = shot.statistics.energies[1];
        // Of what a wall sends out the part f leaves, so all in all f / (1 - a (1 - f)) of it.
        let escaped = open / (1.0 - albedo * (1.0 - open));
        lab.found("energy that escapes", energy.escaped / energy.emitted, escaped, Within::Part(0.02)).at(open);
    }
    Ok(())
}

fn area(mesh: &Mesh) -> f64 {
    let at = |i: u32| glam::Vec3::from(mesh.positions[i as usize]).as_dvec3();
    mesh.triangles.iter().map(|t| 0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length()).sum()
}

fn integrating_sphere(lab: &mut Lab) -> Result<()> {
    let (albedo, radius, intensity) = (0.6, 2.0, 3.0);
    let camera = Camera::look_at([0.0, 0.0, 0.0], [0.0, -0.5, -1.0], [0.0, 1.0, 0.0], 1.8);
    let sphere = Mesh::sphere([0.0; 3], radius as f32, 48, 96).flipped();
    let light = Light::Point { position: [0.9, 0.5, 0.3], intensity: [intensity as f32; 3] };
    let scene = Scene::from_parts(vec![(sphere, Material::lambert([albedo as f32; 3]))], vec![light], camera);
    let shot = lab.shot(&scene, &settings(32, 32, 60_000), 0..lab.pick(8, 10))?;
    let power = 4.0 * PI * intensity;
    let irradiance = albedo * power / (4.0 * PI * radius * radius * (1.0 - albedo));
    let expected = albedo / PI * irradiance;
    lab.found("indirect light", shot.mean("indirect"), expected, Within::Part(0.01)).not(expected * (1.0 - albedo));
    let parts = blocks(&shot.red("indirect"), 4);
    lab.worst("the worst sixteenth of the picture", &parts, &[expected; 16], 0.02);
    let energy = shot.statistics.energies[1];
    let emitted = energy.emitted / shot.statistics.passes as f64;
    lab.found("emitted by the photons [W]", emitted, power, Within::Part(1e-5));
    lab.found("absorbed, of what was emitted", energy.absorbed / energy.emitted, 1.0, Within::Part(0.001));
    let direct = blocks(&shot.red("direct"), 4);
    let uneven = direct.iter().any(|block| (block / direct[0] - 1.0).abs() > 0.1);
    lab.holds("direct light is not even", uneven);
    Ok(())
}

fn white_room(lab: &mut Lab) -> Result<()> {
    let albedo = 0.999f64;
    // As many as are allowed would take minutes on a processor; what they would bring is cut, and known.
    let bounces = lab.pick(300, 2_000);
    let shot = lab.shot(&closed(albedo), &long_lived(bounces, lab.pick(3_000, 1_500)), 0..2)?;
    let energy = shot.statistics.energies[1];
    let cut = albedo.powi(bounces as i32);
    let photons = shot.statistics.photons as f64;
    // Three deviations of the number of bounces.
    let tolerance = f64::max(0.02, 3.0 / photons.sqrt());
    lab.found("radiance", shot.mean(""), 1.0 - cut, Within::Part(tolerance));
    lab.found("energy cut", energy.cut / energy.emitted, cut, Within::Range(3.0 * (cut / photons).sqrt() + 1e-4));
    Ok(())
}
