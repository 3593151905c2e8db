//! The files of a render: checked before it starts, written when it has ended.

use std::path::{Path, PathBuf};

use super::checkpoint::save;
use super::finished::FinishedRender;
use super::flags::{OutputArgs, RenderArgs};
use super::flags_film::FilmOrder;
use crate::error::{Error, Result};
use crate::film::film_file::Packing;
use crate::picture::exr::RenderInfo;
use crate::picture::output::{Destination, Format, Output};
use crate::picture::tonemap::ToneMap;

/// Every file of a render, checked before it starts.
pub(super) struct Files {
    pictures: Vec<Output>,
    report: Option<Destination>,
    trace: Option<Destination>,
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
    let outputs = files.pictures.iter().map(Output::destination).chain(&files.report).chain(&files.trace);
    // A checkpoint may take the place of the film that is gone on with, but of no other file.
    let outputs = outputs.chain(&film.checkpoint);
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
    Ok(files)
}

/// Writes pictures, checkpoint, report and trace.
///
/// # Errors
/// [`Error::Io`].
pub(super) fn write_files(
    (files, film): (&Files, &FilmOrder),
    rendered: &FinishedRender,
    args: &RenderArgs,
) -> Result<()> {
    let text = |destination: &Destination, content: &str| {
        destination.write(|sink| {
            let written = std::io::Write::write_all(sink, content.as_bytes());
            written.map_err(|source| Error::io(destination.path(), "write", source))
        })
    };
    let mut kept = Ok(());
    if rendered.info.passes > 0 {
        let mut metadata = rendered.info.metadata();
        metadata.extend(rendered.notes.clone());
        metadata.extend(rendered.outcome.metadata());
        let picture = (&rendered.picture, &metadata);
        if let (Some(destination), Some(file)) = (&film.checkpoint, &rendered.film) {
            // An error is returned later: the pictures are written even if the checkpoint fails.
            let plain = (&file.film.picture(), &rendered.info.metadata());
            kept = save(destination, plain, file, Packing::Fast);
        }
        let map = ToneMap { curve: args.output.tonemap, exposure: args.output.exposure };
        let display = args.post.display(map);
        let part = rendered.film.as_ref().filter(|_| film.range.is_some());
        files.pictures.iter().try_for_each(|output| match part {
            Some(part) if output.format() == Format::Exr => save(output.destination(), picture, part, Packing::Small),
            _ => output.write(&rendered.picture, &metadata, display),
        })?;
    }
    if let Some(destination) = &files.report {
        text(destination, &format!("{:#}\n", rendered.report))?;
    }
    if let (Some(destination), Some(trace)) = (&files.trace, &rendered.trace) {
        text(destination, trace)?;
    }
    kept
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
