//! The stochastic walk through lists of photons: what it expects, by theory and on lists made up here.

use nephroid::low_level::graph::{Buf, Graph};
use nephroid::low_level::kernels::deposits::Deposits;
use nephroid::low_level::kernels::gather::hash::Options as HashOptions;
use nephroid::low_level::kernels::gather::reference::{Disc, gather, lambert_hit};
use nephroid::low_level::kernels::gather::{Points, Program, Walk, Weight, brute, bvh, hash, hash_grid};
use nephroid::low_level::kernels::lbvh;
use nephroid::low_level::kernels::photon;

use crate::support::gather::{gathered, lambert};
use crate::support::harness::Harness;

type Gather = fn(&mut Graph, Program, Points<'_>, &mut Deposits, &mut Buf<[f32; 4]>);

/// Estimators that walk.
const WALKERS: &[(&str, Gather)] = &[("brute", by_brute), ("bvh", by_bvh), ("hash", by_hash)];

fn by_brute(g: &mut Graph, program: Program, points: Points<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    brute(g, program, points, (&deposits.photons, &deposits.count), target);
}

fn by_bvh(g: &mut Graph, program: Program, points: Points<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let options = lbvh::Options { leaf_items: 8, fences: program.loop_limit.is_none() };
    let map = photon::map(g, deposits, options, false);
    bvh(g, program, points, (&map, deposits), target);
}

fn by_hash(g: &mut Graph, program: Program, points: Points<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let grid = hash_grid(g, deposits, HashOptions::default(), None);
    hash(g, program, points, (&grid, deposits), target);
}

/// Hits that draw the same numbers.
const TOGETHER: usize = nephroid::low_level::constants::WALK_TOGETHER as usize;

/// Photons around one place, brighter and brighter: what is visited matters.
fn pile(photons: usize) -> Vec<Disc> {
    let disc = |i: usize| Disc {
        position: [0.5, 0.0, 0.5],
        normal: [0.0, 1.0, 0.0],
        radii: [0.25, 0.25],
        flux: [1.0 + (i % 13) as f32, 1.0, 0.5],
        direction: [0.0, -1.0, 0.0],
        caustic: false,
    };
    (0..photons).map(disc).collect()
}

/// Mean over `groups` of hits of the estimate over the truth, and its standard error.
fn relative(harness: &Harness, estimator: Gather, walk: Walk, photons: usize, groups: usize) -> (f64, f64) {
    let discs = pile(photons);
    let hit = lambert_hit([0.55, 0.0, 0.5], [0.0, 1.0, 0.0], [1.0; 3]);
    let stored: Vec<_> = discs.iter().map(|disc| disc.stored().0).collect();
    let truth = gather(&[hit], &stored, Weight::Epanechnikov)[0][1][0];
    let program = Program { walk, ..lambert(harness, Weight::Epanechnikov) };
    let found = gathered(harness, &vec![hit; groups * TOGETHER], &discs, |g, points, deposits, target| {
        estimator(g, program, points, deposits, target);
    });
    let means = found.chunks(TOGETHER).map(|group| group.iter().map(|l| f64::from(l[1][0])).sum::<f64>());
    let ratios: Vec<f64> = means.map(|sum| sum / TOGETHER as f64 / truth).collect();
    let mean = ratios.iter().sum::<f64>() / groups as f64;
    let variance = ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (groups as f64 - 1.0);
    (mean, (variance / groups as f64).sqrt())
}

#[test]
fn expectations_are_those_of_theory() {
    let harness = Harness::lock();
    for (name, estimator) in WALKERS {
        for (k, photons) in [(2, 5), (4, 8), (4, 40)] {
            for ratio in [false, true] {
                let walk = Walk { stride: k * k, ratio };
                let (mean, error) = relative(&harness, *estimator, walk, photons, 12_000);
                let expected = walk.expectation(photons as u32);
                println!("{name}, {walk:?}, {photons} photons: {mean:.4} +- {error:.4}, expected {expected:.4}");
                assert!((mean - expected).abs() < 4.0 * error, "{name}, {walk:?}, {photons} photons: {mean}, {error}");
                // Sensitive enough to tell the two scales apart where they differ.
                let other = Walk { ratio: !ratio, ..walk }.expectation(photons as u32);
                assert!(photons > 8 || (mean - other).abs() > 4.0 * error, "{name}: {mean} could be {other}");
            }
        }
    }
}

/// Several ranges of the brute estimator; and where a driver ends loops, the walk that the tree gives up.
#[test]
fn long_lists() {
    let harness = Harness::lock();
    for (name, estimator) in WALKERS {
        for ratio in [false, true] {
            let walk = Walk { stride: 16, ratio };
            let (mean, error) = relative(&harness, *estimator, walk, 40_000, 24);
            println!("{name}, {walk:?}: {mean:.5} +- {error:.5}");
            assert!(error < 0.01 && (mean - 1.0).abs() < 4.5 * error, "{name}, {walk:?}: {mean}, {error}");
        }
    }
}

#[test]
fn the_ratio_is_the_steadier_one() {
    let harness = Harness::lock();
    let error = |ratio| relative(&harness, by_bvh, Walk { stride: 4, ratio }, 60, 400).1;
    assert!(error(true) < 0.8 * error(false));
}
