//! How the error falls with the passes and with the radius: case 24.
//!
//! The scene has an analytic answer whose curvature is smooth: a floor lit by a point light by way of a plane mirror
//! above it. Only the layer of photons is looked at. Discs of one radius for all photons, no guard cuts them.

use std::f64::consts::PI;

use super::lab::{Lab, Shot, settings};
use super::scenes::from_above;
use super::{Case, Within};
use crate::error::Result;
use crate::fit;
use crate::render::{Footprint, Session, Settings};
use crate::scene::shapes::Mesh;
use crate::scene::{Light, Material, Scene};
use crate::study::moments::Moments;

pub(super) const CASES: &[Case] = &[Case {
    number: 24,
    title: "convergence over passes and radii",
    reason: "squared error as passes^(-2/3) with a = 2/3 (Knaus and Zwicker 2011), slopes of bias and variance as the \
             schedule has them; a fixed radius leaves a squared bias of r^4",
    parameter: Some("passes"),
    run: convergence,
}];

/// Pixels of a side of the image, which shows `2 HALF` units.
const SIDE: u32 = 8;
const HALF: f64 = 0.5;
/// Distance of the light's mirror image from the floor.
const HEIGHT: f64 = 1.0;

fn scene() -> Scene {
    let floor = Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    let mirror = Mesh::quad([-1.0, 0.7, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
    let light = Light::Point { position: [0.0, 0.4, 0.0], intensity: [1.0; 3] };
    let parts = vec![(floor, Material::lambert([1.0; 3])), (mirror, Material::mirror())];
    Scene::from_parts(parts, vec![light], from_above([0.0, 0.2, 0.0], HALF as f32))
}

/// Means of the radiance I h / (h^2 + x^2)^1.5 / pi over the pixels, three channels each, by 16 x 16 points.
fn answer() -> Vec<f32> {
    const POINTS: u32 = 16;
    let step = 2.0 * HALF / f64::from(SIDE * POINTS);
    let at = |i: u32| (f64::from(i) + 0.5) * step - HALF;
    let pixel = |px: u32, py: u32| {
        let points = (0..POINTS * POINTS).map(|k| (at(px * POINTS + k % POINTS), at(py * POINTS + k / POINTS)));
        let sum: f64 = points.map(|(x, z)| HEIGHT / (HEIGHT * HEIGHT + x * x + z * z).powf(1.5) / PI).sum();
        sum / f64::from(POINTS * POINTS)
    };
    (0..SIDE * SIDE).flat_map(|i| [pixel(i % SIDE, i / SIDE) as f32; 3]).collect()
}

/// Error after each number of passes.
struct Errors {
    passes: Vec<u64>,
    /// Mean over seeds and pixels of the squared difference.
    squared: Vec<f64>,
    bias_squared: Vec<f64>,
    variance: Vec<f64>,
}

/// Renders 1, 2, 4 ... 2^`doublings` passes with each of `seeds` seeds.
fn measure(lab: &mut Lab, footprint: Footprint, photons: u32, (doublings, seeds): (u32, u32)) -> Result<Errors> {
    let (scene, answer) = (scene(), answer());
    let passes: Vec<u64> = (0..=doublings).map(|k| 1 << k).collect();
    let mut moments = vec![Moments::default(); passes.len()];
    let mut squared = vec![0.0; passes.len()];
    let device = lab.runtime().device().clone();
    let mut fired = 0;
    for seed in 0..seeds {
        // The mirror and the floor.
        let settings = Settings {
            footprint,
            seed,
            leaf_photons: Some(8),
            photon_bounces: 2,
            eye_depth: 2,
            ..settings(SIDE, SIDE, photons)
        };
        let mut session = Session::new(&device, scene.clone(), settings)?;
        let mut done = 0;
        for (k, &count) in passes.iter().enumerate() {
            (done..count).try_for_each(|index| session.run_pass(index))?;
            done = count;
            let picture = session.picture()?;
            let found = picture.layer("caustic").map_or(&[][..], |layer| &layer.data);
            moments[k].add(found);
            let squares = found.iter().zip(&answer).map(|(x, r)| f64::from(x - r).powi(2));
            squared[k] += squares.sum::<f64>() / answer.len() as f64 / f64::from(seeds);
        }
        let shot = Shot::of(&session)?;
        let guards = ["footprints_raised_to_minimum", "footprints_cut_to_maximum", "footprints_beyond_anisotropy"];
        fired += guards.map(|name| shot.guard(name)).iter().sum::<u64>();
        lab.note(&shot);
    }
    lab.found("footprints that a guard has changed", fired as f64, 0.0, Within::Exact);
    let parts: Vec<_> = moments.iter().filter_map(|m| m.absolute(&answer)).collect();
    let bias_squared = parts.iter().map(|part| part.bias_squared).collect();
    let variance = parts.iter().map(|part| part.variance).collect();
    Ok(Errors { passes, squared, bias_squared, variance })
}

/// Slope of log y over log x by least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    fit::fit(points).map_or(f64::NAN, |fit| fit.exponent)
}

fn of(errors: &Errors, values: &[f64]) -> f64 {
    let passes = errors.passes.iter().map(|n| *n as f64);
    slope(&passes.zip(values.iter().copied()).collect::<Vec<_>>())
}

/// Squared bias and variance after `passes` passes relative to those of the first, as the schedule of radii has it:
/// bias grows with the squared radius, variance falls with it, and the picture is the mean.
fn schedule(passes: &[u64]) -> (Vec<f64>, Vec<f64>) {
    let settings = Settings::default();
    let squared = |index: u64| f64::from(settings.radius_scale(index)).powi(2);
    let mean = |n: u64, f: &dyn Fn(f64) -> f64| (0..n).map(|i| f(squared(i))).sum::<f64>() / n as f64;
    let bias = passes.iter().map(|&n| mean(n, &|s| s).powi(2));
    let variance = passes.iter().map(|&n| mean(n, &|s| 1.0 / s) / n as f64);
    (bias.collect(), variance.collect())
}

fn convergence(lab: &mut Lab) -> Result<()> {
    falls_with_passes(lab)?;
    bias_falls(lab)?;
    fixed_radius(lab)
}

/// The footprints hold a photon or two. Photons of a pass are stratified, so wider footprints see less noise than
/// independent photons would give, and lose that as they narrow: with ten photons in them the variance falls as N^-0.53
/// over the same passes.
fn falls_with_passes(lab: &mut Lab) -> Result<()> {
    let radius = 0.25;
    let work = lab.pick((5, 8), (7, 12));
    let errors = measure(lab, Footprint::Density { min: radius, max: radius }, 40, work)?;
    let (_, variance) = schedule(&errors.passes);
    let (found, of_variance) = (of(&errors, &errors.squared), of(&errors, &errors.variance));
    let first = errors.squared[0];
    for (&passes, squared) in errors.passes.iter().zip(&errors.squared) {
        let expected = first * (passes as f64).powf(-2.0 / 3.0);
        let what = format!("squared error after {passes} passes");
        lab.found(what, *squared, expected, Within::Part(0.5)).at(passes as f64);
    }
    lab.found("slope of the squared error", found, -0.665, Within::Range(0.085)).not(-1.0);
    let expected = of(&errors, &variance);
    lab.found("slope of the variance", of_variance, expected, Within::Range(lab.pick(0.1, 0.05)));
    Ok(())
}

/// The bias alone, where photons are many: it falls as the mean of the squared radii.
fn bias_falls(lab: &mut Lab) -> Result<()> {
    let radius = 0.5;
    let work = lab.pick((4, 3), (5, 6));
    let errors = measure(lab, Footprint::Density { min: radius, max: radius }, 8_000, work)?;
    let (bias, _) = schedule(&errors.passes);
    let (found, expected) = (of(&errors, &errors.bias_squared), of(&errors, &bias));
    lab.found("slope of the squared bias", found, expected, Within::Range(0.05));
    Ok(())
}

/// With a fixed radius the error ends at a bias that grows with the fourth power of the radius, squared.
fn fixed_radius(lab: &mut Lab) -> Result<()> {
    let radii: &[f64] = lab.pick(&[0.3, 0.5], &[0.25, 0.35, 0.5]);
    let (mut points, mut falls) = (vec![], vec![]);
    for &radius in radii {
        let work = lab.pick((2, 4), (3, 6));
        let errors = measure(lab, Footprint::Fixed(radius as f32), 8_000, work)?;
        points.push((radius, errors.bias_squared.last().copied().unwrap_or(f64::NAN)));
        falls.push(of(&errors, &errors.squared));
    }
    lab.found("slope of the squared bias over the radius", slope(&points), 4.0, Within::Range(0.5)).not(2.0);
    let widest = falls.last().copied().unwrap_or(f64::NAN);
    lab.found("slope of the squared error, widest radius", widest, -0.3, Within::AtLeast);
    Ok(())
}
