//! `nephroid bench`: the speed of each kernel beside its floor; its subcommands have files of their own.

mod estimator_report;
mod estimators;
mod machine;
mod maps;
mod photon_map;
mod trees;
mod update;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use serde_json::{Value, json};

use self::estimators::EstimatorsArgs;
use self::machine::Machine;
use self::maps::MapsArgs;
use self::photon_map::PhotonMapArgs;
use self::trees::TreesArgs;
use self::update::UpdateArgs;
use super::console::{print, spinner};
use super::device::DeviceArgs;
use super::inputs::check_readable;
use super::numbers::{bytes, si};
use crate::bench::{self, Effort, Floor, Rate, SceneReport, Yardstick, blobs};
use crate::error::Result;
use crate::scene::{self, Limits};

const EXAMPLES: &str = "\
Examples:
  nephroid bench
  nephroid bench --device cpu ring.gltf pool.gltf
  nephroid bench --json > rates.json
  nephroid bench photon-map ring.gltf pool.gltf
  nephroid bench estimators kitchen.glb
  nephroid bench trees chess.glb
  nephroid bench update chess.glb
  nephroid bench maps room.glb

Columns: the median time of a run; items a second; bytes a second as the floor counts them; the rate as
a share of what the floor allows. The floor is the least an item can cost: bytes moved at the speed of a
copy, or instructions at the speed of a chain of multiplications, both measured in the same run.";

/// Flags of `nephroid bench`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, args_conflicts_with_subcommands = true)]
pub struct BenchArgs {
    /// What to measure instead.
    #[command(subcommand)]
    pub table: Option<Table>,

    /// glTF 2.0 scenes to measure rays, photons and memory on [default: a generated mesh of 260 thousand triangles]
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,

    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,

    /// Sizes so small that the numbers mean nothing: to see that it works
    #[arg(long, hide = true)]
    pub quick: bool,

    /// Where to measure.
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Measurements with tables of their own.
#[derive(Debug, Subcommand)]
pub enum Table {
    /// Compare the density estimators: the same photons, time, pairs and memory of each
    Estimators(EstimatorsArgs),
    /// Compare photons traced in environment maps with those traced in the tree: coverage, hits, time
    Maps(MapsArgs),
    /// Compare builders and leaf sizes of the photon map, and count its photons
    PhotonMap(PhotonMapArgs),
    /// Compare the builders of trees over triangles: build time, cost, rays; and a refitted tree with a new one
    Trees(TreesArgs),
    /// Measure what changes of a scene cost in a running session
    Update(UpdateArgs),
}

/// Measures scan, sort, tree build, rays, photons and gathering, and prints a table.
///
/// # Errors
/// Those of the device, and of loading the scenes.
pub fn run(args: &BenchArgs) -> Result<()> {
    match &args.table {
        Some(Table::PhotonMap(args)) => photon_map::run(args),
        Some(Table::Estimators(args)) => estimators::run(args),
        Some(Table::Maps(args)) => maps::run(args),
        Some(Table::Trees(args)) => trees::run(args),
        Some(Table::Update(args)) => update::run(args),
        None => rates(args),
    }
}

fn rates(args: &BenchArgs) -> Result<()> {
    args.scenes.iter().try_for_each(|path| check_readable(path))?;
    // All are loaded before anything is measured: a bad one is found now rather than in ten minutes.
    let mut loaded =
        args.scenes.iter().map(|path| scene::load(path, &Limits::default())).collect::<Result<Vec<_>>>()?;
    if loaded.is_empty() {
        loaded.push(if args.quick { blobs(8, 16) } else { blobs(128, 256) });
    }
    let open = || args.device.open();
    let runtime = open()?;
    let effort = if args.quick { Effort::quick() } else { Effort::full(&runtime) };
    let spinner = spinner();
    let mut begin = |what: &str| spinner.set_message(format!("measuring: {what}"));
    let (yardstick, primitives) = bench::primitives(&runtime, effort, &mut begin)?;
    let machine = Machine::of(&runtime);
    drop(runtime);
    let scenes = loaded.iter().map(|scene| bench::scene(&open, effort, scene, &mut begin)).collect::<Result<_>>()?;
    spinner.finish_and_clear();
    let report = Report { machine, effort, yardstick, primitives, scenes };
    print(&if args.json { format!("{:#}", report.json()) } else { report.text() })
}

/// Everything that is printed.
struct Report {
    machine: Machine,
    effort: Effort,
    yardstick: Yardstick,
    primitives: Vec<Rate>,
    scenes: Vec<SceneReport>,
}

impl Report {
    fn text(&self) -> String {
        let mut lines = self.machine.lines();
        if self.effort.is_quick() {
            lines.push("sizes too small for a measurement: these numbers mean nothing".into());
        }
        lines.push(String::new());
        lines.push(format!(
            "{:<22} {:>9} {:>10} {:>21} {:>9} {:>16} {:>9}",
            "", "items", "time", "rate", "bytes/s", "floor", "of floor"
        ));
        lines.extend(self.primitives.iter().map(|rate| self.line(rate)));
        for scene in &self.scenes {
            lines.push(String::new());
            lines.push(format!("{}: {} triangles", scene.name, scene.triangles));
            lines.extend(scene.rates.iter().map(|rate| self.line(rate)));
            lines.push(format!("{:<22} {} at its peak", "device memory", bytes(scene.peak_bytes)));
        }
        lines.join("\n")
    }

    fn line(&self, rate: &Rate) -> String {
        let floor = match rate.floor {
            Floor::Unknown => "-".into(),
            Floor::Bytes(n) => format!("{n} bytes"),
            Floor::Instructions(n) => format!("{n} instructions"),
        };
        let share = rate.of_floor(&self.yardstick).map_or("-".into(), |share| format!("{:.1} %", 100.0 * share));
        let bandwidth = rate.bytes_per_second().map_or("-".into(), |b| format!("{}B", si(b)));
        let line = format!(
            "{:<22} {:>9} {:>7.2} ms {:>21} {bandwidth:>9} {floor:>16} {share:>9}  {}",
            rate.name,
            si(rate.items as f64),
            1e3 * rate.seconds,
            format!("{} {}/s", si(rate.per_second()), rate.unit),
            rate.note,
        );
        line.trim_end().to_owned()
    }

    fn json(&self) -> Value {
        let rates = |rates: &[Rate]| rates.iter().map(|rate| self.rate_json(rate)).collect::<Value>();
        let scene = |s: &SceneReport| {
            json!({
                "scene": s.name, "triangles": s.triangles, "device_peak_bytes": s.peak_bytes, "rates": rates(&s.rates),
            })
        };
        let own = [
            ("meaningless", json!(self.effort.is_quick())),
            ("copy_bytes_per_second", json!(self.yardstick.bytes_per_second)),
            ("instructions_per_second", json!(self.yardstick.instructions_per_second)),
            ("rates", rates(&self.primitives)),
            ("scenes", self.scenes.iter().map(scene).collect()),
        ];
        let mut report = self.machine.json();
        report.extend(own.map(|(name, value)| (name.to_owned(), value)));
        Value::Object(report)
    }

    fn rate_json(&self, rate: &Rate) -> Value {
        let (bytes, instructions) = match rate.floor {
            Floor::Unknown => (None, None),
            Floor::Bytes(n) => (Some(n), None),
            Floor::Instructions(n) => (None, Some(n)),
        };
        json!({
            "name": rate.name, "items": rate.items, "unit": rate.unit, "seconds": rate.seconds,
            "per_second": rate.per_second(), "bytes_per_second": rate.bytes_per_second(),
            "floor_bytes_per_item": bytes, "floor_instructions_per_item": instructions,
            "of_floor": rate.of_floor(&self.yardstick), "note": rate.note,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_of_its_own_and_a_table_exclude_each_other() {
        use clap::Parser;
        #[derive(Debug, Parser)]
        struct Line {
            #[command(flatten)]
            args: BenchArgs,
        }
        let parsed = |line: &str| Line::try_parse_from(line.split(' ')).map(|line| line.args);
        let plain = parsed("bench a.glb b.glb --json").expect("scenes");
        assert!(plain.table.is_none() && plain.scenes.len() == 2);
        let Some(Table::Estimators(args)) = parsed("bench estimators a.glb").expect("a table").table else {
            panic!("no table");
        };
        assert_eq!(args.scenes, [PathBuf::from("a.glb")]);
        let files = parsed("bench --json estimators").expect("after a flag it is a file's name");
        assert!(files.table.is_none() && files.scenes == [PathBuf::from("estimators")]);
        assert!(parsed("bench estimators").is_err(), "a scene is needed");
    }

    #[test]
    fn a_line_has_time_rate_and_share_of_the_floor() {
        let machine = Machine::example();
        let yardstick = Yardstick { bytes_per_second: 10e9, instructions_per_second: 1e9 };
        let rate =
            |floor| Rate { name: "sort", items: 1 << 20, unit: "pairs", seconds: 0.0209, floor, note: "1.35 x".into() };
        let rates = vec![rate(Floor::Bytes(80.0)), rate(Floor::Unknown)];
        let report = Report { machine, effort: Effort::quick(), yardstick, primitives: rates, scenes: vec![] };
        let text = report.text();
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[0], ["d,", "software,", "driver", "v"]);
        assert_eq!(
            lines[5],
            [
                "sort", "1.05", "M", "20.90", "ms", "50.2", "M", "pairs/s", "4.01", "GB", "80", "bytes", "40.1", "%",
                "1.35", "x"
            ]
        );
        assert!(lines[6].ends_with(&["-", "-", "-", "1.35", "x"]), "{text}");
        assert!(text.contains("mean nothing"));
        assert_eq!(report.json()["rates"][0]["floor_bytes_per_item"], 80.0);
    }
}
