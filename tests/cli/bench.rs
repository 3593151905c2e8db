//! `nephroid bench` from outside: every table is whole.

use serde_json::Value;

use super::device::{folder, json, names_in, success};
use crate::support::program::turn;

#[test]
fn bench_measures_every_kind() {
    let _turn = turn();
    let folder = folder();
    let report = json("bench --quick --json --device %", folder.path());
    assert_eq!(report["meaningless"], true);
    let names = |rates: &Value| -> Vec<String> {
        let rates = rates.as_array().expect("a list");
        assert!(rates.iter().all(|rate| rate["seconds"].as_f64() > Some(0.0) && rate["items"].as_u64() > Some(0)));
        rates.iter().map(|rate| rate["name"].as_str().expect("a name").to_owned()).collect()
    };
    assert_eq!(
        names(&report["rates"]),
        ["copy", "multiply", "scan", "sort", "sort, one CPU thread", "additive blending"]
    );
    let scene = &report["scenes"][0];
    let wanted = [
        "SAH tree, host",
        "LBVH, device",
        "primary rays",
        "shadow rays",
        "diffuse rays",
        "plan, host",
        "photons traced",
        "photon map",
        "whole pass",
        "pairs tested",
        "pairs accepted",
    ];
    assert_eq!(names(&scene["rates"]), wanted);
    assert!(scene["device_peak_bytes"].as_u64() > Some(1 << 16));
    let items = |name: &str| {
        let index = wanted.iter().position(|known| *known == name).expect("measured");
        scene["rates"][index]["items"].as_u64().expect("a count")
    };
    assert!(items("pairs accepted") < items("pairs tested"), "not every photon tested is accepted");
}

#[test]
fn bench_tells_what_changes_cost() {
    let _turn = turn();
    let folder = folder();
    let report = json("bench update --json --repeats 1 --size 16x12 --device % @cornell-glass.glb", folder.path());
    let scene = &report[0];
    assert!(scene["new_seconds"].as_f64() > Some(0.0) && scene["new_compiled_seconds"].as_f64() > Some(0.0));
    let changes = scene["changes"].as_array().expect("a list");
    let steps = |name: &str| {
        let change = changes.iter().find(|change| change["change"] == name).unwrap_or_else(|| panic!("no {name}"));
        assert!(change["update_seconds"].as_f64() > Some(0.0), "{name}");
        change["steps"].clone()
    };
    assert_eq!(steps("camera"), serde_json::json!(["film", "camera"]));
    assert!(steps("instance moved").as_array().expect("a list").contains(&"tree".into()));
}

#[test]
fn bench_compares_the_builders_of_trees() {
    let _turn = turn();
    let folder = folder();
    let report = json("bench trees --quick --deform --json --device % @cornell-glass.glb", folder.path());
    let scene = &report["scenes"][0];
    let trees = scene["trees"].as_array().expect("a list");
    let names: Vec<_> = trees.iter().map(|tree| tree["builder"].as_str().expect("a name")).collect();
    assert_eq!(names, ["sah", "lbvh", "hploc"]);
    assert!(trees.iter().all(|tree| tree["refit_seconds"].as_f64() > Some(0.0)), "{trees:?}");
    let cost = |index: usize| trees[index]["relative_cost"].as_f64().expect("a number");
    assert!(cost(0) == 1.0 && cost(1) > 0.9 && cost(2) > 0.7 && cost(2) < cost(1), "{trees:?}");
    let deformed = scene["deformed"].as_array().expect("a list");
    let growth: Vec<_> = deformed.iter().map(|row| row["growth"].as_f64().expect("a number")).collect();
    assert!((growth[0] - 1.0).abs() < 1e-3 && growth[5] > 1.01, "{growth:?}");
}

#[test]
fn bench_compares_the_estimators() {
    let _turn = turn();
    let folder = folder();
    let line = "bench estimators --quick --device % --json=out.json --csv=out.csv @cornell-glass.glb @wall.glb";
    let words = success(line, folder.path());
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a file");
    let report: Value = serde_json::from_str(&read("out.json")).expect("JSON");
    assert_eq!(report["meaningless"], true);
    let scenes = report["scenes"].as_array().expect("scenes");
    assert_eq!(scenes.len(), 2);
    let estimators = nephroid::low_level::render::Estimator::ALL;
    assert_eq!(read("out.csv").lines().count(), 1 + 2 * 2 * estimators.len());
    for scene in scenes {
        let cells = scene["cells"].as_array().expect("cells");
        assert_eq!(cells.len(), 2 * estimators.len());
        let cell = |name: &str, bsdf: &str| {
            cells.iter().find(|cell| cell["estimator"] == name && cell["bsdf"] == bsdf).expect("a cell")
        };
        let brute = cell("brute", "full");
        for cell in cells.iter().filter(|cell| cell["reason"].is_null()) {
            assert!(cell["gather_ms"].as_f64() > Some(0.0) && cell["build_ms"].as_f64() >= Some(0.0), "{cell}");
            assert_eq!(cell["photons_stored"], brute["photons_stored"], "the same photons");
            let name =
                format!("{} {}", cell["estimator"].as_str().expect("a name"), cell["bsdf"].as_str().expect("a kind"));
            let shown = words.lines().filter(|line| line.starts_with(&name)).any(|line| {
                let sum = line.split_whitespace().nth(4).and_then(|word| word.parse::<f64>().ok());
                sum.is_some_and(|sum| (sum - cell["sum_ms"].as_f64().expect("a time")).abs() <= 0.051)
            });
            assert!(shown, "{cell} is not in the table: {words}");
        }
        let bvh = cell("bvh", "full");
        let tested = |cell: &Value| cell["pairs_tested"].as_u64().expect("a count");
        assert!(tested(bvh) < tested(brute), "a tree looks at fewer photons");
        assert_eq!(bvh["pairs_accepted"], brute["pairs_accepted"], "and accepts the same ones");
        assert_eq!(brute["estimator_bytes"]["kept_per_photon"], 0.0);
        assert!(bvh["estimator_bytes"]["kept_per_photon"].as_f64() > Some(4.0), "{bvh}");
        assert!(bvh["transient_bytes"].as_u64() >= brute["transient_bytes"].as_u64());
    }
    let line = "bench estimators --quick --device % --estimators brute --brute-pairs 1 --csv @wall.glb";
    assert!(success(line, folder.path()).contains("left out: "), "too many pairs");
}

/// What an XML parser would refuse in a document without comments, declarations and entities of its own.
fn assert_xml(document: &str) {
    let mut open = Vec::new();
    let mut rest = document.trim();
    assert!(rest.starts_with('<') && rest.ends_with('>'), "{document}");
    while let Some((text, tail)) = rest.split_once('<') {
        let entities = text.split('&').skip(1);
        assert!(
            entities.into_iter().all(|e| ["amp;", "lt;", "gt;", "quot;", "apos;"].iter().any(|n| e.starts_with(n)))
        );
        let (tag, after) = tail.split_once('>').expect("a tag ends");
        rest = after;
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "{document}");
            continue;
        }
        let (tag, alone) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let (name, attributes) = tag.split_once(' ').unwrap_or((tag, ""));
        let parts: Vec<&str> = attributes.split('"').collect();
        assert_eq!(parts.len() % 2, 1, "quotes in {tag}");
        let names: Vec<&str> =
            parts.iter().step_by(2).map(|part| part.trim()).filter(|part| !part.is_empty()).collect();
        assert!(names.len() == parts.len() / 2 && names.iter().all(|name| name.ends_with('=')), "{tag}");
        if !alone {
            open.push(name);
        }
    }
    assert!(open.is_empty() && rest.is_empty(), "{open:?} are never closed");
}

#[test]
fn the_check_of_xml_can_fail() {
    assert_xml("<a b=\"1\"><c/>x &amp; y</a>");
    for bad in ["<a>", "<a></b>", "<a b=1></a>", "<a b=\"1></a>", "<a>&x</a>", "<a/>x", "<a><b></a></b>"] {
        assert!(std::panic::catch_unwind(|| assert_xml(bad)).is_err(), "{bad}");
    }
}

#[test]
fn bench_measures_and_plots_growth() {
    let _turn = turn();
    let folder = folder();
    let line = "bench estimators --quick --growth --svg plots --json --csv=out.csv --device % @wall.glb";
    let report = json(line, folder.path());
    let curves = report["scenes"][0]["curves"].as_array().expect("curves");
    assert_eq!(curves.len(), 2 * nephroid::low_level::render::Estimator::ALL.len());
    let parts = ["build", "gather", "sum"];
    let mut files: Vec<String> =
        ["photons", "pixels"].iter().flat_map(|over| parts.map(|part| format!("wall-{over}-{part}.svg"))).collect();
    files.sort();
    assert_eq!(names_in(&folder.path().join("plots")), files);
    for over in ["photons", "pixels"] {
        let of = || curves.iter().filter(|curve| curve["over"] == over);
        let measured = |part: &str| {
            let key = format!("{part}_ms");
            of().flat_map(|curve| curve["steps"].as_array().expect("steps"))
                .filter(|step| step[&key].as_f64() > Some(0.0))
                .count()
        };
        for part in parts {
            let file = folder.path().join("plots").join(format!("wall-{over}-{part}.svg"));
            let svg = std::fs::read_to_string(file).expect("a plot");
            assert_xml(&svg);
            assert_eq!(svg.matches("class=\"point\"").count(), measured(part), "{over} {part}");
            assert_eq!(svg.matches("class=\"legend\"").count(), of().count());
        }
        assert!(measured("gather") >= 4, "two estimators at two sizes");
        let bvh = of().next().expect("a curve");
        assert!(bvh["growth"]["gather"]["exponent"].is_number(), "{bvh}");
    }
    let steps: usize = curves.iter().map(|curve| curve["steps"].as_array().expect("steps").len()).sum();
    let csv = std::fs::read_to_string(folder.path().join("out.csv")).expect("a table");
    assert_eq!(csv.lines().count(), 1 + steps);
}

#[test]
fn bench_compares_maps_with_the_tree() {
    let _turn = turn();
    let folder = folder();
    let line = "bench maps --quick --device % @corridors.glb";
    let report = json(&format!("{line} --json"), folder.path());
    let rows = report[0]["rows"].as_array().expect("rows");
    let rays = report[0]["rays"].as_u64().expect("a count");
    for row in rows {
        let all = ["all_right", "all_wrong", "all_lost", "all_escaped", "all_phantom"];
        let sum: u64 = all.iter().map(|name| row["counts"][name].as_u64().expect("a count")).sum();
        assert_eq!(sum, rays, "every ray is judged once: {row}");
        let covered = row["covered"].as_f64().expect("a part");
        assert!((0.0..=1.0).contains(&covered) && row["seconds"].as_f64() >= Some(0.0), "{row}");
    }
    let right = |row: usize| rows[row]["counts"]["all_right"].as_u64();
    assert!(rows.len() == 2 && right(1) > right(0), "four centres know more than one");
    assert!(success(line, folder.path()).lines().count() == 5, "a line for each set of maps below the heads");
}
