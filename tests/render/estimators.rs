//! Whole renders with every estimator: with the same photons, the same picture.
//!
//! `NEPHROID_TEST_DEVICE` and `NEPHROID_VALIDATE` as in the other device tests.

use nephroid::Error;
use nephroid::low_level::graph::DeviceClass;
use nephroid::low_level::render::{Amplification, Estimator, Footprint, Method, Record, Session, Settings, Weight};
use nephroid::low_level::scene::Scene;

use crate::support::device::runtime;
use crate::support::lab::{self, Shot, asset};
use crate::support::proof;

/// Largest difference of a pixel between estimators, relative to the larger of its value and a thousandth of the mean.
fn difference(a: &Shot, b: &Shot) -> f64 {
    let mean = b.moments.iter().map(|m| m[1]).sum::<f64>() / b.moments.len() as f64;
    let pixel = |(a, b): (&[f64; 9], &[f64; 9])| {
        (0..3).map(|k| (a[k] - b[k]).abs() / b[k].abs().max(1e-3 * mean)).fold(0.0, f64::max)
    };
    a.moments.iter().zip(&b.moments).map(pixel).fold(0.0, f64::max)
}

fn radius(scene: &Scene) -> f32 {
    scene.bounds().expect("triangles").radius()
}

fn settings(estimator: Estimator, scene: &Scene, fraction: f32) -> Settings {
    Settings {
        estimator: Some(estimator),
        // More than any hit of these renders has photons of a class around it: knn is then the others' estimate.
        knn_photons: 512,
        footprint: Footprint::Fixed(fraction * radius(scene)),
        ..lab::settings(48, 36, 6000)
    }
}

/// The scenes of the comparison: diffuse, glass and mirrors, textures and masks, glossy, a lens of water.
const SCENES: [&str; 5] = ["corridors", "cornell-glass", "textured", "glossy", "coffee-cup"];

#[test]
fn constant_radius_gives_what_brute_force_gives() {
    for name in SCENES {
        let scene = asset(name);
        let brute = Shot::take(&scene, &settings(Estimator::Brute, &scene, 0.05), 0..2);
        assert!(brute.statistics.deposits > 500, "{name}: {} deposits", brute.statistics.deposits);
        for estimator in Estimator::ALL.into_iter().filter(|estimator| *estimator != Estimator::Brute) {
            let shot = Shot::take(&scene, &settings(estimator, &scene, 0.05), 0..2);
            let difference = difference(&shot, &brute);
            println!("{name}, {}: {difference:.1e}", estimator.name());
            assert!(difference <= 1e-5, "{name}, {}: {difference:e}", estimator.name());
        }
    }
    proof::by_answer(&["gather_split"]);
}

/// The ways to draw bounds that are not the default.
#[test]
fn bounds_of_all_kinds_give_what_brute_force_gives() {
    for name in ["cornell-glass", "glossy"] {
        let scene = asset(name);
        let brute = Shot::take(&scene, &settings(Estimator::Brute, &scene, 0.03), 0..1);
        for (estimator, bound_vertices, amplification) in [
            (Estimator::Bounds25d, 6, Amplification::Vertex),
            (Estimator::Bounds25d, 18, Amplification::Vertex),
            (Estimator::Bounds25d, 7, Amplification::Geometry),
            (Estimator::Bounds3d, 8, Amplification::Geometry),
        ] {
            let of = Settings { bound_vertices, amplification, ..settings(estimator, &scene, 0.03) };
            let difference = difference(&Shot::take(&scene, &of, 0..1), &brute);
            let what = format!("{name}, {}, {bound_vertices} vertices, {amplification:?}", estimator.name());
            println!("{what}: {difference:.1e}");
            assert!(difference <= 1e-5, "{what}: {difference:e}");
        }
    }
}

/// Bounds leave out most photons and none that counts; most of what is left out is hidden or outside of the picture.
#[test]
fn bounds_test_few_pairs_and_accept_all() {
    let scene = asset("corridors");
    let pairs = |estimator| {
        let of = Settings { count_pairs: true, ..settings(estimator, &scene, 0.01) };
        let statistics = Shot::take(&scene, &of, 0..1).statistics.clone();
        (statistics.pairs_tested, statistics.pairs_accepted)
    };
    let (all, accepted) = pairs(Estimator::Brute);
    assert!(accepted > 100, "{accepted} pairs");
    for estimator in [Estimator::Bounds25d, Estimator::Bounds3d] {
        let (tested, found) = pairs(estimator);
        println!("{}: {tested} pairs tested of {all}, {accepted} accepted", estimator.name());
        assert_eq!(found, accepted, "{}", estimator.name());
        assert!(tested < all / 20, "{}: {tested} pairs tested of {all}", estimator.name());
    }
}

#[test]
fn bounds_out_of_range_are_refused() {
    let scene = asset("cornell-glass");
    for bound_vertices in [0, 5, 19, u32::MAX] {
        let of = Settings { bound_vertices, ..settings(Estimator::Bounds25d, &scene, 0.03) };
        let refused = Session::new(runtime().device(), scene.clone(), of).err().map(|error| error.to_string());
        assert!(refused.as_ref().is_some_and(|text| text.contains("6 to 18")), "{bound_vertices}: {refused:?}");
    }
}

#[test]
fn differentials_give_what_brute_force_gives() {
    for (name, weight) in [("coffee-cup", Weight::Epanechnikov), ("cornell-glass", Weight::Cone)] {
        let scene = asset(name);
        let of =
            |estimator| Settings { footprint: Footprint::Differential, weight, ..settings(estimator, &scene, 0.0) };
        let brute = Shot::take(&scene, &of(Estimator::Brute), 0..2);
        for estimator in Estimator::ALL {
            let difference = difference(&Shot::take(&scene, &of(estimator), 0..2), &brute);
            assert!(difference <= 1e-5, "{name}, {}: {difference:e}", estimator.name());
        }
    }
}

/// Root of the mean squared difference over the mean, of the pixels' green channel.
fn rms(a: &Shot, b: &Shot) -> f64 {
    let n = b.moments.len() as f64;
    let mean = b.moments.iter().map(|m| m[1]).sum::<f64>() / n;
    let squares = a.moments.iter().zip(&b.moments).map(|(a, b)| (a[1] - b[1]).powi(2));
    (squares.sum::<f64>() / n).sqrt() / mean
}

/// The estimators that have records, with the kinds of these.
const PACKED: [(Estimator, Record); 5] = [
    (Estimator::Bvh, Record::Packed20),
    (Estimator::Hash, Record::Packed20),
    (Estimator::Tiled, Record::Packed20),
    (Estimator::Hash, Record::Packed12),
    (Estimator::Tiled, Record::Packed12),
];

/// What packing costs in precision, apart from noise: the same photons, the same radius. The table of ARCHITECTURE.md
/// has the figures.
#[test]
fn packing_adds_a_small_error() {
    for (name, footprint, bound) in [
        ("cornell-glass", Some(0.05), 0.01),
        ("glossy", Some(0.05), 0.02),
        ("coffee-cup", Some(0.05), 0.02),
        ("cornell-glass", None, 0.15), // ellipses become discs, which is most of the 11 %
    ] {
        let scene = asset(name);
        let of = |estimator, record| Settings {
            record,
            fold: false, // rounded places may pass a boundary
            count_pairs: true,
            footprint: footprint.map_or(Footprint::Differential, |f| Footprint::Fixed(f * radius(&scene))),
            ..settings(estimator, &scene, 0.0)
        };
        // Its differences are the largest, and their mean needs more photons.
        let passes = if name == "glossy" { 0..4 } else { 0..2 };
        let full = Shot::take(&scene, &of(Estimator::Bvh, Record::Full), passes.clone());
        for (estimator, record) in PACKED {
            let packed = Shot::take(&scene, &of(estimator, record), passes.clone());
            let (error, energy) = (rms(&packed, &full), packed.mean("") / full.mean("") - 1.0);
            let pairs = packed.statistics.pairs_accepted as f64 / full.statistics.pairs_accepted as f64 - 1.0;
            let what = format!("{name}, {footprint:?}, {}, {record:?}", estimator.name());
            println!(
                "{what}: rms {:.3} %, mean {:+.3} %, pairs {:+.3} %",
                100.0 * error,
                100.0 * energy,
                100.0 * pairs
            );
            assert!(error > 0.0 && error < bound, "{what}: {error}");
            assert!(energy.abs() < 0.1 * bound, "{what}: mean {energy:+}");
            assert!(footprint.is_none() || pairs.abs() < 2e-3, "{what}: pairs {pairs:+}");
        }
    }
}

#[test]
fn records_that_an_estimator_lacks_are_refused() {
    let scene = asset("cornell-glass");
    for estimator in Estimator::ALL {
        for record in [Record::Full, Record::Packed20, Record::Packed12] {
            let has = record == Record::Full || PACKED.contains(&(estimator, record));
            let of = Settings { record, ..settings(estimator, &scene, 0.03) };
            match of.validate_plan(&scene, DeviceClass::Cpu) {
                Ok(()) => assert!(has, "{estimator:?}, {record:?}"),
                Err(Error::Setting { settings, .. }) => {
                    assert!(!has && settings == ["record", "estimator"], "{estimator:?}, {record:?}: {settings:?}");
                }
                Err(other) => panic!("{other}"),
            }
        }
    }
}

#[test]
fn the_comparison_notices_another_radius() {
    let scene = asset("cornell-glass");
    let a = Shot::take(&scene, &settings(Estimator::Brute, &scene, 0.05), 0..1);
    let b = Shot::take(&scene, &settings(Estimator::Bvh, &scene, 0.0501), 0..1);
    assert!(difference(&a, &b) > 1e-3);
    assert_eq!(difference(&a, &a), 0.0);
}

/// The camera of `corridors` sees a small part of its photons: the others must not reach a tile.
#[test]
fn tiles_leave_out_what_is_not_in_view() {
    let scene = asset("corridors");
    let count = |shot: &Shot, name: &str| {
        shot.statistics.structure_counts.iter().find(|(known, _)| *known == name).map_or(0, |(_, count)| *count)
    };
    // Footprints of this size, whatever the default is: the share grows with their area.
    let settings = Settings {
        estimator: Some(Estimator::Tiled),
        width: 64,
        height: 48,
        caustic_smoothing: 1.5,
        global_smoothing: 2.0,
        largest_footprint: 0.03,
        ..Settings::of(Method::Photons)
    };
    let shot = Shot::take(&scene, &settings, 0..1);
    let (touched, stored) = (count(&shot, "photons_in_tiles"), shot.statistics.deposits);
    let share = touched as f64 / stored as f64;
    println!(
        "{touched} of {stored} photons in tiles: {:.1} %; {} entries",
        100.0 * share,
        count(&shot, "tile_entries")
    );
    assert!(share < 0.1 && touched > 1000, "{touched} of {stored}");
    assert!(count(&shot, "tile_entries") >= touched);
    // A footprint as large as the scene is in view wherever it lies.
    let wide = Settings { footprint: Footprint::Fixed(radius(&scene)), photons: Some(2000), ..settings };
    let shot = Shot::take(&scene, &wide, 0..1);
    let (touched, stored) = (count(&shot, "photons_in_tiles"), shot.statistics.deposits);
    assert!(touched * 10 > stored * 3, "{touched} of {stored}");
}
