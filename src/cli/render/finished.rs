//! What the renderer returns.

use super::stop_rule::Outcome;
use crate::error::Error;
use crate::film::film_file::FilmFile;
use crate::picture::exr::{Metadata, RenderInfo};
use crate::picture::image::Picture;

/// A render that has ended, also by the user.
#[derive(Debug)]
pub struct FinishedRender {
    /// The layers; none if not one pass was finished.
    pub picture: Picture,
    /// Passes, time and device, for the metadata and the last line.
    pub info: RenderInfo,
    /// Further metadata: the lens, and the passes over the finished picture.
    pub notes: Metadata,
    /// The error of the picture, and why the render ended.
    pub outcome: Outcome,
    /// The film, if it is to be kept.
    pub film: Option<FilmFile>,
    /// Content of `--report`.
    pub report: serde_json::Value,
    /// Content of `--trace`, if it was wanted.
    pub trace: Option<String>,
    /// What ended the render before its time, after the passes that are in the picture.
    pub failure: Option<Error>,
}
