//! The files of frames: which are there, which is in work, and how they are written.

use std::ops::Range;
use std::path::Path;

use sha2::{Digest, Sha256};

use super::flags::AnimateArgs;
use super::pattern::Pattern;
use crate::cli::inputs::spare_inputs;
use crate::cli::render::RenderArgs;
use crate::cli::render::checkpoint::save;
use crate::cli::render::files::{metadata, tone_map};
use crate::cli::render::finished::FinishedRender;
use crate::cli::render::flags_film::FilmOrder;
use crate::error::{Error, Result};
use crate::film::film_file::{Identity, Packing, hex};
use crate::picture::exr::{self, Value};
use crate::picture::output::{Destination, Format, Output};
use crate::scene::Scene;

/// The files of all frames.
pub(super) struct Frames<'a> {
    patterns: Vec<Pattern>,
    args: &'a AnimateArgs,
    of_a_frame: &'a RenderArgs,
}

/// The key of the metadata that tells frames of one render from others.
const IDENTITY: &str = "frame_identity";

impl<'a> Frames<'a> {
    /// Checks that the first frame can be written, and that no two files have the same name.
    ///
    /// # Errors
    /// [`Error::Usage`] and [`Error::Io`].
    pub fn of(
        patterns: Vec<Pattern>,
        (args, of_a_frame, frames): (&'a AnimateArgs, &'a RenderArgs, Range<u64>),
    ) -> Result<Self> {
        let files = Self { patterns, args, of_a_frame };
        let outputs = files.outputs(frames.start)?;
        let mut taken = vec![files.checkpoint(frames.start)?];
        for output in outputs {
            let destination = output.destination();
            if taken.iter().any(|other: &Destination| other.is_same_file(destination.path())) {
                return Err(Error::Usage(format!("'{}' is named twice", destination.path().display())));
            }
            taken.push(destination.clone());
        }
        Ok(files)
    }

    /// The pictures of a frame.
    pub fn outputs(&self, frame: u64) -> Result<Vec<Output>> {
        self.patterns.iter().map(|pattern| Output::check(&pattern.file(frame))).collect()
    }

    /// The film of a frame in work.
    pub fn checkpoint(&self, frame: u64) -> Result<Destination> {
        Destination::check(&self.patterns[0].checkpoint(frame))
    }

    /// Refuses to write a frame over a file of the scene.
    pub fn spare_scene(&self, frame: u64, scene: &Scene) -> Result<()> {
        let outputs = self.outputs(frame)?;
        let inputs: Vec<&Path> = scene.files.iter().map(AsRef::as_ref).chain([scene.path.as_path()]).collect();
        spare_inputs(&outputs.iter().map(Output::destination).collect::<Vec<_>>(), &inputs)
    }

    /// Whether all pictures of a frame are there. Files appear whole, and an EXR says what it is a frame of; one that
    /// cannot be read is none.
    ///
    /// # Errors
    /// [`Error::Usage`] for a frame of another render.
    pub fn is_there(&self, frame: u64, identity: &Identity) -> Result<bool> {
        if self.args.frames.force {
            return Ok(false);
        }
        for pattern in &self.patterns {
            let file = pattern.file(frame);
            if !file.exists() {
                return Ok(false);
            }
            if Output::check(&file)?.format() != Format::Exr {
                continue;
            }
            let Ok((_, known)) = exr::read(&file) else { return Ok(false) };
            if known.get(IDENTITY) != Some(&Value::Text(digest(identity))) {
                let what = format!("'{}' is no frame of this render", file.display());
                return Err(Error::Usage(format!("{what}: choose another name, or --force to replace it")));
            }
        }
        Ok(true)
    }

    /// What becomes of the film of a frame: it goes to a checkpoint, and comes from it if there is one.
    ///
    /// # Errors
    /// Those of [`Destination::check`].
    pub fn film(&self, frame: u64) -> Result<FilmOrder> {
        let checkpoint = self.checkpoint(frame)?;
        let resume = Some(checkpoint.path().to_owned()).filter(|path| path.exists() && !self.args.frames.force);
        let interval = self.args.frames.checkpoint_interval;
        Ok(FilmOrder { checkpoint: Some(checkpoint), interval, resume, range: None, force: true })
    }

    /// Writes the film of a frame that was stopped.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn keep(&self, frame: u64, rendered: &FinishedRender) -> Result<()> {
        let Some(file) = rendered.film.as_ref().filter(|_| rendered.info.passes > 0) else { return Ok(()) };
        let picture = (&file.film.picture(), &rendered.info.metadata());
        save(&self.checkpoint(frame)?, picture, file, Packing::Fast)
    }

    /// Writes the pictures of a frame, and removes its checkpoint.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn write(&self, (frame, time): (u64, f64), rendered: &FinishedRender, identity: &Identity) -> Result<()> {
        let mut metadata = metadata(rendered);
        metadata.insert("frame".into(), Value::Count(frame));
        metadata.insert("time".into(), Value::Number(time));
        metadata.insert("frames_per_second".into(), Value::Number(self.args.frames.fps));
        metadata.insert(IDENTITY.into(), Value::Text(digest(identity)));
        let display = self.of_a_frame.post.display(tone_map(self.of_a_frame));
        for output in self.outputs(frame)? {
            output.write(&rendered.picture, &metadata, display)?;
        }
        // Without it the frame is there all the same.
        let _ = std::fs::remove_file(self.patterns[0].checkpoint(frame));
        Ok(())
    }
}

/// An identity in one word.
fn digest(identity: &Identity) -> String {
    hex(&Sha256::digest(format!("{identity:?}").as_bytes()))
}
