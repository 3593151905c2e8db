//! Builders of the photon map and sizes of its leaves: the picture does not depend on them.
//!
//! `NEPHROID_TEST_DEVICE` and `NEPHROID_VALIDATE` as in the other device tests.

use nephroid::low_level::graph::Runtime;
use nephroid::low_level::render::{
    Estimator, Method, PhotonBuild, Record, Session, Settings, Statistics, automatic_leaf, coverage,
};
use nephroid::low_level::scene::Scene;

use crate::support::device::runtime;
use crate::support::lab::asset;

fn small(photon_build: PhotonBuild, leaf_photons: Option<u32>) -> Settings {
    Settings { width: 40, height: 30, photons: Some(6000), photon_build, leaf_photons, ..Settings::of(Method::Photons) }
}

fn rendered(runtime: &Runtime, scene: &Scene, settings: Settings) -> Session {
    let mut session = Session::new(runtime.device(), scene.clone(), settings).expect("a session");
    (0..2).for_each(|index| assert!(session.run_pass(index).is_ok()));
    session
}

/// Largest difference of a pixel's sums relative to the pixel.
fn difference(a: &[[f64; 9]], b: &[[f64; 9]]) -> f64 {
    let pixel = |(a, b): (&[f64; 9], &[f64; 9])| {
        let size = a[..3].iter().fold(1e-12f64, |most, x| most.max(x.abs()));
        (0..3).map(|k| (a[k] - b[k]).abs() / size).fold(0.0, f64::max)
    };
    a.iter().zip(b).map(pixel).fold(0.0, f64::max)
}

#[test]
fn both_builders_give_the_same_picture() {
    let runtime = runtime();
    for name in ["cornell", "coffee-cup", "pool"] {
        let scene = asset(name);
        let moments = |settings| rendered(&runtime, &scene, settings).moments().expect("the film");
        let linear = moments(small(PhotonBuild::Linear, None));
        let vvh = moments(small(PhotonBuild::Vvh, None));
        let off = difference(&linear, &vvh);
        println!("{name}: {off:.1e}");
        assert!(off < 1e-5, "{name}: pixels differ by {off}");
        assert_eq!(vvh, moments(small(PhotonBuild::Vvh, None)), "{name}: always the same bits");
        let off = difference(&linear, &moments(small(PhotonBuild::Vvh, Some(1))));
        assert!(off < 1e-5, "{name}, leaves of one photon: pixels differ by {off}");
        let packed = |build| moments(Settings { record: Record::Packed20, ..small(build, None) });
        let off = difference(&packed(PhotonBuild::Linear), &packed(PhotonBuild::Vvh));
        assert!(off < 1e-5, "{name}, packed: pixels differ by {off}");
        let other = moments(Settings { seed: 1, ..small(PhotonBuild::Linear, None) });
        assert!(difference(&linear, &other) > 1e-3, "{name}: the check can fail");
    }
}

#[test]
fn leaves_of_the_linear_build_change_no_bit() {
    let (runtime, scene) = (runtime(), asset("cornell"));
    let moments = |leaf| rendered(&runtime, &scene, small(PhotonBuild::Linear, leaf)).moments().expect("the film");
    let automatic = moments(None);
    for leaf in [1, 3, 16] {
        assert!(moments(Some(leaf)) == automatic, "leaves of {leaf}");
    }
}

/// With one photon in a leaf, exactly the photons whose box holds a point are tested: the trees agree on every box.
#[test]
fn counts_are_those_of_the_linear_build() {
    let (runtime, scene) = (runtime(), asset("coffee-cup"));
    let counts = |build, leaf| {
        let session = rendered(&runtime, &scene, Settings { count_pairs: true, ..small(build, Some(leaf)) });
        Statistics { seconds: 0.0, ..session.statistics().expect("counts") }
    };
    let linear = counts(PhotonBuild::Linear, 1);
    assert_eq!(linear, counts(PhotonBuild::Vvh, 1));
    let more = counts(PhotonBuild::Vvh, 16);
    assert!(linear.pairs_accepted > 0 && more.pairs_tested > linear.pairs_tested, "{more:?}");
    assert_eq!(Statistics { pairs_tested: linear.pairs_tested, ..more }, linear);
}

#[test]
fn the_leaf_size_follows_the_footprints() {
    let (runtime, scene) = (runtime(), asset("cornell"));
    let leaf = |smoothing: f32| {
        let settings = Settings {
            global_smoothing: smoothing,
            caustic_smoothing: smoothing,
            read_photons: true,
            photons: Some(120_000), // enough to overlap thirty times at the largest radius
            ..small(PhotonBuild::Linear, None)
        };
        let mut session = Session::new(runtime.device(), scene.clone(), settings).expect("a session");
        session.run_pass(0).expect("a pass");
        let wanted = automatic_leaf(coverage(&scene, &session.photons()), PhotonBuild::Linear);
        assert_eq!(session.leaf_photons(), Some(wanted), "the survey agrees with the pass");
        wanted
    };
    assert_eq!([leaf(0.3), leaf(3.0)], [8, 16]);
    let brute = Settings { estimator: Some(Estimator::Brute), ..small(PhotonBuild::Vvh, None) };
    assert_eq!(rendered(&runtime, &scene, brute).leaf_photons(), None, "no tree, no leaves");
}
