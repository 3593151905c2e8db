//! Files from anywhere: which are opened at all, and OpenEXR read block by block within bounds.
//!
//! A file says how much memory and time it takes to read, and may lie. Whoever reads one keeps to 256 MiB and 40 times
//! the file's bytes, so sizes are checked against the file's own before anything is allocated for them.

pub mod exr;

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use crate::error::{Error, Result};

/// Why a file could not be read.
#[derive(Debug)]
pub enum Fault {
    /// The system refused, or the file ended early.
    Io(io::Error),
    /// What is in it is damaged, not supported, or asks for too much.
    Content(String),
}

impl Fault {
    /// As an error about the file at `path`.
    pub fn at(self, path: &Path) -> Error {
        match self {
            Self::Io(source) if source.kind() != io::ErrorKind::UnexpectedEof => Error::io(path, "read", source),
            Self::Io(_) => Error::scene(path, self.to_string()),
            Self::Content(cause) => Error::scene(path, cause),
        }
    }
}

impl From<io::Error> for Fault {
    fn from(source: io::Error) -> Self {
        Self::Io(source)
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Io(source) if source.kind() == io::ErrorKind::UnexpectedEof => write!(f, "the file ends too early"),
            Self::Io(source) => write!(f, "cannot be read: {source}"),
            Self::Content(cause) => write!(f, "{cause}"),
        }
    }
}

/// Opens a regular file; also its length in bytes. Devices and pipes could block or never end, so they are refused
/// before they are opened.
///
/// # Errors
/// [`Fault::Io`] if it cannot be opened, [`Fault::Content`] if it is not a regular file.
pub fn open(path: &Path) -> std::result::Result<(BufReader<File>, u64), Fault> {
    let irregular = || Fault::Content("is not a regular file".into());
    if !std::fs::metadata(path)?.is_file() {
        return Err(irregular());
    }
    let file = File::open(path)?;
    // Another file may have taken its place.
    let status = file.metadata()?;
    if status.is_file() { Ok((BufReader::new(file), status.len())) } else { Err(irregular()) }
}

/// The bytes of a regular file of at most `most` bytes.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Scene`] if it is not a regular file or has more bytes.
pub fn read(path: &Path, most: u64) -> Result<Vec<u8>> {
    let bounded = || {
        let (file, length) = open(path)?;
        if length > most {
            return Err(Fault::Content(format!("has {length} bytes, more than the limit of {most}")));
        }
        let mut bytes = Vec::new();
        // The file may grow after it was measured: the limit holds for what is read.
        file.take(most).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    bounded().map_err(|fault: Fault| fault.at(path))
}

/// The text of a regular file of at most `most` bytes.
///
/// # Errors
/// Those of [`read`], [`Error::Scene`] if it is not UTF-8.
pub fn read_text(path: &Path, most: u64) -> Result<String> {
    String::from_utf8(read(path, most)?).map_err(|_| Error::scene(path, "is not text in UTF-8"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_of_bounded_size_are_read() {
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        std::fs::write(file.path(), b"four").expect("written");
        assert_eq!(read(file.path(), 4).expect("four bytes"), b"four");
        let message = read(file.path(), 3).expect_err("too long").to_string();
        assert!(message.contains("has 4 bytes, more than the limit of 3"), "{message}");
        for path in ["/dev/zero", "/"] {
            if Path::new(path).exists() {
                let message = read(Path::new(path), 1 << 20).expect_err(path).to_string();
                assert!(message.contains("is not a regular file"), "{message}");
            }
        }
        assert!(matches!(read(Path::new("no/such/file"), 1), Err(Error::Io { action: "read", .. })));
    }
}
