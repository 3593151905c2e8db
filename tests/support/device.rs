//! The device of the tests.
//!
//! `NEPHROID_TEST_DEVICE` chooses it (default `cpu`), `NEPHROID_VALIDATE=0` leaves the validation layers out.

use std::ops::Deref;
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use nephroid::low_level::graph::Runtime;
use nephroid::low_level::vk::{Device, DeviceOptions};

/// The chosen device, as the program's `--device` takes it.
pub fn name() -> String {
    std::env::var("NEPHROID_TEST_DEVICE").unwrap_or_else(|_| "cpu".into())
}

/// Options of the chosen device; with the validation layers, if `validate` says so.
fn options(validate: bool) -> DeviceOptions {
    let select = name().parse().expect("NEPHROID_TEST_DEVICE names a device");
    DeviceOptions { select, validate, cache: None, ..DeviceOptions::default() }
}

/// Options of the chosen device with all validation, whatever `NEPHROID_VALIDATE` says, and no cache on disk.
pub fn validated() -> DeviceOptions {
    options(true)
}

/// Lavapipe of Debian 12 with its validation layer may crash in a command of one device while another is made or ends
/// (seen once in 250 runs). Tests that use the shared device read this; those that make one of their own write it.
static DEVICES: RwLock<()> = RwLock::new(());

/// For tests that make devices of their own: they run alone. To be taken before the first device, so that it is given
/// back after the last.
pub fn alone() -> RwLockWriteGuard<'static, ()> {
    DEVICES.write().unwrap_or_else(PoisonError::into_inner)
}

/// A device under validation; its own, for tests that expect messages and run [`alone`].
pub fn open() -> Arc<Device> {
    Device::open(&validated()).expect("a device with validation layers")
}

/// The shared device, in use.
pub struct Shared {
    runtime: MutexGuard<'static, Runtime>,
    _together: RwLockReadGuard<'static, ()>,
}

impl Deref for Shared {
    type Target = Runtime;

    fn deref(&self) -> &Runtime {
        &self.runtime
    }
}

/// A device for the tests of this program that expect no message; one test at a time uses it. There is one alone: two
/// of them, used by two threads, ended a program in one of five whole runs of the tests on Debian 12, by memory that was
/// freed twice. Whose fault that is, is not known.
pub fn runtime() -> Shared {
    fn open() -> Mutex<Runtime> {
        let validate = std::env::var("NEPHROID_VALIDATE").map_or(true, |value| value != "0");
        Mutex::new(Runtime::new(Device::open(&options(validate)).expect("a device for the tests")))
    }
    static ONE: LazyLock<Mutex<Runtime>> = LazyLock::new(open);
    let together = DEVICES.read().unwrap_or_else(PoisonError::into_inner);
    let runtime = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    Shared { runtime, _together: together }
}
