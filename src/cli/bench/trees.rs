//! `nephroid bench trees`: builders of trees over triangles.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use super::machine::Machine;
use crate::bench::{DeformedRow, Effort, TreeRow, TreesReport, blobs, trees};
use crate::cli::console::{print, spinner};
use crate::cli::device::DeviceArgs;
use crate::cli::inputs::check_readable;
use crate::cli::numbers::si;
use crate::error::Result;
use crate::scene::{self, Limits};

const HELP: &str = "\
For each scene the trees by sah (the host), lbvh and hploc (the device): milliseconds of a build and of a
refit, the surface-area cost over that of sah, nodes, primary and diffuse rays a second. Generated scenes are
four displaced spheres of a thousand to a million triangles in all. With --deform the mesh is twisted, and a
refitted tree by sah compared with a new one by hploc.";

/// Flags of `nephroid bench trees`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct TreesArgs {
    /// glTF 2.0 scenes [default: generated meshes of 1e3, 1e4, 1e5 and 1e6 triangles]
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,

    /// Twist each mesh as well
    #[arg(long)]
    pub deform: bool,

    /// Print JSON instead of tables
    #[arg(long)]
    pub json: bool,

    /// Sizes so small that the numbers mean nothing: to see that it works
    #[arg(long, hide = true)]
    pub quick: bool,

    /// Where to measure.
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Rings of the four spheres, with twice as many segments: 1e3, 1e4, 1e5 and 1e6 triangles.
const RINGS: [u32; 4] = [9, 26, 80, 251];

/// Measures and prints.
///
/// # Errors
/// Those of the device, and of loading the scenes.
pub fn run(args: &TreesArgs) -> Result<()> {
    args.scenes.iter().try_for_each(|path| check_readable(path))?;
    let mut scenes =
        args.scenes.iter().map(|path| scene::load(path, &Limits::default())).collect::<Result<Vec<_>>>()?;
    if scenes.is_empty() {
        let rings = if args.quick { &RINGS[..1] } else { &RINGS[..] };
        scenes = rings.iter().map(|&rings| blobs(rings, 2 * rings)).collect();
    }
    let runtime = args.device.open()?;
    let full = Effort { rays: 512, ..Effort::full(&runtime) };
    let effort = if args.quick { Effort::quick() } else { full };
    let spinner = spinner();
    let mut begin = |what: &str| spinner.set_message(format!("measuring: {what}"));
    let reports = scenes
        .iter()
        .map(|scene| trees(&runtime, (scene, args.deform), effort, &mut begin))
        .collect::<Result<Vec<_>>>()?;
    spinner.finish_and_clear();
    let machine = Machine::of(&runtime);
    let tables = || [vec![machine.lines().join("\n")], reports.iter().map(text).collect()].concat().join("\n\n");
    print(&if args.json { format!("{:#}", as_json(&machine, &reports)) } else { tables() })
}

fn text(report: &TreesReport) -> String {
    let mut lines = vec![
        format!("{}: {} triangles", report.name, report.triangles),
        format!(
            "{:<8}{:>11}{:>11}{:>8}{:>10}{:>14}{:>14}",
            "", "build, ms", "refit, ms", "cost", "nodes", "primary/s", "diffuse/s"
        ),
    ];
    let rate = |rate: Option<f64>| rate.map_or("-".into(), si);
    lines.extend(report.rows.iter().map(|row| {
        let TreeRow { builder, build, refit, cost, nodes, primary, diffuse } = row;
        let (build_ms, refit_ms, primary, diffuse) = (1e3 * build, 1e3 * refit, rate(*primary), rate(*diffuse));
        format!("{builder:<8}{build_ms:>11.2}{refit_ms:>11.2}{cost:>8.3}{nodes:>10}{primary:>14}{diffuse:>14}")
    }));
    if !report.deformed.is_empty() {
        lines.push(format!("{:<14}{:>12}{:>16}{:>18}", "twist", "grown by", "cost over new", "diffuse over new"));
    }
    lines.extend(report.deformed.iter().map(|row| {
        let DeformedRow { degrees, growth, cost, diffuse } = row;
        let diffuse = diffuse.map_or("-".into(), |ratio| format!("{ratio:.2}"));
        format!("{:<14}{growth:>12.3}{cost:>16.3}{diffuse:>18}", format!("{degrees} degrees"))
    }));
    lines.join("\n")
}

fn as_json(machine: &Machine, reports: &[TreesReport]) -> Value {
    let row = |row: &TreeRow| {
        json!({
            "builder": row.builder, "build_seconds": row.build, "refit_seconds": row.refit, "relative_cost": row.cost,
            "nodes": row.nodes, "primary_per_second": row.primary, "diffuse_per_second": row.diffuse,
        })
    };
    let deformed = |row: &DeformedRow| {
        json!({
            "degrees": row.degrees, "growth": row.growth, "cost_over_new": row.cost, "diffuse_over_new": row.diffuse,
        })
    };
    let scene = |report: &TreesReport| {
        json!({
            "scene": report.name, "triangles": report.triangles,
            "trees": report.rows.iter().map(row).collect::<Value>(),
            "deformed": report.deformed.iter().map(deformed).collect::<Value>(),
        })
    };
    let mut all = machine.json();
    all.insert("scenes".into(), reports.iter().map(scene).collect());
    Value::Object(all)
}
