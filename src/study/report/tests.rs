//! The report of made-up studies: valid pages whatever the names and numbers, and the right numbers in them.

use std::collections::BTreeMap;

use super::*;
use crate::plot::well_formed::check;
use crate::study::curves::tests::measurement;
use crate::study::results::{Budget, Decomposition, Peer};

/// Two variants, two scenes, three seeds, three budgets, one other renderer: on the first scene `fast` has the error
/// 0.04 / t and `slow` 0.1 / t, on the second both swap but are closer.
fn study() -> Results {
    let mut results =
        Results { title: "Made up".into(), device: "none".into(), version: "0".into(), ..Default::default() };
    for (scene, factors) in [("ring", [0.04, 0.1]), ("pool", [0.3, 0.2])] {
        for (variant, factor) in ["fast", "slow"].into_iter().zip(factors) {
            for seed in 0..3 {
                for seconds in [1.0f64, 10.0, 100.0] {
                    let error = factor * (1.0 + 0.1 * (seed as f64 - 1.0)) / seconds;
                    results.measurements.push(measurement(scene, variant, seed, seconds, error));
                }
            }
            for passes in [1u64, 8, 64] {
                results.decompositions.push(Decomposition {
                    scene: scene.into(),
                    variant: variant.into(),
                    settings: BTreeMap::new(),
                    passes,
                    seeds: 16,
                    bias_squared: (passes as f64).powf(-2.0 / 3.0),
                    variance: -0.0,
                });
            }
        }
    }
    for (seconds, error) in [(1.0, 0.4), (20.0, 0.02)] {
        let peer = Peer { scene: "ring".into(), name: "other".into(), seconds, relmse: error, relmse_trimmed: error };
        results.peers.push(peer);
    }
    results
}

fn cells(table: &table::Table, row: usize) -> Vec<&str> {
    table.rows[row].iter().map(|cell| cell.text.as_str()).collect()
}

/// All of a page that must hold whatever was measured.
fn assert_valid(results: &Results) -> String {
    let page = html(results);
    check(&page).unwrap_or_else(|fault| panic!("{fault}"));
    for outside in ["<script", "<link", "<iframe", "<img", "src=", "@import", "url(", "javascript:", "NaN"] {
        assert!(!page.contains(outside), "{outside} in the page");
    }
    // Nothing is loaded: the only addresses are the name of SVG and places in the page.
    let addresses = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    assert!(!addresses.contains("://"), "an address in the page");
    assert_eq!(page.matches("href=").count(), page.matches("href=\"#").count());
    let plots = plots(results);
    for (index, (name, svg)) in plots.iter().enumerate() {
        check(svg).unwrap_or_else(|fault| panic!("{name}: {fault}"));
        assert!(page.contains(svg.as_str()), "{name} is in the page");
        let harmless = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        assert!(name.strip_suffix(".svg").is_some_and(|stem| stem.chars().all(harmless)), "{name}");
        assert!(plots[..index].iter().all(|(other, _)| other != name), "{name} twice");
    }
    page
}

#[test]
fn a_study_is_a_valid_page_with_all_its_parts() {
    let page = assert_valid(&study());
    for part in [
        "Made up",
        "At equal time",
        "At equal error",
        "Slopes of",
        "Estimated error",
        "Bias and variance",
        "where the time went",
        "device MiB",
        "Left out",
        "best compromise",
        "How to read this",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let names: Vec<String> =
        plots(&study()).into_iter().map(|(name, _)| name).filter(|n| n.starts_with("ring")).collect();
    assert_eq!(
        names,
        [
            "ring-trimmed-seconds.svg",
            "ring-trimmed-photons.svg",
            "ring-plain-seconds.svg",
            "ring-plain-photons.svg",
            "ring-time-split.svg",
            "ring-bias-variance-passes.svg"
        ]
    );
}

#[test]
fn the_tables_hold_the_numbers() {
    let results = study();
    let time = errors::equal_time(&results, "ring");
    assert_eq!(time.head, ["", "1 s", "10 s", "100 s"]);
    assert_eq!(cells(&time, 0), ["fast", "0.0400 (1.00)", "0.00400 (1.00)", "4.00e-4 (1.00)"]);
    assert_eq!(cells(&time, 1), ["slow", "0.100 (2.50)", "0.0100 (2.50)", "0.00100 (2.50)"]);
    assert_eq!(cells(&time, 2), ["other", "0.400 (10.0)", "0.0400 (10.0)", "-"], "no extrapolation");
    assert!(time.rows[0][1].strong && !time.rows[1][1].strong);

    let error = errors::equal_error(&results, "ring");
    assert_eq!(error.head, ["", "0.1", "0.03", "0.01", "0.003", "0.001"]);
    assert_eq!(cells(&error, 0)[1..3], ["\u{2264} 1.00", "1.33 (1.00)"]);
    assert_eq!(cells(&error, 1)[2..4], ["3.33 (2.50)", "10.0 (2.50)"]);
    assert_eq!(cells(&error, 2)[1..4], ["4.00 (\u{2265} 4.00)", "13.3 (10.0)", "-"]);

    let slopes = errors::slopes(&results, "ring");
    assert_eq!(cells(&slopes, 0)[1..], ["-1.00 \u{b1} 0.00", "-1.00 \u{b1} 0.00", "-1.00 \u{b1} 0.00", "3 seeds"]);
    assert_eq!(cells(&slopes, 2)[1..], ["-1.00", "-", "-1.00", "two points: none"]);

    let estimated = costs::estimated(&results, "ring");
    assert_eq!(estimated.rows.len(), 2, "only one variant has an estimate");
    assert_eq!(cells(&estimated, 0)[..2], ["fast, all pixels", "3.00 (3.00 to 3.00)"]);

    let split = costs::time_split(&results, "pool");
    assert_eq!(split.head, ["", "trace", "gather", "denoise"]);
    assert_eq!(cells(&split, 0), ["fast", "300 (75)", "100 (25)", "0 (0)"]);
    assert_eq!(
        cells(&costs::effort(&results, "pool"), 0)[1..8],
        ["100 s", "3", "100", "800", "1.00e7", "1.00e5", "5.00"]
    );
    assert_eq!(cells(&errors::decomposition(&results, "pool"), 1)[1..4], ["8", "16", "0.250"]);
}

/// `fast` loses 1 and 1.5, `slow` 2.5 and 1.
#[test]
fn the_regret_names_the_best_compromise() {
    let results = study();
    let table = errors::regret_table(&results, Budget::Seconds(10.0));
    assert!(table.caption.ends_with("best compromise fast, the choice of 3 of 3 seeds alone"), "{}", table.caption);
    assert_eq!(cells(&table, 0), ["fast", "1.22", "1.50", "1.00", "1.50"]);
    assert_eq!(cells(&table, 1), ["slow", "1.58", "2.50", "2.50", "1.00"]);
    let text = markdown_summary(&results);
    assert!(text.contains("| **fast** | **1.22** | **1.50** | **1.00** | **1.50** |"), "{text}");
    assert!(text.contains("| fast | **0.0400 (1.00)** |"), "{text}");
}

#[test]
fn a_study_of_nothing_is_a_valid_page() {
    let page = assert_valid(&Results::default());
    assert!(page.contains("Nothing has been measured yet"));
    assert_eq!((plots(&Results::default()).len(), markdown_summary(&Results::default()).len()), (0, 0));
}

#[test]
fn hostile_names_stay_text() {
    let hostile = "<script>alert('&\"')</script>]]>|`\u{1}\u{ffff}\n";
    let mut results = study();
    (results.title, results.device, results.version) = (hostile.into(), hostile.into(), hostile.into());
    for measurement in &mut results.measurements {
        measurement.scene.push_str(hostile);
        measurement.variant.push_str(hostile);
        measurement.settings.insert(hostile.into(), hostile.into());
        measurement.time_split.insert(hostile.into(), 1.0);
        measurement.left_out.push(hostile.into());
    }
    for part in &mut results.decompositions {
        part.settings.insert(format!("radius{hostile}"), format!("{} {hostile}", part.passes));
    }
    for peer in &mut results.peers {
        peer.scene.push_str(hostile);
        peer.name.push_str(hostile);
    }
    let page = assert_valid(&results);
    assert!(page.contains("&lt;script&gt;"));
    let text = markdown_summary(&results);
    assert!(!text.contains("<script") && text.lines().all(|line| !line.starts_with('<')), "{text}");
}

#[test]
fn broken_numbers_are_survived() {
    let odd = [0.0, -1.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, f64::MAX, f64::MIN_POSITIVE, 1e-320, 1.0];
    let mut results = study();
    for (index, measurement) in results.measurements.iter_mut().enumerate() {
        let value = odd[index % odd.len()];
        let error = &mut measurement.error;
        (error.relmse, error.relmse_trimmed, error.mse, error.flip) =
            (value, odd[index / 3 % odd.len()], value, Some(value));
        measurement.seconds = odd[index / 2 % odd.len()];
        measurement.estimated_error = Some(odd[index / 5 % odd.len()]);
        measurement.budget = Budget::Seconds(odd[index / 4 % odd.len()]);
        measurement.time_split.insert("trace".into(), value);
        measurement.photons = if index % 2 == 0 { 0 } else { u64::MAX };
    }
    for (index, part) in results.decompositions.iter_mut().enumerate() {
        (part.bias_squared, part.variance) = (odd[index % odd.len()], odd[(index + 3) % odd.len()]);
    }
    for peer in &mut results.peers {
        (peer.seconds, peer.relmse) = (0.0, f64::NAN);
    }
    // NaN and infinite numbers are written as a dash or as an infinite statistic.
    assert_valid(&results);
    markdown_summary(&results);
}

#[test]
fn one_point_is_enough_for_a_page() {
    let one = Results { measurements: vec![measurement("a", "b", 0, 1.0, 0.1)], ..Default::default() };
    let page = assert_valid(&one);
    assert!(page.contains("0.100 (1.00)"));
    let part = Decomposition { seeds: 2, ..study().decompositions[0].clone() };
    assert_valid(&Results { decompositions: vec![part], ..Default::default() });
    assert_valid(&Results { peers: study().peers, ..Default::default() });
}

/// The checks above see a fault.
#[test]
fn the_check_of_pages_can_fail() {
    let page = html(&study());
    assert!(check(&page.replacen("</td>", "", 1)).is_err());
    assert!(check(&page.replacen("&amp;", "&", 1).replacen("</svg>", "", 1)).is_err());
    assert!(check(&page.replacen("Made up", "<b>", 1)).is_err());
}
