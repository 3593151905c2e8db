//! What the measurements count.

use nephroid::bench::blobs;
use nephroid::graph::Runtime;
use nephroid::render::{Session, Settings, Statistics};

use crate::support::device::runtime;

/// Renders two passes of the measured scene; counts pairs if told to.
fn render(runtime: &Runtime, count_pairs: bool) -> (nephroid::picture::image::Picture, Statistics) {
    let settings = Settings { width: 24, height: 16, photons: Some(5000), count_pairs, ..Settings::default() };
    let mut session = Session::new(runtime, blobs(8, 16), settings).expect("a session");
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
