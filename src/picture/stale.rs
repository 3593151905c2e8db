//! Temporary files of programs that were killed.
//!
//! A process holds a lock on each temporary file that it writes, and the operating system releases the locks of a dead
//! process. So a temporary file belongs to nobody if it can be locked. Only files named after the file that is about to
//! be written are looked at. Where the file system has no locks, nothing is removed.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::path::Path;
use std::time::Duration;

/// Random characters in the name of a temporary file.
pub(super) const RANDOM: usize = 6;

/// Ends the name of a temporary file.
pub(super) const SUFFIX: &str = ".tmp";

/// Younger files may have been created but not yet locked.
const YOUNGEST: Duration = Duration::from_secs(1);

/// Whether `name` is that of a temporary file for `target`.
fn belongs(name: &OsStr, target: &OsStr) -> bool {
    let (name, target) = (name.as_encoded_bytes(), target.as_encoded_bytes());
    let rest = name.strip_prefix(b".").and_then(|rest| rest.strip_prefix(target));
    let random = rest.and_then(|rest| rest.strip_suffix(SUFFIX.as_bytes()));
    random.is_some_and(|random| random.len() == RANDOM && random.iter().all(u8::is_ascii_alphanumeric))
}

/// Removes the temporary files in `folder` that dead processes left of writing `target`. What cannot be removed stays:
/// it is in nobody's way.
pub(super) fn remove_stale(folder: &Path, target: &OsStr) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten().filter(|entry| belongs(&entry.file_name(), target)) {
        let old = entry.metadata().is_ok_and(|status| {
            status.is_file() && status.modified().ok().and_then(|t| t.elapsed().ok()).is_some_and(|age| age > YOUNGEST)
        });
        // The lock ends with `file`, after the name is gone.
        if old
            && let Ok(file) = File::options().write(true).open(entry.path())
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_our_pattern_for_this_very_file() {
        let belongs = |name: &str| belongs(OsStr::new(name), OsStr::new("a.exr"));
        assert!(belongs(".a.exrXy12Zz.tmp"));
        for other in [
            ".a.exrXy12Z.tmp",
            ".a.exrXy12Zzz.tmp",
            "a.exrXy12Zz.tmp",
            ".b.exrXy12Zz.tmp",
            ".a.exrXy12Z-.tmp",
            ".a.exr",
        ] {
            assert!(!belongs(other), "{other}");
        }
    }

    #[test]
    fn what_a_living_process_writes_is_left_alone() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let [dead, alive, young, other] =
            [".a.exrDDDDDD.tmp", ".a.exrAAAAAA.tmp", ".a.exrYYYYYY.tmp", ".b.exrDDDDDD.tmp"]
                .map(|name| folder.path().join(name));
        let old = std::time::SystemTime::now() - Duration::from_secs(60);
        for path in [&dead, &alive, &young, &other] {
            let file = File::create(path).expect("created");
            if path != &young {
                file.set_modified(old).expect("an older file");
            }
        }
        let lock = File::open(&alive).expect("there");
        lock.lock().expect("a lock");
        remove_stale(folder.path(), OsStr::new("a.exr"));
        assert_eq!([dead, alive.clone(), young, other].map(|path| path.exists()), [false, true, true, true]);
        drop(lock);
        remove_stale(folder.path(), OsStr::new("a.exr"));
        assert!(!alive.exists(), "the check can fail");
    }
}
