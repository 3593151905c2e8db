//! Glass: cases 8, 18, 19 and 48.

use std::f64::consts::PI;

use super::lab::{Lab, Shot, mean, settings};
use super::scenes::{floor, from_above, parallel, sky, sun};
use super::{Case, Within};
use crate::error::Result;
use crate::render::Settings;
use crate::scene::shapes::Mesh;
use crate::scene::{Camera, Environment, Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 8,
        title: "glass slab n = 1.5",
        reason: "T = (1 - R) / (1 + R) = 0.923077 of all reflections inside; R + T = 1, Fresnel at 20 degrees",
        parameter: None,
        run: slab,
    },
    Case {
        number: 18,
        title: "index of refraction 1, 1 + 10^-6, 100; the critical angle",
        reason: "an index of 1 cannot be seen; T = (1 - R) / (1 + R); Fresnel in double precision",
        parameter: Some("index of refraction"),
        run: indices,
    },
    Case {
        number: 19,
        title: "absorption, optical depth 0 ... 10^4",
        reason: "exp(-x), where it is a normal number; rounding of x by 6e-8 is 6e-8 x of the result",
        parameter: Some("optical depth"),
        run: absorption,
    },
    Case {
        number: 48,
        title: "fifty nested dielectric shells",
        reason: "nothing absorbs: radiance 1 in a sky of 1; what the limit of depth cuts is counted",
        parameter: None,
        run: shells,
    },
];

/// What a slab lets through of the sun above it, by photons. The picture holds the whole slab with a margin for
/// footprints, so it counts all flux.
fn through_slab(lab: &mut Lab, ior: f64, bounces: u32) -> Result<f64> {
    let block = Mesh::cuboid([-1.0, 0.5, -1.0], [1.0, 0.6, 1.0]);
    let parts = vec![(floor(2.0, 0.0), Material::lambert([1.0; 3])), (block, Material::glass(ior as f32))];
    let scene = Scene::from_parts(parts, vec![sun([0.0, -1.0, 0.0])], from_above([0.0, 0.25, 0.0], 1.25));
    // A white floor: light that comes back from the slab is no caustic.
    let settings = Settings { photon_bounces: bounces, eye_depth: bounces, ..settings(20, 20, 200_000) };
    let shot = lab.shot(&scene, &settings, 0..lab.pick(4, 16))?;
    Ok(shot.mean("caustic") * PI * 2.5 * 2.5 / 4.0)
}

fn slab(lab: &mut Lab) -> Result<()> {
    let flux = through_slab(lab, 1.5, 24)?;
    lab.found("transmittance", flux, 0.923077, Within::Part(0.002)).not(0.96);
    let [reflected, transmitted] = tilted_slab(lab)?;
    let angle = TILT.to_radians();
    let r = fresnel(angle, 1.5);
    lab.found("R + T at 20 degrees", (reflected + transmitted) / (0.16 * angle.cos()), 1.0, Within::Part(0.01));
    let part = reflected / (reflected + transmitted);
    lab.found("R / (R + T) at 20 degrees", part, r * 2.0 / (1.0 + r), Within::Part(0.02));
    Ok(())
}

/// Unpolarised reflectance of one boundary from vacuum, by the sines and tangents of Fresnel's own formulas.
fn fresnel(angle: f64, ior: f64) -> f64 {
    let inside = (angle.sin() / ior).asin();
    let s = ((angle - inside).sin() / (angle + inside).sin()).powi(2);
    let p = ((angle - inside).tan() / (angle + inside).tan()).powi(2);
    0.5 * (s + p)
}

const TILT: f64 = 20.0;

/// Reflected and transmitted flux: sun at 20 degrees through a window in a screen, so that the slab's reflection lands
/// beside the window on the screen's lower side.
fn tilted_slab(lab: &mut Lab) -> Result<[f64; 2]> {
    let (sine, cosine) = TILT.to_radians().sin_cos();
    let block = Mesh::cuboid([0.4, 1.0, -0.3], [1.05, 1.05, 0.3]);
    // The window is 0.4 x 0.4 in the middle of four plates at y = 3: the reflection moves by 2 * 1.95 * tan = 1.42.
    let plate =
        |x: [f32; 2], z: [f32; 2]| Mesh::quad([x[0], 3.0, z[1]], [x[1] - x[0], 0.0, 0.0], [0.0, 0.0, z[0] - z[1]]);
    let mut screen = plate([-4.0, -0.2], [-4.0, 4.0]);
    for part in [plate([0.2, 4.0], [-4.0, 4.0]), plate([-0.2, 0.2], [-4.0, -0.2]), plate([-0.2, 0.2], [0.2, 4.0])] {
        screen.append(&part);
    }
    let light = sun([sine as f32, -(cosine as f32), 0.0]);
    let white = Material::lambert([1.0; 3]);
    let up = parallel([1.42, 2.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], 1.0);
    let parts = vec![(floor(4.0, 0.0), white.clone()), (screen, white), (block, Material::glass(1.5))];
    let mut scene = Scene::from_parts(parts, vec![light], up);
    scene.cameras.push(from_above([1.09, 0.5, 0.0], 1.0));
    let mut flux = [0.0; 2];
    for (camera, flux) in flux.iter_mut().enumerate() {
        let settings = Settings { camera, ..settings(64, 64, 200_000) };
        *flux = lab.shot(&scene, &settings, 0..lab.pick(3, 6))?.mean("caustic") * PI * 4.0;
    }
    Ok(flux)
}

fn camera() -> Camera {
    Camera::look_at([0.0, 0.3, 3.0], [0.0; 3], [0.0, 1.0, 0.0], 0.7)
}

/// A body in front of a sky that is nowhere the same.
fn before_sky(body: Option<Material>) -> Scene {
    let parts = body.map(|material| (Mesh::sphere([0.0; 3], 0.8, 24, 48), material));
    let mut scene = Scene::from_parts(parts.into_iter().collect(), vec![], camera());
    scene.environment = Some(sky(16, 8, |x, y| 1.0 + 0.1 * x as f32 + 0.05 * y as f32));
    scene
}

fn farthest(a: &Shot, b: &Shot) -> f64 {
    let pairs = a.red("").into_iter().zip(b.red(""));
    pairs.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

fn indices(lab: &mut Lab) -> Result<()> {
    let settings = settings(32, 32, 0);
    let empty = lab.shot(&before_sky(None), &settings, 0..2)?;
    let shot = lab.shot(&before_sky(Some(Material::glass(1.0))), &settings, 0..2)?;
    lab.found("a ball of index 1: largest difference to none", farthest(&shot, &empty), 1e-5, Within::AtMost).at(1.0);
    // Rays that graze such a ball are bent by up to the root of 2e-6, all others by 1e-6.
    let shot = lab.shot(&before_sky(Some(Material::glass(1.000_001))), &settings, 0..2)?;
    let what = "a ball of index 1 + 1e-6: mean of the picture";
    lab.found(what, shot.mean(""), empty.mean(""), Within::Part(1e-5)).at(1.000_001);
    lab.found("its largest difference to none", farthest(&shot, &empty), 2e-3, Within::AtMost).at(1.000_001);
    let glass = lab.shot(&before_sky(Some(Material::glass(1.5))), &settings, 0..2)?;
    lab.found("a ball of index 1.5 is seen", farthest(&glass, &empty), 0.01, Within::AtLeast).at(1.5);
    // After 160 surfaces 0.1 % of the light in a slab of index 100 is left.
    for (ior, bounces) in lab.pick(vec![(3.0f64, 24)], vec![(3.0, 24), (100.0, 160)]) {
        let r = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let flux = through_slab(lab, ior, bounces)?;
        let expected = (1.0 - r) / (1.0 + r);
        lab.found(format!("slab of index {ior}: transmittance"), flux, expected, Within::Part(0.02)).at(ior);
    }
    critical(lab)
}

/// From inside of a block at the critical angle, and 1e-6 to either side: what comes in is that of Fresnel, within what
/// rounding of a direction (1e-7) changes the angle.
fn critical(lab: &mut Lab) -> Result<()> {
    let ior = 1.5f64;
    let block = Mesh::cuboid([-100.0, -100.0, -100.0], [100.0, 0.0, 100.0]);
    for (name, shift) in [("below", -1e-6), ("at", 0.0), ("above", 1e-6), ("1e-3 below", -1e-3)] {
        let angle = (1.0 / ior).asin() + shift;
        let forward = [angle.sin() as f32, angle.cos() as f32, 0.0];
        let view = parallel([0.0, -0.1, 0.0], forward, [0.0, 0.0, 1.0], 1e-6);
        let mut scene = Scene::from_parts(vec![(block.clone(), Material::glass(ior as f32))], vec![], view);
        scene.environment = Some(Environment::constant([1.0; 3]));
        let shot = lab.shot(&scene, &Settings { eye_depth: 1, ..settings(16, 16, 0) }, 0..16)?;
        let inside = |angle: f64| 1.0 - fresnel((ior * angle.sin()).min(1.0).asin(), ior);
        // Radiance grows by n^2 into the glass. The steep root at the critical angle turns 3e-7 into 1e-2.
        let [low, high] = [angle + 3e-7, angle - 3e-7].map(|angle| ior * ior * inside(angle));
        let found = shot.mean("");
        lab.found(format!("critical angle, {name}"), found, 1.03 * high + 1e-6, Within::AtMost).at(ior);
        lab.found(format!("critical angle, {name}"), found, 0.97 * low - 1e-6, Within::AtLeast).at(ior);
    }
    Ok(())
}

fn absorption(lab: &mut Lab) -> Result<()> {
    let mut clear = f64::NAN;
    for depth in [0.0f64, 1e-6, 1e-3, 0.1, 1.0, 10.0, 50.0, 100.0, 1e3, 1e4] {
        let slab = Mesh::cuboid([-1.0, 0.5, -1.0], [1.0, 1.0, 1.0]);
        // As the kernels have it: a coefficient in single precision times a length of a half.
        let coefficient = (2.0 * depth) as f32;
        let material = Material { absorption: [coefficient; 3], ..Material::glass(1.0) };
        let expected = (-0.5 * f64::from(coefficient)).exp();
        let mut scene = Scene::from_parts(vec![(slab, material)], vec![], from_above([0.0, 2.0, 0.0], 0.5));
        scene.environment = Some(Environment::constant([1.0; 3]));
        let shot = lab.shot(&scene, &settings(8, 8, 0), 0..1)?;
        // Paths from the eye that carry little end by Russian roulette: without bias, but noise.
        let within = if depth < 2.0 { Within::Part(1e-5) } else { Within::Range(1e-3) };
        lab.found(format!("optical depth {depth}, from the eye"), shot.mean(""), expected, within).at(depth);
        // No chance takes part in what a photon loses on a straight way.
        scene.environment = None;
        scene.add(&floor(2.0, 0.0), Material::lambert([0.5; 3]));
        scene.lights = vec![sun([0.0, -1.0, 0.0])];
        let settings = Settings { read_photons: true, photon_bounces: 3, ..settings(4, 4, 1_000) };
        let shot = lab.shot(&scene, &settings, 0..1)?;
        let caustic = shot.photons.iter().filter(|photon| f32::from_bits(photon.d[3]) < 0.0);
        let flux: Vec<f64> = caustic.map(|photon| f64::from(f32::from_bits(photon.b[0]))).collect();
        let each = if flux.is_empty() { 0.0 } else { mean(&flux) };
        if depth == 0.0 {
            clear = each;
        }
        let within = if expected > 1e-30 { Within::Part(1e-5) } else { Within::Range(1e-30) };
        lab.found(format!("optical depth {depth}, photons' flux"), each / clear, expected, within).at(depth).gap(
            "rays leave surfaces by a bound of the rounding, which shortens a way of 0.5 by 2.6e-6: 5e-6 of the depth",
        );
    }
    Ok(())
}

fn shells(lab: &mut Lab) -> Result<()> {
    let mut scene = Scene::from_parts(vec![], vec![], camera());
    scene.environment = Some(Environment::constant([1.0; 3]));
    for i in 0..50u8 {
        let ior = [1.1, 1.5, 1.3][usize::from(i % 3)];
        scene.add(&Mesh::sphere([0.0; 3], 0.9 - 0.017 * f32::from(i), 16, 32), Material::glass(ior));
    }
    let settings = Settings { eye_depth: 254, ..settings(16, 16, 0) };
    let shot = lab.shot(&scene, &settings, 0..lab.pick(16, 64))?;
    let cut = shot.statistics.eye_paths_truncated as f64 / (4.0 * 256.0 * shot.statistics.passes as f64);
    lab.found("radiance", mean(&shot.red("")), 1.0, Within::Part(0.01)).gap(
        "inside of glass radiance is lower by the square of the index, and Russian roulette takes that for faint: \
         without bias, but noise that grows with each shell",
    );
    lab.found("part of the eye paths cut at 254 surfaces", cut, 0.01, Within::AtMost);
    // A light inside of all shells: its photons get out.
    let light = Light::Point { position: [0.0; 3], intensity: [1.0; 3] };
    let mut inside = Scene { lights: vec![light], environment: None, ..scene };
    inside.add(&Mesh::sphere([0.0; 3], 2.0, 16, 32).flipped(), Material::lambert([0.5; 3]));
    let settings = Settings { photon_bounces: 512, ..super::lab::settings(8, 8, 4_000) };
    let energy = lab.shot(&inside, &settings, 0..2)?.statistics.energies[1];
    lab.found(
        "photons' energy from inside that is absorbed outside",
        energy.absorbed / energy.emitted,
        1.0,
        Within::Part(0.01),
    );
    Ok(())
}
