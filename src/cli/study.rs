//! `nephroid study`: error against run time.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::console::print;
use super::device::DeviceArgs;
use super::interrupt;
use super::numbers::clock;
use crate::error::Result;
use crate::study::config;
use crate::study::plan::{Plan, Work};
use crate::study::runner::{self, Observer, Progress};
use crate::study::{output, results};

const EXAMPLES: &str = "\
Examples:
  nephroid study studies/assets.toml
  nephroid study studies/peers.toml --dry-run

A study goes on where it stopped: measurements are kept in its output folder, and what has
changed since is measured again. Ctrl-C ends it early and writes what is there.";

/// Flags of `nephroid study`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct StudyArgs {
    /// What to render and to compare (.toml)
    #[arg(value_name = "STUDY")]
    study: PathBuf,

    /// List what would be rendered and how long that takes, and render nothing
    #[arg(long)]
    dry_run: bool,

    /// Show no progress and no warnings, only the last line and errors
    #[arg(short, long)]
    quiet: bool,

    /// Where it is computed.
    #[command(flatten)]
    device: DeviceArgs,
}

/// Does what is left of a study and writes its files.
///
/// # Errors
/// Those of the file, of its scenes and references, and of the device; [`crate::error::Error::Interrupted`] after
/// Ctrl-C, when everything finished has been written.
pub fn run(args: &StudyArgs) -> Result<()> {
    let study = config::load(&args.study)?;
    let runtime = args.device.open()?;
    let mut plan = Plan::new(&study, &runtime)?;
    if args.dry_run {
        return print(&outline(&plan));
    }
    let mut observer = Show::new(interrupt::install()?, args.quiet);
    plan.notes.iter().for_each(|note| observer.note(note));
    let outcome = runner::complete(&mut plan, &mut observer);
    observer.finish();
    let results = runner::results(&plan);
    if study.output.is_dir() {
        let files = output::write(&results, &study.output)?;
        let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
        print(&last_line(&results, &names))?;
    }
    outcome
}

fn last_line(results: &results::Results, files: &[String]) -> String {
    let (points, pairs) = (results.measurements.len(), results.decompositions.len());
    let seconds: f64 = {
        let mut renders = std::collections::BTreeMap::new();
        for r in &results.measurements {
            let longest: &mut f64 = renders.entry((&r.scene, &r.variant, r.seed)).or_default();
            *longest = longest.max(r.seconds);
        }
        renders.values().sum()
    };
    format!("{points} points of {}, {pairs} of bias and variance: {}", clock(seconds), files.join(", "))
}

/// What would be done, one line each, and the time it would take.
fn outline(plan: &Plan<'_>) -> String {
    let mut lines = plan.notes.clone();
    let (mut sum, mut unknown, mut done) = (0.0, 0, 0);
    for unit in &plan.units {
        if plan.is_done(unit) {
            done += 1;
            continue;
        }
        let time = plan.estimate(unit);
        sum += time.unwrap_or(0.0);
        unknown += usize::from(time.is_none());
        let time = time.map_or_else(|| "?".into(), clock);
        let kind = match unit.work {
            Work::Reference => "reference",
            Work::Render { .. } => "render",
            Work::Decomposition { .. } => "many seeds",
        };
        lines.push(format!("{time:>8}  {kind:<10}  {}", plan.describe(unit)));
    }
    let left = plan.units.len() - done;
    let and = if unknown > 0 { format!(", and {unknown} by passes, of unknown time") } else { String::new() };
    lines.push(format!("{left} to do, {done} done; rendering time left {}{and}", clock(sum)));
    lines.join("\n")
}

/// Seconds between lines where there is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// Shows the progress of a study on standard error.
struct Show<'a> {
    stop: &'a AtomicBool,
    display: Display,
}

enum Display {
    Quiet,
    Lines { last: Option<(usize, Instant)> },
    Bar(ProgressBar),
}

impl<'a> Show<'a> {
    fn new(stop: &'a AtomicBool, quiet: bool) -> Self {
        let display = if quiet {
            Display::Quiet
        } else if std::io::stderr().is_terminal() {
            let style =
                ProgressStyle::with_template("[{bar:24}] {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
            let bar = ProgressBar::with_draw_target(Some(1), ProgressDrawTarget::stderr());
            Display::Bar(bar.with_style(style.progress_chars("=> ")))
        } else {
            Display::Lines { last: None }
        };
        Self { stop, display }
    }

    fn finish(&self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }
}

/// A study goes on even if standard error is closed.
fn say(sentence: &str) {
    let _ = writeln!(std::io::stderr(), "{sentence}");
}

fn message(p: &Progress<'_>) -> String {
    let left = p.remaining.map(|seconds| format!(", {} left", clock(seconds))).unwrap_or_default();
    format!("{} of {}, {}: pass {}, {}{left}", p.number, p.total, p.what, p.passes, clock(p.seconds))
}

impl Observer for Show<'_> {
    fn note(&mut self, sentence: &str) {
        match &self.display {
            Display::Quiet => {}
            Display::Lines { .. } => say(sentence),
            Display::Bar(bar) => bar.suspend(|| say(sentence)),
        }
    }

    fn progress(&mut self, progress: &Progress<'_>) {
        match &mut self.display {
            Display::Quiet => {}
            Display::Lines { last } => {
                let due = last.is_none_or(|(number, at)| number != progress.number || at.elapsed() >= LINE_INTERVAL);
                if due {
                    *last = Some((progress.number, Instant::now()));
                    say(&message(progress));
                }
            }
            Display::Bar(bar) => {
                bar.set_length(progress.total as u64);
                bar.set_position(progress.number as u64 - 1);
                bar.set_message(message(progress));
            }
        }
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: Progress<'_> =
        Progress { what: "ring: bvh, seed 2", number: 3, total: 8, passes: 12, seconds: 4.2, remaining: Some(187.0) };

    #[test]
    fn progress_names_what_runs_and_what_is_left() {
        assert_eq!(message(&HALF), "3 of 8, ring: bvh, seed 2: pass 12, 4 s, 3:07 left");
        let start = Progress { remaining: None, ..HALF };
        assert_eq!(message(&start), "3 of 8, ring: bvh, seed 2: pass 12, 4 s");
    }

    #[test]
    fn every_display_takes_every_call() {
        let stop = AtomicBool::new(false);
        for display in [Display::Quiet, Display::Lines { last: None }, Display::Bar(ProgressBar::hidden())] {
            let mut show = Show { stop: &stop, display };
            show.note("a sentence");
            show.progress(&HALF);
            if let Display::Bar(bar) = &show.display {
                assert_eq!((bar.position(), bar.length(), bar.message()), (2, Some(8), message(&HALF)));
            }
            show.finish();
            assert!(!show.is_stopped());
        }
        stop.store(true, Ordering::SeqCst);
        assert!(Show { stop: &stop, display: Display::Quiet }.is_stopped());
    }

    #[test]
    fn the_last_line_counts_each_render_once() {
        let measurement = |seed: u32, seconds: f64| results::Measurement {
            seconds,
            ..crate::study::measure::blank("ring", "bvh", seed)
        };
        let measurements = vec![measurement(1, 1.0), measurement(1, 3.0), measurement(2, 3.0)];
        let results = results::Results { measurements, ..results::Results::default() };
        assert_eq!(last_line(&results, &["a".into(), "b".into()]), "3 points of 6 s, 0 of bias and variance: a, b");
    }
}
