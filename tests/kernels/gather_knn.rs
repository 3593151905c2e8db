//! The k nearest photons against their specification, and where they are hard to find.

use nephroid::low_level::graph::{Buf, Graph};
use nephroid::low_level::kernels::deposits::Deposits;
use nephroid::low_level::kernels::gather::reference::{Disc, lambert_hit};
use nephroid::low_level::kernels::gather::reference_knn::{self, Found};
use nephroid::low_level::kernels::gather::{Points, Program, Weight, knn, knn_by_digits, knn_map};
use nephroid::low_level::kernels::generated::EyeHit;

use crate::support::gather::{Light, difference, gathered, lambert, room};
use crate::support::harness::Harness;
use crate::support::proof;
use crate::support::random::Random;

type Gather = fn(&mut Graph, (Program, u32), Points<'_>, &Deposits, &mut Buf<[f32; 4]>);

/// By the tree, and by the selection that replaces it where loops would become too long.
const SEARCHES: [(&str, Gather); 2] = [("tree", by_tree), ("digits", knn_by_digits)];

fn by_tree(g: &mut Graph, kernel: (Program, u32), points: Points<'_>, deposits: &Deposits, out: &mut Buf<[f32; 4]>) {
    let map = knn_map(g, deposits, kernel.0.loop_limit.is_none());
    knn(g, kernel, points, (&map, deposits), out);
}

fn expected(hits: &[EyeHit], discs: &[Disc], weight: Weight, k: u32) -> Vec<Found> {
    let photons: Vec<_> = discs.iter().map(|disc| disc.stored().0).collect();
    reference_knn::gather(hits, &photons, weight, k as usize)
}

fn found(harness: &Harness, (hits, discs): (&[EyeHit], &[Disc]), weight: Weight, k: u32, search: Gather) -> Vec<Light> {
    let program = lambert(harness, weight);
    gathered(harness, hits, discs, |g, points, deposits, out| search(g, (program, k), points, deposits, out))
}

/// The first difference in light or in the number of photons that counted.
fn differs(found: &[Light], expected: &[Found], tolerance: f64) -> Option<String> {
    let light: Vec<_> = expected.iter().map(|e| e.light).collect();
    difference(found, &light, tolerance).or_else(|| {
        let mut pairs = found.iter().zip(expected).enumerate();
        pairs
            .find(|(_, (f, e))| f[1][3] != e.accepted as f32)
            .map(|(slot, (f, e))| format!("slot {slot}: {f:?}, {e:?}"))
    })
}

fn compare(harness: &Harness, (hits, discs): (&[EyeHit], &[Disc]), weight: Weight, ks: &[u32]) {
    for &k in ks {
        let expected = expected(hits, discs, weight, k);
        for (name, search) in SEARCHES {
            let found = found(harness, (hits, discs), weight, k, search);
            let difference = differs(&found, &expected, 4e-5);
            assert_eq!(difference, None, "{name}, k = {k}, {weight:?}, {} photons", discs.len());
        }
    }
}

#[test]
fn the_nearest_are_those_of_the_specification() {
    let harness = Harness::lock();
    let (discs, hits) = room(3000, 200, |r| [0.02 + 0.1 * r.unit(), 0.02 + 0.1 * r.unit()]);
    compare(&harness, (&hits, &discs), Weight::Epanechnikov, &[1, 2, 7, 64, 512]);
    compare(&harness, (&hits, &discs), Weight::Cone, &[7]);
    let (discs, hits) = room(2000, 100, |_| [0.3, 0.3]);
    compare(&harness, (&hits, &discs), Weight::Epanechnikov, &[1, 2, 64, 512]);
    proof::by(reference_knn::gather, &["gather_knn", "knn_leaves", "knn_level", "knn_select", "knn_sum"]);
}

#[test]
fn radii_from_dust_to_the_room() {
    let harness = Harness::lock();
    let (discs, hits) = room(2000, 150, |r| [1e-4f32.powf(r.unit()), 1e-4f32.powf(r.unit())]);
    compare(&harness, (&hits, &discs), Weight::Epanechnikov, &[1, 2, 7, 64, 512]);
}

#[test]
fn few_and_no_photons() {
    let harness = Harness::lock();
    let (discs, hits) = room(3, 70, |_| [0.8, 0.8]);
    for count in 1..=3 {
        compare(&harness, (&hits, &discs[..count]), Weight::Epanechnikov, &[1, 2, 64]);
    }
}

#[test]
fn the_comparison_notices_another_k() {
    let harness = Harness::lock();
    let (discs, hits) = room(500, 50, |_| [0.3, 0.3]);
    let eight = expected(&hits, &discs, Weight::Constant, 8);
    let seven = found(&harness, (&hits, &discs), Weight::Constant, 7, by_tree);
    assert!(differs(&seven, &eight, 4e-5).is_some());
}

fn floor(position: [f32; 3], up: f32, radius: f32) -> Disc {
    let (normal, direction) = ([0.0, up, 0.0], [0.0, -up, 0.0]);
    Disc { position, normal, radii: [radius; 2], flux: [1.0, 2.0, 0.5], direction, caustic: false }
}

/// Photons at random on the unit square, seen well inside of it: the mean estimate is the irradiance, whatever k.
#[test]
fn uniform_light_is_estimated_without_bias() {
    const PHOTONS: usize = 40_000;
    let harness = Harness::lock();
    let mut random = Random(11);
    let mut at = |low: f32, size: f32| [low + size * random.unit(), 0.0, low + size * random.unit()];
    let discs: Vec<_> = (0..PHOTONS).map(|_| floor(at(0.0, 1.0), 1.0, 0.2)).collect();
    let hits: Vec<_> = (0..2000).map(|_| lambert_hit(at(0.2, 0.6), [0.0, 1.0, 0.0], [1.0; 3])).collect();
    for (k, weight) in
        [(4, Weight::Constant), (4, Weight::Epanechnikov), (50, Weight::Cone), (50, Weight::Epanechnikov)]
    {
        let found = found(&harness, (&hits, &discs), weight, k, by_tree);
        let mean = found.iter().map(|light| f64::from(light[1][0])).sum::<f64>() / (hits.len() * PHOTONS) as f64;
        // Relative deviation of one estimate is about sqrt(1.4 / k); with k = 4 the (k)-th distance would give 4/3.
        println!("k = {k}, {weight:?}: {mean:.4} of the irradiance");
        assert!((mean - 1.0).abs() < 0.05, "k = {k}, {weight:?}: {mean} of the irradiance");
    }
}

/// Case 44 of the extreme cases: exact among a million photons at one place, and where a million beside the few that
/// count must be looked through one by one, which some drivers' loops are too short for.
#[test]
fn a_million_photons_at_one_place() {
    const MILLION: usize = 1_000_000;
    let harness = Harness::lock();
    let place = [0.5, 0.0, 0.5];
    let hits = [place, [0.6, 0.0, 0.5], [0.9, 0.0, 0.5]].map(|p| lambert_hit(p, [0.0, 1.0, 0.0], [1.0; 3]));
    let mut discs = vec![floor(place, 1.0, 0.25); MILLION];
    let check = |discs: &[Disc], accepted: [f32; 3]| {
        let found = found(&harness, (&hits, discs), Weight::Constant, 200, by_tree);
        assert_eq!(differs(&found, &expected(&hits, discs, Weight::Constant, 200), 4e-5), None);
        assert_eq!([0, 1, 2].map(|slot| found[slot][1][3]), accepted);
    };
    check(&discs, [200.0, 200.0, 0.0]);
    // All but a hundred of them on the other side of a thin floor.
    for (i, disc) in discs.iter_mut().enumerate().filter(|(i, _)| i % 10_000 != 77) {
        *disc = floor([0.5 + 1e-8 * (i % 1000) as f32, 0.0, 0.5], -1.0, 0.25);
    }
    check(&discs, [100.0, 100.0, 0.0]);
}
