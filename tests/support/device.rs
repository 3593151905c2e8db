//! The device of the tests.
//!
//! `NEPHROID_TEST_DEVICE` chooses it (default `cpu`), `NEPHROID_VALIDATE=0` leaves the validation layers out.

use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError, TryLockError};

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

/// A device under validation; its own, for tests that expect messages.
pub fn open() -> Arc<Device> {
    Device::open(&validated()).expect("a device with validation layers")
}

/// A device for the tests of this program that expect no message; one test at a time uses it. There are two: a test
/// that computes on the host leaves a software device idle.
pub fn runtime() -> MutexGuard<'static, Runtime> {
    fn open() -> Mutex<Runtime> {
        let validate = std::env::var("NEPHROID_VALIDATE").map_or(true, |value| value != "0");
        Mutex::new(Runtime::new(Device::open(&options(validate)).expect("a device for the tests")))
    }
    static FIRST: LazyLock<Mutex<Runtime>> = LazyLock::new(open);
    static SECOND: LazyLock<Mutex<Runtime>> = LazyLock::new(open);
    match FIRST.try_lock() {
        Ok(first) => first,
        Err(TryLockError::Poisoned(first)) => first.into_inner(),
        Err(TryLockError::WouldBlock) => SECOND.lock().unwrap_or_else(PoisonError::into_inner),
    }
}
