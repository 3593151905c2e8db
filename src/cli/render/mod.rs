//! `nephroid render`: a scene in, pictures out.

pub(super) mod checkpoint;
pub(super) mod engine;
pub(super) mod files;
pub(super) mod finished;
mod flags;
pub(super) mod flags_film;
mod flags_post;
pub(super) mod monitor;
pub(super) mod post;
mod report;
pub(super) mod request;
pub(super) mod stop_rule;

use std::sync::atomic::AtomicBool;

use self::files::{check_files, last_line, write_files};
use self::finished::FinishedRender;
pub(super) use self::flags::{EffortArgs, LightArgs, OutputArgs, RenderArgs, ViewArgs};
pub(super) use self::flags_film::FilmArgs;
pub(super) use self::flags_post::{LensArgs, PostArgs};
use self::monitor::Monitor;
use self::request::Request;
use super::console::print;
use super::interrupt;
use super::progress::Progress;
use crate::error::{Error, Result};
use crate::picture::claim::Claim;

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
    renderer: impl FnOnce(&Request, &mut Monitor) -> Result<FinishedRender>,
) -> Result<()> {
    let mut request = Request::new(args)?;
    let files = check_files(args, &request.film)?;
    request.outputs.extend(files.destinations().cloned());
    let _claim = request.film.checkpoint.as_ref().map(Claim::of).transpose()?;
    let mut monitor = Monitor { stop, progress: Progress::new(request.limit, args.output.quiet) };
    let rendered = renderer(&request, &mut monitor);
    monitor.progress.finish();
    let mut rendered = rendered?;
    write_files((&files, &request.film), &rendered, args)?;
    print(&last_line(&files, &rendered))?;
    rendered.failure.take().map_or(Ok(()), Err)?;
    if monitor.is_stopped() { Err(Error::Interrupted) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::flags_film::FilmOrder;
    use super::stop_rule::{Outcome, StopReason};
    use super::*;
    use crate::cli::progress::{Limit, Status};
    use crate::cli::values::{Aov, Size};
    use crate::picture::exr;
    use crate::picture::exr::{Metadata, RenderInfo};
    use crate::picture::image::{Channels, Picture};
    use crate::picture::tonemap::Curve;
    use crate::render::Weight;
    use clap::Parser;
    use std::fs;
    use std::sync::atomic::Ordering;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: RenderArgs,
    }

    /// A folder with an empty scene file, which these tests never read.
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

    fn rendered(passes: u64) -> FinishedRender {
        let mut picture = Picture::new(1, 1);
        picture.push("", Channels::Rgb, vec![0.25; 3]);
        let info = RenderInfo { passes, seconds: 1.5, ..RenderInfo::default() };
        let report = serde_json::json!({ "passes": passes });
        let outcome = Outcome { error: Some(0.0123), stop: StopReason::Time };
        let trace = Some("[]".into());
        FinishedRender { picture, info, notes: Metadata::new(), outcome, film: None, report, trace, failure: None }
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
        let request = Request::new(&args).expect("valid");
        assert_eq!(request.limit, Limit { passes: Some(7), seconds: Some(120.0) });
        assert_eq!((request.photons, request.seed), (Some(250_000), 9));
        assert_eq!((request.view.size, request.view.camera.as_str()), (Size { width: 32, height: 16 }, "side"));
        assert_eq!(request.view.aov, [Aov::Albedo, Aov::Depth]);
        assert_eq!((request.light.weight, request.light.environment.file()), (Weight::Constant, None));
        assert_eq!((request.device.device.as_deref(), request.device.validate), (Some("cpu"), true));
        assert!(!request.wants_trace);
    }

    #[test]
    fn one_percent_or_thirty_seconds_unless_a_limit_is_given() {
        let folder = folder();
        let limit = |line: &str| {
            let request = Request::new(&args(&folder, &format!("-o @/a.exr {line}"))).expect("valid");
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
        run_with(&args, &AtomicBool::new(false), |_, monitor| {
            assert_eq!(names_in(&folder), ["a.glb"], "nothing is written before the end");
            assert!(monitor.pass_done(Status::default()));
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
        let result = run_with(&args(&folder, "-q -o @/a.exr"), &stop, |_, monitor| {
            stop.store(true, Ordering::SeqCst);
            assert!(!monitor.pass_done(Status::default()));
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

    /// Whatever step of writing fails: the other files are there and whole, nothing is left behind, and the error names
    /// the file. A fault before the render is an error before the render.
    #[test]
    fn one_failed_step_takes_one_file_along() {
        use crate::injection::{Step, arm, disarm};
        let line = "-q -o @/a.exr -o @/a.png --report @/report.json --trace @/trace.json";
        let whole = ["a.exr", "a.glb", "a.png", "report.json", "trace.json"];
        let mut faults = 0;
        for step in [Step::Create, Step::Write, Step::Sync, Step::Rename] {
            for before in 0.. {
                let folder = folder();
                let args = args(&folder, line);
                let mut has_rendered = false;
                arm(step, before);
                let result = run_with(&args, &AtomicBool::new(false), |_, _| {
                    has_rendered = true;
                    Ok(rendered(3))
                });
                if !disarm() {
                    result.expect("no fault came");
                    assert_eq!(names_in(&folder), whole);
                    break;
                }
                faults += 1;
                let error = result.expect_err("the fault is told");
                assert!(
                    matches!(&error, Error::Io { .. }) && error.to_string().contains("fault on request"),
                    "{error}"
                );
                let lost = if has_rendered { 1 } else { whole.len() - 1 };
                let names = names_in(&folder);
                assert_eq!(names.len(), whole.len() - lost, "{step:?} {before}: {names:?}, {error}");
                assert!(names.iter().all(|name| whole.contains(&name.as_str())), "{names:?}");
                if names.contains(&"a.exr".to_owned()) {
                    assert_eq!(exr::read(&folder.path().join("a.exr")).expect("whole").0, rendered(3).picture);
                }
            }
        }
        assert!(faults >= 4 * 4, "{faults}");
    }

    #[test]
    fn a_picture_without_a_place_goes_elsewhere() {
        let folder = folder();
        let args = args(&folder, "-q -o @/sub/a.exr --report @/report.json");
        fs::create_dir(folder.path().join("sub")).expect("created");
        let result = run_with(&args, &AtomicBool::new(false), |_, _| {
            fs::remove_dir(folder.path().join("sub")).expect("removed");
            Ok(rendered(3))
        });
        assert!(matches!(result, Err(Error::Io { action: "create", .. })));
        let rescued = std::env::current_dir().expect("a folder").join(format!("a-rescued-{}.exr", std::process::id()));
        assert_eq!(exr::read(&rescued).expect("a picture").0, rendered(3).picture);
        fs::remove_file(rescued).expect("removed");
        assert_eq!(names_in(&folder), ["a.glb", "report.json"]);
    }

    #[test]
    fn passes_before_a_failure_are_written() {
        let folder = folder();
        let result = run_with(&args(&folder, "-q -o @/a.exr"), &AtomicBool::new(false), |_, _| {
            Ok(FinishedRender { failure: Some(Error::NoDevice("gone".into())), ..rendered(2) })
        });
        assert!(matches!(result, Err(Error::NoDevice(_))));
        assert_eq!(names_in(&folder), ["a.exr", "a.glb"]);
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
            let never = |_: &Request, _: &mut Monitor| panic!("rendered in spite of {line}");
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
