//! Every estimator on photons and hits made up here, against the specification in double precision, and where it is
//! hard.

use nephroid::low_level::graph::{Buf, DeviceClass, Graph};
use nephroid::low_level::kernels::deposits::Deposits;
use nephroid::low_level::kernels::gather::hash::{Options as HashOptions, hash, hash_grid};
use nephroid::low_level::kernels::gather::reference::{Disc, density, gather, lambert_hit};
use nephroid::low_level::kernels::gather::{
    Amplification, Band, Bounds, MAX_NEIGHBOURS, Points, Program, Shape, Weight, bounds, brute, bvh, knn, knn_map,
    tiled,
};
use nephroid::low_level::kernels::generated::EyeHit;
use nephroid::low_level::kernels::lbvh;
use nephroid::low_level::kernels::photon;

use crate::support::gather::{Light, difference, gathered_at, gathered_on, lambert, room};
use crate::support::harness::Harness;
use crate::support::proof;
use crate::support::random::Random;
use crate::support::view::View;

type At<'a> = (Points<'a>, Band<'a>);
type Gather = fn(&mut Graph, Program, At<'_>, &mut Deposits, &mut Buf<[f32; 4]>);

/// All estimators.
const ESTIMATORS: &[(&str, Gather)] = &[
    ("brute", by_brute),
    ("bvh", by_bvh),
    ("hash", by_hash),
    ("tiled", by_tiled),
    ("bounds25d", by_polygons),
    ("bounds3d", by_icosahedra),
];

fn by_tiled(g: &mut Graph, program: Program, at: At<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let mut touched = g.buffer("touched", deposits.photons.len());
    g.fill(&mut touched, 0);
    tiled(g, program, at, (deposits, None, &mut touched), target);
}

fn by_hash(g: &mut Graph, program: Program, (points, _): At<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let grid = hash_grid(g, deposits, HashOptions::default(), None);
    hash(g, program, points, (&grid, deposits), target);
}

fn by_polygons(g: &mut Graph, program: Program, at: At<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let drawn = Bounds { shape: Shape::Polygon(8), amplification: Amplification::Vertex };
    bounds(g, (program, drawn), at, (&deposits.photons, &deposits.count), target);
}

fn by_icosahedra(g: &mut Graph, program: Program, at: At<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let drawn = Bounds { shape: Shape::Icosahedron, amplification: Amplification::Geometry };
    bounds(g, (program, drawn), at, (&deposits.photons, &deposits.count), target);
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
    ESTIMATORS.iter().filter(|(name, _)| !harness.fails_to_draw() || !name.starts_with("bounds")).map(one).collect()
}

#[test]
fn estimators_equal_the_specification() {
    let harness = Harness::lock();
    let (discs, hits) = room(3000, 400, |r| [0.02 + 0.1 * r.unit(), 0.02 + 0.1 * r.unit()]);
    for weight in [Weight::Cone, Weight::Epanechnikov] {
        compare(&harness, &hits, &discs, weight, 2e-5);
    }
    // A constant kernel ends at an edge; points within rounding of one may fall on either side, so these are few.
    let (discs, hits) = room(500, 200, |_| [0.05, 0.05]);
    let lights = compare(&harness, &hits, &discs, Weight::Constant, 2e-5);
    let accepted: f32 = lights[0].iter().map(|light| light[1][3]).sum();
    assert!(accepted > 200.0, "{accepted} pairs are too few for a comparison");
    proof::by(
        gather,
        &[
            "gather_brute",
            "gather_bvh",
            "gather_hash",
            "gather_tiled",
            "tiled_bounds",
            "tiled_cover",
            "tiled_fill",
            "tiled_levels",
            "tiled_mark",
            "tiled_ranges",
        ],
    );
}

#[test]
fn radii_from_dust_to_the_room() {
    let harness = Harness::lock();
    let radius = |r: &mut Random| [1e-4f32.powf(r.unit()), 1e-4f32.powf(r.unit())];
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
    // Other tests compare the two classes.
    let class = DeviceClass::Cpu;
    // Bounds have a test of their own, tests/kernels/bounds.rs.
    for (name, estimator) in ESTIMATORS.iter().filter(|(name, _)| !name.starts_with("bounds")) {
        let found = gathered_on(&harness, (&view, class), (&hits, &discs), |g, points, deposits, target| {
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
    proof::by_answer(&["gather_unfinished"]);
}

/// Photons behind the camera, at it, across its plane, larger than the image; both projections; images of odd sizes and
/// of one pixel, cut into bands that begin anywhere.
#[test]
fn cameras_among_the_photons() {
    let harness = Harness::lock();
    let (mut discs, hits) = room(600, 0, |r| [0.02 + 0.3 * r.unit(), 0.02 + 0.3 * r.unit()]);
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
            .take(if view.camera.width == 1 { 3 } else { 60 })
            .collect();
        assert!(hits.len() >= 3, "{} hits", hits.len());
        compare_in(&harness, &view, (&hits, &discs), Weight::Epanechnikov, 2e-5);
    }
}

fn by_knn(g: &mut Graph, program: Program, (points, _): At<'_>, deposits: &mut Deposits, target: &mut Buf<[f32; 4]>) {
    let map = knn_map(g, deposits, program.loop_limit.is_none());
    knn(g, (program, MAX_NEIGHBOURS), points, (&map, deposits), target);
}

/// Case 32 of the extreme cases: photons of radius 1 over an extent of 1e13, and hits at them, by every estimator. The
/// camera is among them, or so far above that it sees them all.
#[test]
fn case_32_extent_over_radius_of_1e13() {
    let harness = Harness::lock();
    let mut random = Random(32);
    let mut discs = Vec::new();
    for scale in [1e13f32, 1e10, 1e7, 1e4, 10.0] {
        for _ in 0..200 {
            let position = [scale * (2.0 * random.unit() - 1.0), 0.0, scale * (2.0 * random.unit() - 1.0)];
            let disc = Disc {
                position,
                normal: [0.0, 1.0, 0.0],
                radii: [1.0, 1.0],
                flux: [random.unit(), 1.0, 0.5],
                direction: [0.0, -1.0, 0.0],
                caustic: false,
            };
            discs.extend([disc, Disc { flux: [0.5, 1.0, 2.0], caustic: true, ..disc }]);
        }
    }
    let all: Vec<EyeHit> = discs.iter().map(|d| lambert_hit(d.position, d.normal, [1.0; 3])).collect();
    let mut above = View::new([0.0, 3.0, 0.0], [0.0; 3], 1.57, [64, 64]).orthographic();
    (above.camera.right, above.camera.up) = ([1e13, 0.0, 0.0], [0.0, 0.0, -1e13]);
    let among = View::new([0.0, 5.0, 0.0], [0.0, 4.5, -1.0], 1.2, [48, 48]);
    for (name, view) in [("above", above), ("among", among)] {
        let seen = |hit: &&EyeHit| view.pixel([hit.a[0], hit.a[1], hit.a[2]].map(f32::from_bits)).is_some();
        // From far above most hits share a pixel, and a frame has one at most in each: few do.
        let hits: Vec<EyeHit> =
            all.iter().filter(seen).step_by(if name == "above" { 41 } else { 7 }).copied().collect();
        assert!(hits.len() > 40, "{name}: {} hits", hits.len());
        let wanted = expected(&hits, &discs, Weight::Epanechnikov);
        let program = lambert(&harness, Weight::Epanechnikov);
        for (estimator, gather) in ESTIMATORS.iter().copied().chain([("knn", by_knn as Gather)]) {
            let found = gathered_at(&harness, &view, (&hits, &discs), |g, at, deposits, target| {
                gather(g, program, at, deposits, target);
            });
            assert_eq!(difference(&found, &wanted, 1e-6), None, "{name}, {estimator}");
        }
    }
}

/// Case 38: at the edge of a uniformly lit plane half of the light is missing, one radius inside nothing, by every
/// estimator and however large the radius is.
#[test]
fn case_38_edge_of_a_lit_plane() {
    const PHOTONS: u32 = 8_000;
    let harness = Harness::lock();
    let view = View::new([0.5, 1.5, 0.5], [0.5, 0.0, 0.5], 0.7, [64, 64]);
    for radius in [0.1f32, 0.06] {
        // The additive recurrence of the plastic number: as even as a grid, without its rows.
        let disc = |i: u32| Disc {
            position: [
                (f64::from(i) * 0.754_877_666_246_693).fract() as f32,
                0.0,
                (f64::from(i) * 0.569_840_290_998_053).fract() as f32,
            ],
            normal: [0.0, 1.0, 0.0],
            radii: [radius, radius],
            flux: [1.0 / PHOTONS as f32; 3],
            direction: [0.0, -1.0, 0.0],
            caustic: false,
        };
        let discs: Vec<Disc> = (0..PHOTONS).map(disc).collect();
        let row = |x: f32| (1..10).map(move |k| lambert_hit([x, 0.0, 0.1 * k as f32], [0.0, 1.0, 0.0], [1.0; 3]));
        let hits: Vec<EyeHit> = [0.0, 0.5 * radius, 1.05 * radius, 0.5].into_iter().flat_map(row).collect();
        let program = lambert(&harness, Weight::Epanechnikov);
        for (estimator, gather) in ESTIMATORS.iter().copied().chain([("knn", by_knn as Gather)]) {
            let found = gathered_at(&harness, &view, (&hits, &discs), |g, at, deposits, target| {
                gather(g, program, at, deposits, target);
            });
            let light: Vec<f32> = found.iter().map(|light| light[1][0]).collect();
            let mean: Vec<f32> = light.chunks(9).map(|row| row.iter().sum::<f32>() / 9.0).collect();
            println!("{estimator}, radius {radius}: {mean:.3?}");
            // The second row is half a radius inside, where it lacks what lies beyond a chord.
            for (found, expected) in mean.iter().zip([0.5, 0.0, 1.0, 1.0]).filter(|(_, expected)| *expected > 0.0) {
                assert!((found / expected - 1.0).abs() < 0.05, "{estimator}, radius {radius}: {mean:?}");
            }
            assert!(mean[1] > 0.7 && mean[1] < 0.95, "{estimator}, radius {radius}: {mean:?}");
            let worst = light[18..].iter().map(|x| (x - 1.0).abs()).fold(0.0, f32::max);
            assert!(worst < 0.05, "{estimator}, radius {radius}: a point is off by {worst}");
        }
    }
}
