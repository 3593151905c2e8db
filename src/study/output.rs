//! The files of a study, and the measurements of others that it shows.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::results::{Budget, Decomposition, Measurement, Peer, Results};
use crate::error::{Error, Result};
use crate::input;
use crate::picture::output::Destination;

/// Columns of `results.csv` before those of the time split.
pub const MEASUREMENT_COLUMNS: [&str; 17] = [
    "scene",
    "variant",
    "seed",
    "budget",
    "limit",
    "passes",
    "photons",
    "seconds",
    "mse",
    "relmse",
    "relmse_trimmed",
    "smape",
    "flip",
    "mean_ratio",
    "estimated_error",
    "device_bytes",
    "settings",
];

/// Columns of `decomposition.csv`.
pub const DECOMPOSITION_COLUMNS: [&str; 7] =
    ["scene", "variant", "passes", "seeds", "bias_squared", "variance", "settings"];

/// Writes `results.json`, `results.csv`, `decomposition.csv`, `report.html`, `summary.md` and the plots as SVG into the
/// folder and returns the names of all but the plots. Each file appears whole or not at all.
///
/// # Errors
/// [`Error::Io`] if a file cannot be written.
pub fn write(results: &Results, folder: &Path) -> Result<Vec<PathBuf>> {
    let json = serde_json::to_string_pretty(results)
        .map_err(|cause| Error::io(folder.join("results.json"), "write", std::io::Error::other(cause)))?;
    let files = [
        ("results.json", json + "\n"),
        ("results.csv", measurements_csv(&results.measurements)),
        ("decomposition.csv", decompositions_csv(&results.decompositions)),
        ("report.html", super::report::html(results)),
        ("summary.md", super::report::markdown_summary(results)),
    ];
    for (name, svg) in super::report::plots(results) {
        write_text(&folder.join(name), &svg)?;
    }
    files.iter().map(|(name, text)| write_text(&folder.join(name), text)).collect()
}

fn write_text(path: &Path, text: &str) -> Result<PathBuf> {
    let fill = |sink: &mut std::io::BufWriter<crate::picture::output::Sink<'_>>| {
        sink.write_all(text.as_bytes()).map_err(|source| Error::io(path, "write", source))
    };
    Destination::check(path)?.write(fill)?;
    Ok(path.to_owned())
}

/// One line for each measurement; the time split has a column `seconds_NAME` for each part that occurs.
pub fn measurements_csv(measurements: &[Measurement]) -> String {
    let parts: BTreeSet<&String> = measurements.iter().flat_map(|measurement| measurement.time_split.keys()).collect();
    let names = MEASUREMENT_COLUMNS.iter().map(|name| (*name).to_owned());
    let parts_names = parts.iter().map(|part| format!("seconds_{}", part.replace(' ', "_")));
    let mut text = row(&names.chain(parts_names).collect::<Vec<_>>());
    for r in measurements {
        let (budget, limit) = match r.budget {
            Budget::Seconds(seconds) => ("seconds", seconds.to_string()),
            Budget::Passes(passes) => ("passes", passes.to_string()),
        };
        let e = &r.error;
        let number = |x: f64| format!("{x:e}");
        let maybe = |x: Option<f64>| x.map(number).unwrap_or_default();
        let mut cells = vec![r.scene.clone(), r.variant.clone(), r.seed.to_string(), budget.into(), limit];
        cells.extend([r.passes.to_string(), r.photons.to_string(), r.seconds.to_string()]);
        cells.extend([e.mse, e.relmse, e.relmse_trimmed, e.smape].map(number));
        cells.extend([maybe(e.flip), e.mean_ratio.to_string(), maybe(r.estimated_error), r.device_bytes.to_string()]);
        cells.push(settings(&r.settings));
        cells.extend(parts.iter().map(|part| r.time_split.get(*part).map(f64::to_string).unwrap_or_default()));
        text += &row(&cells);
    }
    text
}

/// One line for each scene, variant and number of passes.
pub fn decompositions_csv(decompositions: &[Decomposition]) -> String {
    let mut text = row(&DECOMPOSITION_COLUMNS);
    for d in decompositions {
        text += &row(&[
            d.scene.clone(),
            d.variant.clone(),
            d.passes.to_string(),
            d.seeds.to_string(),
            format!("{:e}", d.bias_squared),
            format!("{:e}", d.variance),
            settings(&d.settings),
        ]);
    }
    text
}

fn settings(settings: &std::collections::BTreeMap<String, String>) -> String {
    settings.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
}

/// A line of CSV; cells with a comma, a quotation mark or a line break are quoted (RFC 4180).
fn row(cells: &[impl AsRef<str>]) -> String {
    let quoted = |cell: &str| match cell.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.to_owned(),
    };
    cells.iter().map(|cell| quoted(cell.as_ref())).collect::<Vec<_>>().join(",") + "\n"
}

/// Cells of a line of CSV.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut quoted) = (vec![], String::new(), false);
    let mut letters = line.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if quoted && letters.peek() == Some(&'"') => cell.extend(letters.next()),
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(std::mem::take(&mut cell)),
            _ => cell.push(letter),
        }
    }
    cells.push(cell);
    cells
}

/// Bytes of other renderers' measurements.
const MOST_BYTES: u64 = 64 << 20;

/// Reads measurements of other renderers: CSV with the columns scene, renderer, method, seconds, relmse,
/// relmse_trimmed, in any order and among others. Those of scenes that are not in `scenes` are left out.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Scene`] with the line if a column or a number is missing.
pub fn read_peers(path: &Path, scenes: &[&str]) -> Result<Vec<Peer>> {
    let text = input::read_text(path, MOST_BYTES)?;
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let header = lines.next().map(|(_, line)| cells(line)).unwrap_or_default();
    let column = |name: &str| {
        let missing = || Error::scene(path, format!("line 1: no column '{name}'"));
        header.iter().position(|cell| cell.trim() == name).ok_or_else(missing)
    };
    let [scene, renderer, method] = [column("scene")?, column("renderer")?, column("method")?];
    let numbers = [column("seconds")?, column("relmse")?, column("relmse_trimmed")?];
    let mut peers = vec![];
    for (number, line) in lines {
        let cells = cells(line);
        let cell = |at: usize| cells.get(at).map_or("", |cell| cell.trim());
        if !scenes.contains(&cell(scene)) {
            continue;
        }
        let mut values = [0.0; 3];
        for (value, &at) in values.iter_mut().zip(&numbers) {
            let wrong = || Error::scene(path, format!("line {}: '{}' is no {}", number + 1, cell(at), header[at]));
            *value = cell(at).parse().ok().filter(|x: &f64| x.is_finite() && *x >= 0.0).ok_or_else(wrong)?;
        }
        let [seconds, relmse, relmse_trimmed] = values;
        let name = format!("{} {}", cell(renderer), cell(method));
        peers.push(Peer { scene: cell(scene).to_owned(), name, seconds, relmse, relmse_trimmed });
    }
    Ok(peers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::results::TrueError;
    use std::collections::BTreeMap;

    fn measurement(variant: &str, part: &str) -> Measurement {
        let error =
            TrueError { mse: 1e-3, relmse: 2e-3, relmse_trimmed: 1.5e-3, smape: 0.1, flip: None, mean_ratio: 1.01 };
        Measurement {
            scene: "ring".into(),
            variant: variant.into(),
            settings: BTreeMap::from([("alpha".into(), "0.5".into()), ("radius".into(), "2".into())]),
            seed: 3,
            budget: Budget::Seconds(10.0),
            passes: 7,
            photons: 700,
            seconds: 10.25,
            error,
            estimated_error: Some(0.02),
            time_split: BTreeMap::from([(part.into(), 0.5)]),
            device_bytes: 4096,
            left_out: vec!["textures".into()],
        }
    }

    #[test]
    fn records_have_a_column_for_everything() {
        let text = measurements_csv(&[measurement("a, \"b\"", "eye paths"), measurement("plain", "gather")]);
        let lines: Vec<Vec<String>> = text.lines().map(cells).collect();
        let mut header: Vec<&str> = MEASUREMENT_COLUMNS.to_vec();
        header.extend(["seconds_eye_paths", "seconds_gather"]);
        assert_eq!(lines[0], header);
        let first =
            "ring|a, \"b\"|3|seconds|10|7|700|10.25|1e-3|2e-3|1.5e-3|1e-1||1.01|2e-2|4096|alpha=0.5 radius=2|0.5|";
        assert_eq!(
            lines[1],
            first.split('|').collect::<Vec<_>>(),
            "quoted cells come back, what is not known is empty"
        );
        assert_eq!((lines[2][17].as_str(), lines[2][18].as_str()), ("", "0.5"));
        assert_eq!(measurements_csv(&[]).lines().count(), 1);
    }

    #[test]
    fn decompositions_have_their_columns() {
        let one = Decomposition {
            scene: "ring".into(),
            variant: "x".into(),
            settings: BTreeMap::new(),
            passes: 4,
            seeds: 16,
            bias_squared: -1e-9,
            variance: 0.25,
        };
        assert_eq!(
            decompositions_csv(&[one]),
            "scene,variant,passes,seeds,bias_squared,variance,settings\nring,x,4,16,-1e-9,2.5e-1,\n"
        );
    }

    #[test]
    fn peers_are_found_by_the_names_of_columns() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("peers.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).expect("written");
            read_peers(&path, &["ring"])
        };
        let head = "relmse_trimmed,scene,renderer,method,seconds,relmse,mse";
        let good = &format!("{head}\n1e-3,ring,pbrt,sppm,3.5,2e-3,9\n\n1,pool,x,y,z,,\n");
        let expected =
            Peer { scene: "ring".into(), name: "pbrt sppm".into(), seconds: 3.5, relmse: 2e-3, relmse_trimmed: 1e-3 };
        assert_eq!(read(good).expect("good"), [expected]);
        for (text, part) in [
            ("scene,renderer,method,seconds,relmse\n", "line 1: no column 'relmse_trimmed'"),
            ("", "no column 'scene'"),
            ("scene,renderer,method,seconds,relmse,relmse_trimmed\nring,a,b,1,x,1\n", "line 2: 'x' is no relmse"),
            ("scene,renderer,method,seconds,relmse,relmse_trimmed\nring,a,b,1,1\n", "line 2: '' is no relmse_trimmed"),
            ("scene,renderer,method,seconds,relmse,relmse_trimmed\nring,a,b,NaN,1,1\n", "'NaN' is no seconds"),
        ] {
            let message = read(text).expect_err(part).to_string();
            assert!(message.contains(part) && message.contains("peers.csv"), "{message}");
        }
    }
}
