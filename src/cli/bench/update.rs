//! `nephroid bench update`: what changes of a scene cost in a running session.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::bench::{UpdateReport, UpdateRow, blobs, update};
use crate::cli::console::{print, spinner};
use crate::cli::device::DeviceArgs;
use crate::cli::inputs::check_readable;
use crate::cli::values::{self, Size};
use crate::error::Result;
use crate::render::{Method, Settings, Steps, TreeBuild};
use crate::scene::{self, Limits};

const HELP: &str = "\
Milliseconds of each kind of change in a running session: of the update itself, and of what it leaves to
the next pass (an empty film). Beside them a new session, on a device that has compiled nothing yet and on
one that has. A scene without a punctual light gets a faint lamp.";

/// Flags of `nephroid bench update`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct UpdateArgs {
    /// glTF 2.0 scenes [default: a generated mesh of 260 thousand triangles]
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,

    /// Size of the picture
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "320x240")]
    pub size: Size,

    /// Runs of each measurement
    #[arg(long, value_name = "N", value_parser = values::count, default_value = "15")]
    pub repeats: u64,

    /// Who builds the tree over the triangles
    #[arg(long, value_name = "BUILDER", value_enum, default_value_t)]
    pub tree: TreeBuild,

    /// Print JSON instead of tables
    #[arg(long)]
    pub json: bool,

    /// Where to measure.
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Measures and prints.
///
/// # Errors
/// Those of the device, and of loading the scenes.
pub fn run(args: &UpdateArgs) -> Result<()> {
    args.scenes.iter().try_for_each(|path| check_readable(path))?;
    let mut scenes =
        args.scenes.iter().map(|path| scene::load(path, &Limits::default())).collect::<Result<Vec<_>>>()?;
    if scenes.is_empty() {
        scenes.push(blobs(128, 256));
    }
    let (width, height, tree_build) = (args.size.width, args.size.height, args.tree);
    let settings = Settings { width, height, tree_build, ..Settings::of(Method::Photons) };
    let repeats = args.repeats.min(u64::from(u32::MAX)) as u32;
    let open = || Ok(args.device.open()?.device().clone());
    let spinner = spinner();
    let mut begin = |what: &str| spinner.set_message(format!("measuring: {what}"));
    let reports = scenes
        .iter()
        .map(|scene| update(&open, (scene, &settings), repeats, &mut begin))
        .collect::<Result<Vec<_>>>()?;
    spinner.finish_and_clear();
    let tables = || reports.iter().map(text).collect::<Vec<_>>().join("\n\n");
    print(&if args.json { format!("{:#}", reports.iter().map(as_json).collect::<Value>()) } else { tables() })
}

fn text(report: &UpdateReport) -> String {
    let mut lines = vec![
        format!("{}: {} triangles", report.name, report.triangles),
        format!("{:<26}{:>12}{:>12}{:>12}  {}", "", "update, ms", "pass, ms", "of new", "steps"),
        format!("{:<26}{:>12.2}{:>12}{:>12}", "new session", 1e3 * report.fresh, "-", "1"),
        format!(
            "{:<26}{:>12.2}{:>12}{:>12}",
            "new, kernels compiled",
            1e3 * report.warm,
            "-",
            share(report, report.warm)
        ),
    ];
    lines.extend(report.rows.iter().map(|row| {
        let UpdateRow { name, update, prepare, steps } = row;
        let (update_ms, prepare_ms, share) = (1e3 * update, 1e3 * prepare, share(report, update + prepare));
        format!("{name:<26}{update_ms:>12.3}{prepare_ms:>12.3}{share:>12}  {}", names(*steps))
    }));
    lines.join("\n")
}

/// Seconds as a share of a new session.
fn share(report: &UpdateReport, seconds: f64) -> String {
    format!("{:.4}", seconds / report.fresh)
}

fn names(steps: Steps) -> String {
    steps.iter().map(|step| format!("{step:?}").to_lowercase()).collect::<Vec<_>>().join(", ")
}

fn as_json(report: &UpdateReport) -> Value {
    let row = |row: &UpdateRow| {
        json!({
            "change": row.name, "update_seconds": row.update, "prepare_seconds": row.prepare,
            "steps": row.steps.iter().map(|step| format!("{step:?}").to_lowercase()).collect::<Value>(),
        })
    };
    json!({
        "scene": report.name, "triangles": report.triangles, "new_seconds": report.fresh,
        "new_compiled_seconds": report.warm, "changes": report.rows.iter().map(row).collect::<Value>(),
    })
}
