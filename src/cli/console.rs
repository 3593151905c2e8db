//! Standard output and the terminal.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use indicatif::ProgressBar;

use crate::error::{Error, Result, printable};

/// Prints to standard output, without what a terminal would obey. A reader that closed the pipe early (`nephroid info |
/// head`) has what it wanted.
pub(super) fn print(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    match writeln!(stdout, "{}", printable(text.trim_end())).and_then(|()| stdout.flush()) {
        Err(source) if source.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::io("standard output", "write", source))
        }
        _ => Ok(()),
    }
}

/// Says on standard error what went wrong, also where the user wants quiet.
pub(super) fn complain(sentence: &str) {
    // If standard error is closed, the exit code is all that can be reported.
    let _ = writeln!(std::io::stderr(), "nephroid: {sentence}");
}

/// A turning sign that a measurement is running. It is shown on a terminal only.
pub(super) fn spinner() -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let spinner = ProgressBar::new_spinner();
    spinner.enable_steady_tick(Duration::from_millis(100));
    spinner
}
