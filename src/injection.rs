//! Faults on request: a chosen step fails once, so that tests can see what becomes of it. Only programs with debug
//! assertions have this; in others [`fails`] is the constant `false`.
//!
//! A test asks with [`arm`], for its own thread. For a whole program the environment variable `NEPHROID_FAULT` asks, as
//! `rename:2` for the second rename.

/// What can be made to fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// A temporary file is made.
    Create,
    /// Bytes are written to it.
    Write,
    /// It is flushed to the disk.
    Sync,
    /// It takes the place of the old file.
    Rename,
    /// Memory of the device is allocated.
    Allocate,
    /// Commands are submitted; the device is then lost.
    Submit,
    /// Submitted commands are waited for; the device is then lost.
    Wait,
}

impl Step {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Create, Self::Write, Self::Sync, Self::Rename, Self::Allocate, Self::Submit, Self::Wait];

    /// As the environment variable names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Create => "create",
            Self::Write => "write",
            Self::Sync => "sync",
            Self::Rename => "rename",
            Self::Allocate => "allocate",
            Self::Submit => "submit",
            Self::Wait => "wait",
        }
    }
}

#[cfg(debug_assertions)]
mod armed {
    use crate::injection::Step;
    use std::cell::Cell;
    use std::sync::LazyLock;
    use std::sync::atomic::{AtomicU64, Ordering};

    thread_local! {
        /// The step that fails in this thread, and how many of its kind come before it.
        static PLAN: Cell<Option<(Step, u64)>> = const { Cell::new(None) };
    }

    /// The same for the whole program.
    static ASKED: LazyLock<Option<(Step, AtomicU64)>> = LazyLock::new(|| {
        let text = std::env::var("NEPHROID_FAULT").ok()?;
        let (name, number) = text.split_once(':')?;
        let step = Step::ALL.into_iter().find(|step| step.name() == name)?;
        Some((step, AtomicU64::new(number.parse::<u64>().ok()?.checked_sub(1)?)))
    });

    /// Lets the step with the index `before` of its kind (from 0) fail in this thread.
    pub fn arm(step: Step, before: u64) {
        PLAN.set(Some((step, before)));
    }

    /// Ends [`arm`]; whether the fault came.
    pub fn disarm() -> bool {
        PLAN.take().is_none()
    }

    /// Whether this step is to fail.
    pub fn fails(step: Step) -> bool {
        let of_the_program = match &*ASKED {
            // Past zero the number wraps around, and is not zero again.
            Some((asked, before)) if *asked == step => before.fetch_sub(1, Ordering::Relaxed) == 0,
            _ => false,
        };
        let of_the_thread = match PLAN.get() {
            Some((armed, before)) if armed == step => {
                PLAN.set(before.checked_sub(1).map(|before| (step, before)));
                before == 0
            }
            _ => false,
        };
        of_the_program || of_the_thread
    }
}

#[cfg(debug_assertions)]
pub use armed::{arm, disarm, fails};

/// Nothing fails on request.
#[cfg(not(debug_assertions))]
pub const fn fails(_: Step) -> bool {
    false
}

/// The error of a step of the file system that fails on request.
///
/// # Errors
/// If `step` is to fail.
pub fn file_step(step: Step) -> std::io::Result<()> {
    if fails(step) { Err(std::io::Error::other(format!("fault on request: {}", step.name()))) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chosen_step_fails_once() {
        arm(Step::Rename, 2);
        let steps = [Step::Rename, Step::Write, Step::Rename, Step::Rename, Step::Rename];
        assert_eq!(steps.map(fails), [false, false, false, true, false]);
        assert!(disarm());
        arm(Step::Sync, 1);
        assert!(!fails(Step::Sync) && !disarm());
        assert!(!fails(Step::Sync));
    }
}
