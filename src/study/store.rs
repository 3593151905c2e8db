//! What has been measured, kept so that a study goes on where it stopped: a file of JSON lines that is only appended
//! to.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::results::{Decomposition, Measurement};
use crate::error::{Error, Result};
use crate::input;

/// The measurements of one render, or of the renders of many seeds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Entry {
    /// The points of one render.
    #[serde(rename = "records")]
    Measurements(Vec<Measurement>),
    /// Bias and variance of one variant in one scene.
    Decompositions(Vec<Decomposition>),
}

#[derive(Serialize, Deserialize)]
struct Line {
    key: String,
    entry: Entry,
}

/// Bytes of the file.
const MOST_BYTES: u64 = 1 << 30;

/// The file, and what is in it.
pub struct Store {
    path: PathBuf,
    entries: BTreeMap<String, Entry>,
    /// Bytes of whole lines; what follows is the rest of a write that was cut off.
    whole: u64,
    file: Option<File>,
}

impl Store {
    /// Reads the file if it is there. A last line that was cut off is left out.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Scene`] if a line before the last is damaged.
    pub fn open(path: &Path) -> Result<Self> {
        let bytes = match input::read(path, MOST_BYTES) {
            Err(Error::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => vec![],
            read => read?,
        };
        let mut store = Self { path: path.to_owned(), entries: BTreeMap::new(), whole: 0, file: None };
        let lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
        for (number, line) in lines.iter().enumerate() {
            match serde_json::from_slice::<Line>(line) {
                Ok(Line { key, entry }) if line.ends_with(b"\n") => {
                    store.entries.insert(key, entry);
                    store.whole += line.len() as u64;
                }
                _ if number + 1 == lines.len() => break,
                Ok(_) => {}
                Err(cause) => return Err(Error::scene(path, format!("line {}: {cause}", number + 1))),
            }
        }
        Ok(store)
    }

    /// What is known under a key.
    pub fn get(&self, key: &str) -> Option<&Entry> {
        self.entries.get(key)
    }

    /// All that is known.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.entries.values()
    }

    /// Appends a line and waits until it is on the disk. Makes the file, in a folder that exists, when it is called
    /// first.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written, [`Error::Usage`] if another process writes to it.
    pub fn put(&mut self, key: String, entry: Entry) -> Result<()> {
        let io = |source| Error::io(&self.path, "write", source);
        let file = match &mut self.file {
            Some(file) => file,
            none => none.insert(self::begin(&self.path, self.whole)?),
        };
        let line = Line { key, entry };
        let mut text = serde_json::to_string(&line).map_err(|cause| io(std::io::Error::other(cause)))?;
        text.push('\n');
        file.write_all(text.as_bytes()).and_then(|()| file.sync_data()).map_err(io)?;
        self.entries.insert(line.key, line.entry);
        Ok(())
    }
}

/// Opens the file for appending behind its whole lines; it is locked until it is closed.
fn begin(path: &Path, whole: u64) -> Result<File> {
    let io = |source| Error::io(path, "write", source);
    let file = OpenOptions::new().create(true).append(true).open(path).map_err(io)?;
    file.try_lock().map_err(|_| Error::Usage(format!("another study is writing to {}", path.display())))?;
    file.set_len(whole).map_err(io)?;
    Ok(file)
}

/// A number for content: FNV-1a with 128 bits, the same on every machine and in every version.
#[derive(Debug, Clone, Copy)]
pub struct Fingerprint(u128);

impl Default for Fingerprint {
    fn default() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl Fingerprint {
    /// Includes a part; parts are kept apart by their lengths.
    pub fn with(self, part: &[u8]) -> Self {
        let step = |hash: u128, byte: &u8| (hash ^ u128::from(*byte)).wrapping_mul(0x0100_0000_0000_0000_0000_013b);
        let length = (part.len() as u64).to_le_bytes();
        Self(part.iter().chain(&length).fold(self.0, step))
    }

    /// As 32 hexadecimal digits.
    pub fn text(self) -> String {
        format!("{:032x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decomposition(bias: f64) -> Entry {
        Entry::Decompositions(vec![Decomposition {
            scene: "ring".into(),
            variant: "a, \"b\"".into(),
            settings: BTreeMap::new(),
            passes: 4,
            seeds: 16,
            bias_squared: bias,
            variance: 0.1,
        }])
    }

    /// A store with the entries `a` and `b`, and its bytes.
    fn filled(path: &Path) -> Vec<u8> {
        let mut store = Store::open(path).expect("no file is an empty store");
        store.put("a".into(), decomposition(1.0 / 3.0)).expect("written");
        store.put("b".into(), decomposition(-1e-17)).expect("written");
        std::fs::read(path).expect("the file")
    }

    #[test]
    fn a_store_goes_on_after_being_cut_anywhere() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("store.jsonl");
        let bytes = filled(&path);
        let first = bytes.iter().position(|byte| *byte == b'\n').expect("two lines") + 1;
        for cut in (0..=bytes.len()).step_by(7).chain([first - 1, first, first + 1, bytes.len() - 1, bytes.len()]) {
            std::fs::write(&path, &bytes[..cut]).expect("cut");
            let mut store = Store::open(&path).expect("a torn file");
            let whole = |end: usize| cut >= end;
            assert_eq!(store.get("a").is_some(), whole(first), "cut at {cut}");
            assert_eq!(store.get("b").is_some(), whole(bytes.len()), "cut at {cut}");
            store.put("a".into(), decomposition(1.0 / 3.0)).expect("written");
            store.put("b".into(), decomposition(-1e-17)).expect("written");
            drop(store);
            let again = Store::open(&path).expect("whole again");
            assert_eq!(again.get("a"), Some(&decomposition(1.0 / 3.0)), "cut at {cut}");
            assert_eq!(again.get("b"), Some(&decomposition(-1e-17)), "bit for bit, cut at {cut}");
        }
    }

    #[test]
    fn damage_in_the_middle_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("store.jsonl");
        let mut bytes = filled(&path);
        bytes[3] = b'\0';
        std::fs::write(&path, &bytes).expect("damaged");
        let error = Store::open(&path).err().expect("damaged").to_string();
        assert!(error.contains("store.jsonl: line 1: "), "{error}");
    }

    #[test]
    fn two_writers_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("store.jsonl");
        let (mut one, mut two) = (Store::open(&path).expect("empty"), Store::open(&path).expect("empty"));
        one.put("a".into(), decomposition(1.0)).expect("written");
        assert!(matches!(two.put("a".into(), decomposition(1.0)), Err(Error::Usage(_))));
    }

    #[test]
    fn fingerprints_tell_parts_apart() {
        let of = |parts: &[&str]| parts.iter().fold(Fingerprint::default(), |f, part| f.with(part.as_bytes())).text();
        let all = [of(&[]), of(&[""]), of(&["ab"]), of(&["a", "b"]), of(&["ab", ""]), of(&["ba"])];
        let different: std::collections::BTreeSet<_> = all.iter().collect();
        assert_eq!(different.len(), all.len(), "{all:?}");
        assert_eq!(of(&["ab"]).len(), 32);
    }
}
