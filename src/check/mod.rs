//! Stiff and extreme cases with known answers, small enough to run on every device: `nephroid check` and the tests in
//! `tests/extremes` run the same ones.
//!
//! A case builds its scenes in memory, renders them and compares what it found with an answer that was not made by the
//! renderer: an analytic value, a sum in double precision, or another way to the same picture. Every render of every
//! case is held to three things besides: no number that is not finite, no validation message, and a ledger of the
//! photons' light that closes to 1e-6.

mod bsdf;
mod convergence;
mod degenerate;
mod differentials;
mod error_bars;
mod exact;
mod finding;
mod footprints;
mod furnace;
mod glass;
mod lab;
mod lights;
mod limits;
mod mirrors;
pub mod report;
mod samplers;
mod scale;
pub mod scenes;
mod traversal;
mod walls;

use std::time::Instant;

pub use finding::{Finding, Within};
pub use lab::{Lab, Shot, Size, differences, settings, unfinished};

use crate::error::{Error, Result};
use crate::graph::Runtime;

/// A case.
#[derive(Clone, Copy)]
pub struct Case {
    /// Its number in the list of extreme cases.
    pub number: u32,
    /// What it is.
    pub title: &'static str,
    /// Where the expected values and the tolerances come from.
    pub reason: &'static str,
    /// Name of the parameter that it varies, if it does.
    pub parameter: Option<&'static str>,
    /// Measures.
    pub(crate) run: fn(&mut Lab) -> Result<()>,
}

/// What became of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// All numbers are as expected.
    Passed,
    /// All but those where the renderer has a limit that is known.
    Gap,
    /// A number is not as expected.
    Failed,
}

impl Verdict {
    /// As one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Passed => "pass",
            Self::Gap => "known gap",
            Self::Failed => "FAIL",
        }
    }

    /// Of one number.
    pub fn of(finding: &Finding) -> Self {
        match (finding.holds(), finding.gap) {
            (true, _) => Self::Passed,
            (false, Some(_)) => Self::Gap,
            (false, None) => Self::Failed,
        }
    }
}

/// A case that ran.
pub struct Outcome {
    /// The case.
    pub case: Case,
    /// What it measured.
    pub findings: Vec<Finding>,
    /// Why it ended before its end, if it did.
    pub error: Option<Error>,
    /// Seconds that it took.
    pub seconds: f64,
    /// Plans that ran, as text.
    pub plans: Vec<String>,
}

impl Outcome {
    /// What became of it.
    pub fn verdict(&self) -> Verdict {
        let of = |wanted: Verdict| self.findings.iter().any(|finding| Verdict::of(finding) == wanted);
        if self.error.is_some() || self.findings.is_empty() || of(Verdict::Failed) {
            Verdict::Failed
        } else if of(Verdict::Gap) {
            Verdict::Gap
        } else {
            Verdict::Passed
        }
    }
}

/// All cases, by number.
pub fn cases() -> Vec<Case> {
    let groups = [
        furnace::CASES,
        lights::CASES,
        glass::CASES,
        mirrors::CASES,
        footprints::CASES,
        differentials::CASES,
        bsdf::CASES,
        samplers::CASES,
        convergence::CASES,
        error_bars::CASES,
        exact::CASES,
        limits::CASES,
        scale::CASES,
        degenerate::CASES,
        traversal::CASES,
        walls::CASES,
    ];
    let mut cases: Vec<Case> = groups.concat();
    cases.sort_by_key(|case| case.number);
    cases
}

/// Runs a case.
///
/// # Errors
/// [`Error::DeviceLost`], after which no case can run. Other errors of the renderer are the case's own.
pub fn run(runtime: &Runtime, case: Case, size: Size) -> Result<Outcome> {
    let start = Instant::now();
    let mut lab = Lab::new(runtime, size);
    let error = match (case.run)(&mut lab) {
        Err(error @ Error::DeviceLost { .. }) => return Err(error),
        result => result.err(),
    };
    let (findings, plans) = lab.close();
    Ok(Outcome { case, findings, error, seconds: start.elapsed().as_secs_f64(), plans })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_is_there_once() {
        let numbers: Vec<u32> = cases().iter().map(|case| case.number).collect();
        assert_eq!(numbers, (1..=54).collect::<Vec<_>>());
    }

    #[test]
    fn a_case_fails_by_any_number_and_by_having_none() {
        let case = cases()[0];
        let of =
            |findings: Vec<Finding>, error| Outcome { case, findings, error, seconds: 0.0, plans: vec![] }.verdict();
        let good = Finding::new("", 1.0, 1.0, Within::Exact);
        let bad = Finding::new("", 2.0, 1.0, Within::Exact);
        let gap = Finding { gap: Some("known"), ..bad.clone() };
        assert_eq!(of(vec![good.clone()], None), Verdict::Passed);
        assert_eq!(of(vec![good.clone(), gap.clone()], None), Verdict::Gap);
        assert_eq!(of(vec![good.clone(), gap, bad], None), Verdict::Failed);
        assert_eq!(of(vec![], None), Verdict::Failed);
        assert_eq!(of(vec![good], Some(Error::Interrupted)), Verdict::Failed);
    }
}
