//! Every estimator on photons and hits made up here, against the specification in double precision, and where it is hard.

mod gather_support;

use gather_support::support::Harness;
use gather_support::view::View;
use gather_support::{Light, difference, gathered_at, lambert, room};
use nephroid::graph::{Buf, Graph};
use nephroid::kernels::gather::hash::{Options as HashOptions, hash, hash_grid};
use nephroid::kernels::gather::reference::{Disc, density, gather, lambert_hit};
use nephroid::kernels::gather::{Band, Points, Program, Weight, brute, bvh, tiled};
use nephroid::kernels::generated::EyeHit;
use nephroid::kernels::lbvh;
use nephroid::kernels::photon::{self, Deposits};

type At<'a> = (Points<'a>, Band<'a>);
type Gather = fn(&mut Graph, Program, At<'_>, &mut Deposits, &mut Buf<[f32; 4]>);

/// All estimators.
const ESTIMATORS: &[(&str, Gather)] = &[("brute", by_brute), ("bvh", by_bvh), ("hash", by_hash), ("tiled", by_tiled)];

fn by_tiled(g: &mut Graph, program: Program, at: At<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let mut touched = g.buffer("touched", deposits.photons.len());
    g.fill(&mut touched, 0);
    tiled(g, program, at, (deposits, None, &mut touched), target);
}

fn by_hash(g: &mut Graph, program: Program, (points, _): At<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let grid = hash_grid(g, deposits, HashOptions::default(), None);
    hash(g, program, points, (&grid, deposits), target);
}

/// The room from outside.
fn corner() -> View {
    View::new([1.9, 1.6, 2.1], [0.3, 0.3, 0.5], 0.6, [77, 58])
}

fn by_brute(g: &mut Graph, program: Program, (points, _): At<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    brute(g, program, points, (&deposits.photons, &deposits.count), target);
}

fn by_bvh(g: &mut Graph, program: Program, (points, _): At<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let options = lbvh::Options { leaf_items: 8, fences: program.loop_limit.is_none() };
    let map = photon::map(g, deposits, options, false);
    bvh(g, program, points, (&map, deposits), target);
}

fn expected(hits: &[EyeHit], discs: &[Disc], weight: Weight) -> Vec<[[f64; 3]; 2]> {
    let photons: Vec<_> = discs.iter().map(|disc| disc.stored().0).collect();
    gather(hits, &photons, weight)
}

fn compare(harness: &Harness, hits: &[EyeHit], discs: &[Disc], weight: Weight, tolerance: f64) -> Vec<Vec<Light>> {
    compare_in(harness, &corner(), (hits, discs), weight, tolerance)
}

fn compare_in(
    harness: &Harness,
    view: &View,
    (hits, discs): (&[EyeHit], &[Disc]),
    weight: Weight,
    tolerance: f64,
) -> Vec<Vec<Light>> {
    let expected = expected(hits, discs, weight);
    let program = lambert(harness, weight);
    let one = |(name, estimator): &(&str, Gather)| {
        let found = gathered_at(harness, view, (hits, discs), |g, points, deposits, target| {
            estimator(g, program, points, deposits, target);
        });
        assert_eq!(difference(&found, &expected, tolerance), None, "{name}, {weight:?}, {} photons", discs.len());
        found
    };
    ESTIMATORS.iter().map(one).collect()
}

#[test]
fn estimators_equal_the_specification() {
    let harness = Harness::lock();
    let (discs, hits) = room(3000, 400, |r| [0.02 + 0.1 * r.next(), 0.02 + 0.1 * r.next()]);
    for weight in [Weight::Cone, Weight::Epanechnikov] {
        compare(&harness, &hits, &discs, weight, 2e-5);
    }
    // A constant kernel ends at an edge; points within rounding of one may fall on either side, so these are few.
    let (discs, hits) = room(500, 200, |_| [0.05, 0.05]);
    let lights = compare(&harness, &hits, &discs, Weight::Constant, 2e-5);
    let accepted: f32 = lights[0].iter().map(|light| light[1][3]).sum();
    assert!(accepted > 200.0, "{accepted} pairs are too few for a comparison");
}

#[test]
fn radii_from_dust_to_the_room() {
    let harness = Harness::lock();
    let radius = |r: &mut gather_support::Random| [1e-4f32.powf(r.next()), 1e-4f32.powf(r.next())];
    let (discs, hits) = room(2000, 300, radius);
    compare(&harness, &hits, &discs, Weight::Epanechnikov, 2e-5);
}

#[test]
fn few_and_no_photons() {
    let harness = Harness::lock();
    let (discs, hits) = room(3, 70, |_| [0.8, 0.8]);
    for count in [1, 2, 3] {
        compare(&harness, &hits, &discs[..count], Weight::Epanechnikov, 2e-5);
    }
    let (_, hits) = room(0, 5, |_| [0.1, 0.1]);
    let nothing = [Disc { flux: [0.0; 3], ..discs[0] }];
    compare(&harness, &hits, &nothing, Weight::Constant, 0.0);
}

#[test]
fn the_comparison_fails_on_a_lost_photon() {
    let harness = Harness::lock();
    let (mut discs, hits) = room(200, 50, |_| [0.2, 0.2]);
    let covers = |disc: &Disc| hits.iter().any(|hit| density(hit, &disc.stored().0, Weight::Epanechnikov) > 0.1);
    let needed = discs.iter().position(covers).expect("a photon that counts");
    discs.swap(0, needed);
    let program = lambert(&harness, Weight::Epanechnikov);
    let found = gathered_at(&harness, &corner(), (&hits, &discs[1..]), |g, points, deposits, target| {
        by_bvh(g, program, points, deposits, target);
    });
    assert!(difference(&found, &expected(&hits, &discs, Weight::Epanechnikov), 2e-5).is_some());
}

/// Case 44 of the extreme cases: a million photons at one place are all counted, also where drivers end long loops.
#[test]
fn a_million_photons_at_one_place() {
    const MILLION: usize = 1_000_000;
    let harness = Harness::lock();
    let disc = Disc {
        position: [0.5, 0.0, 0.5],
        normal: [0.0, 1.0, 0.0],
        radii: [0.25, 0.25],
        flux: [1.0, 2.0, 0.5],
        direction: [0.0, -1.0, 0.0],
        caustic: false,
    };
    let discs = vec![disc; MILLION];
    let hits = [[0.5, 0.0, 0.5], [0.6, 0.0, 0.5], [0.9, 0.0, 0.5]].map(|p| lambert_hit(p, [0.0, 1.0, 0.0], [1.0; 3]));
    let program = lambert(&harness, Weight::Constant);
    let view = View::new([0.5, 1.0, 0.5], [0.5, 0.0, 0.5], 0.5, [19, 11]);
    let one = expected(&hits, &discs[..1], Weight::Constant);
    for (name, estimator) in ESTIMATORS {
        let found = gathered_at(&harness, &view, (&hits, &discs), |g, points, deposits, target| {
            estimator(g, program, points, deposits, target);
        });
        let accepted: Vec<f32> = found.iter().map(|light| light[1][3]).collect();
        assert_eq!(accepted, [1e6, 1e6, 0.0], "{name}");
        // A sum of a million equal floats, in partial sums of 16384 or fewer at best and one by one at worst.
        for (found, one) in found.iter().zip(&one) {
            let (found, all) = (f64::from(found[1][0]), one[1][0] * MILLION as f64);
            assert!((found - all).abs() <= 0.02 * all, "{name}: {found}, not {all}");
        }
    }
}

/// Photons behind the camera, at it, across its plane, larger than the image; both projections; images of odd sizes and of one
/// pixel, cut into bands that begin anywhere.
#[test]
fn cameras_among_the_photons() {
    let harness = Harness::lock();
    let (mut discs, hits) = room(600, 0, |r| [0.02 + 0.3 * r.next(), 0.02 + 0.3 * r.next()]);
    assert!(hits.is_empty());
    let eye = [0.6, 0.01, 0.5];
    discs.extend([0.05, 0.6, 40.0].map(|r| Disc { position: eye, radii: [r, r], normal: [0.0, 1.0, 0.0], ..discs[0] }));
    let inside = |size| View::new(eye, [0.0, 0.02, 0.5], 0.9, size);
    let above = |size| View::new([0.5, 0.7, 0.5], [0.5, 0.0, 0.5], 0.6, size).orthographic();
    for view in [inside([37, 21]), inside([37, 21]).cut(5), above([16, 30]), above([9, 7]).cut(3), above([1, 1])] {
        let hits: Vec<EyeHit> = room(0, 3000, |_| [0.1; 2])
            .1
            .into_iter()
            .filter(|hit| view.pixel([hit.a[0], hit.a[1], hit.a[2]].map(f32::from_bits)).is_some())
            .take(if view.camera.width == 1 { 3 } else { 150 })
            .collect();
        assert!(hits.len() >= 3, "{} hits", hits.len());
        compare_in(&harness, &view, (&hits, &discs), Weight::Epanechnikov, 2e-5);
    }
}
