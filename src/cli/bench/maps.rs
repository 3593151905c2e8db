//! `nephroid bench maps`: photons traced in environment maps, beside the tree.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::bench::{MapsReport, MapsRow, kinds_of_maps, maps};
use crate::cli::console::{print, spinner};
use crate::cli::device::DeviceArgs;
use crate::cli::inputs::check_readable;
use crate::error::Result;
use crate::kernels::maps::COUNTS;
use crate::scene::{self, Limits};

const HELP: &str = "\
Each row is a set of maps (Yao et al. 2010). covered: part of the surface that a centre sees, by rays; beside
it the same for places that were not chosen. Of the rays that meet something: right, wrong, lost (no map
knows of a surface on the ray). Of what single maps say: nothing, beside the ray, later on the ray, early,
right. times tree: time of the rays by maps, in that of the tree.";

/// Flags of `nephroid bench maps`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct MapsArgs {
    /// glTF 2.0 scenes
    #[arg(value_name = "SCENE", required = true)]
    pub scenes: Vec<PathBuf>,

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

/// Measures and prints.
///
/// # Errors
/// Those of the device, and of loading the scenes.
pub fn run(args: &MapsArgs) -> Result<()> {
    args.scenes.iter().try_for_each(|path| check_readable(path))?;
    let scenes = args.scenes.iter().map(|path| scene::load(path, &Limits::default())).collect::<Result<Vec<_>>>()?;
    let runtime = args.device.open()?;
    let spinner = spinner();
    let mut begin = |what: &str| spinner.set_message(format!("measuring: {what}"));
    let kinds = if args.quick { kinds_of_maps()[..2].to_vec() } else { kinds_of_maps() };
    let (rays, repeats) = if args.quick { (1 << 10, 1) } else { (1 << 16, 3) };
    let mut reports = Vec::new();
    for scene in &scenes {
        let report = maps(&runtime, scene, (&kinds, rays, repeats), &mut begin)?;
        if let Some(report) = report.as_ref().filter(|_| !args.json) {
            spinner.suspend(|| print(&text(report)))?;
        }
        reports.extend(report);
    }
    spinner.finish_and_clear();
    if args.json { print(&format!("{:#}", reports.iter().map(as_json).collect::<Value>())) } else { Ok(()) }
}

/// Seconds for the rays by maps alone.
fn seconds(report: &MapsReport, row: &MapsRow) -> f64 {
    (row.judge_seconds - report.tree_seconds).max(0.0)
}

fn percent(part: u32, whole: u32) -> String {
    format!("{:.1}", 100.0 * f64::from(part) / f64::from(whole.max(1)))
}

fn text(report: &MapsReport) -> String {
    let tree = report.tree_seconds;
    let mut lines = vec![
        format!(
            "{}: {} triangles; {} rays, {:.0} % hit",
            report.name,
            report.triangles,
            report.rays,
            100.0 * report.hits
        ),
        format!("by the tree: {:.1} ms, {:.2} M rays/s", 1e3 * tree, f64::from(report.rays) / tree / 1e6),
        format!(
            "{:>7} {:>6} {:>6} {:>6} {:>8} {:>7} | {:>6} {:>6} {:>6} {:>7} | \
             {:>7} {:>6} {:>5} {:>5} {:>5} | {:>9} {:>8} {:>6}",
            "centres",
            "texels",
            "layers",
            "search",
            "covered",
            "random",
            "right",
            "wrong",
            "lost",
            "phantom",
            "nothing",
            "beside",
            "later",
            "early",
            "right",
            "choice ms",
            "maps ms",
            "x tree"
        ),
    ];
    lines.extend(report.rows.iter().map(|row| {
        let count = |name: &str| row.counts[COUNTS.iter().position(|known| *known == name).unwrap_or(0)];
        let met = count("all_right") + count("all_wrong") + count("all_lost");
        let missed = count("all_escaped") + count("all_phantom");
        let said: u32 = ["none", "beside", "later", "early", "right"].map(count).iter().sum();
        let s = row.settings;
        format!(
            "{:>7} {:>6} {:>6} {:>6} {:>8.3} {:>7.3} | {:>6} {:>6} {:>6} {:>7} | \
             {:>7} {:>6} {:>5} {:>5} {:>5} | {:>9.1} {:>8.1} {:>6.2}",
            s.centres,
            s.resolution,
            s.layers,
            if s.steps { "steps" } else { "paper" },
            row.covered,
            row.covered_at_random,
            percent(count("all_right"), met),
            percent(count("all_wrong"), met),
            percent(count("all_lost"), met),
            percent(count("all_phantom"), missed),
            percent(count("none"), said),
            percent(count("beside"), said),
            percent(count("later"), said),
            percent(count("early"), said),
            percent(count("right"), said),
            1e3 * row.choice_seconds,
            1e3 * row.draw_seconds,
            seconds(report, row) / tree
        )
    }));
    lines.join("\n")
}

fn as_json(report: &MapsReport) -> Value {
    let row = |row: &MapsRow| {
        let counts: serde_json::Map<_, _> =
            COUNTS.iter().zip(row.counts).map(|(name, count)| ((*name).to_owned(), count.into())).collect();
        let s = row.settings;
        json!({
            "centres": s.centres, "candidates": s.candidates, "resolution": s.resolution, "layers": s.layers,
            "steps": s.steps, "covered": row.covered, "covered_at_random": row.covered_at_random,
            "exchanges": row.exchanges, "choice_seconds": row.choice_seconds, "draw_seconds": row.draw_seconds,
            "seconds": seconds(report, row), "counts": counts,
        })
    };
    json!({
        "scene": report.name, "triangles": report.triangles, "rays": report.rays, "hits": report.hits,
        "tree_seconds": report.tree_seconds, "rows": report.rows.iter().map(row).collect::<Value>(),
    })
}
