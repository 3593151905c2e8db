//! The command line: one file or folder per subcommand, one struct per group of flags. The only part
//! that prints.
//!
//! Results go to standard output, progress, warnings and errors to standard error. Exit codes: 0 done, 1 usage, 2 bad
//! scene or file, 3 no device or missing feature, 4 device lost or out of memory, 5 above a limit of
//! `compare --fail-above` or a case of `check` failed, 130 interrupted.

mod advice;
mod animate;
mod bench;
mod check;
mod compare;
mod console;
mod device;
mod devices;
mod environment;
mod flicker;
mod info;
mod inputs;
mod interrupt;
mod merge;
mod moment;
mod numbers;
mod progress;
mod reading;
mod render;
mod study;
mod values;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

use crate::error::{Error, Result};

const EXAMPLES: &str = "\
Examples:
  nephroid render cup.glb -o cup.exr -o cup.png
  nephroid render ring.gltf -o ring.exr --size 320x240 --time 60s --aov all
  nephroid render hall.gltf -o hall.exr --time 8h --checkpoint hall.film.exr
  nephroid merge part-*.exr -o hall.exr
  nephroid animate fox.glb -o fox_####.png --fps 24 --shutter 0.5
  nephroid compare ring.exr reference.exr

Exit codes: 0 done, 1 usage, 2 bad scene or file, 3 no device, 4 device failed or out
of memory, 5 above a limit of compare --fail-above or a failed case of check,
130 interrupted";

/// A photon-mapping renderer for any Vulkan device: glTF in, EXR and PNG out.
#[derive(Debug, Parser)]
#[command(name = "nephroid", version, after_help = EXAMPLES, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene.
    Render(Box<render::RenderArgs>),
    /// Render the frames of a scene that moves.
    Animate(Box<animate::AnimateArgs>),
    /// Add up the parts of a render that several machines did.
    Merge(merge::MergeArgs),
    /// Show what a scene holds and what rendering it needs.
    Info(info::InfoArgs),
    /// List the Vulkan devices and what each lacks.
    Devices(devices::DevicesArgs),
    /// Measure the kernels on a device.
    Bench(Box<bench::BenchArgs>),
    /// Measure the difference between two EXR pictures.
    Compare(compare::CompareArgs),
    /// Measure how much the frames of a sequence flicker.
    Flicker(flicker::FlickerArgs),
    /// Measure error against run time over scenes, settings and seeds.
    Study(study::StudyArgs),
    /// Run stiff and extreme cases with known answers on a device.
    Check(check::CheckArgs),
}

/// Parses, runs, reports: everything the program does. `args` begins with the program's name.
///
/// An error becomes one sentence on standard error and the code of [`Error::exit_code`].
pub fn main(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let prepared = interrupt::let_large_writes_fail();
    match prepared.and_then(|()| parse(args)).and_then(|cli| cli.map_or(Ok(()), run)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::complain(&advice::sentence(&error));
            ExitCode::from(error.exit_code())
        }
    }
}

/// `None` if help or version was asked for, and printed.
fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Option<Cli>> {
    match Cli::try_parse_from(args) {
        Ok(cli) => Ok(Some(cli)),
        Err(error) if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) => {
            console::print(&error.render().to_string())?;
            Ok(None)
        }
        Err(error) => Err(Error::Usage(sentence(&error))),
    }
}

/// What clap says in paragraphs, as one sentence.
fn sentence(error: &clap::Error) -> String {
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        return "a command is missing; see `nephroid --help`".into();
    }
    let text = error.render().to_string();
    let joined = |paragraph: &str| paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut paragraphs = text.split("\n\n");
    let problem = joined(paragraphs.next().unwrap_or_default());
    let mut sentence = problem.strip_prefix("error: ").unwrap_or(&problem).to_owned();
    let tip = paragraphs.find_map(|paragraph| paragraph.trim().strip_prefix("tip: ").map(joined));
    if let Some(tip) = tip {
        sentence = format!("{sentence}; {tip}");
    }
    format!("{sentence}; see `nephroid --help`")
}

fn run(cli: Cli) -> Result<()> {
    match cli.command {
        Command::Render(args) => render::run(&args),
        Command::Animate(args) => animate::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Devices(args) => devices::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Flicker(args) => flicker::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Check(args) => check::run(&args),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn parsed(line: &str) -> Result<Option<Cli>> {
        parse(line.split_whitespace().map(OsString::from))
    }

    fn refusal(line: &str) -> String {
        let error = parsed(line).expect_err(line);
        assert_eq!(error.exit_code(), 1);
        error.to_string()
    }

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_flag_and_command_has_a_help_text() {
        let cli = Cli::command();
        for command in cli.get_subcommands().flat_map(|c| std::iter::once(c).chain(c.get_subcommands())) {
            assert!(command.get_about().is_some(), "{}", command.get_name());
            for argument in command.get_arguments() {
                assert!(argument.get_help().is_some(), "{} {}", command.get_name(), argument.get_id());
            }
        }
    }

    /// Whether some command has this flag.
    fn is_flag(name: &str) -> bool {
        let cli = Cli::command();
        let mut arguments = cli.get_subcommands().flat_map(|command| command.get_arguments());
        arguments.any(|argument| argument.get_long().is_some_and(|long| format!("--{long}") == name))
    }

    #[test]
    fn advice_names_flags_that_there_are() {
        assert!(advice::FLAGS.iter().all(|(_, flag)| is_flag(flag)));
        assert!(!is_flag("--brightness"));
    }

    #[test]
    fn usage_errors_are_one_sentence() {
        assert_eq!(refusal("nephroid"), "a command is missing; see `nephroid --help`");
        assert_eq!(
            refusal("nephroid rendr"),
            "unrecognized subcommand 'rendr'; a similar subcommand exists: \
             'render'; see `nephroid --help`"
        );
        assert_eq!(
            refusal("nephroid render"),
            "the following required arguments were not provided: --output <FILE> <SCENE>; see `nephroid --help`"
        );
        let unknown = refusal("nephroid render a.glb -o a.exr --sise 1x1");
        assert!(unknown.starts_with("unexpected argument '--sise' found; a similar argument exists: '--size'"));
        for line in ["nephroid render a.glb -o a.exr --size 0x4", "nephroid compare a.exr", "nephroid info a b"] {
            assert!(!refusal(line).contains('\n'), "{line}");
        }
    }

    #[test]
    fn help_is_not_an_error() {
        assert!(matches!(parsed("nephroid --help"), Ok(None)));
        assert!(matches!(parsed("nephroid render --help"), Ok(None)));
        assert!(matches!(parsed("nephroid --version"), Ok(None)));
    }
}
