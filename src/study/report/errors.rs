//! Tables of errors: at equal time, at equal error, slopes, bias and variance, regret.

use std::collections::BTreeMap;

use super::table::{Table, Td, figures, figures_or_dash, plain};
use crate::study::curves::{Cell, Cost, Measure, measured_scenes, peer_curve, peers, seeds, steps, times, variants};
use crate::study::regret::Regret;
use crate::study::results::{Budget, Results};
use crate::study::statistics::{Basis, Reached, Slope, ratio, reach, read, slope};

/// Columns of a table at equal error.
const MOST_TARGETS: usize = 7;

/// Variants, then others, that have points on a scene, and whether they are ours.
fn rows_of(results: &Results, scene: &str) -> Vec<(String, bool)> {
    let ours = variants(results).into_iter().filter(|v| Cell::of(results, scene, v).measurements().next().is_some());
    let theirs =
        peers(results).into_iter().filter(|name| results.peers.iter().any(|p| p.scene == scene && p.name == *name));
    ours.map(|v| (v, true)).chain(theirs.map(|p| (p, false))).collect()
}

/// Errors at the times of the budgets, with their ratios to the least.
pub(super) fn equal_time(results: &Results, scene: &str) -> Table {
    let measure = Measure::Trimmed;
    let times = times(results, scene);
    let head = times.iter().map(|t| format!("{} s", plain(*t)));
    let caption = "At equal time: relMSE without the worst 0.1 % of the pixels, median over the seeds (times the best)";
    let mut table = Table::new(caption, std::iter::once(String::new()).chain(head));
    let names = rows_of(results, scene);
    let at = |(name, ours): &(String, bool), time: f64| {
        if *ours {
            Cell::of(results, scene, name).at_time(time, measure).map(|at| (at.error.median, at.inside))
        } else {
            read(&peer_curve(results, scene, name, measure), time).map(|r| (r.y, r.inside))
        }
    };
    let columns: Vec<Vec<Option<(f64, bool)>>> =
        times.iter().map(|time| names.iter().map(|name| at(name, *time)).collect()).collect();
    for (row, (name, _)) in names.iter().enumerate() {
        let mut cells = vec![Td::from(name.as_str())];
        for column in &columns {
            let best = column.iter().flatten().map(|(y, _)| *y).fold(f64::INFINITY, f64::min);
            cells.push(column[row].map_or_else(
                || "-".into(),
                |(y, inside)| Td {
                    text: format!(
                        "{}{} ({})",
                        if inside { "" } else { "\u{2248}" },
                        figures(y),
                        figures_or_dash(ratio(y, best))
                    ),
                    strong: y == best,
                },
            ));
        }
        table.rows.push(cells);
    }
    table
}

/// Seconds to come down to errors, with their ratios to the least.
pub(super) fn equal_error(results: &Results, scene: &str) -> Table {
    let measure = Measure::Trimmed;
    let names = rows_of(results, scene);
    let curves: Vec<Vec<(f64, f64)>> = names
        .iter()
        .map(|(name, ours)| match ours {
            true => Cell::of(results, scene, name).medians(Cost::Seconds, measure),
            false => peer_curve(results, scene, name, measure),
        })
        .collect();
    let ours = curves.iter().zip(&names).filter(|(_, (_, ours))| *ours).flat_map(|(curve, _)| curve);
    let mut targets: Vec<f64> = steps(ours.map(|p| p.1)).into_iter().rev().collect();
    let skipped = targets.len().saturating_sub(MOST_TARGETS);
    targets.drain(..skipped); // the small errors are what one waits for
    let head = targets.iter().map(|t| plain(*t));
    let caption =
        "At equal error: seconds until relMSE without the worst 0.1 % of the pixels is so small (times the least)";
    let mut table = Table::new(caption, std::iter::once(String::new()).chain(head));
    if targets.is_empty() {
        return table;
    }
    let columns: Vec<Vec<Reached>> =
        targets.iter().map(|target| curves.iter().map(|curve| reach(curve, *target)).collect()).collect();
    for (row, (name, _)) in names.iter().enumerate() {
        let cells = columns.iter().map(|column| seconds_to(column, row));
        table.rows.push(std::iter::once(Td::from(name.as_str())).chain(cells).collect());
    }
    table
}

/// One cell of the table at equal error. A curve that starts below the error bounds its time, and so the least, from
/// above only.
fn seconds_to(column: &[Reached], row: usize) -> Td {
    let bound = |reached: &Reached| match reached {
        Reached::Before(x) | Reached::At(x) => *x,
        Reached::Never => f64::INFINITY,
    };
    let best = column.iter().map(bound).fold(f64::INFINITY, f64::min);
    let sure = !column.iter().any(|r| matches!(r, Reached::Before(_)));
    let x = bound(&column[row]);
    let times = figures_or_dash(ratio(x, best));
    match column[row] {
        Reached::Never => "-".into(),
        Reached::At(_) if sure => Td { text: format!("{} ({times})", figures(x)), strong: x == best },
        Reached::At(_) => format!("{} (\u{2265} {times})", figures(x)).into(),
        Reached::Before(_) => format!("\u{2264} {}", figures(x)).into(),
    }
}

/// A slope with its interval.
pub(super) fn slope_text(slope: &Slope) -> String {
    match slope.half_width {
        Some(half) => format!("{:.2} \u{b1} {:.2}", slope.value, half),
        None => format!("{:.2}", slope.value),
    }
}

fn basis_text(basis: Basis) -> String {
    match basis {
        Basis::Seeds(n) => format!("{n} seeds"),
        Basis::Residuals(n) => format!("residuals of one run, {n} degrees of freedom"),
        Basis::None => "two points: none".into(),
    }
}

/// Fitted slopes of error against cost.
pub(super) fn slopes(results: &Results, scene: &str) -> Table {
    let head = ["", "against seconds", "against photons", "all pixels, against seconds", "interval from"];
    let mut table = Table::new("Slopes of log error over log cost, with 95 % intervals", head);
    for (name, ours) in rows_of(results, scene) {
        let of = |cost, measure| match (ours, cost) {
            (true, _) => slope(&Cell::of(results, scene, &name).runs(cost, measure)),
            (false, Cost::Seconds) => slope(&[peer_curve(results, scene, &name, measure)]),
            (false, Cost::Photons) => None,
        };
        let found = [
            of(Cost::Seconds, Measure::Trimmed),
            of(Cost::Photons, Measure::Trimmed),
            of(Cost::Seconds, Measure::Plain),
        ];
        let text = |slope: &Option<Slope>| slope.as_ref().map_or_else(|| "-".to_owned(), slope_text);
        let mut cells: Vec<Td> = std::iter::once(name.into()).chain(found.iter().map(|s| text(s).into())).collect();
        cells.push(found[0].map_or_else(|| "-".to_owned(), |s| basis_text(s.basis)).into());
        table.rows.push(cells);
    }
    table
}

/// Bias and variance of a scene.
pub(super) fn decomposition(results: &Results, scene: &str) -> Table {
    let head = ["", "passes", "seeds", "bias\u{b2}", "variance of one render", "bias\u{b2} / variance"];
    let mut table = Table::new("Bias and variance, both over (reference\u{b2} + 0.01), means over the pixels", head);
    let mut rows: Vec<_> = results.decompositions.iter().filter(|d| d.scene == scene).collect();
    let order = variants(results);
    rows.sort_by_key(|d| (order.iter().position(|v| *v == d.variant), d.passes));
    for d in rows {
        table.rows.push(vec![
            d.variant.as_str().into(),
            d.passes.to_string().into(),
            d.seeds.to_string().into(),
            figures(d.bias_squared).into(),
            figures(d.variance).into(),
            figures(d.bias_squared / d.variance).into(),
        ]);
    }
    table
}

/// A budget as text.
pub(super) fn budget_text(budget: Budget) -> String {
    match budget {
        Budget::Seconds(s) => format!("{} s", plain(s)),
        Budget::Passes(1) => "1 pass".into(),
        Budget::Passes(p) => format!("{p} passes"),
    }
}

/// What all variants lose at a budget, and in how many seeds alone of how many the same variant is chosen.
pub(super) fn regret(results: &Results, budget: Budget) -> (Regret, [usize; 2]) {
    let (variants, scenes) = (variants(results), measured_scenes(results));
    let measure = Measure::Trimmed;
    let mut cells = BTreeMap::new();
    for scene in &scenes {
        for variant in &variants {
            cells.insert((variant.as_str(), scene.as_str()), Cell::of(results, scene, variant));
        }
    }
    let error = |variant: &str, scene: &str| cells[&(variant, scene)].at_budget(budget, measure);
    let all = Regret::new(&variants, &scenes, error);
    let mut agreement = [0, 0];
    for seed in seeds(results) {
        let error = |variant: &str, scene: &str| cells[&(variant, scene)].seed(seed).at_budget(budget, measure);
        let alone = Regret::new(&variants, &scenes, error);
        agreement[0] += usize::from(alone.best.is_some() && alone.chosen() == all.chosen());
        agreement[1] += usize::from(alone.best.is_some());
    }
    (all, agreement)
}

/// Regret as a table, the chosen variant in bold.
pub(super) fn regret_table(results: &Results, budget: Budget) -> Table {
    let (regret, [same, seeds]) = regret(results, budget);
    let choice = match regret.chosen() {
        Some(name) => format!("best compromise {name}, the choice of {same} of {seeds} seeds alone"),
        None => "no variant was measured on every scene".into(),
    };
    let caption =
        format!("After {}: trimmed relMSE over that of the best variant of each scene; {choice}", budget_text(budget));
    let head = ["", "geometric mean", "worst"].map(str::to_owned);
    let mut table = Table::new(caption, head.into_iter().chain(regret.scenes.iter().cloned()));
    for (index, row) in regret.rows.iter().enumerate().filter(|(_, row)| row.losses.iter().any(Option::is_some)) {
        let losses = [row.mean, row.worst].into_iter().chain(row.losses.iter().copied());
        let cells = std::iter::once(row.variant.clone()).chain(losses.map(figures_or_dash));
        let strong = regret.best == Some(index);
        table.rows.push(cells.map(|text| Td { text, strong }).collect());
    }
    table
}
