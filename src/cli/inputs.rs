//! Files that a command reads, and files that it must not write over.

use std::path::Path;

use crate::error::{Error, Result};
use crate::film::film_file::read_about;
use crate::picture::output::Destination;

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

/// Refuses to write over a file that is read.
///
/// # Errors
/// [`Error::Usage`].
pub(super) fn spare_inputs<P: AsRef<Path>>(outputs: &[&Destination], inputs: &[P]) -> Result<()> {
    let taken = outputs.iter().find(|output| inputs.iter().any(|input| output.is_same_file(input.as_ref())));
    let Some(output) = taken else { return Ok(()) };
    let what = format!("'{}' is a file of the scene and is not written over", output.path().display());
    Err(Error::Usage(what))
}

/// Refuses to replace a film by one of fewer passes, or by a picture without a film (`passes` is zero).
///
/// # Errors
/// [`Error::Usage`].
pub(super) fn spare_film(output: &Destination, passes: u64, force: bool) -> Result<()> {
    // A file that cannot be read as a film is none.
    let held = if force { None } else { read_about(output.target()).and_then(|about| about.passes()).ok() };
    let Some(held) = held.map(|held| held.count()).filter(|held| *held > passes) else { return Ok(()) };
    let plural = if held == 1 { "" } else { "es" };
    let file = output.path().display();
    let what = format!("'{file}' holds {held} pass{plural} of a render, more than would replace them");
    Err(Error::Usage(format!("{what}: --resume goes on with them, --force replaces them")))
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
