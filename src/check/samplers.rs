//! Where photons go against the densities that they should have: cases 21 and 22.
//!
//! Photons of lights are seen through an invisible shell (glass of index 1): it makes them caustic photons, which are
//! stored where they next meet a surface. Photons of surfaces are those that a narrow beam sends on by one reflection.

use std::f64::consts::PI;

use glam::DVec3;

use super::lab::{Lab, settings};
use super::scenes::{cap, parallel, sky};
use super::{Case, Within};
use crate::error::Result;
use crate::kernels::gather::reference::oct_decode;
use crate::kernels::generated::Photon;
use crate::kernels::lobes::table;
use crate::render::Settings;
use crate::scene::shapes::Mesh;
use crate::scene::{Camera, Environment, Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 21,
        title: "chi-square of samplers: lights, sky with a texel of 10^8 : 1, surfaces",
        reason: "counts in cells of equal expected number; the level of Sidak 1967 for all of them at 0.01",
        parameter: None,
        run: chi_squares,
    },
    Case {
        number: 22,
        title: "poles of the environment, u and v exactly 0 and 1",
        reason: "the texel that is there",
        parameter: None,
        run: poles,
    },
];

/// Tests of which the smallest p-value decides.
const TESTS: f64 = 7.0;

/// Quantile of the standard normal distribution above which lies the share `p`, by bisection of the complementary error
/// function's continued fraction.
fn normal_quantile(p: f64) -> f64 {
    let above = |x: f64| {
        // Abramowitz and Stegun 26.2.14, evaluated from the end.
        let fraction = (1..60).rev().fold(x, |rest, k| x + f64::from(k) / rest);
        (-0.5 * x * x).exp() / (2.0 * PI).sqrt() / fraction
    };
    let (mut low, mut high) = (1.0, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if above(middle) > p { low = middle } else { high = middle }
    }
    low
}

/// Greatest chi-square that chance allows with so many degrees of freedom (Wilson and Hilferty 1931).
fn limit(freedom: f64) -> f64 {
    let significance = 1.0 - (1.0f64 - 0.01).powf(1.0 / TESTS);
    let z = normal_quantile(significance);
    let a = 2.0 / (9.0 * freedom);
    freedom * (1.0 - a + z * a.sqrt()).powi(3)
}

/// Chi-square of counts against expected ones.
fn chi_square(counts: &[f64], expected: &[f64]) -> f64 {
    counts.iter().zip(expected).map(|(n, e)| (n - e).powi(2) / e).sum()
}

/// Numbers in cells of equal probability: `u` and `v` uniform in [0, 1) if the sampler is right.
fn cells(numbers: impl Iterator<Item = [f64; 2]>) -> Vec<f64> {
    const SIDE: usize = 8;
    let mut counts = vec![0.0; SIDE * SIDE];
    let cell = |x: f64| ((x * SIDE as f64) as usize).min(SIDE - 1);
    numbers.for_each(|[u, v]| counts[cell(v) * SIDE + cell(u)] += 1.0);
    counts
}

fn check_even(lab: &mut Lab, what: &str, numbers: impl Iterator<Item = [f64; 2]>) {
    let counts = cells(numbers);
    let each = counts.iter().sum::<f64>() / counts.len() as f64;
    let found = chi_square(&counts, &vec![each; counts.len()]);
    lab.found(format!("{what}: photons"), each * counts.len() as f64, 1000.0, Within::AtLeast);
    lab.found(format!("{what}: chi-square"), found, limit(counts.len() as f64 - 1.0), Within::AtMost);
}

fn position(photon: &Photon) -> DVec3 {
    DVec3::from([0, 1, 2].map(|k| f64::from(f32::from_bits(photon.a[k]))))
}

fn direction(photon: &Photon) -> DVec3 {
    DVec3::from(oct_decode(photon.b[3])).normalize()
}

fn azimuth(x: f64, y: f64) -> f64 {
    (y.atan2(x) / (2.0 * PI)).rem_euclid(1.0)
}

fn view() -> Camera {
    parallel([0.0, 5.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], 1.0)
}

/// Photons that a scene stores in one pass.
fn photons(lab: &mut Lab, scene: &Scene, count: u32) -> Result<Vec<Photon>> {
    // Two surfaces: the one that scatters, and the one that the photon is stored at.
    let settings = Settings { read_photons: true, photon_bounces: 2, ..settings(4, 4, count) };
    Ok(lab.shot(scene, &settings, 0..1)?.photons)
}

/// A light in the middle of an invisible shell in the middle of a sphere of radius 2.
fn in_shell(light: Light) -> Scene {
    let parts = vec![
        (Mesh::sphere([0.0; 3], 0.5, 8, 16), Material::glass(1.0)),
        (Mesh::sphere([0.0; 3], 2.0, 64, 128).flipped(), Material::lambert([0.1; 3])),
    ];
    Scene::from_parts(parts, vec![light], view())
}

fn chi_squares(lab: &mut Lab) -> Result<()> {
    let count = lab.pick(60_000, 400_000);
    let point = in_shell(Light::Point { position: [0.0; 3], intensity: [1.0; 3] });
    let from_point = photons(lab, &point, count)?;
    let on_sphere = |d: DVec3| [azimuth(d.x, d.z), 0.5 * (d.y + 1.0)];
    check_even(lab, "point light", from_point.iter().map(|p| on_sphere(direction(p))));
    of_area_light(lab, count)?;
    of_sky(lab, count)?;
    of_hot_sky(lab, count)?;
    of_surfaces(lab, count)?;
    // A sampler that is a little wrong: the sphere's height squared.
    let bent = cells(from_point.iter().map(|p| on_sphere(direction(p))).map(|[u, v]| [u, v.powf(1.1)]));
    let each = from_point.len() as f64 / 64.0;
    let wrong = chi_square(&bent, &[each; 64]) / limit(63.0);
    lab.found("a density that is off by 10 %: chi-square over its limit", wrong, 1.0, Within::AtLeast);
    Ok(())
}

/// An emitter under a shell that covers it: aimed photons are uniform over its triangles.
fn of_area_light(lab: &mut Lab, count: u32) -> Result<()> {
    let lamp = Mesh::quad([-0.1, 0.0, 0.1], [0.2, 0.0, 0.0], [0.0, 0.0, -0.2]);
    let parts = vec![
        (lamp, Material::emitter([1.0; 3])),
        (cap([0.0; 3], 0.5, PI, [8, 16]), Material::glass(1.0)),
        (Mesh::sphere([0.0; 3], 2.0, 64, 128).flipped(), Material::lambert([0.1; 3])),
    ];
    let stored = photons(lab, &Scene::from_parts(parts, vec![], view()), count)?;
    // Back along the flight to the lamp's plane.
    let start = |p: &Photon| {
        let (at, d) = (position(p), direction(p));
        at - d * (at.y / d.y)
    };
    let steep = stored.iter().filter(|p| direction(p).y > 0.2).map(start);
    check_even(lab, "emitter, places", steep.map(|p| [(p.x + 0.1) / 0.2, (p.z + 0.1) / 0.2]));
    Ok(())
}

/// A floor under an invisible plate, in a sky.
fn under_sky(map: Environment) -> Scene {
    // A sheet: the area with which it faces a direction is a cosine.
    let plate = Mesh::disc([0.0, 0.2, 0.0], [0.0, 1.0, 0.0], 0.3, 256);
    let sheet = Material { volume: false, ..Material::glass(1.0) };
    let floor = Mesh::quad([-50.0, 0.0, 50.0], [100.0, 0.0, 0.0], [0.0, 0.0, -100.0]);
    let mut scene = Scene::from_parts(vec![(plate, sheet), (floor, Material::lambert([0.1; 3]))], vec![], view());
    scene.environment = Some(map);
    scene
}

/// Photons that fall on a level plate are as many as the sky's texels are bright, times the cosine with which the plate
/// meets the disc that they start on.
fn of_sky(lab: &mut Lab, count: u32) -> Result<()> {
    let (width, height) = (8u32, 8u32);
    let radiance = |x: u32, y: u32| 1.0 + ((3 * x + 5 * y) % 7) as f32;
    let scene = under_sky(sky(width, height, radiance));
    let stored = photons(lab, &scene, count)?;
    let mut counts = vec![0.0; 32];
    let mut expected = vec![0.0; 32];
    for photon in &stored {
        let d = -direction(photon);
        let (u, v) = ((d.x.atan2(-d.z) / (2.0 * PI) + 0.5).rem_euclid(1.0), d.y.acos() / PI);
        let (x, y) = ((u * 8.0) as usize % 8, ((v * 8.0) as usize).min(3));
        counts[y * 8 + x] += 1.0;
    }
    for (at, expected) in expected.iter_mut().enumerate() {
        let (x, y) = (at as u32 % 8, at as u32 / 8);
        // Within a texel the density is even in u and v: the mean of sin(t) cos(t) over sin(t) is that of cos(t).
        let cosine =
            (0..64).map(|k| (PI * (f64::from(y) + (f64::from(k) + 0.5) / 64.0) / 8.0).cos()).sum::<f64>() / 64.0;
        *expected = texel_share(x, y, &radiance) * cosine;
    }
    let all: f64 = expected.iter().sum();
    expected.iter_mut().for_each(|e| *e *= stored.len() as f64 / all);
    lab.found("sky: photons", stored.len() as f64, 1000.0, Within::AtLeast);
    lab.found("sky: chi-square", chi_square(&counts, &expected), limit(31.0), Within::AtMost);
    Ok(())
}

/// Importance of a texel: its radiance, smoothed by 1/8, 3/4, 1/8 along both axes as the sampler says, times its solid
/// angle.
fn texel_share(x: u32, y: u32, radiance: &dyn Fn(u32, u32) -> f32) -> f64 {
    let along = |y: u32| {
        let at = |x: u32| f64::from(radiance(x % 8, y));
        0.125 * (at(x + 7) + at(x + 1)) + 0.75 * at(x)
    };
    let smooth = 0.125 * (along(y.saturating_sub(1)) + along((y + 1).min(7))) + 0.75 * along(y);
    let row = |y: u32| (PI * f64::from(y) / 8.0).cos();
    smooth * (row(y) - row(y + 1))
}

/// One texel has 1e8 times the radiance of all others; and a sky that is black.
fn of_hot_sky(lab: &mut Lab, count: u32) -> Result<()> {
    let hot = sky(16, 8, |x, y| if (x, y) == (5, 2) { 1e8 } else { 1.0 });
    let stored = photons(lab, &under_sky(hot), count)?;
    let inside = |d: DVec3| {
        let (u, v) = ((d.x.atan2(-d.z) / (2.0 * PI) + 0.5).rem_euclid(1.0), d.y.acos() / PI);
        (u * 16.0 - 5.5).abs() < 1.6 && (v * 8.0 - 2.5).abs() < 1.6
    };
    let part = stored.iter().filter(|p| inside(-direction(p))).count() as f64 / stored.len() as f64;
    lab.found("sky with a hot texel: photons from it and its neighbours", part, 0.9999, Within::AtLeast);
    let black = under_sky(sky(16, 8, |_, _| 0.0));
    let shot = lab.shot(&black, &Settings { read_photons: true, ..settings(4, 4, 1_000) }, 0..1)?;
    lab.found("black sky: photons", shot.statistics.photons as f64, 0.0, Within::Exact);
    lab.found("black sky: lights", f64::from(shot.lights), 0.0, Within::Exact);
    lab.found("black sky: radiance", shot.mean(""), 0.0, Within::Exact);
    Ok(())
}

/// A beam from above on a patch in the middle of a sphere: where its photons go after one reflection.
fn of_surfaces(lab: &mut Lab, count: u32) -> Result<()> {
    for (name, roughness) in [("Lambert", None), ("GGX 0.5", Some(0.5f64)), ("GGX 1", Some(1.0))] {
        let material = roughness.map_or(Material::lambert([1.0; 3]), |r| Material::metal([1.0; 3], r as f32));
        let light = Light::Spot {
            position: [0.0, 1.0, 0.0],
            direction: [0.0, -1.0, 0.0],
            intensity: [1.0; 3],
            inner_angle: 1e-2,
            outer_angle: 1.01e-2,
        };
        let parts = vec![
            (Mesh::disc([0.0; 3], [0.0, 1.0, 0.0], 0.02, 16), material),
            (Mesh::sphere([0.0; 3], 2.0, 64, 128).flipped(), Material::lambert([0.01; 3])),
        ];
        let stored = photons(lab, &Scene::from_parts(parts, vec![light], view()), count / 2)?;
        // The distribution of the polar angle, so that right samples are even.
        let even = move |d: DVec3| {
            let cosine = d.y.clamp(0.0, 1.0);
            let below = match roughness {
                None => 1.0 - cosine * cosine,
                Some(r) => reflected_below(r * r, cosine),
            };
            [azimuth(d.x, d.z), below]
        };
        check_even(lab, name, stored.iter().map(direction).filter(|d| d.y > 0.0).map(even));
    }
    Ok(())
}

/// Part of the light from straight above that a GGX surface sends into polar angles below that of `cosine`. All normals
/// are visible as they are, and tan^2 of half the angle is distributed as t / (t + alpha^2). A photon goes on with a
/// chance of at most 1: the part that is not masked on its way out, times the scales of the lobe for light that is
/// scattered again, whose table has tests of its own.
fn reflected_below(alpha: f64, cosine: f64) -> f64 {
    let a2 = alpha * alpha;
    let scale = |cosine: f64| table::reflection(alpha, Some(cosine)).scale;
    let head_on = scale(1.0);
    let chance = |tan2_half: f64| {
        let c = (1.0 - tan2_half) / (1.0 + tan2_half);
        let lambda = 0.5 * ((1.0 + a2 * (1.0 - c * c) / (c * c)).sqrt() - 1.0);
        (head_on * scale(c.max(0.0)) / (1.0 + lambda)).min(1.0)
    };
    // Midpoints in the distribution of the normals.
    let reached = |tan2: f64| {
        let most = tan2 / (tan2 + a2);
        let at = |k: u32| (f64::from(k) + 0.5) / 200.0 * most;
        let sum: f64 = (0..200).map(|k| chance(a2 * at(k) / (1.0 - at(k)))).sum();
        sum / 200.0 * most
    };
    reached((1.0 - cosine) / (1.0 + cosine)) / reached(1.0)
}

fn poles(lab: &mut Lab) -> Result<()> {
    // Rows of their own radiance; columns too, but for the poles.
    let (width, height) = (8u32, 4u32);
    let value = move |x: u32, y: u32| match y {
        0 => 10.0,
        3 => 20.0,
        _ => 1.0 + x as f32,
    };
    let views: [(&str, [f32; 3], f64); 6] = [
        ("v = 0, up", [0.0, 1.0, 0.0], 10.0),
        ("v = 1, down", [0.0, -1.0, 0.0], 20.0),
        // Between the first and the last column.
        ("u = 0 and 1, +z", [0.0, 0.0, 1.0], 4.5),
        ("u = 0.5, -z", [0.0, 0.0, -1.0], 4.5),
        ("u = 0.75, +x", [1.0, 0.0, 0.0], 6.5),
        ("u = 0.25, -x", [-1.0, 0.0, 0.0], 2.5),
    ];
    for (name, forward, expected) in views {
        let camera = parallel([0.0; 3], forward, [0.0, 0.6, 0.8], 1.0);
        let mut scene = Scene::from_parts(vec![], vec![], camera);
        scene.environment = Some(sky(width, height, value));
        let shot = lab.shot(&scene, &settings(4, 4, 0), 0..1)?;
        lab.found(name, shot.mean(""), expected, Within::Part(1e-4));
    }
    // Poles that alone shine light photons and shadow rays.
    let mut scene = under_sky(sky(width, height, |_, y| if y == 0 { 1.0 } else { 0.0 }));
    scene.cameras = vec![view()];
    let shot = lab.shot(&scene, &settings(8, 8, 4_000), 0..2)?;
    lab.holds("a sky whose pole alone shines gives light", shot.mean("direct") > 0.0);
    Ok(())
}
