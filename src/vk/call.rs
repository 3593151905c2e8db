//! What every call of Vulkan needs: its error with a name, its strings, locks that outlast a panic.

use crate::error::Error;

/// Turns a `VkResult` into an [`Error`] that names the call and its object.
pub(super) fn failed(call: &'static str, object: &str) -> impl FnOnce(ash::vk::Result) -> Error {
    move |code| match code {
        ash::vk::Result::ERROR_DEVICE_LOST => {
            Error::DeviceLost { last_finished_scope: format!("unknown (seen by {call} for '{object}')") }
        }
        code => Error::Vulkan { call, object: object.to_owned(), code: code.as_raw() },
    }
}

/// `text` for Vulkan, cut at the first NUL (a name from outside may hold one).
pub(super) fn c_string(text: &str) -> std::ffi::CString {
    let clean = text.split('\0').next().unwrap_or_default();
    std::ffi::CString::new(clean).unwrap_or_default()
}

/// Locks, also after a panic elsewhere: every value guarded here is consistent between statements.
pub(super) fn lock<T>(mutex: &std::sync::Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
