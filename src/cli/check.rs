//! `nephroid check`: stiff and extreme cases with known answers, on the device at hand.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;

use super::console::{print, spinner};
use super::device::DeviceArgs;
use crate::check::{self, Case, Outcome, Size, Verdict, report};
use crate::error::{Error, Result};
use crate::graph::Runtime;
use crate::picture::output::Destination;

const EXAMPLES: &str = "\
Examples:
  nephroid check
  nephroid check --case 9 --case 24
  nephroid check --device cpu --page docs

Exit code 5 if a case fails. A known gap is a limit of the renderer that docs/stability.md
explains; it is shown, and fails nothing.";

/// Flags of `nephroid check`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CheckArgs {
    /// Run this case only; may be given several times [default: all]
    #[arg(long, value_name = "N")]
    case: Vec<u32>,

    /// Do as little as makes each case mean something, as the project's tests do
    #[arg(long)]
    quick: bool,

    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,

    /// Write the table with plots as stability.md into this folder, too
    #[arg(long, value_name = "FOLDER")]
    page: Option<PathBuf>,

    /// Where it is computed.
    #[command(flatten)]
    device: DeviceArgs,
}

/// Runs the cases, prints what they found, and writes the page.
///
/// # Errors
/// [`Error::Usage`] for a case that there is not, [`Error::Cases`] if any failed, those of opening the device, and
/// [`Error::Io`] if the page cannot be written.
pub fn run(args: &CheckArgs) -> Result<()> {
    let cases = chosen(&args.case)?;
    let runtime = args.device.open()?;
    let size = if args.quick { Size::Quick } else { Size::Full };
    let mut outcomes = vec![];
    for case in cases {
        let sign = spinner();
        sign.set_message(format!("case {}: {}", case.number, case.title));
        let outcome = check::run(&runtime, case, size)?;
        sign.finish_and_clear();
        if !args.json {
            print(&report::text(&outcome))?;
        }
        outcomes.push(outcome);
    }
    if args.json {
        let all: Vec<_> = outcomes.iter().map(report::json).collect();
        print(&format!("{:#}", serde_json::json!({ "device": machine(&runtime), "cases": all })))?;
    } else {
        print(&closing(&outcomes))?;
    }
    if let Some(folder) = &args.page {
        write_page(&outcomes, &machine(&runtime), folder)?;
    }
    let failed = outcomes.iter().filter(|outcome| outcome.verdict() == Verdict::Failed).count();
    if failed > 0 { Err(Error::Cases { failed, all: outcomes.len() }) } else { Ok(()) }
}

/// The cases with these numbers, or all.
fn chosen(numbers: &[u32]) -> Result<Vec<Case>> {
    let all = check::cases();
    if let Some(unknown) = numbers.iter().find(|number| !all.iter().any(|case| case.number == **number)) {
        return Err(Error::Usage(format!("there is no case {unknown}; cases are 1 to {}", all.len())));
    }
    Ok(all.into_iter().filter(|case| numbers.is_empty() || numbers.contains(&case.number)).collect())
}

fn machine(runtime: &Runtime) -> String {
    let info = runtime.device().info();
    format!("{}, driver {}", info.name, info.driver)
}

fn closing(outcomes: &[Outcome]) -> String {
    let count = |verdict: Verdict| outcomes.iter().filter(|outcome| outcome.verdict() == verdict).count();
    let seconds: f64 = outcomes.iter().map(|outcome| outcome.seconds).sum();
    format!(
        "{} passed, {} with known gaps, {} failed, in {seconds:.0} s",
        count(Verdict::Passed),
        count(Verdict::Gap),
        count(Verdict::Failed)
    )
}

/// `stability.md` and, in the folder `stability` beside it, the plots.
fn write_page(outcomes: &[Outcome], machine: &str, folder: &Path) -> Result<()> {
    let plots = folder.join("stability");
    std::fs::create_dir_all(&plots).map_err(|source| Error::io(&plots, "create", source))?;
    for outcome in outcomes {
        if let Some(svg) = report::figure(outcome) {
            write(&plots.join(report::figure_name(outcome)), &svg)?;
        }
    }
    write(&folder.join("stability.md"), &report::markdown(outcomes, machine, "stability"))
}

fn write(path: &Path, text: &str) -> Result<()> {
    Destination::check(path)?
        .write(|sink| sink.write_all(text.as_bytes()).map_err(|source| Error::io(path, "write", source)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_are_chosen_by_number() {
        assert_eq!(chosen(&[]).expect("all").len(), 54);
        let some: Vec<u32> = chosen(&[24, 9]).expect("two").iter().map(|case| case.number).collect();
        assert_eq!(some, [9, 24]);
        let error = chosen(&[9, 77]).err().expect("no such case");
        assert_eq!((error.exit_code(), error.to_string().as_str()), (1, "there is no case 77; cases are 1 to 54"));
    }
}
