//! A study from end to end on a device, stopped and gone on with.
//!
//! `NEPHROID_TEST_DEVICE` chooses the device (default `cpu`), `NEPHROID_VALIDATE=0` leaves the validation layers out.

use std::path::Path;

use nephroid::Error;
use nephroid::low_level::compare::metrics;
use nephroid::low_level::graph::Runtime;
use nephroid::low_level::study::plan::Plan;
use nephroid::low_level::study::results::{Budget, Results};
use nephroid::low_level::study::runner::{Observer, Progress};
use nephroid::low_level::study::{config, output, runner};

use crate::support::device::runtime;
use crate::support::lab::asset;
use crate::support::repository;

/// Counts passes and stops after some.
struct Counter {
    passes: u64,
    most: u64,
    notes: Vec<String>,
    last: (usize, usize),
}

impl Counter {
    fn new(most: u64) -> Self {
        Self { passes: 0, most, notes: vec![], last: (0, 0) }
    }
}

impl Observer for Counter {
    fn note(&mut self, sentence: &str) {
        self.notes.push(sentence.to_owned());
    }

    fn progress(&mut self, progress: &Progress<'_>) {
        self.passes += 1;
        self.last = (progress.number, progress.total);
        assert!(progress.remaining.is_none_or(|seconds| seconds.is_finite() && seconds >= 0.0));
    }

    fn is_stopped(&self) -> bool {
        self.passes > self.most
    }
}

/// Two scenes, two variants, two seeds, three budgets; bias and variance over three seeds. `{alpha}` is replaced.
const STUDY: &str = r#"
title = "Tiny"
output = "out"
seeds = 2
keep_pictures = true

[budgets]
passes = [1, 2, 4]

[[scene]]
name = "ring"
file = "ASSETS/ring.glb"
size = "12x9"
reference = { passes = 6, settings = { method = "photons", photons = 4000 } }

[[scene]]
name = "box"
file = "ASSETS/cornell.glb"
size = "10x10"
reference = "out/box.exr"

[[scene]]
name = "elsewhere"
file = "no/such.glb"
size = "10x10"
reference = "self"
optional = true

[[variant]]
name = "narrow"
method = "photons"
photons = 2000

[[variant]]
name = "wide, slow"
method = "photons"
photons = 2000
radius = 2
alpha = {alpha}

[decomposition]
seeds = 3
passes = [1, 2]
variants = ["narrow"]
"#;

fn write_study(folder: &Path, alpha: &str) -> std::path::PathBuf {
    let assets = repository("assets");
    let text = STUDY.replace("ASSETS", &assets.display().to_string()).replace("{alpha}", alpha);
    let path = folder.join("tiny.toml");
    std::fs::write(&path, text).expect("written");
    path
}

fn go(path: &Path, runtime: &Runtime, observer: &mut Counter) -> Result<Results, Error> {
    let study = config::load(path).expect("a good study");
    runner::run(&study, runtime, observer)
}

/// A picture for the box: a reference in a file.
fn make_box(folder: &Path, runtime: &Runtime) {
    use nephroid::low_level::render::{Method, Session, Settings};
    let scene = asset("cornell");
    let settings = Settings { width: 10, height: 10, photons: Some(4000), seed: 77, ..Settings::of(Method::Photons) };
    let mut session = Session::new(runtime.device(), scene, settings).expect("a session");
    (0..4).for_each(|pass| session.run_pass(pass).expect("a pass"));
    std::fs::create_dir_all(folder.join("out")).expect("a folder");
    let output = nephroid::low_level::picture::output::Output::check(&folder.join("out/box.exr")).expect("writable");
    let map = nephroid::low_level::picture::tonemap::ToneMap::default();
    output.write(&session.picture().expect("a picture"), &Default::default(), map).expect("written");
}

/// Everything in results that does not depend on the clock.
fn timeless(results: &Results) -> serde_json::Value {
    let mut value = rounded(results);
    for record in value["records"].as_array_mut().expect("records") {
        let fields = record.as_object_mut().expect("a record");
        for name in ["seconds", "time_split", "device_bytes"] {
            fields.remove(name).expect(name);
        }
    }
    value
}

fn check_results(results: &Results, folder: &Path) {
    assert_eq!(results.measurements.len(), 2 * 2 * 2 * 3);
    for r in &results.measurements {
        let Budget::Passes(passes) = r.budget else { panic!("{:?}", r.budget) };
        assert_eq!((r.passes, r.photons), (passes, passes * 2000), "warming up leaves nothing in the picture");
        assert!(r.error.relmse > 0.0 && r.error.relmse_trimmed <= 1.0001 * r.error.relmse, "{:?}", r.error);
        assert!(r.error.mean_ratio > 0.0 && r.error.mse > 0.0, "{:?}", r.error);
        assert!(r.seconds > 0.0 && r.device_bytes > 1000 && !r.left_out.is_empty());
        for part in ["load", "build", "compile", "host", "gather", "film", "eye paths"] {
            assert!(r.time_split.contains_key(part), "{part} in {:?}", r.time_split);
        }
        assert_eq!(r.time_split.contains_key("write"), passes == 4, "the last picture is written");
    }
    let order: Vec<_> = results.measurements.iter().step_by(3).map(|r| (r.seed, &*r.scene, &*r.variant)).collect();
    assert_eq!(order[..3], [(1, "ring", "narrow"), (1, "ring", "wide, slow"), (1, "box", "narrow")], "seeds outermost");
    let one = &results.measurements[2];
    let picture =
        nephroid::low_level::picture::exr::read(&folder.join("out/pictures/ring-narrow-1.exr")).expect("kept").0;
    let references = std::fs::read_dir(folder.join("out/references")).expect("a folder");
    let reference = references.map(|entry| entry.expect("an entry").path()).next().expect("one reference");
    let reference = nephroid::low_level::picture::exr::read(&reference).expect("kept").0;
    assert_eq!(metrics::compare(&picture, &reference, "").expect("one size").relmse, one.error.relmse);
    assert_eq!(results.decompositions.len(), 2 * 2);
    for d in &results.decompositions {
        assert!(d.seeds == 3 && d.variance > 0.0 && d.bias_squared.is_finite() && d.variant == "narrow");
    }
    let [first, second] = &results.decompositions[..2] else { panic!("two numbers of passes") };
    assert!((first.passes, second.passes) == (1, 2) && second.variance < first.variance);
}

#[test]
fn a_study_is_stopped_torn_and_gone_on_with() {
    let folder = tempfile::tempdir().expect("a folder");
    let runtime = runtime();
    let path = write_study(folder.path(), "0.5");
    let error = go(&path, &runtime, &mut Counter::new(0)).expect_err("no reference").to_string();
    assert!(error.contains("scene 'box'") && error.contains("box.exr is not there"), "{error}");
    make_box(folder.path(), &runtime);

    // Stopped in the second render: after a reference of 6 passes and a render of 4.
    let mut observer = Counter::new(12);
    assert!(matches!(go(&path, &runtime, &mut observer), Err(Error::Interrupted)));
    let store = folder.path().join("out/store.jsonl");
    assert_eq!(std::fs::read_to_string(&store).expect("a store").lines().count(), 1);
    assert!(observer.notes.iter().any(|note| note.contains("'elsewhere' is left out")), "{:?}", observer.notes);

    let mut observer = Counter::new(u64::MAX);
    let results = go(&path, &runtime, &mut observer).expect("the rest");
    let passes = 7 * 4 + 2 * 3 * 2;
    assert_eq!(observer.passes, passes, "one render and the reference were there");
    assert_eq!(observer.last, (11, 11));
    check_results(&results, folder.path());

    // The last line torn off in the middle: that result is measured again, and nothing else.
    let bytes = std::fs::read(&store).expect("a store");
    std::fs::write(&store, &bytes[..bytes.len() - 40]).expect("torn");
    let mut observer = Counter::new(u64::MAX);
    let again = go(&path, &runtime, &mut observer).expect("the rest");
    assert_eq!(observer.passes, 3 * 2);
    assert!(timeless(&again) == timeless(&results));
    assert!(rounded(&again.measurements) == rounded(&results.measurements), "what was kept is the same");

    // Nothing left, and one variant changed.
    let mut observer = Counter::new(u64::MAX);
    assert!(rounded(&go(&path, &runtime, &mut observer).expect("nothing to do")) == rounded(&again));
    assert_eq!(observer.passes, 0);
    let path = write_study(folder.path(), "0.9");
    let study = config::load(&path).expect("a good study");
    let plan = Plan::new(&study, &runtime).expect("a plan");
    let open: Vec<String> = plan.units.iter().filter(|u| !plan.is_done(u)).map(|u| plan.describe(u)).collect();
    assert_eq!(open.len(), 4, "{open:?}");
    assert!(open.iter().all(|unit| unit.contains("wide, slow")), "{open:?}");
    assert!(plan.units.iter().all(|unit| plan.estimate(unit).is_some()), "paces are known by now");

    let files = output::write(&again, &study.output).expect("written");
    let json = std::fs::read_to_string(&files[0]).expect("JSON");
    assert!(rounded(&serde_json::from_str::<Results>(&json).expect("results")) == rounded(&again));
    assert_eq!(std::fs::read_to_string(&files[1]).expect("CSV").lines().count(), 1 + 24);
    assert_eq!(std::fs::read_to_string(&files[2]).expect("CSV").lines().count(), 1 + 4);
}

/// As JSON, with numbers in single precision: reading decimal digits may change the last bit of a double.
fn rounded(value: &impl serde::Serialize) -> serde_json::Value {
    fn round(value: &mut serde_json::Value) {
        match value {
            serde_json::Value::Number(number) if number.is_f64() => {
                *value = (number.as_f64().expect("a number") as f32).into();
            }
            serde_json::Value::Array(list) => list.iter_mut().for_each(round),
            serde_json::Value::Object(map) => map.values_mut().for_each(round),
            _ => {}
        }
    }
    let mut value = serde_json::to_value(value).expect("JSON");
    round(&mut value);
    value
}
