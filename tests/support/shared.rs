//! The folder `../shared/` beside the checkout: sample models and references that are too large for the repository.

use std::path::PathBuf;

use super::repository;

/// A file or folder of the shared folder (`NEPHROID_SHARED` names another one). Where it does not exist, `None`, and a
/// line says which test is skipped for want of what; tools/test repeats these lines at its end.
pub fn path(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("NEPHROID_SHARED").map_or_else(|| repository("../shared"), PathBuf::from);
    let path = folder.join(name);
    if path.exists() {
        return Some(path);
    }
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    super::skip(&format!("{test} needs ../shared/{name}"));
    None
}
