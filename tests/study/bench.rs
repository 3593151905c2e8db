//! What the measurements count.

use nephroid::low_level::bench::blobs;
use nephroid::low_level::graph::{Graph, Grid, Runtime};
use nephroid::low_level::kernels::generated::{BenchMultiply, BenchMultiplyBindings, BenchMultiplyParams};
use nephroid::low_level::render::{Method, Session, Settings, Statistics};

use crate::support::device::runtime;
use crate::support::proof;

/// Renders two passes of the measured scene; counts pairs if told to.
fn render(runtime: &Runtime, count_pairs: bool) -> (nephroid::low_level::picture::image::Picture, Statistics) {
    let settings =
        Settings { width: 24, height: 16, photons: Some(5000), count_pairs, ..Settings::of(Method::Photons) };
    let mut session = Session::new(runtime.device(), blobs(8, 16), settings).expect("a session");
    for index in 0..2 {
        session.run_pass(index).expect("a pass");
    }
    (session.picture().expect("a picture"), session.statistics().expect("counts"))
}

#[test]
fn counting_pairs_changes_no_pixel_and_finds_both_kinds() {
    let runtime = runtime();
    let (counted, with) = render(&runtime, true);
    let (plain, without) = render(&runtime, false);
    assert_eq!(counted, plain);
    assert!(with.pairs_accepted > 0 && with.pairs_accepted < with.pairs_tested, "{with:?}");
    // A hit meets a photon at most once.
    assert!(with.pairs_tested <= with.deposits * 24 * 16, "{with:?}");
    assert_eq!((without.pairs_tested, without.pairs_accepted), (0, 0));
    let other = Statistics { pairs_tested: 0, pairs_accepted: 0, seconds: without.seconds, ..with };
    assert_eq!(other, without, "nothing else is counted differently");
}

/// The kernel that measures multiplications does all of them: each number is the product of a start and 512 factors.
#[test]
fn the_yardstick_multiplies() {
    let (count, factor) = (300u32, 1.001f32);
    let runtime = runtime();
    let mut g = Graph::new();
    let mut products = g.buffer("products", count);
    let params = BenchMultiplyParams { count, factor };
    g.dispatch(BenchMultiply, Grid::Threads(count), params, BenchMultiplyBindings { products: &mut products });
    let readback = g.readback(&products);
    let plan = g.plan().expect("a plan");
    let mut executable = runtime.prepare(&plan).expect("memory");
    executable.run().expect("no validation message");
    proof::ran(&plan.dump());
    let power = f64::from(factor).powi(512);
    for (index, found) in executable.read(&readback).into_iter().enumerate() {
        let starts = (0..8).map(|k| index as f64 + f64::from(k)).sum::<f64>();
        // 512 roundings of half a unit in the last place, and the sums.
        let off = (f64::from(found) / (starts * power) - 1.0).abs();
        assert!(off < 520.0 * 0.5 * f64::from(f32::EPSILON), "item {index}: {found}, not {}", starts * power);
    }
    assert!((power / f64::from(factor) - power).abs() / power > 5e-4, "a factor left out would be noticed");
    proof::by_answer(&["bench_multiply"]);
}
