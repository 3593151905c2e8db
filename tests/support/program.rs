//! The program from outside, in a folder of its own.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

use nephroid::low_level::picture::exr;
use nephroid::low_level::picture::image::Picture;

use super::{device, repository};

/// The turn of a test that starts programs: two at a time, because a program is busy on one core for part of its time,
/// and the cores are few.
pub fn turn() -> MutexGuard<'static, ()> {
    static TURNS: [Mutex<()>; 2] = [Mutex::new(()), Mutex::new(())];
    match TURNS[0].try_lock() {
        Ok(first) => first,
        Err(TryLockError::Poisoned(first)) => first.into_inner(),
        Err(TryLockError::WouldBlock) => TURNS[1].lock().unwrap_or_else(PoisonError::into_inner),
    }
}

/// The program, a temporary folder, and its turn.
pub struct Program {
    folder: tempfile::TempDir,
    _turn: MutexGuard<'static, ()>,
}

impl Program {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a temporary folder"), _turn: turn() }
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn asset(&self, name: &str) -> PathBuf {
        repository("assets").join(name)
    }

    /// In `line`, `@` stands for the folder of assets, `%` for the device.
    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nephroid"));
        let assets = self.asset("").display().to_string();
        command.args(line.split_whitespace().map(|word| word.replace('@', &assets).replace('%', &device::name())));
        command.current_dir(self.folder());
        command
    }

    fn run(&self, line: &str) -> Output {
        self.command(line).output().expect("the program starts")
    }

    /// Standard output of a run that succeeds.
    pub fn succeeds(&self, line: &str) -> String {
        let output = self.run(line);
        assert_eq!(output.status.code(), Some(0), "{line}: {}", text(&output.stderr));
        text(&output.stdout)
    }

    /// The exit code is `code` and standard error one sentence with `part`.
    pub fn refuses(&self, line: &str, code: i32, part: &str) {
        let output = self.run(line);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{line}: {message}");
        assert!(message.starts_with("nephroid: ") && message.contains(part), "{line}: {message}");
        assert_eq!(message.lines().count(), 1, "{line}: {message}");
    }

    pub fn picture(&self, name: &str) -> Picture {
        exr::read(&self.path(name)).expect("a whole picture").0
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Sorted names of what lies in a folder.
pub fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}
