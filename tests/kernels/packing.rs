//! Packed photons, by every estimator that has them, against the specification of full ones: what is lost is precision,
//! never light.

use nephroid::low_level::graph::{Buf, DeviceClass, Graph};
use nephroid::low_level::kernels::deposits::Deposits;
use nephroid::low_level::kernels::gather::hash::{HASH_BITS, LEVELS, Options, hash, hash_grid};
use nephroid::low_level::kernels::gather::reference::{Disc, gather};
use nephroid::low_level::kernels::gather::{Band, Points, Program, Weight, bvh, tiled};
use nephroid::low_level::kernels::generated::EyeHit;
use nephroid::low_level::kernels::lbvh;
use nephroid::low_level::kernels::photon;
use nephroid::low_level::kernels::records::{self, Record};

use crate::support::gather::{Light, difference, gathered, gathered_on, lambert, room};
use crate::support::harness::Harness;
use crate::support::proof;
use crate::support::random::Random;
use crate::support::view::View;

type At<'a> = (Points<'a>, Band<'a>);
type Gather = fn(&mut Graph, Program, At<'_>, &mut Deposits, (Record, &mut Buf<[f32; 4]>));

/// The estimators that have records, and how far these move a photon along an axis at most, in its radii, with a single
/// radius of 0.1 and `corner`: half of 1/1023 of a cell, which is 2.04 radii wide, or of a tile with 1.12 radii around
/// it. The tile is the whole room at worst, because a photon that needs many tiles goes up.
const PACKED: &[(&str, Gather, Record, f64)] = &[
    ("bvh", by_bvh, Record::Packed20, 0.0),
    ("hash", by_hash, Record::Packed20, 0.0),
    ("tiled", by_tiled, Record::Packed20, 0.0),
    ("hash", by_hash, Record::Packed12, 2.04 / 2046.0),
    ("tiled", by_tiled, Record::Packed12, 12.24 / 2046.0),
];

fn by_bvh(
    g: &mut Graph,
    program: Program,
    (points, _): At<'_>,
    deposits: &mut Deposits,
    (record, target): (Record, &mut Buf<[f32; 4]>),
) {
    assert_eq!(record, Record::Packed20);
    let options = lbvh::Options { leaf_items: 8, fences: program.loop_limit.is_none() };
    let map = photon::map(g, deposits, options, true);
    bvh(g, program, points, (&map, deposits), target);
}

fn by_hash(
    g: &mut Graph,
    program: Program,
    (points, _): At<'_>,
    deposits: &mut Deposits,
    (record, target): (Record, &mut Buf<[f32; 4]>),
) {
    let packed = records::pack(g, deposits, record);
    let grid = hash_grid(g, deposits, Options::default(), packed.as_ref());
    hash(g, program, points, (&grid, deposits), target);
}

fn by_tiled(
    g: &mut Graph,
    program: Program,
    at: At<'_>,
    deposits: &mut Deposits,
    (record, target): (Record, &mut Buf<[f32; 4]>),
) {
    let mut touched = g.buffer("touched", deposits.photons.len());
    g.fill(&mut touched, 0);
    let packed = records::pack(g, deposits, record);
    tiled(g, program, at, (deposits, packed.as_ref(), &mut touched), target);
}

/// The room from outside.
fn corner() -> View {
    View::new([1.9, 1.6, 2.1], [0.3, 0.3, 0.5], 0.6, [77, 58])
}

/// A room without boundaries: places in records are rounded, and so may pass one.
fn open_room(photons: usize, hits: usize, radius: impl Fn(&mut Random) -> [f32; 2]) -> (Vec<Disc>, Vec<EyeHit>) {
    let (discs, mut hits) = room(photons, hits, radius);
    hits.iter_mut().for_each(|hit| hit.e = [0; 4]);
    (discs, hits)
}

fn expected(hits: &[EyeHit], discs: &[Disc]) -> Vec<[[f64; 3]; 2]> {
    let photons: Vec<_> = discs.iter().map(|disc| disc.stored().0).collect();
    gather(hits, &photons, Weight::Epanechnikov)
}

/// Gathered by an estimator from its records, on graphs for a kind of device.
fn packed(harness: &Harness, class: DeviceClass, by: (Gather, Record), hits: &[EyeHit], discs: &[Disc]) -> Vec<Light> {
    let program = lambert(harness, Weight::Epanechnikov);
    gathered_on(harness, (&corner(), class), (hits, discs), |g, at, deposits, target| {
        by.0(g, program, at, deposits, (by.1, target));
    })
}

/// Pairs of hit and photon that count.
fn pairs(hits: &[EyeHit], discs: &[Disc]) -> f64 {
    use nephroid::low_level::kernels::gather::reference::density;
    let photons: Vec<_> = discs.iter().map(|disc| disc.stored().0).collect();
    let of = |hit| photons.iter().filter(|p| density(hit, p, Weight::Constant) > 0.0).count();
    hits.iter().map(of).sum::<usize>() as f64
}

#[test]
fn packed_photons_are_close() {
    let harness = Harness::lock();
    // One radius is kept exactly, and the axes' directions are.
    let (discs, hits) = open_room(3000, 300, |_| [0.1, 0.1]);
    let (wanted, counted) = (expected(&hits, &discs), pairs(&hits, &discs));
    assert!(counted > 5000.0, "{counted} pairs are too few for a comparison");
    for &(name, by, record, moved) in PACKED {
        for class in [DeviceClass::Cpu, DeviceClass::Gpu] {
            let what = format!("{name}, {record:?}, {class:?}");
            let found = packed(&harness, class, (by, record), &hits, &discs);
            // Half a step of flux, 2^-8 of it at most; and what the kernel 2 (1 - r^2), one in the mean, changes by
            // over the way.
            let tolerance = 2f64.powi(-8) + 4.0 * 2f64.sqrt() * moved;
            assert_eq!(difference(&found, &wanted, tolerance), None, "{what}");
            assert!(difference(&found, &wanted, 1e-5).is_some(), "{what}: nothing was packed");
            let accepted: f64 = found.iter().map(|light| f64::from(light[1][3])).sum();
            // Photons at an edge come in and go out: as many, but for chance.
            let off = (accepted / counted - 1.0).abs();
            println!("{what}: {accepted} pairs, of {counted}");
            assert!(off < if moved > 0.0 { 2e-3 } else { 1e-4 }, "{what}: {accepted} pairs, not {counted}");
        }
    }
    proof::by_answer(&["hash_pack", "photon_pack", "photon_radii", "photon_sort_records", "tiled_pack"]);
}

/// Radii over one and two decades, each within half of a step of the logarithm: what all hits see together stays. In
/// the tiles of this view, places move by up to 0.0006: a third of the smallest radii of two decades, whose sum is then
/// left to chance.
#[test]
fn packed_radii_keep_the_light() {
    let harness = Harness::lock();
    for smallest in [0.1f32, 0.01] {
        let (discs, hits) = open_room(3000, 4000, |r| [0.2 * smallest.powf(r.unit()); 2]);
        let all: f64 = expected(&hits, &discs).iter().flatten().map(|l| l[0]).sum();
        for &(name, by, record, moved) in PACKED.iter().filter(|p| smallest > 0.05 || p.3 < 0.002) {
            let found = packed(&harness, DeviceClass::Cpu, (by, record), &hits, &discs);
            let found: f64 = found.iter().flatten().map(|l| f64::from(l[0])).sum();
            println!("{name}, {record:?}, moved by {moved}: {:+.3} %", 100.0 * (found / all - 1.0));
            assert!((found / all - 1.0).abs() < 0.005, "{name}, {record:?}: {found}, not {all}");
        }
    }
}

/// Cells that share a key: places relative to one cell must not count in another, and each photon counts once.
#[test]
fn cells_that_share_a_key_keep_apart() {
    let harness = Harness::lock();
    let program = lambert(&harness, Weight::Epanechnikov);
    let size = |r: &mut Random| [0.02 + 0.1 * r.unit(); 2];
    let (discs, hits) = open_room(2000, 200, size);
    for levels in [LEVELS, 1] {
        let of = |hash_bits| {
            gathered(&harness, &hits, &discs, |g, points, deposits, target| {
                let packed = records::pack(g, deposits, Record::Packed12);
                let grid = hash_grid(g, deposits, Options { levels, hash_bits }, packed.as_ref());
                hash(g, program, points, (&grid, deposits), target);
            })
        };
        let alone = of(HASH_BITS);
        let wanted: Vec<_> = alone.iter().map(|light| light.map(|x| [0, 1, 2].map(|k| f64::from(x[k])))).collect();
        let sum = |lights: &[Light], at: usize| lights.iter().map(|light| f64::from(light[at][3])).sum::<f64>();
        for hash_bits in [1, 3, 6, 9] {
            let shared = of(hash_bits);
            assert_eq!(difference(&shared, &wanted, 1e-5), None, "{levels} levels, {hash_bits} bits");
            assert_eq!(sum(&shared, 1), sum(&alone, 1), "{levels} levels, {hash_bits} bits");
            assert!(hash_bits > 3 || sum(&shared, 0) > 2.0 * sum(&alone, 0), "no keys were shared");
        }
    }
}

/// A photon less is noticed by the same tolerance.
#[test]
fn the_comparison_fails_on_lost_photons() {
    let harness = Harness::lock();
    let (discs, hits) = open_room(300, 100, |_| [0.1, 0.1]);
    let wanted = expected(&hits, &discs);
    for &(name, by, record, moved) in PACKED {
        let found = packed(&harness, DeviceClass::Cpu, (by, record), &hits, &discs[20..]);
        let tolerance = 2f64.powi(-8) + 4.0 * 2f64.sqrt() * moved;
        assert!(difference(&found, &wanted, tolerance).is_some(), "{name}, {record:?}");
    }
}
