//! What becomes of a render whose device fails: an error of the right kind, nothing leaked, and passes that are kept.

use std::sync::Arc;

use nephroid::low_level::injection::{Step, arm, disarm};
use nephroid::low_level::vk::Device;
use nephroid::{Error, Film, Method, Result, Session, Settings};

use crate::support::device;
use crate::support::lab::{asset, settings};

fn small() -> Settings {
    Settings { layers: true, ..settings(8, 6, 500) }
}

/// Set-up, two passes, and the film of them; and the session, so that its end is not a part of this.
fn kept(device: &Arc<Device>) -> Result<(Film, Session)> {
    let mut session = Session::new(device, asset("cornell-glass"), small())?;
    session.run_pass(0)?;
    session.run_pass(1)?;
    Ok((session.film()?, session))
}

fn render(device: &Arc<Device>) -> Result<Film> {
    kept(device).map(|(film, _)| film)
}

/// Numbers of the faults to try: all of the first, then fewer and fewer.
fn numbers() -> impl Iterator<Item = u64> {
    std::iter::successors(Some(0_u64), |n| Some(n + 1 + n / 8))
}

#[test]
fn every_allocation_may_fail() {
    let _alone = device::alone();
    let device = device::open();
    let expected = render(&device).expect("no fault");
    let before = device.memory().current;
    let mut faults = 0;
    for number in numbers() {
        arm(Step::Allocate, number);
        let result = render(&device);
        if !disarm() {
            assert!(result.expect("no fault came") == expected, "another film");
            break;
        }
        let error = result.expect_err("the fault is told");
        assert!(matches!(error, Error::OutOfMemory { .. }) && error.exit_code() == 4, "{error}");
        assert_eq!(device.memory().current, before, "fault {number} leaks");
        faults += 1;
    }
    assert!(faults > 20, "{faults}");
    // The device is as good as before.
    assert!(render(&device).expect("no fault") == expected, "another film");
    device.check_validation().expect("no message");
}

#[test]
fn the_device_may_be_lost_at_any_time() {
    let _alone = device::alone();
    for step in [Step::Submit, Step::Wait] {
        let mut faults = 0;
        for number in numbers() {
            let device = Device::open(&device::validated()).expect("a device");
            let log = device.validation_log();
            arm(step, number);
            let result = kept(&device);
            let came = disarm();
            // A session that ends waits once more, when nobody asks any longer.
            let result = result.map(|_| ());
            if !came {
                result.expect("no fault came");
                break;
            }
            let error = result.expect_err("the fault is told");
            assert!(matches!(error, Error::DeviceLost { .. }) && error.exit_code() == 4, "{error}");
            // A device that goes tells what it still holds.
            drop(device);
            log.check().expect("no message");
            faults += 1;
        }
        assert!(faults > 2, "{step:?}: {faults}");
    }
}

/// A pass that finds no memory leaves the film as it was, and can be tried again.
#[test]
fn a_pass_that_fails_leaves_the_film() {
    let _alone = device::alone();
    let device = device::open();
    let expected = render(&device).expect("no fault");
    let mut session = Session::new(&device, asset("cornell-glass"), small()).expect("a session");
    session.run_pass(0).expect("a pass");
    let film = session.film().expect("a film");
    session.reset();
    arm(Step::Allocate, 0);
    let result = session.run_pass(0);
    if disarm() {
        assert!(matches!(result, Err(Error::OutOfMemory { .. })));
        session.run_pass(0).expect("memory is there again");
    }
    assert!(session.film().expect("a film") == film, "another film");
    session.run_pass(1).expect("a pass");
    assert!(session.film().expect("a film") == expected, "another film");
}

/// A part of a render that has no opening renders one first, to find out whose turn its passes are. Where that fails,
/// the film is as it was, and the pass can be tried again.
#[test]
fn a_rehearsal_that_fails_leaves_the_film() {
    let _alone = device::alone();
    let device = device::open();
    let open = || {
        let settings = Settings { method: Method::Auto, ..small() };
        let mut session = Session::new(&device, asset("cornell-glass"), settings).expect("a session");
        session.run_pass(1).expect("a pass of the opening");
        session
    };
    let (film, late) = (open().film().expect("a film"), 9);
    let mut whole = open();
    whole.run_pass(late).expect("no fault");
    let mut faults = 0;
    for number in 0..3 {
        let mut session = open();
        arm(Step::Allocate, number);
        let result = session.run_pass(late);
        if disarm() {
            assert!(matches!(result, Err(Error::OutOfMemory { .. })), "fault {number}");
            assert!(session.film().expect("a film") == film, "fault {number}: another film");
            assert_eq!(session.statistics().expect("counts").passes, 1, "fault {number}");
            faults += 1;
            session.run_pass(late).expect("memory is there again");
        }
        assert!(
            session.film().expect("a film") == whole.film().expect("a film"),
            "fault {number}: another film at last"
        );
    }
    assert!(faults > 0, "nothing was allocated");
}
