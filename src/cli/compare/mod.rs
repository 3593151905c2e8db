//! `nephroid compare`: the difference between two pictures.

mod limits;
mod report;

use std::path::PathBuf;

use clap::Args;

use self::limits::Limit;
use self::report::{Comparison, HeatMap, HeatMapOf};
use super::console::print;
use super::inputs::spare_inputs;
use crate::compare::flip::{self, PIXELS_PER_DEGREE};
use crate::compare::heat_map::{self, Scale};
use crate::compare::metrics::{self, block_means, compare};
use crate::error::{Error, Result};
use crate::picture::exr;
use crate::picture::image::Picture;
use crate::picture::output::{Destination, Format, Output};

const EXAMPLES: &str = "\
Examples:
  nephroid compare ring.exr reference.exr
  nephroid compare ring.exr reference.exr --json
  nephroid compare ring.exr reference.exr --heat-map error.png --heat-map-of hdr-flip
  nephroid compare ring.exr reference.exr --fail-above relmse=1e-3 --fail-above mean_ratio=0.01
  nephroid compare a.exr b.exr --layer caustic --block 16

With --fail-above the exit code is 5 if a measure is above its limit";

/// Flags of `nephroid compare`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CompareArgs {
    /// Picture to judge (.exr)
    #[arg(value_name = "PICTURE")]
    picture: PathBuf,

    /// Reference of the same size (.exr)
    #[arg(value_name = "REFERENCE")]
    reference: PathBuf,

    /// Layer to compare, for example albedo or caustic [default: the colour R, G, B]
    #[arg(long, value_name = "NAME", default_value = "", hide_default_value = true)]
    layer: String,

    /// Compare the means of blocks of N x N pixels: noise shrinks, a bias stays
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    block: u32,

    /// Print JSON instead of a table; an infinite error is null
    #[arg(long)]
    json: bool,

    /// Exit with code 5 if a measure is above a limit; may be given more than once. METRIC is mse, relmse,
    /// relmse_trimmed, smape, max, flip, hdr_flip, or mean_ratio for |mean ratio - 1|
    #[arg(long, value_name = "METRIC=LIMIT", value_parser = limits::limit)]
    fail_above: Vec<Limit>,

    /// Leave out FLIP, which takes most of the time
    #[arg(long)]
    no_flip: bool,

    /// Pixels per degree of sight for FLIP [default: 67.02, 3840 pixels on 0.7 m seen from 0.7 m]
    #[arg(long, value_name = "N", default_value_t = PIXELS_PER_DEGREE, hide_default_value = true)]
    pixels_per_degree: f64,

    /// Write a picture of where the error is (.png)
    #[arg(long, value_name = "FILE")]
    heat_map: Option<PathBuf>,

    /// What the heat map shows
    #[arg(long, value_name = "ERROR", value_enum, default_value_t = HeatMapOf::Relative, requires = "heat_map")]
    heat_map_of: HeatMapOf,

    /// Where the colours of the heat map end [default: 1 for FLIP, otherwise what 99.9 % of the pixels stay below]
    #[arg(long, value_name = "ERROR", value_parser = limits::positive, requires = "heat_map")]
    heat_map_max: Option<f64>,
}

/// Reads both pictures, prints their difference and writes the heat map.
///
/// # Errors
/// Those of [`exr::read`] and [`metrics::compare`], [`Error::Usage`] for flags that do not go together, and, when all
/// is printed and written, [`Error::Threshold`] for the first limit that is exceeded.
pub fn run(args: &CompareArgs) -> Result<()> {
    let heat_map = args.heat_map.as_deref().map(Output::check).transpose()?;
    if heat_map.as_ref().is_some_and(|output| output.format() != Format::Png) {
        return Err(Error::Usage("the heat map must end in .png".into()));
    }
    if let Some(output) = &heat_map {
        spare_inputs(&[output.destination()], &[&args.picture, &args.reference])?;
    }
    let read = |path: &PathBuf| -> Result<Picture> {
        let picture = exr::read(path)?.0;
        Ok(if args.block == 1 { picture } else { block_means(&picture, args.block) })
    };
    let pictures = Pictures { x: read(&args.picture)?, r: read(&args.reference)?, args };
    let mut comparison = pictures.compare()?;
    // Checked before anything is written: a limit for a measure that was left out is a mistake.
    let exceeded = comparison.exceeded(&args.fail_above)?;
    if let Some(output) = heat_map {
        comparison.heat_map = Some(pictures.heat_map(output.destination(), &comparison)?);
    }
    print(&if args.json { comparison.json()? } else { comparison.table() })?;
    exceeded.map_or(Ok(()), Err)
}

/// What is compared and how.
struct Pictures<'a> {
    x: Picture,
    r: Picture,
    args: &'a CompareArgs,
}

impl Pictures<'_> {
    fn compare(&self) -> Result<Comparison> {
        let Self { x, r, args } = self;
        let (name, ppd) = (&args.layer, args.pixels_per_degree);
        let metrics = compare(x, r, name)?;
        if args.no_flip {
            return Ok(Comparison::new(metrics, None, None));
        }
        Ok(Comparison::new(metrics, flip::ldr(x, r, name, ppd)?, flip::hdr(x, r, name, ppd)?))
    }

    /// Writes the heat map.
    fn heat_map(&self, destination: &Destination, comparison: &Comparison) -> Result<HeatMap> {
        let Self { x, r, args } = self;
        let of = args.heat_map_of;
        let values: Vec<f64> = match of {
            HeatMapOf::Relative => {
                metrics::relative_squared_errors(x, r, &args.layer)?.into_iter().map(f64::sqrt).collect()
            }
            HeatMapOf::Signed => metrics::signed_relative_errors(x, r, &args.layer)?,
            HeatMapOf::Flip | HeatMapOf::HdrFlip => {
                let map = comparison.flip_map(of == HeatMapOf::HdrFlip);
                let map =
                    map.ok_or_else(|| Error::Usage("a heat map of FLIP needs colours and no --no-flip".into()))?;
                map.iter().map(|error| f64::from(*error)).collect()
            }
        };
        let fitted = if matches!(of, HeatMapOf::Flip | HeatMapOf::HdrFlip) { 1.0 } else { heat_map::fitted(&values) };
        let high = args.heat_map_max.unwrap_or(fitted);
        let scale = if of == HeatMapOf::Signed { Scale::around_zero(high) } else { Scale::from_zero(high) };
        destination.write(|sink| heat_map::write(sink, destination.path(), x.width, &values, scale))?;
        Ok(HeatMap { file: destination.path().to_string_lossy().into_owned(), of, scale })
    }
}
