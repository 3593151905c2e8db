//! The renderer's line to the user: progress one way, the wish to end the other.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::cli::progress::{Progress, Status};

/// Shows the progress of one render and knows whether the user wants it to end.
pub struct Monitor<'a> {
    /// Set by Ctrl-C.
    pub stop: &'a AtomicBool,
    /// What is shown.
    pub progress: Progress,
}

impl Monitor<'_> {
    /// To be called after each pass; `false` asks the renderer to return what it has.
    pub fn pass_done(&mut self, status: Status) -> bool {
        self.progress.update(status);
        !self.is_stopped()
    }

    /// Whether the user sees the progress.
    pub fn is_shown(&self) -> bool {
        self.progress.is_shown()
    }

    /// Shows a warning, unless the user wants quiet.
    pub fn note(&self, sentence: &str) {
        self.progress.note(sentence);
    }

    /// Whether the user wants the render to end.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }
}
