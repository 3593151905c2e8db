//! What `nephroid compare` says: a table, JSON, and whether a limit is exceeded.

use clap::ValueEnum;

use super::limits::{Limit, Metric};
use crate::compare::flip::{Exposures, Flip};
use crate::compare::heat_map::Scale;
use crate::compare::metrics::{self, Metrics};
use crate::error::{Error, Result};

/// The difference between two pictures. The names are those of the JSON.
#[derive(Debug, serde::Serialize)]
pub struct Comparison {
    #[serde(flatten)]
    metrics: Metrics,
    /// Mean LDR-FLIP; null if it was left out or the layer is no colour.
    flip: Option<f64>,
    /// Mean HDR-FLIP.
    hdr_flip: Option<f64>,
    /// The exposures of HDR-FLIP, in stops.
    exposures: Option<Exposures>,
    /// The heat map that was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heat_map: Option<HeatMap>,
    #[serde(skip)]
    maps: [Option<Vec<f32>>; 2],
}

/// A heat map that was written.
#[derive(Debug, serde::Serialize)]
pub struct HeatMap {
    /// The file.
    pub file: String,
    /// What it shows.
    pub of: HeatMapOf,
    /// What the first and the last colour mean.
    #[serde(flatten)]
    pub scale: Scale,
}

/// What a heat map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HeatMapOf {
    /// Root of the relative squared error: dark violet (none), red, pale yellow
    Relative,
    /// The same with its sign: blue where the picture is too dark, red where it is too bright
    Signed,
    /// FLIP of what a display shows without a tone curve
    Flip,
    /// FLIP, the worst over the exposures that suit the reference
    HdrFlip,
}

impl Comparison {
    /// Puts the measures together.
    pub fn new(metrics: Metrics, ldr: Option<Flip>, hdr: Option<(Flip, Exposures)>) -> Self {
        let (hdr, exposures) = hdr.unzip();
        Self {
            metrics,
            flip: ldr.as_ref().map(|flip| flip.mean),
            hdr_flip: hdr.as_ref().map(|flip| flip.mean),
            exposures,
            heat_map: None,
            maps: [ldr, hdr].map(|flip| flip.map(|flip| flip.map)),
        }
    }

    /// FLIP of each pixel: of the display, or the worst over the exposures.
    pub fn flip_map(&self, hdr: bool) -> Option<&[f32]> {
        self.maps[usize::from(hdr)].as_deref()
    }

    /// The measure that a limit is for; None if it was left out.
    fn value(&self, metric: Metric) -> Option<f64> {
        let metrics = &self.metrics;
        Some(match metric {
            Metric::Mse => metrics.mse,
            Metric::Relmse => metrics.relmse,
            Metric::RelmseTrimmed => metrics.relmse_trimmed,
            Metric::Smape => metrics.smape,
            Metric::Max => metrics.max,
            Metric::MeanRatio => (metrics.mean_ratio - 1.0).abs(),
            Metric::Flip => return self.flip,
            Metric::HdrFlip => return self.hdr_flip,
        })
    }

    /// The [`Error::Threshold`] for the first limit that is exceeded. NaN exceeds every limit.
    ///
    /// # Errors
    /// [`Error::Usage`] for a limit of FLIP if that was left out.
    pub fn exceeded(&self, limits: &[Limit]) -> Result<Option<Error>> {
        let mut first = None;
        for limit in limits {
            let value = self.value(limit.metric).ok_or_else(|| {
                Error::Usage(format!("a limit of {} needs colours and no --no-flip", limit.metric.name()))
            })?;
            if (value.is_nan() || value > limit.greatest) && first.is_none() {
                first = Some(Error::Threshold { metric: limit.metric.name(), value, limit: limit.greatest });
            }
        }
        Ok(first)
    }

    /// All of it as JSON.
    ///
    /// # Errors
    /// [`Error::Usage`] with the cause if it cannot be written.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map_err(|cause| Error::Usage(format!("cannot write JSON: {cause}")))
    }

    /// One measure a line, with its meaning.
    pub fn table(&self) -> String {
        let (metrics, trimmed) = (&self.metrics, format!("{:.1} % of the pixels removed", 100.0 * metrics::TRIM));
        let mut lines = vec![
            format!("mse             {:<12.4e}mean of (x - r)^2", metrics.mse),
            format!("relmse          {:<12.4e}mean of (x - r)^2 / (r^2 + {})", metrics.relmse, metrics::RELMSE_FLOOR),
            format!("relmse trimmed  {:<12.4e}the same, worst {trimmed}", metrics.relmse_trimmed),
            format!("smape           {:<12.4e}mean of |x - r| / (|x| + |r|)", metrics.smape),
            format!("max             {:<12.4e}greatest |x - r|", metrics.max),
            format!("mean            {:<12.6}mean of x", metrics.mean),
            format!("reference mean  {:<12.6}mean of r", metrics.reference_mean),
            format!("mean ratio      {:<12.6}mean of x / mean of r", metrics.mean_ratio),
        ];
        lines.extend(
            self.flip.map(|flip| format!("flip            {flip:<12.6}0 to 1, colours cut off at 1 (LDR-FLIP)")),
        );
        lines.extend(self.hdr_flip.zip(self.exposures).map(|(flip, range)| {
            let Exposures { start, stop, count } = range;
            format!(
                "hdr flip        {flip:<12.6}0 to 1, worst of {count} exposures from {start:+.2} to {stop:+.2} stops"
            )
        }));
        lines.push(format!("not finite      {:<12}numbers in x", metrics.non_finite));
        lines.extend(self.heat_map.as_ref().map(HeatMap::line));
        lines.join("\n")
    }
}

impl HeatMap {
    fn line(&self) -> String {
        let Scale { low, high } = self.scale;
        let of = self.of.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned());
        format!("heat map        {}: {of} error, colours from {low:.4} to {high:.4}", self.file)
    }
}

#[cfg(test)]
mod tests {
    use super::super::limits::limit;
    use super::*;
    use crate::compare::flip;
    use crate::compare::metrics::compare;
    use crate::picture::image::{Channels, Picture};

    fn comparison(value: f32) -> Comparison {
        let picture = |value: f32| {
            let mut picture = Picture::new(2, 2);
            picture.push("", Channels::Rgb, vec![value; 12]);
            picture
        };
        let (x, r, ppd) = (picture(value), picture(1.0), flip::PIXELS_PER_DEGREE);
        let ldr = flip::ldr(&x, &r, "", ppd).expect("same size");
        let hdr = flip::hdr(&x, &r, "", ppd).expect("same size");
        Comparison::new(compare(&x, &r, "").expect("same size"), ldr, hdr)
    }

    fn parsed(comparison: &Comparison) -> serde_json::Value {
        serde_json::from_str(&comparison.json().expect("JSON")).expect("JSON")
    }

    fn limits(text: &str) -> Vec<Limit> {
        text.split_whitespace().map(|one| limit(one).expect(one)).collect()
    }

    #[test]
    fn json_holds_every_measure_under_its_name() {
        let value = parsed(&comparison(1.5));
        assert_eq!(value["mse"], 0.25);
        assert_eq!(value["mean_ratio"], 1.5);
        assert!((value["relmse_trimmed"].as_f64().expect("a number") - 0.25 / 1.01).abs() < 1e-12);
        assert_eq!((&value["max"], &value["non_finite"], &value["pixels"]), (&0.5.into(), &0.into(), &4.into()));
        assert_eq!((&value["mean"], &value["reference_mean"]), (&1.5.into(), &1.0.into()));
        // Cut off at 1 they are equal; at the exposures of the reference they are not.
        assert_eq!(value["flip"], 0.0);
        assert!(value["hdr_flip"].as_f64().expect("a number") > 0.05);
        assert_eq!(value["exposures"]["count"], 2);
        assert!(value.get("heat_map").is_none() && value.get("maps").is_none());
        let broken = parsed(&comparison(f32::NAN));
        assert!(broken["mse"].is_null());
        assert_eq!((&broken["non_finite"], &broken["hdr_flip"]), (&12.into(), &1.0.into()));
    }

    #[test]
    fn the_table_has_one_measure_a_line() {
        let mut comparison = comparison(1.5);
        let table = comparison.table();
        assert_eq!(table.lines().count(), 11);
        assert!(table.contains("mse             2.5000e-1   mean of"), "{table}");
        assert!(table.contains("worst 0.1 % of the pixels removed"), "{table}");
        assert!(table.contains("hdr flip        0.") && table.contains("worst of 2 exposures"), "{table}");
        let (file, scale) = ("error.png".to_owned(), Scale::around_zero(0.25));
        comparison.heat_map = Some(HeatMap { file, of: HeatMapOf::Signed, scale });
        assert!(comparison.table().ends_with("error.png: signed error, colours from -0.2500 to 0.2500"));
        assert_eq!(parsed(&comparison)["heat_map"]["low"], -0.25);
        assert_eq!(parsed(&comparison)["heat_map"]["of"], "signed");
    }

    #[test]
    fn limits_are_exceeded_one_by_one() {
        let comparison = comparison(1.5);
        let message = |text: &str| comparison.exceeded(&limits(text)).expect("measured").map(|error| error.to_string());
        // The greatest values that pass, and the next ones that do not.
        for (metric, value) in [("mse", "0.25"), ("max", "0.5"), ("mean_ratio", "0.5"), ("flip", "0")] {
            assert_eq!(message(&format!("{metric}={value}")), None);
        }
        for metric in ["mse", "relmse", "relmse_trimmed", "smape", "max", "mean_ratio", "hdr_flip"] {
            let text = message(&format!("flip=0.5 {metric}=0.01 mse=0")).expect(metric);
            assert!(text.starts_with(&format!("{metric} is ")), "{text}");
        }
        assert_eq!(message("mse=0.249").expect("exceeded"), "mse is 2.500000e-1, above the limit of 2.49e-1");
        assert_eq!(comparison.exceeded(&limits("max=0")).expect("measured").map(|error| error.exit_code()), Some(5));
        let dark = self::comparison(0.5);
        assert!(dark.exceeded(&limits("mean_ratio=0.49")).expect("measured").is_some(), "too dark counts as well");
    }

    #[test]
    fn what_is_not_finite_exceeds_every_limit() {
        let broken = comparison(f32::NAN);
        for metric in ["mse", "relmse", "relmse_trimmed", "smape", "max", "mean_ratio", "flip", "hdr_flip"] {
            assert!(broken.exceeded(&limits(&format!("{metric}=0.99"))).expect("measured").is_some(), "{metric}");
        }
    }

    #[test]
    fn a_limit_of_what_was_left_out_is_a_mistake() {
        let mut comparison = comparison(1.0);
        comparison.flip = None;
        let error = comparison.exceeded(&limits("mse=1 flip=1")).expect_err("left out");
        assert_eq!(error.exit_code(), 1);
        assert!(error.to_string().contains("flip needs colours and no --no-flip"));
    }
}
