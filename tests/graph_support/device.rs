//! The device of the tests that run graphs.
#![allow(dead_code)]

use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

use nephroid::graph::Runtime;
use nephroid::vk::{Device, DeviceOptions};

/// A device under validation; its own, for tests that expect messages.
pub fn open() -> Arc<Device> {
    let select = std::env::var("NEPHROID_TEST_DEVICE").unwrap_or_else(|_| "cpu".into());
    let select = select.parse().expect("NEPHROID_TEST_DEVICE names a device");
    let options = DeviceOptions { select, validate: true, cache: None, ..DeviceOptions::default() };
    Device::open(&options).expect("a device with validation layers")
}

/// One device for the tests that expect no message, one test at a time.
pub fn runtime() -> MutexGuard<'static, Runtime> {
    static RUNTIME: LazyLock<Mutex<Runtime>> = LazyLock::new(|| Mutex::new(Runtime::new(open())));
    RUNTIME.lock().unwrap_or_else(PoisonError::into_inner)
}
