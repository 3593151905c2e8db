//! Files that a command reads.

use std::path::Path;

use crate::error::{Error, Result};

/// Finds out early whether an input file can be read.
///
/// # Errors
/// [`Error::Io`] if it cannot be opened, [`Error::Scene`] if it is not a file.
pub(super) fn check_readable(path: &Path) -> Result<()> {
    let io = |source| Error::io(path, "read", source);
    let status = std::fs::metadata(path).map_err(io)?;
    // Before opening: opening a pipe would wait for its writer.
    if !status.is_file() {
        return Err(Error::scene(path, "not a regular file"));
    }
    std::fs::File::open(path).map_err(io)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_are_checked_early() {
        assert!(matches!(check_readable(Path::new("no/such.gltf")), Err(Error::Io { action: "read", .. })));
        assert!(matches!(check_readable(&std::env::temp_dir()), Err(Error::Scene { .. })));
        assert!(check_readable(tempfile::NamedTempFile::new().expect("a file").path()).is_ok());
    }
}
