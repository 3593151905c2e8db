//! Hostile files have a budget: 256 MiB and 40 times the file, 10 s and 1 s for each MiB of it. The allocator of this
//! program counts, so it holds nothing else, and its cases run one after the other.

#[path = "../support/mod.rs"]
mod support;

mod bombs;
mod scenes;

use std::path::Path;

use nephroid::low_level::film::film_file;
use nephroid::low_level::picture::exr;
use nephroid::low_level::scene::{self, Environment, Limits};
use peak_alloc::PeakAlloc;

use self::bombs::Bomb;
use crate::support::clock::seconds_of_work;
use crate::support::shared;

#[global_allocator]
static COUNTED: PeakAlloc = PeakAlloc;

/// A way to read a file.
type Reading = fn(&Path) -> Result<(), String>;

/// Everything that reads OpenEXR or Radiance files, by name.
const READINGS: [(&str, Reading); 4] = [
    ("environment", |path| Environment::load(path, &Limits::default()).map(drop).map_err(|e| e.to_string())),
    ("picture", |path| exr::read(path).map(drop).map_err(|e| e.to_string())),
    ("description of a film", |path| film_file::read_about(path).map(drop).map_err(|e| e.to_string())),
    ("film", |path| film_file::read(path).map(drop).map_err(|e| e.to_string())),
];

/// What reads scenes, and moves them.
const LOADING: [(&str, Reading); 1] =
    [("scene", |path| scene::load(path, &Limits::default()).map(|mut s| s.move_to(0.5)).map_err(|e| e.to_string()))];

/// Reads the file in every way; the sentences with which it was refused. Fails beyond the budget.
fn within_budget(name: &str, path: &Path, readings: &[(&str, Reading)]) -> Vec<String> {
    let length = std::fs::metadata(path).expect("a file").len();
    let mut refusals = Vec::new();
    for (reading, read) in readings {
        COUNTED.reset_peak_usage();
        let (before, begin) = (COUNTED.current_usage(), seconds_of_work());
        let outcome = read(path);
        let (seconds, peak) = (seconds_of_work() - begin, COUNTED.peak_usage() - before);
        println!("{name} as {reading}: {length} bytes, peak {peak} bytes, {seconds:.2} s, {outcome:?}");
        assert!(peak as u64 <= (256 << 20) + 40 * length, "{name} as {reading}: {peak} bytes for {length}");
        // This build is not the fastest: twice the time of a release is enough to tell what does not end.
        assert!(seconds <= 2.0 * (10.0 + length as f64 / f64::from(1 << 20)), "{name} as {reading}: {seconds} s");
        if let Err(sentence) = outcome {
            assert!(!sentence.contains('\n'), "{sentence}");
            refusals.push(sentence);
        }
    }
    refusals
}

fn bytes_within_budget(name: &str, bytes: &[u8]) -> Vec<String> {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    std::fs::write(file.path(), bytes).expect("written");
    within_budget(name, file.path(), &READINGS)
}

/// One test, so that nothing else allocates while it counts.
#[test]
fn hostile_files_keep_to_their_budget() {
    for Bomb { name, bytes, refused } in bombs::all() {
        let refusals = bytes_within_budget(name, &bytes);
        assert!(!refused || refusals.len() == READINGS.len(), "{name} is refused in every way: {refusals:?}");
    }
    for scene in scenes::all() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let refusals = within_budget(scene.name, &scene.write(folder.path()), &LOADING);
        assert!(!scene.refused || !refusals.is_empty(), "{} is read", scene.name);
    }
    for folder in ["assets/bad/faults", "assets/bad/openexr-damaged"] {
        let Some(Ok(files)) = shared::path(folder).map(std::fs::read_dir) else { continue };
        for path in files.map(|file| file.expect("a file").path()) {
            let readings = match path.extension().and_then(|extension| extension.to_str()) {
                Some("exr") => &READINGS[..],
                Some("gltf" | "glb") => &LOADING,
                _ => continue,
            };
            within_budget(&path.display().to_string(), &path, readings);
        }
    }
    sabotage();
}

/// The count sees what a reader takes.
fn sabotage() {
    COUNTED.reset_peak_usage();
    let before = COUNTED.current_usage();
    drop(std::hint::black_box(vec![1_u8; 300 << 20]));
    assert!(COUNTED.peak_usage() - before >= 300 << 20, "the count sees nothing");
}
