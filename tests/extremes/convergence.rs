//! How the error falls with the passes and with the radius: case 24.
//!
//! The scene has an analytic answer whose curvature is smooth: a floor lit by a point light by way of a plane mirror
//! above it. Only the layer of photons is looked at. Discs of one radius for all photons, no guard cuts them.

use std::f64::consts::PI;

use nephroid::low_level::render::{Footprint, Session, Settings};
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Light, Material, Scene};
use nephroid::low_level::study::moments::Moments;

use crate::support::device::runtime;
use crate::support::lab::{from_above, settings};

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
fn measure(footprint: Footprint, photons: u32, (doublings, seeds): (u32, u32)) -> Errors {
    let (scene, answer) = (scene(), answer());
    let passes: Vec<u64> = (0..=doublings).map(|k| 1 << k).collect();
    let mut moments = vec![Moments::default(); passes.len()];
    let mut squared = vec![0.0; passes.len()];
    let runtime = runtime();
    for seed in 0..seeds {
        let settings = Settings {
            footprint,
            seed,
            leaf_photons: Some(8),
            // The mirror and the floor.
            photon_bounces: 2,
            eye_depth: 2,
            ..settings(SIDE, SIDE, photons)
        };
        let mut session = Session::new(runtime.device(), scene.clone(), settings).expect("a session");
        let mut done = 0;
        for (k, &count) in passes.iter().enumerate() {
            (done..count).for_each(|index| session.run_pass(index).expect("a pass without validation message"));
            done = count;
            let picture = session.picture().expect("a picture");
            let found = &picture.layer("caustic").expect("the layer of photons").data;
            moments[k].add(found);
            let squares = found.iter().zip(&answer).map(|(x, r)| f64::from(x - r).powi(2));
            squared[k] += squares.sum::<f64>() / answer.len() as f64 / f64::from(seeds);
        }
        let cut = ["radius_min", "radius_max", "anisotropy"];
        let statistics = session.statistics().expect("counts");
        let fired =
            statistics.counters.iter().filter(|(name, count)| cut.iter().any(|c| name.contains(c)) && *count > 0);
        assert_eq!(fired.count(), 0, "{:?}", statistics.counters);
    }
    let parts: Vec<_> = moments.iter().map(|m| m.absolute(&answer).expect("two seeds")).collect();
    let bias_squared = parts.iter().map(|part| part.bias_squared).collect();
    let variance = parts.iter().map(|part| part.variance).collect();
    Errors { passes, squared, bias_squared, variance }
}

/// Slope of log y over log x by least squares.
fn slope(points: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let points: Vec<(f64, f64)> = points.into_iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |(a, b), p| (a + (p.0 - x) * (p.1 - y), b + (p.0 - x).powi(2)));
    xy / xx
}

fn of(errors: &Errors, values: &[f64]) -> f64 {
    let passes = errors.passes.iter().map(|n| *n as f64);
    slope(passes.zip(values.iter().copied()))
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

/// Case 24, first half: with the exponent 2/3 the squared error falls as N^(-2/3).
///
/// The footprints hold a photon or two. Photons of a pass are stratified, so wider footprints see less noise than
/// independent photons would give, and lose that as they narrow: with ten photons in them the variance falls as N^-0.53
/// over the same passes.
#[test]
fn case_24_error_falls_with_the_passes() {
    let radius = 0.25;
    let errors = measure(Footprint::Density { min: radius, max: radius }, 40, (8, 16));
    let (_, variance) = schedule(&errors.passes);
    let (found, of_variance) = (of(&errors, &errors.squared), of(&errors, &errors.variance));
    let expected = of(&errors, &variance);
    println!("squared error {:?}", errors.squared);
    println!("slope {found:.4}, of the variance {of_variance:.4}, by the schedule {expected:.4}");
    assert!((-0.75..=-0.58).contains(&found), "slope of the squared error: {found}");
    assert!((of_variance - expected).abs() < 0.05, "slope of the variance: {of_variance}, by the schedule {expected}");
}

/// Case 24, the bias alone, where photons are many: it falls as the mean of the squared radii.
#[test]
fn case_24_bias_falls_with_the_passes() {
    let radius = 0.5;
    let errors = measure(Footprint::Density { min: radius, max: radius }, 8_000, (6, 8));
    let (bias, _) = schedule(&errors.passes);
    let (found, expected) = (of(&errors, &errors.bias_squared), of(&errors, &bias));
    println!("bias^2 {:?}, variance {:?}", errors.bias_squared, errors.variance);
    println!("slope {found:.4}, by the schedule {expected:.4}");
    assert!((found - expected).abs() < 0.05, "slope of the squared bias: {found}, by the schedule {expected}");
}

/// Case 24, second half: with a fixed radius the error ends at a bias that grows with the fourth power of the radius,
/// squared.
#[test]
fn case_24_a_fixed_radius_has_a_floor() {
    let radii = [0.25, 0.35, 0.5];
    let errors = radii.map(|radius| measure(Footprint::Fixed(radius as f32), 8_000, (4, 8)));
    for (radius, errors) in radii.iter().zip(&errors) {
        println!("{radius}: {:?}, bias^2 {:?}, variance {:?}", errors.squared, errors.bias_squared, errors.variance);
    }
    let last = errors.iter().map(|errors| errors.bias_squared[errors.passes.len() - 1]);
    let found = slope(radii.into_iter().zip(last));
    println!("slope {found:.4}");
    assert!((3.5..=4.5).contains(&found), "bias^2 grows as r^{found}");
    let floor = &errors[2];
    let fall = of(floor, &floor.squared);
    assert!(fall > -0.3, "the squared error of the widest discs still falls as N^{fall}");
}

#[test]
fn slopes_are_those_of_powers() {
    let power = |exponent: f64| slope([1.0, 2.0, 8.0].map(|x: f64| (x, 3.0 * x.powf(exponent))));
    assert!((power(-2.0 / 3.0) + 2.0 / 3.0).abs() < 1e-12 && (power(4.0) - 4.0).abs() < 1e-12);
    // What a schedule that does not shrink would give is outside of the range.
    assert!(!(-0.75..=-0.58).contains(&power(-1.0)));
}
