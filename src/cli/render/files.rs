//! The files of a render: checked before it starts, written when it has ended.

use std::path::{Path, PathBuf};

use super::checkpoint::save;
use super::finished::FinishedRender;
use super::flags::{OutputArgs, RenderArgs};
use super::flags_film::FilmOrder;
use crate::cli::advice;
use crate::cli::console::complain;
use crate::cli::inputs::spare_film;
use crate::error::{Error, Result};
use crate::film::film_file::Packing;
use crate::picture::exr::{Metadata, RenderInfo};
use crate::picture::output::{Destination, Format, Output};
use crate::picture::tonemap::ToneMap;

/// Every file of a render, checked before it starts.
pub(super) struct Files {
    pictures: Vec<Output>,
    report: Option<Destination>,
    trace: Option<Destination>,
}

impl Files {
    /// All of them.
    pub fn destinations(&self) -> impl Iterator<Item = &Destination> {
        self.pictures.iter().map(Output::destination).chain(&self.report).chain(&self.trace)
    }
}

/// Checks that all files can be written and that none is named twice.
///
/// # Errors
/// [`Error::Io`] and [`Error::Usage`].
pub(super) fn check_files(args: &RenderArgs, film: &FilmOrder) -> Result<Files> {
    let OutputArgs { output, report, trace, .. } = &args.output;
    let files = Files {
        pictures: output.iter().map(|path| Output::check(path)).collect::<Result<_>>()?,
        report: report.as_deref().map(Destination::check).transpose()?,
        trace: trace.as_deref().map(Destination::check).transpose()?,
    };
    let is_part = |output: &Output| output.format() == Format::Exr;
    if film.range.is_some() && film.checkpoint.is_none() && !files.pictures.iter().any(is_part) {
        return Err(Error::Usage("--pass-range needs an --output in .exr, which holds the part".into()));
    }
    // A checkpoint may take the place of the film that is gone on with, but of no other file.
    let outputs = files.destinations().chain(&film.checkpoint);
    let replaced = |path: &&PathBuf| !film.checkpoint.as_ref().is_some_and(|checkpoint| checkpoint.is_same_file(path));
    let resumed = film.resume.iter().filter(replaced);
    let inputs = std::iter::once(&args.scene).chain(&args.light.environment.environment);
    let mut taken: Vec<&Path> = inputs.chain(resumed).map(PathBuf::as_path).collect();
    for destination in outputs {
        if taken.iter().any(|path| destination.is_same_file(path)) {
            return Err(Error::Usage(format!("'{}' is named twice", destination.path().display())));
        }
        taken.push(destination.path());
    }
    // The film of the checkpoint was looked at where its passes are known.
    let passes = film.range.as_ref().map_or(0, |range| range.end - range.start);
    for output in &files.pictures {
        let is_kept = if is_part(output) { passes } else { 0 };
        spare_film(output.destination(), is_kept, film.force)?;
    }
    Ok(files)
}

/// Writes pictures, checkpoint, report and trace, each whatever becomes of the others. If no picture and no checkpoint
/// can be written where it was wanted, the picture goes to a file of another folder, whose name is printed.
///
/// # Errors
/// [`Error::Io`]: the first failure. Those after it are printed.
pub(super) fn write_files(
    (files, film): (&Files, &FilmOrder),
    rendered: &FinishedRender,
    args: &RenderArgs,
) -> Result<()> {
    let mut failures = Vec::new();
    if rendered.info.passes > 0 && !write_pictures((files, film), rendered, args, &mut failures) {
        rescue(rendered, args);
    }
    if let Some(destination) = &files.report {
        failures.extend(text(destination, &format!("{:#}\n", rendered.report)).err());
    }
    if let (Some(destination), Some(trace)) = (&files.trace, &rendered.trace) {
        failures.extend(text(destination, trace).err());
    }
    let mut failures = failures.into_iter();
    let first = failures.next();
    failures.for_each(|error| complain(&advice::sentence(&error)));
    first.map_or(Ok(()), Err)
}

fn text(destination: &Destination, content: &str) -> Result<()> {
    destination.write(|sink| {
        let written = std::io::Write::write_all(sink, content.as_bytes());
        written.map_err(|source| Error::io(destination.path(), "write", source))
    })
}

/// Writes the checkpoint and all pictures; whether at least one of them is now there.
fn write_pictures(
    (files, film): (&Files, &FilmOrder),
    rendered: &FinishedRender,
    args: &RenderArgs,
    failures: &mut Vec<Error>,
) -> bool {
    let metadata = metadata(rendered);
    let picture = (&rendered.picture, &metadata);
    let mut is_written = false;
    let mut note = |result: Result<()>| match result {
        Ok(()) => is_written = true,
        Err(error) => failures.push(error),
    };
    if let (Some(destination), Some(file)) = (&film.checkpoint, &rendered.film) {
        let plain = (&file.film.picture(), &rendered.info.metadata());
        note(save(destination, plain, file, Packing::Fast));
    }
    let display = args.post.display(tone_map(args));
    let part = rendered.film.as_ref().filter(|_| film.range.is_some());
    for output in &files.pictures {
        note(match part {
            Some(part) if output.format() == Format::Exr => save(output.destination(), picture, part, Packing::Small),
            _ => output.write(&rendered.picture, &metadata, display),
        });
    }
    is_written
}

pub(in crate::cli) fn metadata(rendered: &FinishedRender) -> Metadata {
    let mut metadata = rendered.info.metadata();
    metadata.extend(rendered.notes.clone());
    metadata.extend(rendered.outcome.metadata());
    metadata
}

pub(in crate::cli) fn tone_map(args: &RenderArgs) -> ToneMap {
    ToneMap { curve: args.output.tonemap, exposure: args.output.exposure }
}

/// Writes the picture into the first folder that takes it: the current one, the user's, the one for temporary files.
/// A film is kept with it, so that the render can be gone on with.
fn rescue(rendered: &FinishedRender, args: &RenderArgs) {
    let stem = args.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = format!("{stem}-rescued-{}.exr", std::process::id());
    let folders = [std::env::current_dir().ok(), std::env::home_dir(), Some(std::env::temp_dir())];
    for folder in folders.into_iter().flatten() {
        let write = || {
            let output = Output::check(&folder.join(&name))?;
            match &rendered.film {
                Some(film) => {
                    let picture = (&rendered.picture, &metadata(rendered));
                    save(output.destination(), picture, film, Packing::Small)
                }
                None => output.write(&rendered.picture, &metadata(rendered), ToneMap::default()),
            }
        };
        if write().is_ok() {
            return complain(&format!("the picture is in {} instead", folder.join(&name).display()));
        }
    }
    complain("no other folder takes the picture: it is lost");
}

/// The one line that every render ends with.
pub(super) fn last_line(files: &Files, rendered: &FinishedRender) -> String {
    let RenderInfo { passes, seconds, .. } = rendered.info;
    let names: Vec<String> =
        files.pictures.iter().map(|output| output.destination().path().display().to_string()).collect();
    let written = if passes > 0 { names.join(", ") } else { "nothing to write".into() };
    let plural = if passes == 1 { "" } else { "es" };
    format!("{passes} pass{plural} in {seconds:.2} s, {}: {written}", rendered.outcome.describe())
}
