//! `nephroid bench photon-map`: builders, leaf sizes and footprints of the photon map.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::bench::{
    BuilderTimes, LEAF_SIZES, LeafTime, PERCENTILES, PhotonMapEffort, PhotonMapReport, Queries, Radii, photon_map,
};
use crate::cli::console::{print, spinner};
use crate::cli::device::DeviceArgs;
use crate::cli::inputs::check_readable;
use crate::cli::values::{self, Size};
use crate::error::Result;
use crate::scene::{self, Limits};
use crate::vk::DeviceKind;

const HELP: &str = "\
Repeats tables 1 to 3 of Fabianowski and Dingliana 2009 on the first pass of each scene: milliseconds to
build the photon map and to gather from it by leaf size (the least of several runs), with the linear build
and with the voxel volume heuristic; photons looked at; semiaxes of the footprints.";

/// Flags of `nephroid bench photon-map`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct PhotonMapArgs {
    /// glTF 2.0 scenes
    #[arg(value_name = "SCENE", required = true)]
    pub scenes: Vec<PathBuf>,

    /// Size of the picture [default: 160x120 on software devices, 512x512 on others]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub size: Option<Size>,

    /// Photons of a pass [default: as in a render]
    #[arg(long, value_name = "N", value_parser = values::count)]
    pub photons: Option<u64>,

    /// Runs of each measurement
    #[arg(long, value_name = "N", value_parser = values::count, default_value = "15")]
    pub repeats: u64,

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
pub fn run(args: &PhotonMapArgs) -> Result<()> {
    args.scenes.iter().try_for_each(|path| check_readable(path))?;
    let scenes = args.scenes.iter().map(|path| scene::load(path, &Limits::default())).collect::<Result<Vec<_>>>()?;
    let runtime = args.device.open()?;
    let software = runtime.device().info().kind == DeviceKind::Software;
    let size = args.size.map_or(if software { [160, 120] } else { [512, 512] }, |size| [size.width, size.height]);
    let capped = |count: u64| count.min(u64::from(u32::MAX)) as u32;
    let effort = PhotonMapEffort { size, photons: args.photons.map(capped), repeats: capped(args.repeats) };
    let spinner = spinner();
    let mut begin = |what: &str| spinner.set_message(format!("measuring: {what}"));
    let reports =
        scenes.iter().map(|scene| photon_map(&runtime, scene, effort, &mut begin)).collect::<Result<Vec<_>>>()?;
    spinner.finish_and_clear();
    let tables = || reports.iter().map(text).collect::<Vec<_>>().join("\n\n");
    print(&if args.json { format!("{:#}", reports.iter().map(as_json).collect::<Value>()) } else { tables() })
}

fn text(report: &PhotonMapReport) -> String {
    let PhotonMapReport { name, photons, coverage, automatic, .. } = report;
    let columns = |cells: &mut dyn Iterator<Item = String>| cells.map(|cell| format!("{cell:>9}")).collect::<String>();
    let mut lines = vec![
        format!("{name}: {photons} photons, {coverage:.2} at a point on average"),
        format!("{:<26}{}", "leaf size", columns(&mut LEAF_SIZES.iter().map(u32::to_string))),
    ];
    for (times, automatic) in report.builders.iter().zip(automatic) {
        let name = format!("{:?}", times.build).to_lowercase();
        let mut row = |what: &str, of: &dyn Fn(&LeafTime) -> String| {
            lines.push(format!("{:<26}{}", format!("{name} {what}"), columns(&mut times.leaves.iter().map(of))));
        };
        row("build, ms", &|t| format!("{:.2}", 1e3 * t.build));
        row("gather, ms", &|t| format!("{:.2}", 1e3 * t.gather));
        row("both, ms", &|t| format!("{:.2}", 1e3 * t.total));
        row("both, of the best", &|t| percent(times.best(|t| t.total) / t.total));
        row("gather, of the best", &|t| percent(times.best(|t| t.gather) / t.gather));
        row("median over least", &|t| format!("{:.2}", t.noise));
        lines.push(format!("{:<26}{}", format!("{name}, leaves of {automatic}"), automatic_line(times, *automatic)));
    }
    for queries in &report.queries {
        let name = queries.estimator.name();
        let Queries { tested, accepted, seconds, .. } = queries;
        lines.push(format!(
            "photons a pixel, {name}: {tested:.1} tested, {accepted:.1} counted; map and gather {:.1} ms",
            1e3 * seconds
        ));
    }
    lines.push(format!("{:<26}{}", "percentile", columns(&mut PERCENTILES.iter().map(u32::to_string))));
    for class in &report.radii {
        let name = class_name(class);
        lines.push(format!("{:<26}{}", format!("{name} radius"), columns(&mut class.mean.iter().map(short))));
        lines.push(format!("{:<26}{}", format!("{name} axis ratio"), columns(&mut class.ratio.iter().map(short))));
    }
    lines.join("\n")
}

fn automatic_line(times: &BuilderTimes, leaf: u32) -> String {
    let share = |of: fn(&LeafTime) -> f64| times.share_of_best(leaf, of).map_or("-".into(), percent);
    format!("{} of the best, gather {}", share(|t| t.total), share(|t| t.gather))
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn short(value: &f64) -> String {
    if *value >= 0.01 && *value < 1e4 { format!("{value:.3}") } else { format!("{value:.1e}") }
}

fn class_name(class: &Radii) -> &'static str {
    if class.caustic { "caustic" } else { "other" }
}

fn as_json(report: &PhotonMapReport) -> Value {
    let leaf = |t: &LeafTime| {
        json!({
            "leaf": t.leaf, "build_seconds": t.build, "gather_seconds": t.gather, "total_seconds": t.total,
            "median_over_least": t.noise,
        })
    };
    let builder = |b: &BuilderTimes| {
        let name = format!("{:?}", b.build).to_lowercase();
        json!({ "build": name, "leaves": b.leaves.iter().map(leaf).collect::<Value>() })
    };
    let class =
        |r: &Radii| json!({ "class": class_name(r), "photons": r.photons, "radius": r.mean, "axis_ratio": r.ratio });
    json!({
        "scene": report.name, "photons": report.photons, "coverage": report.coverage, "automatic": report.automatic,
        "builders": report.builders.iter().map(builder).collect::<Value>(),
        "queries": report.queries.iter().map(|q| json!({
            "estimator": q.estimator.name(), "tested_per_pixel": q.tested, "accepted_per_pixel": q.accepted,
            "seconds": q.seconds,
        })).collect::<Value>(),
        "percentiles": PERCENTILES, "radii": report.radii.iter().map(class).collect::<Value>(),
    })
}
