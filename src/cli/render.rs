//! `nephroid render`: a scene in, pictures out.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;

use super::flags::{DeviceArgs, EffortArgs, LightArgs, OutputArgs, ViewArgs};
use super::flags_film::{FilmArgs, FilmOrder};
use super::flags_post::{LensArgs, PostArgs};
use super::progress::{Limit, Progress, Status};
use super::stop::{DEFAULT_TARGET, Outcome};
use super::values::Aov;
use super::{check_readable, engine, interrupt, keep, print};
use crate::error::{Error, Result};
use crate::film::film_file::{FilmFile, Packing};
use crate::picture::exr::{Metadata, RenderInfo};
use crate::picture::image::Picture;
use crate::picture::output::{Destination, Format, Output};
use crate::picture::tonemap::ToneMap;

const EXAMPLES: &str = "\
Examples:
  nephroid render cup.glb -o cup.png                     an error of 1 % or 30 s, 640x480
  nephroid render cup.glb -o cup.exr --target-error 0.5% --time 1h
  nephroid render cup.glb -o cup.exr -o cup.png --size 1920x1080 --time 10m
  nephroid render ring.gltf -o ring.exr --passes 256 --aov caustic,depth --seed 7
  nephroid render car.gltf -o car.png --environment sky.exr --exposure -1
  nephroid render chess.glb -o chess.png --aperture f/2.8 --focus 0.4 --bloom 0.05
  nephroid render hall.glb -o hall.exr --time 8h --checkpoint hall.film.exr --resume hall.film.exr
  nephroid render hall.glb -o part-1.exr --pass-range 64..128     a part, for `nephroid merge`

Ctrl-C ends a render early and writes what is finished; a second Ctrl-C writes nothing.";

/// Rendering time where neither passes nor time nor error are given, in seconds.
const DEFAULT_SECONDS: f64 = 30.0;

/// Flags of `nephroid render`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct RenderArgs {
    /// glTF 2.0 scene (.gltf or .glb)
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Where results go.
    #[command(flatten)]
    pub output: OutputArgs,
    /// What is seen.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Through which lens.
    #[command(flatten)]
    pub lens: LensArgs,
    /// How much is computed.
    #[command(flatten)]
    pub effort: EffortArgs,
    /// What is kept to go on with.
    #[command(flatten)]
    pub film: FilmArgs,
    /// Light and how it is estimated.
    #[command(flatten)]
    pub light: LightArgs,
    /// Where it is computed.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// What is done to the picture after it.
    #[command(flatten)]
    pub post: PostArgs,
}

/// A checked order to the renderer.
#[derive(Debug)]
pub struct Request {
    /// Scene file; it can be opened.
    pub scene: PathBuf,
    /// Size, camera, layers.
    pub view: ViewArgs,
    /// Aperture and focus.
    pub lens: LensArgs,
    /// Passes over the finished picture.
    pub post: PostArgs,
    /// Environment and kernel; the environment can be opened.
    pub light: LightArgs,
    /// Photons per pass, if the user has a wish.
    pub photons: Option<u64>,
    /// Seed.
    pub seed: u64,
    /// When to end.
    pub limit: Limit,
    /// Relative error at which to end, too.
    pub target_error: Option<f64>,
    /// What is kept to go on with; its files can be read and written.
    pub film: FilmOrder,
    /// Device and validation.
    pub device: DeviceArgs,
    /// Whether a trace shall be recorded.
    pub wants_trace: bool,
}

/// What the renderer returns, also when it was stopped early.
#[derive(Debug)]
pub struct Rendered {
    /// The layers; none if not one pass was finished.
    pub picture: Picture,
    /// Passes, time and device, for the metadata and the last line.
    pub info: RenderInfo,
    /// More for the metadata: the lens and the passes after the film, where there are any.
    pub notes: Metadata,
    /// The error of the picture, and why the render ended.
    pub outcome: Outcome,
    /// The film, if it is to be kept.
    pub film: Option<FilmFile>,
    /// Content of `--report`.
    pub report: serde_json::Value,
    /// Content of `--trace`, if it was wanted.
    pub trace: Option<String>,
}

/// The renderer's line to the user.
pub struct Watch<'a> {
    stop: &'a AtomicBool,
    progress: Progress,
}

impl Watch<'_> {
    /// To be called after each pass; `false` asks the renderer to return what it has.
    pub fn pass_done(&mut self, status: Status) -> bool {
        self.progress.update(status);
        !self.is_stopped()
    }

    /// Whether the user sees the progress.
    pub fn is_shown(&self) -> bool {
        self.progress.is_shown()
    }

    /// Shows a warning, unless the user wants quiet.
    pub fn note(&self, sentence: &str) {
        self.progress.note(sentence);
    }

    /// Whether the user wants the render to end.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }
}

/// Every file of a render, checked before it starts.
struct Files {
    pictures: Vec<Output>,
    report: Option<Destination>,
    trace: Option<Destination>,
}

/// Renders and writes the files.
///
/// # Errors
/// [`Error::Io`] and [`Error::Usage`] before the render if a file cannot be read or written, those of the renderer, and
/// [`Error::Interrupted`] after Ctrl-C, when everything finished has been written.
pub fn run(args: &RenderArgs) -> Result<()> {
    run_with(args, interrupt::install()?, engine::render)
}

/// Does everything but the rendering itself. `stop` is set by Ctrl-C.
fn run_with(
    args: &RenderArgs,
    stop: &AtomicBool,
    renderer: impl FnOnce(&Request, &mut Watch) -> Result<Rendered>,
) -> Result<()> {
    let request = request(args)?;
    let files = check_files(args, &request.film)?;
    let mut watch = Watch { stop, progress: Progress::new(request.limit, args.output.quiet) };
    let rendered = renderer(&request, &mut watch);
    watch.progress.finish();
    let rendered = rendered?;
    write_files((&files, &request.film), &rendered, args)?;
    print(&last_line(&files, &rendered))?;
    if watch.is_stopped() { Err(Error::Interrupted) } else { Ok(()) }
}

fn request(args: &RenderArgs) -> Result<Request> {
    check_readable(&args.scene)?;
    args.light.environment.iter().try_for_each(|path| check_readable(path))?;
    let EffortArgs { target_error, passes, time, photons, seed } = args.effort;
    let film = args.film.order()?;
    let passes = film.range.as_ref().map(|range| range.end - range.start).or(passes);
    let is_open = target_error.is_none() && passes.is_none() && time.is_none();
    let seconds = time.or(is_open.then_some(DEFAULT_SECONDS));
    let target_error = target_error.or(is_open.then_some(DEFAULT_TARGET));
    let mut view = args.view.clone();
    view.aov = Aov::resolve(&view.aov);
    Ok(Request {
        scene: args.scene.clone(),
        view,
        lens: args.lens.clone(),
        post: args.post.clone(),
        light: args.light.clone(),
        photons,
        seed,
        limit: Limit { passes, seconds },
        target_error,
        film,
        device: args.device.clone(),
        wants_trace: args.output.trace.is_some(),
    })
}

fn check_files(args: &RenderArgs, film: &FilmOrder) -> Result<Files> {
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
    let mut taken: Vec<&Path> =
        std::iter::once(&args.scene).chain(&args.light.environment).chain(resumed).map(PathBuf::as_path).collect();
    for destination in outputs {
        if taken.iter().any(|path| destination.is_same_file(path)) {
            return Err(Error::Usage(format!("'{}' is named twice", destination.path().display())));
        }
        taken.push(destination.path());
    }
    Ok(files)
}

fn write_files((files, film): (&Files, &FilmOrder), rendered: &Rendered, args: &RenderArgs) -> Result<()> {
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
            // If it fails, the pictures are all the more important.
            let plain = (&file.film.picture(), &rendered.info.metadata());
            kept = keep::save(destination, plain, file, Packing::Fast);
        }
        let map = ToneMap { curve: args.output.tonemap, exposure: args.output.exposure };
        let display = args.post.display(map);
        let part = rendered.film.as_ref().filter(|_| film.range.is_some());
        files.pictures.iter().try_for_each(|output| match part {
            Some(part) if output.format() == Format::Exr => {
                keep::save(output.destination(), picture, part, Packing::Small)
            }
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
fn last_line(files: &Files, rendered: &Rendered) -> String {
    let RenderInfo { passes, seconds, .. } = rendered.info;
    let names: Vec<String> =
        files.pictures.iter().map(|output| output.destination().path().display().to_string()).collect();
    let written = if passes > 0 { names.join(", ") } else { "nothing to write".into() };
    let plural = if passes == 1 { "" } else { "es" };
    format!("{passes} pass{plural} in {seconds:.2} s, {}: {written}", rendered.outcome.describe())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::stop::Stop;
    use crate::cli::values::Size;
    use crate::picture::exr;
    use crate::picture::image::Channels;
    use crate::picture::tonemap::Curve;
    use crate::render::Weight;
    use clap::Parser;
    use std::fs;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: RenderArgs,
    }

    /// A folder with a scene file that nobody reads.
    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("a.glb"), "").expect("written");
        folder
    }

    /// Parses `nephroid a.glb LINE`, where `@` stands for the folder.
    fn args(folder: &tempfile::TempDir, line: &str) -> RenderArgs {
        let line = format!("nephroid @/a.glb {line}").replace('@', &folder.path().display().to_string());
        Line::try_parse_from(line.split_whitespace()).expect("a valid line").args
    }

    fn rendered(passes: u64) -> Rendered {
        let mut picture = Picture::new(1, 1);
        picture.push("", Channels::Rgb, vec![0.25; 3]);
        let info = RenderInfo { passes, seconds: 1.5, ..RenderInfo::default() };
        let report = serde_json::json!({ "passes": passes });
        let outcome = Outcome { error: Some(0.0123), stop: Stop::Time };
        Rendered { picture, info, notes: Metadata::new(), outcome, film: None, report, trace: Some("[]".into()) }
    }

    fn names_in(folder: &tempfile::TempDir) -> Vec<String> {
        let entries = fs::read_dir(folder.path()).expect("a folder");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn every_flag_reaches_the_renderer() {
        let folder = folder();
        let line = "-o @/a.exr --size 32x16 --camera side --passes 7 --time 2m --photons 250k --seed 9 --device cpu \
                    --kernel constant --aov depth,albedo,depth --validate --quiet --exposure -1.5";
        let args = args(&folder, line);
        assert_eq!((args.output.exposure, args.output.tonemap), (-1.5, Curve::Neutral));
        let request = request(&args).expect("valid");
        assert_eq!(request.limit, Limit { passes: Some(7), seconds: Some(120.0) });
        assert_eq!((request.photons, request.seed), (Some(250_000), 9));
        assert_eq!((request.view.size, request.view.camera.as_str()), (Size { width: 32, height: 16 }, "side"));
        assert_eq!(request.view.aov, [Aov::Albedo, Aov::Depth]);
        assert_eq!((request.light.kernel, request.light.environment), (Weight::Constant, None));
        assert_eq!((request.device.device.as_deref(), request.device.validate), (Some("cpu"), true));
        assert!(!request.wants_trace);
    }

    #[test]
    fn one_percent_or_thirty_seconds_unless_a_limit_is_given() {
        let folder = folder();
        let limit = |line: &str| {
            let request = request(&args(&folder, &format!("-o @/a.exr {line}"))).expect("valid");
            (request.target_error, request.limit.passes, request.limit.seconds)
        };
        assert_eq!(limit(""), (Some(0.01), None, Some(30.0)));
        assert_eq!(limit("--passes 3"), (None, Some(3), None));
        assert_eq!(limit("--time 5s"), (None, None, Some(5.0)));
        assert_eq!(limit("--target-error 2%"), (Some(0.02), None, None));
        assert_eq!(limit("--target-error 0.02 --time 5s --passes 9"), (Some(0.02), Some(9), Some(5.0)));
    }

    #[test]
    fn all_files_are_written() {
        let folder = folder();
        let args = args(&folder, "-q -o @/a.exr -o @/a.png --report @/report.json --trace @/trace.json");
        run_with(&args, &AtomicBool::new(false), |_, watch| {
            assert_eq!(names_in(&folder), ["a.glb"], "nothing is written before the end");
            assert!(watch.pass_done(Status::default()));
            Ok(rendered(3))
        })
        .expect("rendered");
        assert_eq!(names_in(&folder), ["a.exr", "a.glb", "a.png", "report.json", "trace.json"]);
        let (picture, metadata) = exr::read(&folder.path().join("a.exr")).expect("our own file");
        assert_eq!(picture, rendered(3).picture);
        assert_eq!(metadata["passes"], exr::Value::Count(3));
        assert_eq!(metadata["estimated_error"], exr::Value::Number(0.0123));
        assert_eq!(metadata["stop_reason"], exr::Value::Text("time".into()));
        let report = fs::read_to_string(folder.path().join("report.json")).expect("read");
        assert_eq!(report, "{\n  \"passes\": 3\n}\n");
    }

    #[test]
    fn an_interrupted_render_writes_what_is_finished() {
        let folder = folder();
        let stop = AtomicBool::new(false);
        let result = run_with(&args(&folder, "-q -o @/a.exr"), &stop, |_, watch| {
            stop.store(true, Ordering::SeqCst);
            assert!(!watch.pass_done(Status::default()));
            Ok(rendered(1))
        });
        assert!(matches!(result, Err(Error::Interrupted)));
        assert_eq!(names_in(&folder), ["a.exr", "a.glb"]);
        fs::remove_file(folder.path().join("a.exr")).expect("removed");
        let result = run_with(&args(&folder, "-q -o @/a.exr"), &stop, |_, _| Ok(rendered(0)));
        assert!(matches!(result, Err(Error::Interrupted)));
        assert_eq!(names_in(&folder), ["a.glb"], "no pass, no picture");
    }

    #[test]
    fn a_failed_render_leaves_nothing() {
        let folder = folder();
        let result = run_with(&args(&folder, "-q -o @/a.exr"), &AtomicBool::new(false), |_, _| {
            Err(Error::NoDevice("none".into()))
        });
        assert_eq!(result.expect_err("no device").exit_code(), 3);
        assert_eq!(names_in(&folder), ["a.glb"]);
    }

    #[test]
    fn bad_files_are_found_before_rendering() {
        let folder = folder();
        for (line, code) in [
            ("-o @/no/a.exr", 2),
            ("-o @/a.jpg", 1),
            ("-o @/a.exr -o @/a.exr", 1),
            ("-o @/a.exr --report @/./a.exr", 1),
            ("-o @/a.exr --trace @/a.glb", 1),
            ("-o @/a.exr --trace @", 2),
            ("-o @/a.exr --environment @/no.hdr", 2),
        ] {
            let never = |_: &Request, _: &mut Watch| panic!("rendered in spite of {line}");
            let error = run_with(&args(&folder, line), &AtomicBool::new(false), never).expect_err(line);
            assert_eq!(error.exit_code(), code, "{line}: {error}");
        }
    }

    #[test]
    fn the_last_line_has_seconds_error_and_reason() {
        let folder = folder();
        let args = args(&folder, "-o @/a.exr -o @/b.png");
        let line = last_line(&check_files(&args, &FilmOrder::default()).expect("writable"), &rendered(118));
        let path = folder.path().display();
        let numbers = "118 passes in 1.50 s, error 1.2 % (estimated), stopped by time";
        assert_eq!(line, format!("{numbers}: {path}/a.exr, {path}/b.png"));
    }
}
