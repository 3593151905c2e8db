//! Whole renders with a part of the pixels or of the photons, beside those with all.
//!
//! `NEPHROID_TEST_DEVICE` and `NEPHROID_VALIDATE` as in the other device tests.

use nephroid::low_level::render::{Estimator, Sampling, Scale, Session, Settings};
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Camera, Light, Material, Scene};

use crate::support::device::runtime;
use crate::support::lab::{self, Shot, asset, from_above, settings};
use crate::support::proof;

fn stochastic(k: u32) -> Sampling {
    Sampling::Stochastic { k, scale: Scale::Unbiased, filter: false }
}

fn filtered(k: u32) -> Sampling {
    Sampling::Stochastic { k, scale: Scale::Unbiased, filter: true }
}

/// Light of a point by way of a mirror above it, so that photons bring it, as from (0, 1.5, 0), on `parts`; seen from
/// above without perspective, two units in 32 pixels.
fn below_a_mirror(parts: Vec<(Mesh, Material)>, height: f32) -> Scene {
    let ceiling = Mesh::quad([-1.5, 1.0, -1.5], [3.0, 0.0, 0.0], [0.0, 0.0, 3.0]);
    let light = Light::Point { position: [0.0, 0.5, 0.0], intensity: [2.0; 3] };
    let parts = [parts, vec![(ceiling, Material::mirror())]].concat();
    Scene::from_parts(parts, vec![light], from_above([0.0, height, 0.0], 1.0))
}

fn grey(albedo: f32) -> Material {
    Material::lambert([albedo; 3])
}

/// Means over the columns 32 x 32 pixels, without the rows next to the border.
fn columns(shot: &Shot) -> Vec<f64> {
    let red = shot.red("caustic");
    (0..32).map(|x| (4..28).map(|y| red[y * 32 + x]).sum::<f64>() / 24.0).collect()
}

/// Largest relative difference of columns, with the column.
fn worst(found: &[f64], expected: &[f64], range: std::ops::Range<usize>) -> (f64, usize) {
    let of = |x: usize| ((found[x] / expected[x] - 1.0).abs(), x);
    range.map(of).fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a })
}

fn take(scene: &Scene, sampling: Sampling, (passes, photons): (u64, u32)) -> Shot {
    let settings = Settings { sampling, count_pairs: true, ..settings(32, 32, photons) };
    Shot::take(scene, &settings, 0..passes)
}

/// Mean and standard error, over blocks of 8 x 8 pixels, of the difference to `full`, relative to the mean of `full`.
fn bias(shot: &[f64], full: &[f64], width: usize) -> (f64, f64) {
    let mean = full.iter().sum::<f64>() / full.len() as f64;
    let (columns, rows) = (width / 8, full.len() / width / 8);
    let block = |i: usize| {
        let corner = (i / columns) * 8 * width + (i % columns) * 8;
        (0..64).map(|p| shot[corner + p / 8 * width + p % 8] - full[corner + p / 8 * width + p % 8]).sum::<f64>() / 64.0
    };
    let blocks: Vec<f64> = (0..columns * rows).map(|i| block(i) / mean).collect();
    let n = blocks.len() as f64;
    let mean = blocks.iter().sum::<f64>() / n;
    let variance = blocks.iter().map(|b| (b - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// In the mean every estimator that walks gives with one photon in k^2 what it gives with all of them.
#[test]
fn the_stochastic_walk_is_unbiased() {
    let walkers = Estimator::ALL.into_iter().filter(|e| e.walks() && *e != Estimator::Brute);
    let in_glass: Vec<_> = walkers.map(|estimator| ("cornell-glass", estimator)).collect();
    assert_eq!(in_glass.len(), 3);
    for (name, estimator) in in_glass.into_iter().chain([("glossy", Estimator::Bvh)]) {
        let scene = asset(name);
        let take = |sampling| {
            let plain = settings(64, 48, 8000);
            let settings = Settings { sampling, estimator: Some(estimator), count_pairs: true, ..plain };
            let shot = Shot::take(&scene, &settings, 0..16);
            (shot.moments.iter().map(|m| m[1] / 16.0).collect::<Vec<_>>(), shot.statistics.pairs_accepted as f64)
        };
        let (full, all) = take(Sampling::Full);
        let k = if estimator == Estimator::Bvh { 4 } else { 2 };
        let (part, visited) = take(stochastic(k));
        let (mean, error) = bias(&part, &full, 64);
        let what = format!("{name}, {}, k = {k}", estimator.name());
        println!("{what}: {mean:+.5} +- {error:.5}, {:.4} of the pairs", visited / all);
        assert!(error > 0.0 && mean.abs() < 3.5 * error, "{what}: off by {mean}, +- {error}");
        let share = visited / all * f64::from(k * k);
        assert!((share - 1.0).abs() < 0.05, "{what}: {share} of the pairs that it should visit");
        let level = full.iter().sum::<f64>() / full.len() as f64;
        let raised: Vec<f64> = part.iter().map(|x| x + 0.1 * level).collect();
        let (mean, error) = bias(&raised, &full, 64);
        assert!(mean.abs() > 3.5 * error, "{what}: 10 % must be noticed, not {mean} +- {error}");
    }
}

/// Uniform light in a sphere: what is filled equals what is estimated, with as few estimates as the mode promises.
#[test]
fn smooth_light_is_filled_in() {
    let camera = Camera::look_at([0.0; 3], [0.0, -0.5, -1.0], [0.0, 1.0, 0.0], 1.8);
    let sphere = Mesh::sphere([0.0; 3], 2.0, 48, 96).flipped();
    let light = Light::Point { position: [0.9, 0.5, 0.3], intensity: [3.0; 3] };
    let scene = Scene::from_parts(vec![(sphere, grey(0.6))], vec![light], camera);
    let full = take(&scene, Sampling::Full, (8, 60_000));
    for k in [2, 4] {
        let part = take(&scene, Sampling::Regular(k), (8, 60_000));
        let ratio = part.mean("indirect") / full.mean("indirect");
        let pairs = part.statistics.pairs_accepted as f64 / full.statistics.pairs_accepted as f64;
        println!("regular:{k}: mean {ratio:.4}, pairs {pairs:.4}");
        assert!((ratio - 1.0).abs() < 0.01, "regular:{k}: {ratio}");
        // The edge of the image and places without a similar hit cost a little more than 1 / k^2.
        let least = 1.0 / f64::from(k * k);
        assert!(pairs > 0.9 * least && pairs < 1.15 * least, "regular:{k}: {pairs} of the pairs");
        let rms = |shot: &Shot| {
            let errors = shot.red("indirect").into_iter().map(|x| (x / full.mean("indirect") - 1.0).powi(2));
            (errors.sum::<f64>() / 1024.0).sqrt()
        };
        assert!(rms(&part) < 2.0 * rms(&full), "regular:{k}: {} beside {}", rms(&part), rms(&full));
    }
    // The filter removes noise and keeps the mean.
    let spread = |shot: &Shot| {
        let mean = shot.mean("indirect");
        shot.red("indirect").iter().map(|x| (x / mean - 1.0).powi(2)).sum::<f64>()
    };
    let (rough, smooth) = (take(&scene, stochastic(4), (4, 60_000)), take(&scene, filtered(4), (4, 60_000)));
    assert!(spread(&smooth) < 0.5 * spread(&rough), "{} of {}", spread(&smooth), spread(&rough));
    assert!((smooth.mean("indirect") / rough.mean("indirect") - 1.0).abs() < 0.01);
    proof::by_answer(&["sampling_choose", "sampling_filter"]);
}

/// A bright table over a deep floor, with an edge along x = 0.5: no light of the one reaches the other.
#[test]
fn no_leak_across_a_step() {
    let table = Mesh::quad([0.5, 0.0, 1.5], [1.5, 0.0, 0.0], [0.0, 0.0, -3.0]);
    let floor = Mesh::quad([-4.0, -3.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]);
    check_sides(&below_a_mirror(vec![(table, grey(1.0)), (floor, grey(1.0))], 0.25));
    proof::by_answer(&["sampling_fill"]);
}

/// A ridge along x = 0.5: one slope faces the light, the other turns away.
#[test]
fn no_leak_across_a_ridge() {
    let lit = Mesh::quad([-2.0, -2.0, 1.5], [2.5, 2.0, 0.0], [0.0, 0.0, -3.0]);
    let turned = Mesh::quad([0.5, 0.0, 1.5], [2.0, -2.5, 0.0], [0.0, 0.0, -3.0]);
    check_sides(&below_a_mirror(vec![(lit, grey(1.0)), (turned, grey(1.0))], 0.25));
}

/// How far columns leave the range that `full` has on their side of the edge, relative to the value that they pass.
fn leak(found: &[f64], full: &[f64]) -> f64 {
    let side = |range: std::ops::Range<usize>| {
        let low = full[range.clone()].iter().copied().fold(f64::INFINITY, f64::min);
        let high = full[range.clone()].iter().copied().fold(0.0, f64::max);
        range.map(|x| (found[x] / high - 1.0).max(1.0 - found[x] / low)).fold(0.0, f64::max)
    };
    // Column 24 is the first one beyond the edge.
    side(16..24).max(side(24..32))
}

/// On each side of an edge, all light is what full sampling finds somewhere on that side.
fn check_sides(scene: &Scene) {
    let full = columns(&take(scene, Sampling::Full, (12, 100_000)));
    for sampling in [Sampling::Regular(4), filtered(2)] {
        let leak = leak(&columns(&take(scene, sampling, (12, 100_000))), &full);
        println!("{sampling:?}: {leak:.4}");
        assert!(leak < 0.06, "{sampling:?}: a column is {leak} out of its side's range: {full:?}");
    }
    let leaked: Vec<f64> = (0..32).map(|x| 0.7 * full[x] + 0.3 * full[if x < 24 { 24 } else { 23 }]).collect();
    assert!(leak(&leaked, &full) > 0.1, "a leak of a third of the light must be noticed: {full:?}");
}

/// A dark and a bright half of one plane: light is interpolated, not reflectance.
#[test]
fn textures_stay_sharp() {
    let dark = Mesh::quad([-2.0, 0.0, 2.0], [2.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    let bright = Mesh::quad([0.0, 0.0, 2.0], [2.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    let scene = below_a_mirror(vec![(dark, grey(0.2)), (bright, grey(1.0))], 0.25);
    let full = columns(&take(&scene, Sampling::Full, (12, 60_000)));
    for sampling in [Sampling::Regular(3), filtered(2)] {
        let found = columns(&take(&scene, sampling, (12, 60_000)));
        let (difference, at) = worst(&found, &full, 2..30);
        println!("{sampling:?}: {difference:.4} at column {at}");
        assert!(difference < 0.06, "{sampling:?}: column {at} is off by {difference}");
    }
    let shifted: Vec<f64> = (0..32).map(|x| full[(x + 1).min(31)]).collect();
    let (difference, at) = worst(&shifted, &full, 2..30);
    assert!(difference > 0.6, "neighbours at the edge differ by {difference} at {at}");
}

/// A strip one pixel wide, which most passes do not choose: it is estimated wherever nothing like it was.
#[test]
fn thin_things_are_estimated() {
    let strip = Mesh::quad([-0.5, 0.4, 1.5], [0.0625, 0.0, 0.0], [0.0, 0.0, -3.0]);
    let floor = Mesh::quad([-4.0, -3.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]);
    let scene = below_a_mirror(vec![(strip, grey(1.0)), (floor, grey(1.0))], 0.45);
    let full = columns(&take(&scene, Sampling::Full, (12, 60_000)));
    assert!(full[8] > 3.0 * full[7] && full[8] > 3.0 * full[9], "column 8 shows the strip: {:?}", &full[6..11]);
    for k in [4, 16] {
        let found = columns(&take(&scene, Sampling::Regular(k), (12, 60_000)));
        let (difference, _) = worst(&found, &full, 8..9);
        println!("regular:{k}: {difference:.4}");
        assert!(difference < 0.05, "regular:{k}: the strip is off by {difference}");
    }
}

#[test]
fn images_smaller_than_a_block() {
    let floor = Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    let scene = below_a_mirror(vec![(floor, grey(1.0))], 0.25);
    for (width, height) in [(1, 1), (1, 17), (5, 19)] {
        // Some fifteen photons count at a pixel, and in these narrow pictures neighbours see the same ones: with six
        // passes a column differs by 15 % from every second pixel of it, with 40 by 6 %.
        let passes = if height == 17 { 40 } else { 24 };
        let mean = |sampling| {
            let settings = Settings { sampling, ..settings(width, height, 20_000) };
            Shot::take(&scene, &settings, 0..passes).mean("caustic")
        };
        let full = mean(Sampling::Full);
        for (sampling, tolerance) in [(Sampling::Regular(16), 0.1), (Sampling::Regular(2), 0.1), (filtered(2), 0.3)] {
            let ratio = mean(sampling) / full;
            println!("{width} x {height}, {sampling:?}: {ratio:.4}");
            assert!((ratio - 1.0).abs() < tolerance, "{width} x {height}, {sampling:?}: {ratio}");
        }
    }
}

/// Pictures of two bands (134,400 pixels with four slots each), and the same bits every time.
#[test]
fn bands_and_repetition() {
    let floor = Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    let scene = below_a_mirror(vec![(floor, grey(1.0))], 0.25);
    let take = |sampling| Shot::take(&scene, &Settings { sampling, ..settings(400, 336, 20_000) }, 3..5);
    let full = take(Sampling::Full);
    for sampling in [Sampling::Regular(4), filtered(2), stochastic(4)] {
        let part = take(sampling);
        if sampling == filtered(2) {
            lab::assert_same(&take(sampling).bits(), &part.bits(), "a second render");
        }
        let ratio = part.mean("caustic") / full.mean("caustic");
        assert!((ratio - 1.0).abs() < 0.01, "{sampling:?}: {ratio}");
        // The rows around the border of the bands (131,072 pixels: row 327) are as bright as elsewhere.
        let rows = |shot: &Shot| shot.red("caustic")[324 * 400..331 * 400].iter().sum::<f64>();
        assert!((rows(&part) / rows(&full) - 1.0).abs() < 0.05, "{sampling:?}: {}", rows(&part) / rows(&full));
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let scene = asset("cornell");
    let runtime = runtime();
    for sampling in [Sampling::Regular(1), Sampling::Regular(17), stochastic(0), stochastic(1000)] {
        let settings = Settings { sampling, ..settings(8, 8, 1000) };
        let error = Session::new(runtime.device(), scene.clone(), settings).err().expect("an error").to_string();
        assert!(error.contains("expected 2 to 16"), "{error}");
    }
    for estimator in Estimator::ALL.into_iter().filter(|e| !e.walks()) {
        let settings = Settings { sampling: stochastic(2), estimator: Some(estimator), ..settings(8, 8, 1000) };
        let error = Session::new(runtime.device(), scene.clone(), settings).err().expect("an error").to_string();
        assert!(error.contains(estimator.name()) && error.contains("regular sampling"), "{error}");
    }
}
