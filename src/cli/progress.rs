//! What a running render shows: a bar on a terminal, a line every few seconds elsewhere, nothing if it shall be quiet.

use std::io::{IsTerminal, Write};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::numbers::{clock, percent, si};
use crate::error::printable;

/// Totals of a render so far.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Status {
    /// Passes finished.
    pub passes: u64,
    /// Photons emitted.
    pub photons: u64,
    /// Rendering time in seconds.
    pub seconds: f64,
    /// Relative error of the picture by the last estimate; `None` while it is unknown.
    pub error: Option<f64>,
    /// Seconds until the error is at its target; `None` while that is unknown or without a target.
    pub left: Option<f64>,
    /// Seconds that the next pass will take; `None` before the first.
    pub next: Option<f64>,
}

/// Limits of a render, which ends at the first that it reaches. Without limits it ends at its target error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Number of passes.
    pub passes: Option<u64>,
    /// Rendering time in seconds.
    pub seconds: Option<f64>,
}

impl Limit {
    /// The part that is done, 0 ... 1.
    fn fraction(self, status: Status) -> f64 {
        let by_passes = self.passes.map_or(0.0, |limit| status.passes as f64 / limit as f64);
        let by_time = self.seconds.map_or(0.0, |limit| status.seconds / limit);
        let by_error = status.left.map_or(0.0, |left| status.seconds / (status.seconds + left).max(f64::MIN_POSITIVE));
        by_passes.max(by_time).max(by_error).min(1.0)
    }

    /// Seconds that are left at the pace so far; `None` while that is unknown.
    fn remaining(self, status: Status) -> Option<f64> {
        let by_passes = self.passes.filter(|_| status.passes > 0).map(|limit| {
            let left = limit.saturating_sub(status.passes) as f64;
            left * status.seconds / status.passes as f64
        });
        let by_time = self.seconds.map(|limit| (limit - status.seconds).max(0.0));
        [by_passes, by_time, status.left].into_iter().flatten().reduce(f64::min)
    }
}

/// Shows the progress of one render on standard error.
pub struct Progress {
    limit: Limit,
    display: Display,
    /// What comes before the numbers.
    title: String,
}

enum Display {
    Quiet,
    Lines {
        /// Rendering time of the next line.
        next: f64,
    },
    Bar(ProgressBar),
}

/// Seconds between lines where there is no terminal.
const LINE_INTERVAL: f64 = 5.0;

/// Steps of the bar.
const STEPS: u64 = 1000;

impl Progress {
    /// Chooses the display for standard error.
    pub fn new(limit: Limit, quiet: bool) -> Self {
        let display = if quiet {
            Display::Quiet
        } else if std::io::stderr().is_terminal() {
            Display::Bar(bar())
        } else {
            // The first pass has a line of its own: preparing may have taken long, and now it runs.
            Display::Lines { next: 0.0 }
        };
        Self { limit, display, title: String::new() }
    }

    /// The same, with a title before the numbers.
    pub fn titled(self, title: String) -> Self {
        Self { title, ..self }
    }

    /// Shows a new status; cheap enough for every pass.
    pub fn update(&mut self, status: Status) {
        match &mut self.display {
            Display::Quiet => (),
            Display::Lines { next } => {
                if is_due(next, status.seconds) {
                    say(&format!("{}{}", self.title, message(status, self.limit)));
                }
            }
            Display::Bar(bar) => {
                bar.set_position((self.limit.fraction(status) * STEPS as f64) as u64);
                bar.set_message(format!("{}{}", self.title, message(status, self.limit)));
            }
        }
    }

    /// Shows a sentence, for example a warning of the scene.
    pub fn note(&self, sentence: &str) {
        match &self.display {
            Display::Quiet => (),
            Display::Lines { .. } => say(sentence),
            Display::Bar(bar) => bar.suspend(|| say(sentence)),
        }
    }

    /// Whether anything is shown.
    pub fn is_shown(&self) -> bool {
        !matches!(self.display, Display::Quiet)
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

fn bar() -> ProgressBar {
    // The template is a constant that parses; the plain bar only avoids a panic.
    let style = ProgressStyle::with_template("[{bar:32}] {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr()).with_style(style.progress_chars("=> "))
}

/// A render goes on even if standard error is closed.
fn say(sentence: &str) {
    let _ = writeln!(std::io::stderr(), "{}", printable(sentence));
}

/// Whether a line is due at this rendering time, and if so, when the next one is.
fn is_due(next: &mut f64, seconds: f64) -> bool {
    let due = seconds >= *next;
    if due {
        *next = (seconds / LINE_INTERVAL).floor() * LINE_INTERVAL + LINE_INTERVAL;
    }
    due
}

fn message(status: Status, limit: Limit) -> String {
    let of = limit.passes.map_or(String::new(), |passes| format!("/{passes}"));
    let mut text = format!("pass {}{of}", status.passes);
    if status.photons > 0 && status.seconds > 0.0 {
        text += &format!(", {} photons/s", si(status.photons as f64 / status.seconds));
    }
    if let Some(error) = status.error {
        text += &format!(", error {}", percent(error));
    }
    if let Some(seconds) = limit.remaining(status) {
        text += &format!(", {} left", clock(seconds));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const BY_PASSES: Limit = Limit { passes: Some(100), seconds: None };
    const BY_TIME: Limit = Limit { passes: None, seconds: Some(60.0) };
    const BOTH: Limit = Limit { passes: Some(100), seconds: Some(60.0) };
    const QUARTER: Status =
        Status { passes: 25, photons: 50_000_000, seconds: 10.0, error: None, left: None, next: None };

    #[test]
    fn the_nearer_limit_counts() {
        assert_eq!(BY_PASSES.remaining(QUARTER), Some(30.0));
        assert_eq!(BY_TIME.remaining(QUARTER), Some(50.0));
        assert_eq!(BOTH.remaining(QUARTER), Some(30.0));
        assert_eq!(BOTH.fraction(QUARTER), 0.25);
        assert_eq!(BY_PASSES.remaining(Status::default()), None);
        let over = Status { passes: 101, seconds: 61.0, ..QUARTER };
        assert_eq!((BOTH.remaining(over), BOTH.fraction(over)), (Some(0.0), 1.0));
    }

    #[test]
    fn messages_name_passes_photons_and_time() {
        assert_eq!(message(QUARTER, BY_PASSES), "pass 25/100, 5.00 M photons/s, 30 s left");
        assert_eq!(message(QUARTER, BY_TIME), "pass 25, 5.00 M photons/s, 50 s left");
        assert_eq!(message(Status::default(), BY_PASSES), "pass 0/100");
        let with_target = Status { error: Some(0.0134), left: Some(5.0), ..QUARTER };
        assert_eq!(message(with_target, BY_TIME), "pass 25, 5.00 M photons/s, error 1.3 %, 5 s left");
        assert_eq!(BY_TIME.fraction(with_target), 10.0 / 15.0);
        let far = Status { left: Some(1e6), ..with_target };
        assert_eq!(BY_TIME.remaining(far), Some(50.0), "limits cap the target");
    }

    #[test]
    fn lines_come_every_few_seconds() {
        let mut next = LINE_INTERVAL;
        let due: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.13).filter(|s| is_due(&mut next, *s)).collect();
        assert_eq!(due.len(), 5, "{due:?}");
        assert!(is_due(&mut next, 1000.0) && !is_due(&mut next, 1001.0));
    }

    #[test]
    fn every_display_takes_every_call() {
        let displays = [Display::Quiet, Display::Lines { next: 1e9 }, Display::Bar(ProgressBar::hidden())];
        for display in displays {
            let mut progress = Progress { limit: BOTH, display, title: "frame 3, ".into() };
            progress.update(QUARTER);
            if let Display::Bar(bar) = &progress.display {
                assert_eq!((bar.position(), bar.message()), (250, format!("frame 3, {}", message(QUARTER, BOTH))));
            }
            progress.finish();
        }
    }
}
