//! What `nephroid bench estimators` measured, as text, JSON and CSV.

use serde_json::{Value, json};

use super::machine::Machine;
use crate::bench::estimators::{Cell, Raced, SceneTable, Trial};
use crate::bench::growth::{Curve, Growth, Part, Step, Variable};
use crate::cli::numbers::{bytes, si};
use crate::fit::Fit;

/// Estimators side by side.
pub(super) struct TableReport {
    pub machine: Machine,
    pub meaningless: bool,
    pub trial: Trial,
    pub tables: Vec<SceneTable>,
}

/// Reasons, each told once.
#[derive(Default)]
struct Footnotes(Vec<String>);

impl Footnotes {
    /// A dash with the number of the reason.
    fn dash(&mut self, reason: &str) -> String {
        let index = self.0.iter().position(|known| known == reason).unwrap_or_else(|| {
            self.0.push(reason.to_owned());
            self.0.len() - 1
        });
        format!("- [{}]", index + 1)
    }

    fn lines(&self) -> impl Iterator<Item = String> {
        self.0.iter().enumerate().map(|(index, reason)| format!("[{}] {reason}", index + 1))
    }
}

fn header(machine: &Machine, meaningless: bool) -> Vec<String> {
    let mut lines = machine.lines();
    if meaningless {
        lines.push("sizes too small for a measurement: these numbers mean nothing".into());
    }
    lines
}

fn ms(seconds: f64) -> String {
    let ms = 1e3 * seconds;
    if ms < 10.0 { format!("{ms:.3}") } else { format!("{ms:.1}") }
}

/// File name of a scene: paths are too long for a column.
fn short(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

impl TableReport {
    pub fn text(&self) -> String {
        let mut lines = header(&self.machine, self.meaningless);
        let [w, h] = self.trial.size;
        lines.push(format!("{w}x{h}; medians of {} passes of the same photons", self.trial.passes.max(1)));
        let mut notes = Footnotes::default();
        for lambert in [false, true] {
            lines.push(String::new());
            let title = if lambert { "Lambert only" } else { "full BSDF" };
            lines.push(format!("{title}: milliseconds of build + gather (times the fastest)"));
            lines.extend(self.summary(lambert, &mut notes));
        }
        for table in &self.tables {
            lines.push(String::new());
            lines.extend(Self::details(table, &mut notes));
        }
        if !notes.0.is_empty() {
            lines.push(String::new());
            lines.extend(notes.lines());
        }
        lines.join("\n")
    }

    /// A row per scene, a column per estimator.
    fn summary(&self, lambert: bool, notes: &mut Footnotes) -> Vec<String> {
        let width = self.tables.iter().map(|t| short(&t.name).chars().count()).max().unwrap_or(0).max(6);
        let mut lines = vec![format!("{:<width$}", "")];
        for estimator in &self.trial.estimators {
            lines[0].push_str(&format!(" {:>18}", estimator.name()));
        }
        for table in &self.tables {
            let mut line = format!("{:<width$}", short(&table.name));
            for &estimator in &self.trial.estimators {
                let Some(cell) = table.cell(estimator, lambert) else { continue };
                let text = match &cell.outcome {
                    Ok(raced) => {
                        format!("{} ({:.2})", ms(raced.times.total), table.ratio(cell).unwrap_or(f64::NAN))
                    }
                    Err(reason) => notes.dash(reason),
                };
                line.push_str(&format!(" {text:>18}"));
            }
            lines.push(line);
        }
        lines
    }

    /// Everything about one scene.
    fn details(table: &SceneTable, notes: &mut Footnotes) -> Vec<String> {
        let photons = table
            .photons()
            .map_or(String::new(), |[emitted, stored]| format!(", {emitted} photons emitted, {stored} stored"));
        let mut lines = vec![format!("{}: {} triangles{photons}", table.name, table.triangles)];
        if table.lambert_only {
            lines.push("nothing but Lambert's law on flat triangles: full and Lambert are one program".into());
        }
        lines.push(format!(
            "{:<20} {:>10} {:>10} {:>10} {:>7} {:>7} {:>9} {:>9} {:>16} {:>10} {:>10}",
            "",
            "build ms",
            "gather ms",
            "sum ms",
            "ratio",
            "spread",
            "tested",
            "accepted",
            "bytes/photon",
            "fixed",
            "pass"
        ));
        for cell in &table.cells {
            let name = format!("{} {}", cell.estimator.name(), kind(cell));
            let raced = match &cell.outcome {
                Ok(raced) => raced,
                Err(reason) => {
                    lines.push(format!("{name:<20} {:>10}", notes.dash(reason)));
                    continue;
                }
            };
            let pair = |k: usize| cell.pairs.map_or("-".into(), |pairs| si(pairs[k] as f64));
            let own = raced.bytes.unwrap_or_default();
            lines.push(format!(
                "{name:<20} {:>10} {:>10} {:>10} {:>7.2} {:>7.2} {:>9} {:>9} {:>16} {:>10} {:>10}",
                ms(raced.times.build),
                ms(raced.times.gather),
                ms(raced.times.total),
                table.ratio(cell).unwrap_or(f64::NAN),
                raced.times.spread,
                pair(0),
                pair(1),
                format!("{:.0} + {:.0}", own.kept_per_photon, own.scratch_per_photon),
                bytes(own.fixed),
                bytes(raced.transient_bytes),
            ));
        }
        lines
    }

    pub fn json(&self) -> Value {
        let mut report = self.machine.json();
        let [w, h] = self.trial.size;
        let own = [
            ("meaningless", json!(self.meaningless)),
            ("width", json!(w)),
            ("height", json!(h)),
            ("passes", json!(self.trial.passes.max(1))),
            ("brute_most_pairs", json!(self.trial.most_pairs)),
            ("scenes", self.tables.iter().map(scene_json).collect()),
        ];
        report.extend(own.map(|(name, value)| (name.to_owned(), value)));
        Value::Object(report)
    }

    pub fn csv(&self) -> String {
        let mut lines =
            vec![format!("scene,triangles,width,height,bsdf,{MEASURED},ratio,pairs_tested,pairs_accepted,reason")];
        let [w, h] = self.trial.size;
        for table in &self.tables {
            for cell in &table.cells {
                let start = format!("{},{},{w},{h},{}", quoted(&table.name), table.triangles, kind(cell));
                let number = |n: Option<f64>| n.map_or(String::new(), |n| n.to_string());
                let pair = |k: usize| cell.pairs.map_or(String::new(), |pairs| pairs[k].to_string());
                lines.push(format!(
                    "{start},{},{},{},{},{}",
                    measured(cell.estimator.name(), cell.outcome.as_ref().ok()),
                    number(table.ratio(cell)),
                    pair(0),
                    pair(1),
                    quoted(cell.outcome.as_ref().err().map_or("", |reason| reason)),
                ));
            }
        }
        lines.join("\n") + "\n"
    }
}

/// Columns of a CSV that [`measured`] fills.
const MEASURED: &str = "estimator,photons_emitted,photons_stored,build_ms,gather_ms,sum_ms,spread,\
                        kept_bytes_per_photon,scratch_bytes_per_photon,fixed_bytes,transient_bytes";

fn measured(estimator: &str, raced: Option<&Raced>) -> String {
    let Some(raced) = raced else { return format!("{estimator},,,,,,,,,,") };
    let times = raced.times;
    let [build, gather, sum] = [times.build, times.gather, times.total].map(|seconds| 1e3 * seconds);
    let own = raced.bytes.unwrap_or_default();
    format!(
        "{estimator},{},{},{build},{gather},{sum},{},{},{},{},{}",
        raced.emitted,
        raced.stored,
        times.spread,
        own.kept_per_photon,
        own.scratch_per_photon,
        own.fixed,
        raced.transient_bytes
    )
}

/// A field of a CSV (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

fn kind(cell: &Cell) -> &'static str {
    if cell.lambert { "lambert" } else { "full" }
}

fn raced_json(outcome: &Result<Raced, String>) -> Value {
    let raced = match outcome {
        Ok(raced) => raced,
        Err(reason) => return json!({ "reason": reason }),
    };
    let own = raced.bytes.map(|own| {
        json!({
            "kept_per_photon": own.kept_per_photon, "scratch_per_photon": own.scratch_per_photon,
            "deposits_per_photon": own.deposits_per_photon, "fixed": own.fixed,
        })
    });
    json!({
        "photons_emitted": raced.emitted, "photons_stored": raced.stored,
        "build_ms": 1e3 * raced.times.build, "gather_ms": 1e3 * raced.times.gather, "sum_ms": 1e3 * raced.times.total,
        "spread": raced.times.spread, "estimator_bytes": own, "transient_bytes": raced.transient_bytes,
    })
}

/// The members of `more` in `object`.
fn with(object: Value, more: Value) -> Value {
    let (Value::Object(mut all), Value::Object(more)) = (object, more) else { return Value::Null };
    all.extend(more);
    Value::Object(all)
}

fn scene_json(table: &SceneTable) -> Value {
    let cell = |cell: &Cell| {
        let more = json!({
            "estimator": cell.estimator.name(), "bsdf": kind(cell), "ratio": table.ratio(cell),
            "pairs_tested": cell.pairs.map(|pairs| pairs[0]), "pairs_accepted": cell.pairs.map(|pairs| pairs[1]),
        });
        with(raced_json(&cell.outcome), more)
    };
    json!({
        "scene": table.name, "triangles": table.triangles, "lambert_only": table.lambert_only,
        "cells": table.cells.iter().map(cell).collect::<Value>(),
    })
}

/// Growth of every estimator.
pub(super) struct GrowthReport {
    pub machine: Machine,
    pub meaningless: bool,
    pub growths: Vec<Growth>,
}

impl GrowthReport {
    pub fn text(&self) -> String {
        let mut lines = header(&self.machine, self.meaningless);
        let mut notes = Footnotes::default();
        for growth in &self.growths {
            for variable in [Variable::Photons, Variable::Pixels] {
                lines.push(String::new());
                lines.extend(block(growth, variable, &mut notes));
            }
        }
        if !notes.0.is_empty() {
            lines.push(String::new());
            lines.extend(notes.lines());
        }
        lines.join("\n")
    }

    pub fn json(&self) -> Value {
        let step = |step: &Step| {
            let [width, height] = step.size;
            with(raced_json(&step.outcome), json!({ "photons": step.photons, "width": width, "height": height }))
        };
        let curve = |curve: &Curve| {
            let fits = Part::ALL.map(|part| (part.name().to_owned(), fit_json(curve.fit(part))));
            json!({
                "estimator": curve.estimator.name(), "over": curve.variable.name(),
                "growth": Value::Object(fits.into_iter().collect()),
                "steps": curve.steps.iter().map(step).collect::<Value>(),
            })
        };
        let growth = |growth: &Growth| {
            let curves: Value = growth.curves.iter().map(curve).collect();
            json!({ "scene": growth.name, "curves": curves })
        };
        let mut report = self.machine.json();
        report.insert("meaningless".into(), json!(self.meaningless));
        report.insert("scenes".into(), self.growths.iter().map(growth).collect());
        Value::Object(report)
    }

    pub fn csv(&self) -> String {
        let mut lines = vec![format!("scene,over,photons,width,height,{MEASURED},reason")];
        for growth in &self.growths {
            for curve in &growth.curves {
                for step in &curve.steps {
                    let [w, h] = step.size;
                    lines.push(format!(
                        "{},{},{},{w},{h},{},{}",
                        quoted(&growth.name),
                        curve.variable.name(),
                        step.photons,
                        measured(curve.estimator.name(), step.outcome.as_ref().ok()),
                        quoted(step.outcome.as_ref().err().map_or("", |reason| reason)),
                    ));
                }
            }
        }
        lines.join("\n") + "\n"
    }
}

/// A row per size, a column per estimator, and the growth below.
fn block(growth: &Growth, variable: Variable, notes: &mut Footnotes) -> Vec<String> {
    let curves: Vec<&Curve> = growth.over(variable).collect();
    let [w, h] = growth.size;
    let title = match variable {
        Variable::Photons => format!("{}: build + gather in ms by photons emitted, {w}x{h}", growth.name),
        Variable::Pixels => format!("{}: build + gather in ms by pixels, {} photons", growth.name, growth.photons),
    };
    let mut lines = vec![title, format!("{:>10}", "")];
    curves.iter().for_each(|curve| lines[1].push_str(&format!(" {:>22}", curve.estimator.name())));
    let longest = curves.iter().max_by_key(|curve| curve.steps.len()).map_or(&[][..], |curve| &curve.steps);
    for (index, size) in longest.iter().enumerate() {
        let mut line = match variable {
            Variable::Photons => format!("{:>10}", size.photons),
            Variable::Pixels => format!("{:>10}", format!("{}x{}", size.size[0], size.size[1])),
        };
        for curve in &curves {
            let text = match curve.steps.get(index).map(|step| &step.outcome) {
                Some(Ok(raced)) => format!("{} + {}", ms(raced.times.build), ms(raced.times.gather)),
                Some(Err(reason)) => notes.dash(reason),
                None => "-".into(),
            };
            line.push_str(&format!(" {text:>22}"));
        }
        lines.push(line);
    }
    let n = if variable == Variable::Photons { "photons stored" } else { "pixels" };
    for curve in curves {
        let [build, gather, sum] = Part::ALL.map(|part| exponent(curve.fit(part)));
        let name = curve.estimator.name();
        lines.push(format!("{name:>10} grows as a power of {n}: sum {sum}; build {build}; gather {gather}"));
    }
    lines
}

/// `0.93 +- 0.02, last 0.99`.
fn exponent(fit: Option<Fit>) -> String {
    let Some(fit) = fit else { return "-".into() };
    let error = fit.error.map_or(String::new(), |error| format!(" +- {error:.2}"));
    format!("{:.2}{error} (last step {:.2})", fit.exponent, fit.last)
}

fn fit_json(fit: Option<Fit>) -> Value {
    fit.map_or(Value::Null, |fit| {
        json!({ "exponent": fit.exponent, "standard_error": fit.error, "last_step": fit.last, "points": fit.points })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::estimators::Times;
    use crate::render::{Estimator, EstimatorBytes, Footprint};

    fn raced(build: f64, gather: f64, stored: u64) -> Raced {
        let bytes =
            EstimatorBytes { kept_per_photon: 104.0, scratch_per_photon: 36.0, deposits_per_photon: 88.0, fixed: 4096 };
        let times = Times { build, gather, total: build + gather, spread: 1.25 };
        Raced { times, emitted: 2 * stored, stored, transient_bytes: 3 << 20, bytes: Some(bytes) }
    }

    fn report() -> TableReport {
        let cell = |estimator, lambert, outcome: Result<Raced, String>| {
            let pairs = outcome.is_ok().then_some([5000, 1200]);
            Cell { estimator, lambert, outcome, pairs }
        };
        let cells = vec![
            cell(Estimator::Bvh, false, Ok(raced(0.0015, 0.0235, 1000))),
            cell(Estimator::Brute, false, Ok(raced(0.0, 0.05, 1000))),
            cell(Estimator::Bvh, true, Ok(raced(0.002, 0.018, 1000))),
            cell(Estimator::Brute, true, Err("left out, \"too\" slow".into())),
        ];
        let table = SceneTable { name: "dir/a.glb".into(), triangles: 12, lambert_only: false, cells };
        let trial = Trial {
            size: [32, 18],
            photons: None,
            passes: 5,
            footprint: Footprint::default(),
            estimators: vec![Estimator::Bvh, Estimator::Brute],
            most_pairs: 1e9,
        };
        TableReport { machine: Machine::example(), meaningless: false, trial, tables: vec![table] }
    }

    #[test]
    fn text_json_and_csv_agree() {
        let report = report();
        let (text, json, csv) = (report.text(), report.json(), report.csv());
        let line = |start: &str| -> Vec<String> {
            let line = text.lines().find(|line| line.starts_with(start)).unwrap_or_else(|| panic!("{start}: {text}"));
            line.split_whitespace().map(str::to_owned).collect()
        };
        assert_eq!(line("a.glb"), ["a.glb", "25.0", "(1.00)", "50.0", "(2.00)"]);
        assert_eq!(
            line("dir/a.glb"),
            "dir/a.glb: 12 triangles, 2000 photons emitted, 1000 stored".split(' ').collect::<Vec<_>>()
        );
        let cells = json["scenes"][0]["cells"].as_array().expect("cells");
        let rows: Vec<&str> = csv.lines().skip(1).collect();
        assert_eq!((cells.len(), rows.len()), (4, 4));
        for (cell, row) in cells.iter().zip(rows) {
            let name = |key: &str| cell[key].as_str().expect("a name");
            let (estimator, bsdf) = (name("estimator"), name("bsdf"));
            let words = line(&format!("{estimator} {bsdf}"));
            let number = |key: &str| cell[key].as_f64();
            let fields: Vec<&str> = row.split(',').collect();
            assert_eq!(fields[..6], ["dir/a.glb", "12", "32", "18", bsdf, estimator], "{row}");
            if let Some(reason) = cell["reason"].as_str() {
                assert_eq!(words[2..], ["-", "[1]"]);
                assert!(text.contains(&format!("[1] {reason}")), "{text}");
                assert!(row.ends_with(",\"left out, \"\"too\"\" slow\""), "{row}");
                continue;
            }
            for (column, key) in ["build_ms", "gather_ms", "sum_ms", "ratio", "spread"].into_iter().enumerate() {
                let shown: f64 = words[2 + column].parse().expect("a number");
                assert!((shown - number(key).expect("a number")).abs() <= 0.05, "{key}: {words:?} {cell}");
            }
            assert_eq!(words[7..9], ["5.00", "k"], "{words:?}");
            assert_eq!((&cell["pairs_tested"], &cell["pairs_accepted"]), (&json!(5000), &json!(1200)));
            assert_eq!(fields[8].parse(), Ok(number("build_ms").expect("a number")));
            assert_eq!(fields.last(), Some(&""), "no reason");
        }
        let columns = csv.lines().next().expect("a header").split(',').count();
        assert_eq!(csv.lines().nth(1).map(|row| row.split(',').count()), Some(columns));
    }

    #[test]
    fn growth_is_stated() {
        let step = |photons, outcome| Step { photons, size: [32, 18], outcome };
        let steps = vec![
            step(2000, Ok(raced(0.001, 0.01, 1000))),
            step(20_000, Ok(raced(0.01, 0.02, 10_000))),
            step(200_000, Ok(raced(0.1, 0.04, 100_000))),
            step(2_000_000, Err("full".into())),
        ];
        let curve = Curve { estimator: Estimator::Bvh, variable: Variable::Photons, steps };
        let growth = Growth { name: "a.glb".into(), photons: 9, size: [32, 18], curves: vec![curve] };
        let report = GrowthReport { machine: Machine::example(), meaningless: true, growths: vec![growth] };
        let text = report.text();
        assert!(text.contains("build 1.00 +- 0.00 (last step 1.00); gather 0.30 +- 0.00 (last step 0.30)"), "{text}");
        assert!(text.contains("[1] full") && text.contains("mean nothing"), "{text}");
        let curve = &report.json()["scenes"][0]["curves"][0];
        assert!((curve["growth"]["build"]["exponent"].as_f64().expect("a number") - 1.0).abs() < 1e-9, "{curve}");
        assert_eq!(curve["growth"]["gather"]["points"], 3);
        assert_eq!(
            (&curve["steps"][1]["photons_stored"], &curve["steps"][3]["reason"]),
            (&json!(10_000), &json!("full"))
        );
        let csv = report.csv();
        assert_eq!(csv.lines().count(), 5);
        let columns = |line: &str| line.split(',').count();
        assert!(csv.lines().all(|line| columns(line) == columns(&csv[..csv.find('\n').expect("a line")])), "{csv}");
    }
}
