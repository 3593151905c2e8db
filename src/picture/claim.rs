//! One writer for a file that is written again and again.
//!
//! The claim is a lock of the operating system on a small file beside it, which says who holds it; it ends with the
//! process, however that ends. Where the file system has no locks, everybody may write.

use std::fs::{self, File, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use super::output::{Destination, forget_unfinished, note_unfinished};
use crate::error::{Error, Result};

/// The right to write a file, as long as this value lives.
#[derive(Debug)]
pub struct Claim {
    /// Keeps the lock.
    _file: File,
    path: PathBuf,
}

impl Claim {
    /// Claims `destination` for this process.
    ///
    /// # Errors
    /// [`Error::Io`] if another process has claimed it, or if the file beside it cannot be made.
    pub fn of(destination: &Destination) -> Result<Self> {
        let path = beside(destination);
        let failed = |source| Error::io(destination.path(), "claim", source);
        loop {
            let mut file =
                File::options().read(true).write(true).create(true).truncate(false).open(&path).map_err(failed)?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => return Err(failed(taken(&mut file))),
                // A file that the last holder removed meanwhile is nobody's: the next writer would make a new one.
                Ok(()) if !is_at(&file, &path) => {}
                Ok(()) | Err(TryLockError::Error(_)) => {
                    note_unfinished(&path);
                    let _ = file.set_len(0).and_then(|()| file.write_all(holder().as_bytes()));
                    return Ok(Self { _file: file, path });
                }
            }
        }
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // The name goes before the lock does.
        let _ = fs::remove_file(&self.path);
        forget_unfinished(&self.path);
    }
}

fn beside(destination: &Destination) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(destination.target().file_name().unwrap_or_default());
    name.push(".lock");
    destination.target().with_file_name(name)
}

/// This process, in words.
fn holder() -> String {
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let host = if host.trim().is_empty() { String::new() } else { format!(" on {}", host.trim()) };
    format!("process {}{host}", std::process::id())
}

fn taken(file: &mut File) -> std::io::Error {
    // Whoever writes this file is brief.
    const LONGEST: u64 = 200;
    let mut holder = String::new();
    let _ = file.take(LONGEST).read_to_string(&mut holder);
    let holder: String = holder.chars().filter(|c| !c.is_control()).collect();
    let holder = if holder.is_empty() { "another process".into() } else { holder };
    std::io::Error::new(std::io::ErrorKind::WouldBlock, format!("{holder} writes it"))
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let key = |status: fs::Metadata| (status.dev(), status.ino());
    file.metadata().ok().map(key) == fs::metadata(path).ok().map(key)
}

/// Other systems do not remove a file that is open.
#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_one_writer() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let destination = Destination::check(&folder.path().join("a.exr")).expect("writable");
        let other = Destination::check(&folder.path().join("b.exr")).expect("writable");
        let claim = Claim::of(&destination).expect("nobody writes it");
        let error = Claim::of(&destination).expect_err("claimed").to_string();
        assert!(error.contains("a.exr: cannot claim: process ") && error.ends_with(" writes it"), "{error}");
        drop(Claim::of(&other).expect("another file"));
        drop(claim);
        drop(Claim::of(&destination).expect("free again"));
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0, "no trace");
    }

    #[test]
    fn what_a_dead_process_left_is_no_claim() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let destination = Destination::check(&folder.path().join("a.exr")).expect("writable");
        fs::write(beside(&destination), "process 1 on elsewhere, long dead").expect("written");
        let claim = Claim::of(&destination).expect("no lock, no claim");
        assert_eq!(fs::read_to_string(beside(&destination)).expect("there"), holder());
        drop(claim);
    }
}
