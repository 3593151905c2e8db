//! Tables of what a render used, what it thought of its own error, and what it left out.

use std::collections::BTreeSet;

use super::errors::budget_text;
use super::table::{Table, Td, figures, figures_or_dash};
use crate::plot::{Bar, Bars};
use crate::study::curves::{Cell, budgets, variants};
use crate::study::results::{Measurement, Results};
use crate::study::statistics::{ratio, spread};

/// Parts of the time in the order in which they happen; others follow by name.
const PARTS: [&str; 8] = ["load", "build", "compile", "trace", "gather", "film", "estimate", "write"];

/// The variants with measurements on a scene, with those at the greatest time.
fn last<'a>(results: &'a Results, scene: &str) -> Vec<(String, Vec<&'a Measurement>)> {
    let all = variants(results).into_iter().map(|v| {
        let measurements = Cell::of(results, scene, &v).last();
        (v, measurements)
    });
    all.filter(|(_, measurements)| !measurements.is_empty()).collect()
}

fn median<'a>(measurements: &[&'a Measurement], of: impl Fn(&'a Measurement) -> f64) -> Option<f64> {
    spread(measurements.iter().map(|r| of(r))).map(|s| s.median)
}

/// Names of the parts of the time on a scene.
fn parts(rows: &[(String, Vec<&Measurement>)]) -> Vec<String> {
    let named: BTreeSet<&String> =
        rows.iter().flat_map(|(_, measurements)| measurements).flat_map(|r| r.time_split.keys()).collect();
    let rank = |name: &str| PARTS.iter().position(|p| *p == name).unwrap_or(PARTS.len());
    let mut parts: Vec<String> = named.into_iter().cloned().collect();
    parts.sort_by_key(|name| rank(name)); // stable: the others stay in the order of their names
    parts
}

/// Medians of the parts of the time at the end of each variant's curve, as bars.
pub(super) fn time_bars(results: &Results, scene: &str) -> Option<Bars> {
    let rows = last(results, scene);
    let parts = parts(&rows);
    if parts.is_empty() {
        return None;
    }
    let bars = rows.iter().map(|(name, measurements)| Bar {
        name: name.clone(),
        values: parts.iter().map(|part| part_seconds(measurements, part)).collect(),
    });
    let title = format!("{scene}: where the time went");
    Some(Bars { title, label: "seconds at the greatest budget, medians".into(), bars: bars.collect(), parts })
}

/// Median seconds of a part; a render without it spent none.
fn part_seconds(measurements: &[&Measurement], part: &str) -> f64 {
    median(measurements, |r| r.time_split.get(part).copied().unwrap_or(0.0)).unwrap_or(0.0)
}

/// The numbers of [`time_bars`], with the part of their sum.
pub(super) fn time_split(results: &Results, scene: &str) -> Table {
    let rows = last(results, scene);
    let parts = parts(&rows);
    let head = std::iter::once("").chain(parts.iter().map(String::as_str));
    let mut table =
        Table::new("Time at the greatest budget: seconds (percent of the sum), medians over the seeds", head);
    if parts.is_empty() {
        return table;
    }
    for (name, measurements) in &rows {
        let seconds: Vec<f64> = parts.iter().map(|part| part_seconds(measurements, part)).collect();
        let sum: f64 = seconds.iter().sum();
        let cells = seconds.iter().map(|s| match 100.0 * s / sum {
            percent if percent.is_finite() => format!("{} ({percent:.0})", figures(*s)),
            _ => figures(*s),
        });
        table.rows.push(std::iter::once(name.clone()).chain(cells).map(Td::from).collect());
    }
    table
}

/// Work, memory and all measures of the error at the end of each variant's curve.
pub(super) fn effort(results: &Results, scene: &str) -> Table {
    let head = [
        "",
        "budget",
        "seeds",
        "seconds",
        "passes",
        "photons",
        "photons/s",
        "device MiB",
        "relMSE",
        "trimmed",
        "MSE",
        "SMAPE",
        "FLIP",
        "mean / reference",
    ];
    let mut table = Table::new("At the greatest budget: medians over the seeds; memory is the greatest of all", head);
    for (name, measurements) in last(results, scene) {
        let of = |f: fn(&Measurement) -> f64| figures_or_dash(median(&measurements, f));
        let bytes = measurements.iter().map(|r| r.device_bytes).max().unwrap_or(0);
        let flips: Vec<f64> = measurements.iter().filter_map(|r| r.error.flip).collect();
        let cells = [
            name,
            measurements.first().map_or_else(String::new, |r| budget_text(r.budget)),
            measurements.len().to_string(),
            of(|r| r.seconds),
            of(|r| r.passes as f64),
            of(|r| r.photons as f64),
            of(|r| if r.seconds > 0.0 { r.photons as f64 / r.seconds } else { f64::NAN }),
            figures(bytes as f64 / 1_048_576.0),
            of(|r| r.error.relmse),
            of(|r| r.error.relmse_trimmed),
            of(|r| r.error.mse),
            of(|r| r.error.smape),
            figures_or_dash(spread(flips).map(|s| s.median)),
            of(|r| r.error.mean_ratio),
        ];
        table.rows.push(cells.into_iter().map(Td::from).collect());
    }
    table
}

/// A true error of a point.
type Truth = fn(&Measurement) -> f64;

/// The renderer's own estimate over the true error, where it has one.
pub(super) fn estimated(results: &Results, scene: &str) -> Table {
    let budgets = budgets(results);
    let head = std::iter::once(String::new()).chain(budgets.iter().map(|b| budget_text(*b)));
    let caption =
        "Estimated error over true error (root of relMSE): median (10 % to 90 % of the seeds); above 1 is cautious";
    let mut table = Table::new(caption, head);
    let truths: [(&str, Truth); 2] =
        [("all pixels", |r| r.error.relmse.sqrt()), ("trimmed", |r| r.error.relmse_trimmed.sqrt())];
    for variant in variants(results) {
        let cell = Cell::of(results, scene, &variant);
        for (name, truth) in truths {
            let ratios = |measurements: &mut dyn Iterator<Item = &Measurement>| {
                spread(measurements.filter_map(|r| ratio(r.estimated_error?, truth(r))))
            };
            let found: Vec<_> = budgets.iter().map(|budget| ratios(&mut cell.at(*budget))).collect();
            if found.iter().all(Option::is_none) {
                continue;
            }
            let text = found.iter().map(|s| {
                s.map_or_else(
                    || "-".to_owned(),
                    |s| format!("{} ({} to {})", figures(s.median), figures(s.low), figures(s.high)),
                )
            });
            table.rows.push(std::iter::once(format!("{variant}, {name}")).chain(text).map(Td::from).collect());
        }
    }
    table
}

/// What the renders of a scene left out, by variant.
pub(super) fn omissions(results: &Results, scene: &str) -> Table {
    let mut table = Table::new("Left out, because the scene does not need it", ["", "left out"]);
    for variant in variants(results) {
        let cell = Cell::of(results, scene, &variant);
        let names: BTreeSet<&str> = cell.measurements().flat_map(|r| &r.left_out).map(String::as_str).collect();
        if cell.measurements().next().is_some() {
            let list = names.into_iter().collect::<Vec<_>>().join(", ");
            table.rows.push(vec![variant.into(), if list.is_empty() { "nothing" } else { &list }.into()]);
        }
    }
    table
}

/// The settings of each variant.
pub(super) fn settings(results: &Results) -> Table {
    let mut table = Table::new("Settings of the variants", ["", "settings"]);
    for variant in variants(results) {
        let of_measurements = results.measurements.iter().filter(|r| r.variant == variant).map(|r| &r.settings);
        let of_others = results.decompositions.iter().filter(|d| d.variant == variant).map(|d| &d.settings);
        let settings = of_measurements.chain(of_others).next();
        let list: Vec<String> =
            settings.into_iter().flatten().map(|(name, value)| format!("{name} = {value}")).collect();
        table.rows.push(vec![variant.into(), if list.is_empty() { "defaults".into() } else { list.join(", ").into() }]);
    }
    table
}
