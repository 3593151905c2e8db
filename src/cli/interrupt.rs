//! Signals. The first SIGINT (Ctrl-C), SIGTERM or SIGHUP asks for an orderly end, which writes what is finished; only a
//! second Ctrl-C after a pause ends the process at once. Whoever closes a terminal or stops a job often sends two
//! signals within milliseconds, and wants the picture.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::picture::output::remove_unfinished;

/// Set by the first signal.
static STOP: AtomicBool = AtomicBool::new(false);

/// Time without a signal after which Ctrl-C means that nothing is to be written.
const PAUSE: Duration = Duration::from_secs(1);

/// Installs the handler, once per process, and returns the flag to poll between passes.
///
/// # Errors
/// [`Error::Io`] if the operating system refuses the handler.
pub fn install() -> Result<&'static AtomicBool> {
    static INSTALLED: OnceLock<std::result::Result<(), String>> = OnceLock::new();
    match INSTALLED.get_or_init(|| system::listen().map_err(|cause| cause.to_string())) {
        Ok(()) => Ok(&STOP),
        Err(cause) => Err(refused(std::io::Error::other(cause.clone()))),
    }
}

/// Lets a write beyond the limit on the size of files fail, instead of the signal SIGXFSZ end the process.
///
/// # Errors
/// [`Error::Io`] if the operating system refuses the handler.
pub fn let_large_writes_fail() -> Result<()> {
    system::let_large_writes_fail().map_err(refused)
}

fn refused(source: std::io::Error) -> Error {
    Error::io("signals", "handle", source)
}

/// Tells the signals that ask for an orderly end from the one that does not wait for it.
#[derive(Debug, Default)]
struct Signals {
    last: Option<Instant>,
}

impl Signals {
    /// Whether this one ends the process at once. Each signal begins the pause anew: a key that is held down does not.
    fn ends_at_once(&mut self, is_ctrl_c: bool, now: Instant) -> bool {
        let after_a_pause = self.last.is_some_and(|last| now.saturating_duration_since(last) >= PAUSE);
        self.last = Some(now);
        is_ctrl_c && after_a_pause
    }

    fn handle(&mut self, is_ctrl_c: bool) {
        if self.ends_at_once(is_ctrl_c, Instant::now()) {
            remove_unfinished();
            std::process::exit(i32::from(Error::Interrupted.exit_code()));
        }
        STOP.store(true, Ordering::SeqCst);
    }
}

#[cfg(unix)]
mod system {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};

    /// Handles signals in a thread of their own.
    pub fn listen() -> std::io::Result<()> {
        let mut incoming = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP])?;
        let handle = move || {
            let mut signals = super::Signals::default();
            incoming.forever().for_each(|signal| signals.handle(signal == SIGINT));
        };
        std::thread::Builder::new().name("signals".into()).spawn(handle).map(drop)
    }

    /// A handler of any kind does: the write then returns an error.
    pub fn let_large_writes_fail() -> std::io::Result<()> {
        signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))).map(drop)
    }
}

#[cfg(not(unix))]
mod system {
    use std::sync::Mutex;

    /// Handles Ctrl-C.
    pub fn listen() -> Result<(), ctrlc::Error> {
        let signals = Mutex::new(super::Signals::default());
        ctrlc::set_handler(move || {
            if let Ok(mut signals) = signals.lock() {
                signals.handle(true);
            }
        })
    }

    /// There is no such signal.
    pub fn let_large_writes_fail() -> std::io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_second_ctrl_c_after_a_pause_ends_at_once() {
        // Kind of signal and milliseconds; whether the last one ends the process.
        let (ctrl_c, other) = (true, false);
        for (signals, ends) in [
            (vec![(ctrl_c, 0)], false),
            (vec![(ctrl_c, 0), (ctrl_c, 1500)], true),
            (vec![(other, 0), (ctrl_c, 1500)], true),
            (vec![(ctrl_c, 0), (ctrl_c, 5)], false),
            (vec![(other, 0), (other, 5)], false),
            (vec![(other, 0), (other, 5000)], false),
            (vec![(ctrl_c, 0), (ctrl_c, 600), (ctrl_c, 1200)], false),
            (vec![(ctrl_c, 0), (ctrl_c, 600), (ctrl_c, 1600)], true),
        ] {
            let (mut state, begin) = (Signals::default(), Instant::now());
            let mut at = |&(kind, ms): &(bool, u64)| state.ends_at_once(kind, begin + Duration::from_millis(ms));
            let verdicts: Vec<bool> = signals.iter().map(&mut at).collect();
            let (last, before) = verdicts.split_last().expect("a signal");
            assert!(*last == ends && !before.contains(&true), "{signals:?}: {verdicts:?}");
        }
    }
}
