//! The file of a study: what is read from it, and what is said about a wrong one.

use std::path::Path;

use nephroid::low_level::render::{Estimator, Settings};
use nephroid::low_level::scene::Scene;
use nephroid::low_level::study::config::{self, Reference, Study};
use nephroid::low_level::study::results::Budget;

use crate::support::repository;

const GOOD: &str = r#"
title = "A study"
output = "out"
seeds = 3
keep_pictures = true
peers = "peers.csv"

[budgets]
seconds = [3, 1.5]
passes = [4, 1]

[[scene]]
name = "ring"
file = "scenes/ring.glb"
size = "32x24"
reference = "ring.exr"

[[scene]]
name = "pool"
file = "/pool.glb"
size = "16x16"
camera = "2"
environment = "sky.exr"
reference = { passes = 64, seed = 9, settings = { radius = 0.5, kernel = "cone" } }
optional = true

[[scene]]
name = "box"
file = "box.glb"
size = "8x8"
reference = "self"

[[variant]]
name = "hash, wide"
estimator = "hash"
caustic_smoothing = 3
global_smoothing = 4.5
alpha = 0.5
photons = 1000

[[grid]]
photons_per_pixel = [0.5, 2]
radius = [1, 2]

[decomposition]
passes = [4, 1, 2]
scenes = ["ring"]
"#;

/// Reads a study from a file in the folder `here`.
fn read(text: &str) -> Result<Study, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("study.toml");
    std::fs::write(&path, text).expect("written");
    let inside = folder.path().to_owned();
    config::load(&path)
        .map(|mut study| {
            for scene in &mut study.scenes {
                if let Ok(rest) = scene.file.strip_prefix(&inside) {
                    scene.file = Path::new("here").join(rest);
                }
            }
            study.output = Path::new("here").join(study.output.strip_prefix(&inside).expect("beside the file"));
            study
        })
        .map_err(|error| error.to_string().replace(&path.display().to_string(), "study.toml"))
}

#[test]
fn everything_in_the_file_arrives() {
    let study = read(GOOD).expect("a good study");
    assert_eq!((study.title.as_str(), study.output.as_path()), ("A study", Path::new("here/out")));
    assert_eq!((study.seeds.as_slice(), study.keep_pictures, study.flip), (&[1, 2, 3][..], true, false));
    let expected = [Budget::Seconds(1.5), Budget::Seconds(3.0), Budget::Passes(1), Budget::Passes(4)];
    assert_eq!(study.budgets, expected, "ascending");
    let [ring, pool, cube] = &study.scenes[..] else { panic!("three scenes") };
    assert_eq!((ring.file.as_path(), ring.size.to_string().as_str()), (Path::new("here/scenes/ring.glb"), "32x24"));
    assert!(matches!(&ring.reference, Reference::File(path) if path.ends_with("ring.exr")) && !ring.optional);
    assert_eq!((pool.file.as_path(), pool.camera.as_str(), pool.optional), (Path::new("/pool.glb"), "2", true));
    assert!(pool.environment.as_ref().expect("a sky").path.ends_with("sky.exr"));
    let Reference::Render(render) = &pool.reference else { panic!("ours") };
    assert_eq!((render.limits(), render.seed), ((Some(64), None), 9));
    assert_eq!(render.settings.settings()["kernel"], "cone");
    let Reference::Render(render) = &cube.reference else { panic!("ours") };
    assert!(render.limits().0.is_some() && !study.seeds.contains(&render.seed));
    let names: Vec<&str> = study.variants.iter().map(|variant| variant.name.as_str()).collect();
    assert_eq!(names, ["hash, wide", "ppp=0.5 r=1", "ppp=0.5 r=2", "ppp=2 r=1", "ppp=2 r=2"]);
    let decomposition = study.decomposition.expect("one");
    assert_eq!((decomposition.seeds.len(), decomposition.passes), (16, vec![1, 2, 4]));
    assert!(decomposition.scenes.contains("ring") && decomposition.scenes.len() == 1);
    assert_eq!(decomposition.variants.len(), 5, "all, if not said");
}

#[test]
fn variants_become_settings() {
    let study = read(GOOD).expect("a good study");
    let resolve = |index: usize| study.variants[index].resolve(&Scene::default(), 0, study.scenes[0].size);
    let found = resolve(0);
    let expected = Settings {
        width: 32,
        height: 24,
        estimator: Some(Estimator::Hash),
        caustic_smoothing: 3.0,
        global_smoothing: 4.5,
        alpha: 0.5,
        photons: Some(1000),
        ..Settings::default()
    };
    assert_eq!(found, expected);
    let (found, d) = (resolve(2), Settings::default());
    assert_eq!(found.photons, Some(384), "half a photon for each of 32 x 24 pixels");
    assert_eq!(
        (found.caustic_smoothing, found.global_smoothing),
        (2.0 * d.caustic_smoothing, 2.0 * d.global_smoothing)
    );
    let settings = study.variants[0].settings();
    let words: Vec<String> = settings.iter().map(|(name, value)| format!("{name}={value}")).collect();
    let expected = "alpha=0.5 caustic_smoothing=3 estimator=hash global_smoothing=4.5 photons=1000";
    assert_eq!(words.join(" "), expected);
}

/// Each replaces a part of the good file and names what the message must hold.
const BAD: [(&str, &str, &[&str]); 25] = [
    ("seeds = 3", "sedes = 3", &["line 4: `sedes = 3`: unknown field `sedes`"]),
    ("seeds = 3", "seeds = 0", &["line 4: `seeds = 0`: '0': expected a whole number from 1"]),
    ("seeds = 3", "seeds = -1", &["`seeds = -1`: '-1': expected a whole number"]),
    ("seeds = 3", "seeds = true", &["`seeds = true`: invalid type: boolean `true`, expected a word or a number"]),
    ("seeds = 3", "seeds = ", &["line 4: `seeds =`: "]),
    ("title = \"A study\"", "", &["missing field `title`"]),
    ("seconds = [3, 1.5]", "seconds = [3, 0]", &["line 9: `seconds = [3, 0]`: '0': expected a number greater than 0"]),
    ("seconds = [3, 1.5]", "seconds = [3, nan]", &["`seconds = [3, nan]`: 'NaN': expected a number"]),
    ("passes = [4, 1]", "passes = [1.5]", &["`passes = [1.5]`: '1.5': expected a whole number"]),
    ("32x24", "32", &["`size = \"32\"`: '32': expected WIDTHxHEIGHT"]),
    ("name = \"pool\"", "name = \"ring\"", &["`name = \"ring\"`: a scene of this name is there already"]),
    ("name = \"box\"", "name = \"\"", &["`name = \"\"`: a scene needs a name"]),
    ("reference = \"self\"", "", &["missing field `reference`"]),
    (
        "reference = \"self\"",
        "reference = 5",
        &["`reference = 5`: invalid type: integer `5`, expected the path of an EXR"],
    ),
    ("seed = 9", "sead = 9", &["sead = 9", "unknown field `sead`"]),
    ("radius = 0.5", "radius = 0", &["'0': expected a number greater than 0"]),
    ("settings = {", "settings = { name = \"x\",", &["the settings of a reference have no name"]),
    (
        "estimator = \"hash\"",
        "estimator = \"hush\"",
        &["`estimator = \"hush\"`: 'hush': expected one of bvh, tiled, hash"],
    ),
    ("alpha = 0.5", "alpha = 1.5", &["`alpha = 1.5`: '1.5': expected a number between 0.000001 and 1"]),
    ("alpha = 0.5", "footprint = \"fixed:-1\"", &["`footprint = \"fixed:-1\"`: 'fixed:-1': expected differential"]),
    ("name = \"hash, wide\"", "", &["a variant needs a name"]),
    ("name = \"hash, wide\"", "name = \"ppp=2 r=1\"", &["variant 'ppp=2 r=1' is there already"]),
    ("scenes = [\"ring\"]", "scenes = [\"rang\"]", &["`scenes = [\"rang\"]`: there is no scene 'rang'"]),
    ("scenes = [\"ring\"]", "variants = [\"x\"]", &["there is no variant 'x'"]),
    ("scenes = [\"ring\"]", "seeds = 1", &["`seeds = 1`: a variance needs at least 2 seeds"]),
];

#[test]
fn what_is_wrong_is_named_with_its_line() {
    for (part, replacement, expected) in BAD {
        assert!(GOOD.contains(part), "{part}");
        let message = read(&GOOD.replacen(part, replacement, 1)).expect_err(replacement);
        assert!(message.starts_with("study.toml: "), "{message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        for part in expected {
            assert!(message.contains(part), "'{replacement}' should give '{part}', not: {message}");
        }
    }
    for (text, part) in [
        ("title = \"x\"\noutput = \"o\"\nscene = []\n", "no [[scene]]"),
        (GOOD.split("[[variant]]").next().expect("a start"), "no [[variant]] and no [[grid]]"),
    ] {
        let message = read(text).expect_err(part);
        assert!(message.contains(part), "{message}");
    }
    let without = GOOD.replace("[budgets]\nseconds = [3, 1.5]\npasses = [4, 1]", "");
    assert!(read(&without).is_ok(), "bias and variance alone are a study");
    let without = without.split("[decomposition]").next().expect("a start").to_owned();
    assert!(read(&without).expect_err("nothing").contains("no budgets: nothing to measure"));
    assert!(config::load(Path::new("no/such.toml")).expect_err("none").to_string().contains("no/such.toml"));
}

#[test]
fn the_committed_studies_can_be_read() {
    let folder = repository("studies");
    for (name, scenes, variants) in [("assets", 3, 4), ("peers", 5, 1), ("defaults", 5, 15), ("rooms", 24, 4)] {
        let study = config::load(&folder.join(name).with_extension("toml")).expect(name);
        assert_eq!((study.scenes.len(), study.variants.len()), (scenes, variants), "{name}");
        for scene in study.scenes.iter().filter(|scene| !scene.optional) {
            assert!(scene.file.is_file(), "{}", scene.file.display());
        }
    }
}
