//! Ctrl-C: the first asks for an orderly end, the second ends the process at once.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};
use crate::picture::output::remove_unfinished;

/// Set by the first Ctrl-C (or SIGTERM, SIGHUP).
static STOP: AtomicBool = AtomicBool::new(false);

/// Installs the handler, once per process, and returns the flag to poll between passes.
///
/// # Errors
/// [`Error::Io`] if the operating system refuses the handler.
pub fn install() -> Result<&'static AtomicBool> {
    static INSTALLED: OnceLock<std::result::Result<(), String>> = OnceLock::new();
    let installed = INSTALLED.get_or_init(|| ctrlc::set_handler(handle).map_err(|cause| cause.to_string()));
    match installed {
        Ok(()) => Ok(&STOP),
        Err(cause) => Err(Error::io("Ctrl-C", "handle", std::io::Error::other(cause.clone()))),
    }
}

fn handle() {
    if STOP.swap(true, Ordering::SeqCst) {
        remove_unfinished();
        std::process::exit(i32::from(Error::Interrupted.exit_code()));
    }
}
