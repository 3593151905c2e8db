//! Decides when a render ends (target error, time, passes, or the user), and estimates how long that will take.

use std::time::Duration;

use crate::cli::numbers::percent;
use crate::cli::progress::{Limit, Status};
use crate::film::error_estimate::ErrorEstimate;
use crate::picture::exr::{Metadata, Value};

/// Target where neither error nor time nor passes are given.
pub const DEFAULT_TARGET: f64 = 0.01;

/// Confidence of the layer `error`.
pub const CONFIDENCE: f64 = 0.9;

/// Passes that an estimate must rest on before a render ends by it.
const LEAST_PASSES: u64 = 8;

/// Why a render ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The estimated error reached the target.
    Target,
    /// The time limit was reached.
    Time,
    /// All passes were done.
    Passes,
    /// The user interrupted it.
    Interrupted,
    /// A pass failed.
    Failed,
}

impl StopReason {
    /// For metadata and reports.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Target => "target error reached",
            Self::Time => "time",
            Self::Passes => "passes",
            Self::Interrupted => "interrupted",
            Self::Failed => "failed",
        }
    }

    /// For the last line.
    fn sentence(self) -> &'static str {
        match self {
            Self::Target => "stopped at the target error",
            Self::Time => "stopped by time",
            Self::Passes => "stopped by passes",
            Self::Interrupted => "interrupted",
            Self::Failed => "ended by a pass that failed",
        }
    }
}

/// How a render ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Estimated relative error of the picture, [`ErrorEstimate::relative`].
    pub error: Option<f64>,
    /// Why it ended.
    pub stop: StopReason,
}

impl Outcome {
    /// For the last line: `error 1.3 % (estimated), stopped by time`.
    pub fn describe(&self) -> String {
        let error = self.error.map_or("error unknown".into(), |e| format!("error {} (estimated)", percent(e)));
        format!("{error}, {}", self.stop.sentence())
    }

    /// For an EXR: `estimated_error` (where it is known), `stop_reason`, and `error_confidence`, that of the layer
    /// `error`.
    pub fn metadata(&self) -> Metadata {
        let error = self.error.map(|error| ("estimated_error", Value::Number(error)));
        let reason = ("stop_reason", Value::Text(self.stop.reason().into()));
        let all = error.into_iter().chain([reason, ("error_confidence", Value::Number(CONFIDENCE))]);
        all.map(|(key, value)| (key.to_owned(), value)).collect()
    }

    /// For the report.
    pub fn report(&self, estimate: &ErrorEstimate, target: Option<f64>) -> serde_json::Value {
        serde_json::json!({
            "estimated": self.error, "target": target, "bias": estimate.bias.name(), "confidence": CONFIDENCE,
        })
    }
}

/// Follows the error of a render and decides when it ends.
pub struct StopRule {
    limit: Limit,
    target: Option<f64>,
    /// Whether estimates are made at all.
    estimates: bool,
    /// Passes and errors of the estimates so far.
    history: Vec<(f64, f64)>,
    /// Passes and seconds before which no estimate is due.
    next: (u64, f64),
    /// Estimates in sequence that met the target.
    met: u32,
}

impl StopRule {
    /// A rule for a render with these limits. `shown` says whether the user sees the progress.
    pub fn new(limit: Limit, target: Option<f64>, shown: bool) -> Self {
        Self { limit, target, estimates: shown || target.is_some(), history: vec![], next: (4, 0.0), met: 0 }
    }

    /// Whether it is time for an estimate: after an eighth more passes than for the last, and when those took so long
    /// that estimates are 2 % of the work.
    pub fn is_due(&self, status: &Status) -> bool {
        self.estimates && status.passes >= self.next.0 && status.seconds >= self.next.1
    }

    /// Takes an estimate that took `cost`.
    pub fn add_estimate(&mut self, status: &Status, error: Option<f64>, cost: Duration) {
        self.next = (status.passes + (status.passes / 8).max(1), status.seconds + 50.0 * cost.as_secs_f64());
        // A picture that is black so far tells nothing; an exact one has no logarithm.
        self.history.extend(error.filter(|error| *error > 0.0).map(|error| (status.passes as f64, error)));
        let met =
            status.passes >= LEAST_PASSES && error.zip(self.target).is_some_and(|(error, target)| error <= target);
        self.met = if met { self.met + 1 } else { 0 };
    }

    /// Fills in the last estimate of the error and the time until the error reaches the target.
    pub fn complete(&self, status: &mut Status) {
        status.error = self.history.last().map(|(_, error)| *error);
        status.left = self
            .target
            .and_then(|target| self.passes_left(target, status.passes as f64))
            .map(|passes| passes * status.seconds / (status.passes.max(1) as f64));
    }

    /// Whether the render ends here, and why.
    pub fn decide(&self, status: &Status) -> Option<StopReason> {
        // Two in sequence: a single estimate below the target may be luck.
        if self.met >= 2 {
            return Some(StopReason::Target);
        }
        if self.limit.passes.is_some_and(|limit| status.passes >= limit) {
            return Some(StopReason::Passes);
        }
        self.limit.seconds.is_some_and(|limit| is_over(limit, status)).then_some(StopReason::Time)
    }

    /// Passes from `passes` on until the error is at `target`, along a line through the last estimates in logarithms.
    fn passes_left(&self, target: f64, passes: f64) -> Option<f64> {
        let (at, error) = *self.history.last()?;
        let wanted = at * (error / target).max(1.0).powf(-1.0 / slope(&self.history));
        Some((wanted - passes).max(0.0))
    }
}

/// Whether the time of a render is over: whether it ends nearer to its limit without the next pass than with it, or
/// would end more than a tenth beyond it. The first pass is always rendered: it is the picture.
fn is_over(limit: f64, status: &Status) -> bool {
    let next = status.next.unwrap_or(0.0);
    status.seconds >= limit
        || status.passes > 0 && (status.seconds + 0.5 * next > limit || status.seconds + next > 1.1 * limit)
}

/// Slope of log error over log passes by least squares over the last estimates: -1/2 for noise alone, -1/3 (photon
/// mapping at alpha = 2/3; Knaus and Zwicker 2011) while there are fewer than three. Kept between -1 and -1/6, so that
/// a few estimates by chance alike do not make the end recede to years.
fn slope(history: &[(f64, f64)]) -> f64 {
    const LAST: usize = 8;
    let last = &history[history.len().saturating_sub(LAST)..];
    if last.len() < 3 {
        return -1.0 / 3.0;
    }
    let n = last.len() as f64;
    let points = || last.iter().map(|(passes, error)| (passes.ln(), error.ln()));
    let (x, y) = points().fold((0.0, 0.0), |(sx, sy), (x, y)| (sx + x / n, sy + y / n));
    let (xy, xx) = points().fold((0.0, 0.0), |(xy, xx), (a, b)| (xy + (a - x) * (b - y), xx + (a - x) * (a - x)));
    (xy / xx).clamp(-1.0, -1.0 / 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(passes: u64) -> Status {
        Status { passes, seconds: passes as f64 * 0.5, ..Status::default() }
    }

    const NO_LIMIT: Limit = Limit { passes: None, seconds: None };

    /// Feeds a rule with estimates where they are due, until it decides.
    fn run(rule: &mut StopRule, error: impl Fn(u64) -> Option<f64>, cost: f64) -> (u64, Option<StopReason>, u32) {
        let mut estimates = 0;
        for passes in 1..100_000 {
            let mut status = status(passes);
            if rule.is_due(&status) {
                rule.add_estimate(&status, error(passes), Duration::from_secs_f64(cost));
                estimates += 1;
            }
            rule.complete(&mut status);
            if let Some(stop) = rule.decide(&status) {
                return (passes, Some(stop), estimates);
            }
        }
        (100_000, None, estimates)
    }

    #[test]
    fn the_target_ends_a_render_once_it_is_sure() {
        let error = |passes: u64| Some(0.1 / (passes as f64).sqrt());
        let (passes, stop, _) = run(&mut StopRule::new(NO_LIMIT, Some(0.005), false), error, 0.0);
        assert_eq!(stop, Some(StopReason::Target));
        assert!((400..=520).contains(&passes), "{passes}");
        let few = run(&mut StopRule::new(NO_LIMIT, Some(0.5), false), error, 0.0);
        assert!(
            few.0 >= LEAST_PASSES && few.1 == Some(StopReason::Target),
            "not before {LEAST_PASSES} passes: {few:?}"
        );
        let lucky = |passes| Some(if passes == 16 { 0.0 } else { 0.1 });
        assert_eq!(
            run(&mut StopRule::new(NO_LIMIT, Some(0.01), false), lucky, 0.0).1,
            None,
            "one estimate is not enough"
        );
        let black = run(&mut StopRule::new(NO_LIMIT, Some(0.01), false), |_| None, 0.0);
        assert_eq!(black.1, None, "a black picture is not a finished one");
    }

    #[test]
    fn limits_cap_the_target() {
        let error = |_| Some(0.1);
        let limit = Limit { passes: Some(40), seconds: Some(100.0) };
        assert_eq!(run(&mut StopRule::new(limit, Some(0.01), true), error, 0.0), (40, Some(StopReason::Passes), 21));
        let limit = Limit { seconds: Some(10.0), ..limit };
        assert_eq!(run(&mut StopRule::new(limit, Some(0.01), true), error, 0.0).1, Some(StopReason::Time));
        assert_eq!(
            run(&mut StopRule::new(limit, None, false), error, 0.0).2,
            0,
            "no estimate without a target and without progress"
        );
    }

    #[test]
    fn time_ends_between_passes_near_the_limit() {
        let rule = StopRule::new(Limit { passes: None, seconds: Some(10.0) }, None, false);
        let ends = |passes, seconds, next| {
            rule.decide(&Status { passes, seconds, next, ..Status::default() }) == Some(StopReason::Time)
        };
        // A short pass goes beyond the limit by less than half of itself, none by more than a tenth of the limit.
        assert!(!ends(9, 9.0, Some(1.5)) && ends(9, 9.5, Some(1.5)));
        assert!(!ends(2, 6.0, Some(4.9)) && ends(2, 6.0, Some(5.1)));
        assert!(ends(9, 10.0, Some(0.0)) && !ends(9, 9.9, None));
        assert!(!ends(0, 0.0, Some(100.0)), "no picture without a pass");
    }

    #[test]
    fn estimates_take_little_of_the_time() {
        let limit = Limit { passes: Some(10_000), seconds: None };
        for cost in [0.0, 0.1, 10.0] {
            let (passes, _, estimates) = run(&mut StopRule::new(limit, None, true), |_| Some(0.1), cost);
            let share = f64::from(estimates - 1) * cost / (passes as f64 * 0.5);
            assert!(estimates > 1 && estimates < 100 && share <= 0.02, "{estimates} estimates of {cost} s: {share}");
        }
    }

    #[test]
    fn the_rest_is_extrapolated_along_the_slope() {
        for exponent in [-0.5, -1.0 / 3.0] {
            let mut rule = StopRule::new(NO_LIMIT, Some(0.01), true);
            for passes in [10, 20, 40] {
                rule.add_estimate(&status(passes), Some((passes as f64).powf(exponent)), Duration::ZERO);
            }
            let mut status = status(50);
            rule.complete(&mut status);
            let (left, expected) = (status.left.expect("known"), (0.01f64.powf(1.0 / exponent) - 50.0) * 0.5);
            assert!((left / expected - 1.0).abs() < 1e-9, "{left} {expected}");
            assert_eq!(status.error, Some(40f64.powf(exponent)));
        }
        let mut rule = StopRule::new(NO_LIMIT, Some(0.01), true);
        let mut first = status(4);
        rule.complete(&mut first);
        assert_eq!((first.left, first.error), (None, None));
        rule.add_estimate(&first, Some(0.02), Duration::ZERO);
        rule.complete(&mut first);
        assert!((first.left.expect("by the usual slope") - (32.0 - 4.0) * 0.5).abs() < 1e-9);
        // An error that grows by chance still has an end.
        rule.add_estimate(&status(5), Some(0.021), Duration::ZERO);
        rule.add_estimate(&status(6), Some(0.022), Duration::ZERO);
        rule.complete(&mut first);
        assert!(first.left.is_some_and(|left| left.is_finite() && left > 0.0));
    }

    #[test]
    fn an_outcome_is_told_in_words_and_in_numbers() {
        let outcome = Outcome { error: Some(0.0134), stop: StopReason::Time };
        assert_eq!(outcome.describe(), "error 1.3 % (estimated), stopped by time");
        assert_eq!(outcome.metadata()["estimated_error"], Value::Number(0.0134));
        let unknown = Outcome { error: None, stop: StopReason::Target };
        assert_eq!(unknown.describe(), "error unknown, stopped at the target error");
        assert_eq!(unknown.metadata()["stop_reason"], Value::Text("target error reached".into()));
        assert!(!unknown.metadata().contains_key("estimated_error"));
    }
}
