//! Limits for measures of a comparison: `--fail-above relmse=1e-3`.

/// A measure that can have a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    /// Mean squared error.
    Mse,
    /// Mean relative squared error.
    Relmse,
    /// The same without the worst pixels.
    RelmseTrimmed,
    /// Symmetric mean absolute error.
    Smape,
    /// Greatest difference.
    Max,
    /// Distance of the ratio of the means from 1.
    MeanRatio,
    /// LDR-FLIP.
    Flip,
    /// HDR-FLIP.
    HdrFlip,
}

impl Metric {
    const ALL: [Self; 8] = [
        Self::Mse,
        Self::Relmse,
        Self::RelmseTrimmed,
        Self::Smape,
        Self::Max,
        Self::MeanRatio,
        Self::Flip,
        Self::HdrFlip,
    ];

    /// The name in the JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mse => "mse",
            Self::Relmse => "relmse",
            Self::RelmseTrimmed => "relmse_trimmed",
            Self::Smape => "smape",
            Self::Max => "max",
            Self::MeanRatio => "mean_ratio",
            Self::Flip => "flip",
            Self::HdrFlip => "hdr_flip",
        }
    }
}

/// What a measure may be at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The measure.
    pub metric: Metric,
    /// The greatest value that passes: finite, at least 0.
    pub greatest: f64,
}

/// Parses `relmse=1e-3`.
pub fn limit(text: &str) -> std::result::Result<Limit, String> {
    let (name, number) = text.split_once('=').ok_or("expected METRIC=LIMIT, for example relmse=1e-3")?;
    let metric = Metric::ALL.into_iter().find(|metric| metric.name() == name).ok_or_else(|| {
        let names: Vec<&str> = Metric::ALL.iter().map(|metric| metric.name()).collect();
        format!("'{name}' is not one of {}", names.join(", "))
    })?;
    let greatest = number.parse::<f64>().ok().filter(|limit| *limit >= 0.0 && limit.is_finite());
    Ok(Limit { metric, greatest: greatest.ok_or("expected a limit of at least 0, for example 1e-3")? })
}

/// Parses a finite number above 0.
pub fn positive(text: &str) -> std::result::Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "expected a number above 0".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_have_a_measure_and_a_number() {
        assert_eq!(limit("relmse=1e-3"), Ok(Limit { metric: Metric::Relmse, greatest: 1e-3 }));
        for metric in Metric::ALL {
            assert_eq!(limit(&format!("{}=0", metric.name())), Ok(Limit { metric, greatest: 0.0 }));
        }
        for bad in ["", "mse", "mse=", "=1", "mse=-1", "mse=nan", "mse=inf", "mse=1=2", "psnr=30", "mse 1"] {
            assert!(limit(bad).is_err(), "{bad}");
        }
        assert!(limit("psnr=30").expect_err("unknown").contains("mse, relmse, relmse_trimmed, smape"));
    }

    #[test]
    fn a_positive_number_is_above_0_and_finite() {
        assert_eq!(positive("0.5"), Ok(0.5));
        for bad in ["", "0", "-1", "nan", "inf", "much"] {
            assert!(positive(bad).is_err(), "{bad}");
        }
    }
}
