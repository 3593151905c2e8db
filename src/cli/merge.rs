//! `nephroid merge`: parts of one render in, their sum out.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::console::print;
use super::inputs::{check_readable, spare_film};
use super::progress::{Limit, Progress, Status};
use super::render::checkpoint::save;
use super::values;
use crate::error::{Error, Result};
use crate::film::accumulate::PassSet;
use crate::film::film_file::{self, About, Difference, FilmFile, Packing};
use crate::picture::exr::{Metadata, Value};
use crate::picture::output::{Format, Output};
use crate::picture::tonemap::{Curve, ToneMap};

const EXAMPLES: &str = "\
Examples:
  nephroid render ring.gltf -o a.exr --pass-range 0..64       on one machine
  nephroid render ring.gltf -o b.exr --pass-range 64..128     on another
  nephroid merge a.exr b.exr -o ring.exr -o ring.png --passes 128
  nephroid render ring.gltf --resume ring.exr --passes 256 -o more.exr

The result is bit for bit the film and the picture of one render of all passes, in whatever order the parts
are named. Its layers are those of the parts. Passes after the render (bloom, grading, ...) are not in it:
`nephroid render SCENE --resume FILE --passes N`, with the N that FILE has, applies them and renders nothing.";

/// Flags of `nephroid merge`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct MergeArgs {
    /// Films of one render without a pass in common: parts, checkpoints, merged films (.exr)
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,

    /// File to write, repeatable: .exr (with the film, to merge and resume again) or .png (8-bit sRGB, tone-mapped)
    #[arg(short, long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,

    /// Leave the film out of .exr files: smaller, and the end of merging
    #[arg(long)]
    picture_only: bool,

    /// Refuse unless the parts together are exactly the passes 0..N
    #[arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true)]
    passes: Option<u64>,

    /// Tone curve of a PNG
    #[arg(long, value_name = "CURVE", value_enum, default_value_t)]
    tonemap: Curve,

    /// Exposure of a PNG in stops: +1 doubles, -1 halves
    #[arg(long, value_name = "STOPS", default_value = "0", value_parser = values::stops, allow_negative_numbers = true)]
    exposure: f32,

    /// Write over a film that has more passes than the sum of the parts
    #[arg(long)]
    force: bool,

    /// Show no progress and no warnings, only the last line and errors
    #[arg(short, long)]
    quiet: bool,
}

/// Reads the parts one after the other and writes their sum.
///
/// # Errors
/// [`Error::Scene`] for parts that do not belong together or miss passes, those of [`film_file::read`] and of the
/// encoders.
pub fn run(args: &MergeArgs) -> Result<()> {
    args.parts.iter().try_for_each(|path| check_readable(path))?;
    let outputs = args.output.iter().map(|path| Output::check(path)).collect::<Result<Vec<_>>>()?;
    check_names(&args.parts, &outputs)?;
    let abouts = args.parts.iter().map(|path| film_file::read_about(path)).collect::<Result<Vec<_>>>()?;
    let passes = check_parts(&args.parts, &abouts)?;
    check_complete(&args.parts, &passes, args.passes)?;
    for output in &outputs {
        spare_film(output.destination(), if args.picture_only { 0 } else { passes.count() }, args.force)?;
    }
    let limit = Limit { passes: Some(passes.count()), seconds: None };
    let mut progress = Progress::new(limit, args.quiet);
    warn_about_devices(&abouts, &progress);
    let merged = merge(&args.parts, &abouts, &mut progress);
    progress.finish();
    write(&outputs, &merged?, args)?;
    let names: Vec<String> = outputs.iter().map(|output| output.destination().path().display().to_string()).collect();
    let plural = if args.parts.len() == 1 { "" } else { "s" };
    print(&format!("{} part{plural}, passes {passes}: {}", args.parts.len(), names.join(", ")))
}

fn check_names(parts: &[PathBuf], outputs: &[Output]) -> Result<()> {
    let mut taken: Vec<&Path> = parts.iter().map(PathBuf::as_path).collect();
    for destination in outputs.iter().map(Output::destination) {
        if taken.iter().any(|path| destination.is_same_file(path)) {
            return Err(Error::Usage(format!("'{}' is named twice", destination.path().display())));
        }
        taken.push(destination.path());
    }
    Ok(())
}

/// All passes of parts that belong together.
fn check_parts(paths: &[PathBuf], abouts: &[About]) -> Result<PassSet> {
    let mut all = PassSet::default();
    for (index, (path, about)) in paths.iter().zip(abouts).enumerate() {
        let first = paths[0].display();
        if let Some(Difference { name, ours, theirs }) = abouts[0].identity.difference(&about.identity) {
            let what = format!("a part of another render: {name} is {theirs} in it and {ours} in {first}");
            return Err(Error::scene(path, what));
        }
        let passes = about.passes()?;
        if let Some(twice) = all.overlap(&passes) {
            let holds = |about: &About| about.passes().is_ok_and(|held| held.contains(twice.start));
            let other = abouts[..index].iter().position(holds).map_or(first, |at| paths[at].display());
            let what = format!("passes {}..{} are in {other}, too", twice.start, twice.end);
            return Err(Error::scene(path, what));
        }
        all.unite(&passes);
    }
    Ok(all)
}

fn check_complete(paths: &[PathBuf], held: &PassSet, wanted: Option<u64>) -> Result<()> {
    let Some(wanted) = wanted.filter(|n| *held != PassSet::of(0..*n)) else { return Ok(()) };
    let files = paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>();
    let files = if files.len() > 3 { format!("{} ... {}", files[0], files[files.len() - 1]) } else { files.join(", ") };
    let what = match held.first_missing(0..wanted) {
        Some(missing) => format!("pass {missing} is missing"),
        None => "there are more".into(),
    };
    Err(Error::scene(files, format!("passes {held} instead of 0..{wanted}: {what}")))
}

fn warn_about_devices(abouts: &[About], progress: &Progress) {
    let mut devices: Vec<&str> = abouts.iter().flat_map(|about| &about.devices).map(String::as_str).collect();
    devices.sort_unstable();
    devices.dedup();
    if devices.len() > 1 {
        progress.note(&format!(
            "warning: parts of {} devices or drivers ({}): all passes are as good, but no single one would give the \
             same bits",
            devices.len(),
            devices.join(", ")
        ));
    }
}

/// Adds the parts one after the other: besides the sum only one part is in memory.
fn merge(paths: &[PathBuf], abouts: &[About], progress: &mut Progress) -> Result<FilmFile> {
    let read = |at: usize| {
        let file = film_file::read(&paths[at])?;
        // The file may have been replaced since its description was checked.
        let about = &abouts[at];
        if file.identity != about.identity || file.film.passes != about.passes()? {
            return Err(Error::scene(&paths[at], "it changed while it was read"));
        }
        Ok(file)
    };
    let start = Instant::now();
    let mut sum = read(0)?;
    for (at, path) in paths.iter().enumerate().skip(1) {
        progress.update(status(&sum, start));
        sum.merge(&read(at)?).map_err(|cause| Error::scene(path, cause.to_string()))?;
    }
    progress.update(status(&sum, start));
    Ok(sum)
}

fn status(sum: &FilmFile, start: Instant) -> Status {
    Status { passes: sum.film.passes.count(), photons: 0, seconds: start.elapsed().as_secs_f64(), ..Status::default() }
}

fn write(outputs: &[Output], merged: &FilmFile, args: &MergeArgs) -> Result<()> {
    let picture = merged.film.picture();
    let setting = |name: &str| merged.identity.settings.iter().find(|(known, _)| known == name).map(|(_, value)| value);
    let mut metadata = Metadata::from([
        ("passes".to_owned(), Value::Count(merged.film.passes.count())),
        ("seconds".to_owned(), Value::Number(merged.totals.seconds)),
        ("device".to_owned(), Value::Text(merged.devices.join(", "))),
    ]);
    for key in ["seed", "version"] {
        if let Some(value) = setting(key) {
            let value = value.parse().map_or_else(|_| Value::Text(value.clone()), Value::Count);
            metadata.insert(key.to_owned(), value);
        }
    }
    let map = ToneMap { curve: args.tonemap, exposure: args.exposure };
    for output in outputs {
        if output.format() == Format::Exr && !args.picture_only {
            save(output.destination(), (&picture, &metadata), merged, Packing::Small)?;
        } else {
            output.write(&picture, &metadata, map)?;
        }
    }
    Ok(())
}
