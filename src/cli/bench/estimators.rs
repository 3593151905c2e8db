//! `nephroid bench estimators`: every density estimator on the same photons.

use std::path::{Path, PathBuf};

use clap::Args;

use super::estimator_report::{GrowthReport, TableReport};
use super::machine::Machine;
use crate::bench::estimators::{SceneTable, Trial, table};
use crate::bench::growth::{Growth, Part, Sizes, Variable, growth};
use crate::cli::console::{print, spinner};
use crate::cli::device::DeviceArgs;
use crate::cli::inputs::check_readable;
use crate::cli::values::{self, FootprintRule, Size};
use crate::error::{Error, Result};
use crate::graph::Runtime;
use crate::render::Estimator;
use crate::scene::{self, Limits, Scene};

const EXAMPLES: &str = "\
Examples:
  nephroid bench estimators kitchen.glb corridors.glb
  nephroid bench estimators --estimators bvh,hash --size 640x360 --csv=times.csv pool.glb
  nephroid bench estimators --growth --svg plots --json=growth.json pool.glb

Each number is the median over passes in which all estimators take turns, with the same photons in every pass: build is
the time to make what is gathered from, gather that of all pixels. `full` gathers with the reflection that the scene
has, `Lambert` with the kernels of a scene that has nothing but Lambert's law and flat triangles (glossy surfaces then
count with the reflectance that is stored at the hit). Bytes per photon are those of the estimator beside the deposits,
as if no buffer shared memory: kept for the gather, and scratch. `brute` is left out where pixels times photons are
too many.";

/// Flags of `nephroid bench estimators`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct EstimatorsArgs {
    /// glTF 2.0 scenes, a row for each
    #[arg(value_name = "SCENE", required = true)]
    pub scenes: Vec<PathBuf>,

    /// Size of the picture [default: 320x180 on a software device, 1920x1080 on others]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub size: Option<Size>,

    /// Photons emitted per pass [default: two per pixel, at least 65536, at most 524288]
    #[arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true)]
    pub photons: Option<u64>,

    /// Passes that are timed [default: 5]
    #[arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true)]
    pub passes: Option<u64>,

    /// Estimators to compare, separated by commas [default: all]
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',')]
    pub estimators: Vec<Estimator>,

    /// Size of footprints, as in `nephroid render`
    #[arg(long, value_name = "RULE", default_value = "differential", value_parser = values::footprint)]
    pub footprint: FootprintRule,

    /// Pairs of pixel and emitted photon beyond which `brute` is left out, such as 1000M
    /// [default: 1000M on a software device, 100000M on others]
    #[arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true)]
    pub brute_pairs: Option<u64>,

    /// Measure how times grow with photons (10^4 to 10^7 emitted) and with pixels, instead of the table
    #[arg(long)]
    pub growth: bool,

    /// Folder for plots of the growth, made if it does not exist
    #[arg(long, value_name = "DIR", requires = "growth")]
    pub svg: Option<PathBuf>,

    /// Write JSON: to a file, or without one to standard output instead of the table
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<PathBuf>,

    /// Write CSV: to a file, or without one to standard output instead of the table
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub csv: Option<PathBuf>,

    /// Sizes so small that the numbers mean nothing: to see that it works
    #[arg(long, hide = true)]
    pub quick: bool,

    /// Where to measure.
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Measures and prints the table, or the growth.
///
/// # Errors
/// Those of the device, of loading the scenes and of writing files. What one estimator cannot do is told in the table.
pub fn run(args: &EstimatorsArgs) -> Result<()> {
    let to_stdout = |file: &Option<PathBuf>| file.as_deref() == Some(Path::new("-"));
    if to_stdout(&args.json) && to_stdout(&args.csv) {
        return Err(Error::Usage(
            "only one of --json and --csv can go to standard output; name a file, --csv=FILE".into(),
        ));
    }
    args.scenes.iter().try_for_each(|path| check_readable(path))?;
    let scenes = args.scenes.iter().map(|path| scene::load(path, &Limits::default())).collect::<Result<Vec<_>>>()?;
    let runtime = args.device.open()?;
    let machine = Machine::of(&runtime);
    let spinner = spinner();
    let mut begin = |what: &str| spinner.set_message(format!("measuring: {what}"));
    if args.growth {
        let mut growths: Vec<Growth> = Vec::new();
        let sizes = if args.quick { Sizes::quick() } else { Sizes::full(&runtime) };
        for scene in &scenes {
            growths.push(growth(&runtime, scene, (&trial(args, &runtime, scene), &sizes), &mut begin));
        }
        runtime.device().check_validation()?;
        spinner.finish_and_clear();
        if let Some(folder) = &args.svg {
            write_plots(folder, &growths)?;
        }
        let report = GrowthReport { machine, meaningless: args.quick, growths };
        return publish(args, || report.text(), || format!("{:#}", report.json()), || report.csv());
    }
    let mut tables: Vec<SceneTable> = Vec::new();
    for scene in &scenes {
        tables.push(table(&runtime, scene, &trial(args, &runtime, scene), &mut begin));
    }
    runtime.device().check_validation()?;
    spinner.finish_and_clear();
    let trial = trial(args, &runtime, &scenes[0]);
    let report = TableReport { machine, meaningless: args.quick, trial, tables };
    publish(args, || report.text(), || format!("{:#}", report.json()), || report.csv())
}

/// What is measured on `scene`: radii may depend on its size.
fn trial(args: &EstimatorsArgs, runtime: &Runtime, scene: &Scene) -> Trial {
    let default = if args.quick { Trial::quick(runtime) } else { Trial::full(runtime) };
    let clamped = |n: u64| n.min(u64::from(u32::MAX)) as u32;
    Trial {
        size: args.size.map_or(default.size, |size| [size.width, size.height]),
        photons: args.photons.map(clamped).or(default.photons),
        passes: args.passes.map_or(default.passes, clamped),
        footprint: args.footprint.in_scene(scene),
        estimators: if args.estimators.is_empty() { default.estimators } else { args.estimators.clone() },
        most_pairs: args.brute_pairs.map_or(default.most_pairs, |n| n as f64),
    }
}

/// Files, and what remains on standard output.
fn publish(
    args: &EstimatorsArgs,
    text: impl Fn() -> String,
    json: impl Fn() -> String,
    csv: impl Fn() -> String,
) -> Result<()> {
    let mut printed = false;
    let formats: [(&Option<PathBuf>, &dyn Fn() -> String); 2] = [(&args.json, &json), (&args.csv, &csv)];
    for (file, content) in formats {
        match file.as_deref() {
            Some(path) if path == Path::new("-") => {
                print(&content())?;
                printed = true;
            }
            Some(path) => write(path, &content())?,
            None => {}
        }
    }
    if printed { Ok(()) } else { print(&text()) }
}

fn write(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).map_err(|source| Error::io(path, "write", source))
}

/// One plot per scene, variable and part: `kitchen-photons-gather.svg`.
fn write_plots(folder: &Path, growths: &[Growth]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|source| Error::io(folder, "create", source))?;
    let mut stems: Vec<String> = Vec::new();
    for growth in growths {
        let stem =
            Path::new(&growth.name).file_stem().map_or("scene".into(), |stem| stem.to_string_lossy().into_owned());
        // Scenes of the same name in different folders.
        let again = stems.iter().filter(|known| **known == stem).count();
        let unique = if again == 0 { stem.clone() } else { format!("{stem}-{}", again + 1) };
        stems.push(stem);
        for variable in [Variable::Photons, Variable::Pixels] {
            for part in Part::ALL {
                let file = folder.join(format!("{unique}-{}-{}.svg", variable.name(), part.name()));
                write(&file, &growth.plot(variable, part).svg())?;
            }
        }
    }
    Ok(())
}
