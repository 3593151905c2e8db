//! Output files that appear whole or not at all.
//!
//! A file is written under a temporary name in its own folder, flushed to the disk and renamed: a reader sees the old
//! file or the new one, even after a crash, and a failure leaves nothing behind. [`Destination::check`] makes the same
//! steps without content before a render starts, because an hour of rendering must not end with `permission denied`; it
//! also removes what processes that were killed left behind.

use std::fs::{self, File};
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};
use crate::injection::{Step, file_step};
use crate::picture::exr::Metadata;
use crate::picture::image::Picture;
use crate::picture::post::display::Display;
use crate::picture::tonemap::ToneMap;
use crate::picture::{exr, png, stale};

/// Temporary files that exist at the moment, for [`remove_unfinished`].
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file that can be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Destination {
    /// As the user named it.
    path: PathBuf,
    /// The file to replace: links resolved, but relative if the file is new.
    target: PathBuf,
}

impl Destination {
    /// Finds out whether `path` can be written, and leaves no trace.
    ///
    /// # Errors
    /// [`Error::Io`] if its folder does not exist or takes no new file, or if the path is a folder or write-protected.
    pub fn check(path: &Path) -> Result<Self> {
        let refuse = |kind: std::io::ErrorKind| Err(Error::io(path, "create", kind.into()));
        // A link is followed, so that it is the target which is replaced.
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        if let Ok(existing) = fs::metadata(&target) {
            if existing.is_dir() {
                return refuse(std::io::ErrorKind::IsADirectory);
            }
            if !existing.is_file() || existing.permissions().readonly() {
                return refuse(std::io::ErrorKind::PermissionDenied);
            }
        }
        if target.file_name().is_none() {
            return refuse(std::io::ErrorKind::InvalidFilename);
        }
        let destination = Self { path: path.to_owned(), target };
        stale::remove_stale(destination.folder(), destination.target.file_name().unwrap_or_default());
        // The name itself is tried, too: it may be longer than the file system allows.
        destination.temporary().map_err(|source| Error::io(path, "create", source))?;
        Ok(destination)
    }

    /// The file as it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file that is replaced: links resolved.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Whether both name one file.
    pub fn is_same_file(&self, other: &Path) -> bool {
        absolute(&self.target) == absolute(&fs::canonicalize(other).unwrap_or_else(|_| other.to_owned()))
    }

    /// Calls `fill` on a new file and puts it in place of the old one when it succeeds.
    ///
    /// # Errors
    /// Those of `fill`, and [`Error::Io`] if the file cannot be created, flushed or renamed; the old file is then
    /// untouched.
    pub fn write(&self, fill: impl FnOnce(&mut BufWriter<Sink<'_>>) -> Result<()>) -> Result<()> {
        let io = |action| move |source| Error::io(&self.path, action, source);
        let temporary = self.temporary().map_err(io("create"))?;
        let file = temporary.0.as_file();
        let mut sink = BufWriter::new(Sink(file));
        fill(&mut sink)?;
        sink.flush().map_err(io("write"))?;
        drop(sink);
        file_step(Step::Sync).and_then(|()| file.sync_all()).map_err(io("write"))?;
        temporary.rename(&self.target).map_err(io("rename"))?;
        self.sync_folder();
        Ok(())
    }

    fn folder(&self) -> &Path {
        folder_of(&self.target)
    }

    fn temporary(&self) -> std::io::Result<Temporary> {
        file_step(Step::Create)?;
        let mut prefix = std::ffi::OsString::from(".");
        prefix.push(self.target.file_name().unwrap_or_default());
        let mut builder = tempfile::Builder::new();
        builder.prefix(&prefix).rand_bytes(stale::RANDOM).suffix(stale::SUFFIX);
        // The usual mode of a new file (the umask still applies) instead of the private one of temporary files.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(self.folder())?;
        // Says that somebody is writing; a file system without locks does without.
        let _ = file.as_file().try_lock();
        note_unfinished(file.path());
        Ok(Temporary(file))
    }

    /// Makes the rename itself survive a crash. Some file systems refuse to flush a folder; the file is whole anyway.
    fn sync_folder(&self) {
        if let Ok(folder) = File::open(self.folder()) {
            let _ = folder.sync_all();
        }
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The path with its folder resolved; the file itself may not exist yet.
fn absolute(path: &Path) -> PathBuf {
    let folder = folder_of(path);
    let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    path.file_name().map_or_else(|| folder.clone(), |name| folder.join(name))
}

/// The temporary file, as what fills it sees it.
#[derive(Debug)]
pub struct Sink<'a>(&'a File);

impl Write for Sink<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        file_step(Step::Write)?;
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

impl Seek for Sink<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(to)
    }
}

/// A temporary file and its entry in [`UNFINISHED`]; dropping it removes both.
struct Temporary(NamedTempFile);

impl Temporary {
    fn rename(mut self, target: &Path) -> std::io::Result<()> {
        file_step(Step::Rename)?;
        let source = self.0.path().to_owned();
        fs::rename(&source, target)?;
        // Its path is gone, so there is nothing left to delete.
        self.0.disable_cleanup(true);
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        forget_unfinished(self.0.path());
    }
}

fn unfinished() -> std::sync::MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Adds a file that shall not outlast the process.
pub(super) fn note_unfinished(path: &Path) {
    unfinished().push(path.to_owned());
}

/// Takes back [`note_unfinished`].
pub(super) fn forget_unfinished(path: &Path) {
    unfinished().retain(|other| other != path);
}

/// Deletes the temporary files of writes that are under way. Only for a process that is about to end without running
/// destructors.
pub fn remove_unfinished() {
    for path in unfinished().drain(..) {
        let _ = fs::remove_file(path);
    }
}

/// Formats of picture files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: all layers, linear floats, metadata.
    Exr,
    /// PNG: the beauty layer, tone-mapped.
    Png,
}

/// A picture file that can be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    destination: Destination,
    format: Format,
}

impl Output {
    /// Chooses the format by the extension, in either case, and checks the destination.
    ///
    /// # Errors
    /// [`Error::Usage`] if the extension is not `exr` or `png`, [`Error::Io`] as [`Destination::check`].
    pub fn check(path: &Path) -> Result<Self> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        let format = match extension.as_deref() {
            Some("exr") => Format::Exr,
            Some("png") => Format::Png,
            _ => return Err(Error::Usage(format!("output '{}' must end in .exr or .png", path.display()))),
        };
        Ok(Self { destination: Destination::check(path)?, format })
    }

    /// Where it goes.
    pub fn destination(&self) -> &Destination {
        &self.destination
    }

    /// The format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Writes the picture; `display` (or a tone map alone) is for PNG only, `metadata` for EXR only.
    ///
    /// # Errors
    /// As [`Destination::write`] and the encoder.
    pub fn write(&self, picture: &Picture, metadata: &Metadata, display: impl Into<Display>) -> Result<()> {
        let display = display.into();
        let path = self.destination.path();
        self.destination.write(|sink| match self.format {
            Format::Exr => exr::write(sink, path, picture, metadata),
            Format::Png => png::write(sink, path, picture, display),
        })
    }
}

impl Picture {
    /// Writes the picture as the extension of `path` says: `.exr` (all layers, linear floats) or `.png` (the beauty
    /// layer, 8-bit sRGB, through the default tone curve). The file appears whole or not at all.
    ///
    /// # Errors
    /// [`Error::Usage`] for another extension or a picture without a beauty layer, [`Error::Io`] if it cannot be
    /// written.
    pub fn save(&self, path: &Path) -> Result<()> {
        Output::check(path)?.write(self, &Metadata::new(), ToneMap::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::image::Channels;

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a temporary folder")
    }

    fn names_in(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_check_leaves_nothing_behind() {
        let folder = folder();
        assert_eq!(Output::check(&folder.path().join("a.EXR")).expect("writable").format(), Format::Exr);
        assert_eq!(Output::check(&folder.path().join("a.png")).expect("writable").format(), Format::Png);
        assert_eq!(names_in(folder.path()), [""; 0]);
    }

    #[test]
    fn what_cannot_be_written_is_found_by_the_check() {
        let folder = folder();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "").expect("written");
        fs::create_dir(at("folder.exr")).expect("created");
        fs::write(at("protected.exr"), "").expect("written");
        let mut mode = fs::metadata(at("protected.exr")).expect("there").permissions();
        mode.set_readonly(true);
        fs::set_permissions(at("protected.exr"), mode).expect("set");
        let long = format!("{}.exr", "x".repeat(300));
        for name in ["no/such/folder.exr", "file/a.exr", "folder.exr", "protected.exr", &long] {
            let error = Output::check(&at(name)).expect_err(name);
            assert!(matches!(error, Error::Io { action: "create", .. }), "{name}: {error}");
        }
        for name in ["a.jpg", "a", "exr", ".exr", "a.exr.bak"] {
            assert!(matches!(Output::check(&at(name)), Err(Error::Usage(_))), "{name}");
        }
    }

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let folder = folder();
        let path = folder.path().join("report.json");
        fs::write(&path, "old").expect("written");
        let destination = Destination::check(&path).expect("writable");
        let result = destination.write(|sink| {
            sink.write_all(b"half of the new").expect("buffered");
            sink.flush().expect("flushed");
            assert_eq!(names_in(folder.path()).len(), 2, "the temporary file is in the same folder");
            Err(Error::Usage("stop".into()))
        });
        assert!(result.is_err());
        assert_eq!(fs::read_to_string(&path).expect("read"), "old");
        assert_eq!(names_in(folder.path()), ["report.json"]);
        destination.write(|sink| sink.write_all(b"new").map_err(|e| Error::io("", "write", e))).expect("writable");
        assert_eq!(fs::read_to_string(&path).expect("read"), "new");
        assert_eq!(names_in(folder.path()), ["report.json"]);
    }

    #[test]
    fn a_folder_that_vanishes_is_an_error() {
        let folder = folder();
        let destination = Destination::check(&folder.path().join("a.json")).expect("writable");
        folder.close().expect("removed");
        assert!(matches!(destination.write(|_| Ok(())), Err(Error::Io { .. })));
    }

    #[test]
    fn a_write_that_cannot_be_renamed_is_cleaned_up() {
        let folder = folder();
        let path = folder.path().join("a.json");
        let destination = Destination::check(&path).expect("writable");
        fs::create_dir(&path).expect("a folder takes the name");
        assert!(matches!(destination.write(|_| Ok(())), Err(Error::Io { action: "rename", .. })));
        assert_eq!(names_in(folder.path()), ["a.json"]);
    }

    #[test]
    fn both_formats_can_be_read_back() {
        let folder = folder();
        let mut picture = Picture::new(4, 2);
        picture.push("", Channels::Rgb, vec![0.25; 24]);
        for name in ["a.exr", "a.png"] {
            let output = Output::check(&folder.path().join(name)).expect("writable");
            output.write(&picture, &Metadata::new(), ToneMap::default()).expect("written");
        }
        assert_eq!(exr::read(&folder.path().join("a.exr")).expect("our own file").0, picture);
        assert_eq!(::image::open(folder.path().join("a.png")).expect("our own file").width(), 4);
    }

    #[test]
    fn one_file_under_two_names_is_recognised() {
        let folder = folder();
        let destination = Destination::check(&folder.path().join("a.json")).expect("writable");
        fs::create_dir(folder.path().join("inner")).expect("created");
        assert!(destination.is_same_file(&folder.path().join("inner/../a.json")));
        assert!(!destination.is_same_file(&folder.path().join("inner/a.json")));
        fs::write(folder.path().join("a.json"), "").expect("written");
        assert!(destination.is_same_file(&folder.path().join("inner/../a.json")));
    }

    #[cfg(unix)]
    #[test]
    fn a_new_file_has_the_usual_mode_and_a_link_stays_a_link() {
        use std::os::unix::fs::PermissionsExt;
        let folder = folder();
        let [target, link, plain] = ["target.json", "link.json", "plain.json"].map(|name| folder.path().join(name));
        fs::write(&target, "old").expect("written");
        fs::write(&plain, "").expect("written");
        std::os::unix::fs::symlink(&target, &link).expect("linked");
        let destination = Destination::check(&link).expect("writable");
        assert!(destination.is_same_file(&target));
        destination.write(|_| Ok(())).expect("written");
        assert!(fs::symlink_metadata(&link).expect("there").is_symlink());
        let mode = |path: &Path| fs::metadata(path).expect("there").permissions().mode();
        assert_eq!(mode(&target), mode(&plain));
        assert_eq!(fs::read_to_string(&target).expect("read"), "");
    }
}
