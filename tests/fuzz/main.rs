//! Random damage: whatever a file holds, reading it gives a result or a sentence, within the budget of time and memory
//! of hostile input (256 MiB and 40 times the file; 10 s and 1 s for each MiB).
//!
//! Every input follows from the seed and its number, so that a failure can be had again. The environment chooses:
//! `NEPHROID_FUZZ_SECONDS` (processor time in all, default 6), `NEPHROID_FUZZ_SEED` (default 1). An input that fails
//! is written into the folder for temporary files, and its name is printed.

#[path = "../support/mod.rs"]
mod support;

mod corpus;
mod damage;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use nephroid::low_level::compare::metrics;
use nephroid::low_level::film::film_file;
use nephroid::low_level::picture::exr;
use nephroid::low_level::scene::{Environment, Limits, World, load};
use peak_alloc::PeakAlloc;

use self::corpus::Corpus;
use crate::support::clock::seconds_of_work;
use crate::support::random::Random;

#[global_allocator]
static COUNTED: PeakAlloc = PeakAlloc;

/// A reader of files, and what is damaged for it.
struct Target {
    name: &'static str,
    extension: &'static str,
    corpus: Corpus,
    read: fn(&Path) -> Result<(), String>,
}

/// Everything of this program that reads files from outside.
fn targets() -> Vec<Target> {
    let target = |name, extension, corpus, read| Target { name, extension, corpus, read };
    let mut all = vec![
        target("scene", "glb", corpus::scenes(), |path| {
            // What was loaded must also be fit for use.
            let mut scene = load(path, &Limits::default()).map_err(|e| e.to_string())?;
            World::of(&scene);
            scene.validate_references().map_err(|e| e.to_string())?;
            let is_valid = scene.validate().is_ok();
            for time in [0.3, 1e9, f64::NAN] {
                scene.move_to(time);
                World::of(&scene);
                let fault = scene.validate().err().filter(|_| is_valid);
                assert!(fault.is_none(), "sound at rest, but not at {time} s: {fault:?}");
            }
            Ok(())
        }),
        target("environment", "hdr", corpus::radiance(), environment),
        target("environment", "exr", corpus::openexr(), environment),
        target("picture", "exr", corpus::openexr(), |path| {
            let (picture, _) = exr::read(path).map_err(|e| e.to_string())?;
            metrics::compare(&picture, &picture, "").map(drop).map_err(|e| e.to_string())
        }),
        target("film", "exr", corpus::films(), |path| {
            film_file::read_about(path).map_err(|e| e.to_string())?;
            film_file::read(path).map(drop).map_err(|e| e.to_string())
        }),
    ];
    #[cfg(feature = "cli")]
    all.push(target("study", "toml", corpus::studies(), |path| {
        nephroid::low_level::study::config::load(path).map(drop).map_err(|e| e.to_string())
    }));
    all
}

fn environment(path: &Path) -> Result<(), String> {
    Environment::load(path, &Limits::default()).map(drop).map_err(|e| e.to_string())
}

fn number(variable: &str, default: u64) -> u64 {
    std::env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// One input; what is wrong with how it was read.
fn try_one(target: &Target, path: &Path, length: usize) -> Result<bool, String> {
    COUNTED.reset_peak_usage();
    let (before, begin) = (COUNTED.current_usage(), seconds_of_work());
    let outcome = catch_unwind(AssertUnwindSafe(|| (target.read)(path)));
    let (seconds, peak) = (seconds_of_work() - begin, COUNTED.peak_usage().saturating_sub(before));
    let outcome = outcome.map_err(|_| "it panics".to_owned())?;
    if peak > (256 << 20) + 40 * length {
        return Err(format!("{peak} bytes for a file of {length}"));
    }
    // Twice the time of a release tells what does not end.
    if seconds > 2.0 * (10.0 + length as f64 / f64::from(1 << 20)) {
        return Err(format!("{seconds} s for a file of {length} bytes"));
    }
    match outcome {
        Err(sentence) if sentence.is_empty() || sentence.contains(char::is_control) => {
            Err(format!("not a sentence: {sentence:?}"))
        }
        outcome => Ok(outcome.is_ok()),
    }
}

/// Damages and reads for a while; the numbers of inputs, and of those that could be read.
fn attack(target: &Target, folder: &Path, seed: u64, seconds: f64) -> Result<[u64; 2], String> {
    let path = folder.join(format!("input.{}", target.extension));
    let (begin, mut count) = (seconds_of_work(), [0_u64; 2]);
    while seconds_of_work() - begin < seconds {
        let mut random = Random(seed ^ count[0].wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let bytes = target.corpus.damaged(&mut random);
        std::fs::write(&path, &bytes).expect("written");
        match try_one(target, &path, bytes.len()) {
            Ok(is_read) => count[1] += u64::from(is_read),
            Err(fault) => return Err(format!("input {} of seed {seed}, {fault}: {}", count[0], keep(&path, target))),
        }
        count[0] += 1;
    }
    Ok(count)
}

/// Keeps an input that failed.
fn keep(path: &Path, target: &Target) -> String {
    let kept: PathBuf = std::env::temp_dir().join(format!("nephroid-{}-input.{}", target.name, target.extension));
    std::fs::copy(path, &kept).expect("copied");
    kept.display().to_string()
}

/// The harness notices a reader that panics, one that takes too much memory, and one that answers in two lines.
fn faulty_readers_are_found() {
    let target = |read| Target { name: "faulty", extension: "txt", corpus: Corpus::of("a", b"a".to_vec()), read };
    let path = std::env::temp_dir();
    assert!(try_one(&target(|_| panic!("on purpose")), &path, 1).is_err());
    assert!(try_one(&target(|_| Err("two\nlines".into())), &path, 1).is_err());
    assert_eq!(try_one(&target(|_| Err("a sentence".into())), &path, 1), Ok(false));
    let greedy = target(|_| {
        let bytes = vec![1_u8; 300 << 20];
        if bytes[bytes.len() / 2] == 1 { Ok(()) } else { Err("no".into()) }
    });
    assert!(try_one(&greedy, &path, 1).is_err());
}

/// One test, so that nothing else allocates while it counts.
#[test]
fn damaged_files_are_read_or_refused() {
    faulty_readers_are_found();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (seconds, seed) = (number("NEPHROID_FUZZ_SECONDS", 6) as f64, number("NEPHROID_FUZZ_SEED", 1));
    let targets = targets();
    let mut faults = Vec::new();
    for target in &targets {
        for (name, bytes) in target.corpus.sound() {
            let path = folder.path().join(format!("sound.{}", target.extension));
            std::fs::write(&path, bytes).expect("written");
            assert_eq!(try_one(target, &path, bytes.len()), Ok(true), "{} {name} without damage", target.name);
        }
        match attack(target, folder.path(), seed, seconds / targets.len() as f64) {
            Ok([tried, read]) => println!("{} .{}: {tried} inputs, {read} read", target.name, target.extension),
            Err(fault) => faults.push(format!("{} .{}: {fault}", target.name, target.extension)),
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}
