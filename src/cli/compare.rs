//! `nephroid compare`: the difference between two pictures.

use std::path::PathBuf;

use clap::Args;

use crate::error::{Error, Result};
use crate::film::image::Picture;
use crate::film::metrics::{Metrics, block_means, compare};
use crate::film::{exr, metrics};

const EXAMPLES: &str = "\
Examples:
  nephroid compare ring.exr reference.exr
  nephroid compare ring.exr reference.exr --json
  nephroid compare a.exr b.exr --layer caustic --block 16";

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
}

/// Reads both pictures and prints their difference.
///
/// # Errors
/// Those of [`exr::read`] and [`metrics::compare`].
pub fn run(args: &CompareArgs) -> Result<()> {
    let read = |path: &PathBuf| -> Result<Picture> {
        let picture = exr::read(path)?.0;
        Ok(if args.block == 1 { picture } else { block_means(&picture, args.block) })
    };
    let metrics = compare(&read(&args.picture)?, &read(&args.reference)?, &args.layer)?;
    super::print(&if args.json { json(&metrics)? } else { table(&metrics) })
}

fn json(metrics: &Metrics) -> Result<String> {
    serde_json::to_string_pretty(metrics).map_err(|cause| Error::Usage(format!("cannot write JSON: {cause}")))
}

fn table(metrics: &Metrics) -> String {
    let trimmed = format!("{:.1} % of the pixels removed", 100.0 * metrics::TRIM);
    [
        format!("mse             {:<12.4e}mean of (x - r)^2", metrics.mse),
        format!("relmse          {:<12.4e}mean of (x - r)^2 / (r^2 + {})", metrics.relmse, metrics::RELMSE_FLOOR),
        format!("relmse trimmed  {:<12.4e}the same, worst {trimmed}", metrics.relmse_trimmed),
        format!("smape           {:<12.4e}mean of |x - r| / (|x| + |r|)", metrics.smape),
        format!("max             {:<12.4e}greatest |x - r|", metrics.max),
        format!("mean ratio      {:<12.6}mean of x / mean of r", metrics.mean_ratio),
        format!("not finite      {:<12}numbers in x", metrics.non_finite),
    ]
    .join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::image::Channels;

    fn metrics_of(value: f32) -> Metrics {
        let picture = |value: f32| {
            let mut picture = Picture::new(2, 2);
            picture.push("", Channels::Rgb, vec![value; 12]);
            picture
        };
        compare(&picture(value), &picture(1.0), "").expect("same size")
    }

    #[test]
    fn json_holds_every_measure_under_its_name() {
        let value: serde_json::Value = serde_json::from_str(&json(&metrics_of(1.5)).expect("JSON")).expect("JSON");
        assert_eq!(value["mse"], 0.25);
        assert_eq!(value["mean_ratio"], 1.5);
        assert!((value["relmse_trimmed"].as_f64().expect("a number") - 0.25 / 1.01).abs() < 1e-12);
        assert_eq!((&value["max"], &value["non_finite"], &value["pixels"]), (&0.5.into(), &0.into(), &4.into()));
        let broken: serde_json::Value =
            serde_json::from_str(&json(&metrics_of(f32::NAN)).expect("JSON")).expect("JSON");
        assert!(broken["mse"].is_null());
        assert_eq!(broken["non_finite"], 12);
    }

    #[test]
    fn the_table_has_one_measure_a_line() {
        let table = table(&metrics_of(1.5));
        assert_eq!(table.lines().count(), 7);
        assert!(table.contains("mse             2.5000e-1   mean of"), "{table}");
        assert!(table.contains("worst 0.1 % of the pixels removed"), "{table}");
    }
}
