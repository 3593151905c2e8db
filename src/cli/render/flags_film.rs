//! Flags of renders that are stopped, gone on with, and divided among machines.

use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::inputs::{check_readable, spare_film};
use crate::cli::values;
use crate::error::Result;
use crate::film::film_file::read_about;
use crate::picture::output::Destination;

/// Keeping the film of a render.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Stop and go on")]
pub struct FilmArgs {
    /// Write the film to this EXR every minute, at the end and on Ctrl-C: a picture of what is finished, and all that
    /// --resume needs. The file is whole at any moment, whatever happens to the program
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Time between checkpoints
    #[arg(long, value_name = "TIME", default_value = "1m", value_parser = values::duration, requires = "checkpoint")]
    #[arg(hide_short_help = true, allow_negative_numbers = true)]
    pub checkpoint_interval: f64,

    /// Go on with the film of a checkpoint, a part or a merged file, bit for bit as if the render had never been
    /// stopped: --passes and --time count from its beginning, and passes that are missing in between come first. Scene
    /// and settings must be the same. A file that is also the --checkpoint may be missing: then the render begins, so
    /// that one command line serves the first attempt and all others
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,

    /// Render passes A up to but without B, and write the film into each .exr of --output: a part, for `nephroid merge`
    #[arg(
        long,
        value_name = "A..B",
        value_parser = pass_range,
        conflicts_with_all = ["passes", "time", "target_error"]
    )]
    pub pass_range: Option<Range<u64>>,

    /// Write over a film (a checkpoint, a part, a merged file) that has more passes than what replaces it
    #[arg(long, hide_short_help = true)]
    pub force: bool,
}

/// What becomes of the film, checked.
#[derive(Debug, Clone, Default)]
pub struct FilmOrder {
    /// Where checkpoints go.
    pub checkpoint: Option<Destination>,
    /// Seconds between them.
    pub interval: f64,
    /// A film to go on with; it can be opened.
    pub resume: Option<PathBuf>,
    /// The passes to render; `None` is all from 0 on.
    pub range: Option<Range<u64>>,
    /// Whether films with more passes may be replaced.
    pub force: bool,
}

impl FilmArgs {
    /// Checks the files.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] if a file cannot be read or written, [`crate::error::Error::Scene`] if it is not a
    /// regular file.
    pub fn order(&self) -> Result<FilmOrder> {
        let checkpoint = self.checkpoint.as_deref().map(Destination::check).transpose()?;
        let begins = |path: &PathBuf| !path.exists() && checkpoint.as_ref().is_some_and(|c| c.is_same_file(path));
        let resume = self.resume.clone().filter(|path| !begins(path));
        resume.iter().try_for_each(|path| check_readable(path))?;
        if let Some(checkpoint) = &checkpoint {
            spare_film(checkpoint, resume.as_deref().map_or(0, passes_in), self.force)?;
        }
        let (interval, range, force) = (self.checkpoint_interval, self.pass_range.clone(), self.force);
        Ok(FilmOrder { checkpoint, interval, resume, range, force })
    }
}

impl FilmOrder {
    /// Whether the film itself shall leave the renderer.
    pub fn keeps_film(&self) -> bool {
        self.checkpoint.is_some() || self.range.is_some()
    }
}

/// Passes of a film; none in a file that is no film, which is refused later.
fn passes_in(path: &Path) -> u64 {
    read_about(path).and_then(|about| about.passes()).map_or(0, |passes| passes.count())
}

/// Parses `16..32`.
fn pass_range(text: &str) -> std::result::Result<Range<u64>, String> {
    // A sum has room for 2^33 passes.
    const MOST: u64 = 1 << 32;
    let ends = text.split_once("..").and_then(|(a, b)| Some(a.parse::<u64>().ok()?..b.parse::<u64>().ok()?));
    let range = ends.filter(|range| !range.is_empty() && range.end <= MOST);
    range.ok_or_else(|| format!("expected A..B with A below B, such as 16..32, and B at most {MOST}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_passes() {
        assert_eq!(pass_range("16..32"), Ok(16..32));
        for wrong in ["16", "32..16", "4..4", "0..=3", "-1..3", "0..4294967297", "..", "0...3"] {
            assert!(pass_range(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn only_a_checkpoint_may_be_missing() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| Some(folder.path().join(name));
        let args = |checkpoint: Option<PathBuf>, resume: Option<PathBuf>| FilmArgs {
            checkpoint,
            checkpoint_interval: 60.0,
            resume,
            pass_range: None,
            force: false,
        };
        assert!(args(at("a.exr"), at("a.exr")).order().expect("begins").resume.is_none());
        assert!(args(at("a.exr"), at("b.exr")).order().is_err());
        let error = args(None, at("a.exr")).order().expect_err("missing");
        assert!(error.to_string().contains("a.exr: cannot read"), "{error}");
        std::fs::write(folder.path().join("a.exr"), "").expect("written");
        assert_eq!(args(at("a.exr"), at("a.exr")).order().expect("resumes").resume, at("a.exr"));
    }
}
