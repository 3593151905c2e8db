//! Measurements put in order: scenes, variants, budgets, and the curves of each seed.

use std::collections::BTreeMap;

use super::results::{Budget, Measurement, Peer, Results, TrueError};
use super::statistics::{Spread, read, spread};

/// Which error is plotted and compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// relMSE without the worst 0.1 % of the pixels.
    Trimmed,
    /// relMSE.
    Plain,
}

impl Measure {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Trimmed, Self::Plain];

    /// Label of an axis.
    pub fn label(self) -> &'static str {
        match self {
            Self::Trimmed => "relMSE without the worst 0.1 % of the pixels",
            Self::Plain => "relMSE of all pixels",
        }
    }

    /// Part of a file name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trimmed => "trimmed",
            Self::Plain => "plain",
        }
    }

    /// The error of ours.
    pub fn of(self, error: &TrueError) -> f64 {
        match self {
            Self::Trimmed => error.relmse_trimmed,
            Self::Plain => error.relmse,
        }
    }

    /// The error of another renderer.
    pub fn of_peer(self, peer: &Peer) -> f64 {
        match self {
            Self::Trimmed => peer.relmse_trimmed,
            Self::Plain => peer.relmse,
        }
    }
}

/// What an error is plotted against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// Rendering time.
    Seconds,
    /// Photons emitted.
    Photons,
}

impl Cost {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Seconds, Self::Photons];

    /// Label of an axis.
    pub fn label(self) -> &'static str {
        match self {
            Self::Seconds => "rendering time [s]",
            Self::Photons => "photons emitted",
        }
    }

    /// Part of a file name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Photons => "photons",
        }
    }

    /// The cost of a point.
    pub fn of(self, measurement: &Measurement) -> f64 {
        match self {
            Self::Seconds => measurement.seconds,
            Self::Photons => measurement.photons as f64,
        }
    }
}

/// All seeds at one budget.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Cost.
    pub x: Spread,
    /// Error.
    pub y: Spread,
}

/// An error at a time, over seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtTime {
    /// Errors of the seeds.
    pub error: Spread,
    /// False where the nearest point stood in for some seed.
    pub inside: bool,
}

/// The measurements of one variant on one scene.
#[derive(Debug, Clone)]
pub struct Cell<'a> {
    /// By seed.
    runs: BTreeMap<u64, Vec<&'a Measurement>>,
}

impl<'a> Cell<'a> {
    /// Those of `results`.
    pub fn of(results: &'a Results, scene: &str, variant: &str) -> Self {
        let mut runs: BTreeMap<u64, Vec<&Measurement>> = BTreeMap::new();
        for measurement in results.measurements.iter().filter(|r| r.scene == scene && r.variant == variant) {
            runs.entry(measurement.seed).or_default().push(measurement);
        }
        Self { runs }
    }

    /// All measurements, seed by seed.
    pub fn measurements(&self) -> impl Iterator<Item = &'a Measurement> + '_ {
        self.runs.values().flatten().copied()
    }

    /// The measurements at a budget.
    pub fn at(&self, budget: Budget) -> impl Iterator<Item = &'a Measurement> + '_ {
        self.measurements().filter(move |r| r.budget == budget)
    }

    /// The last measurement of each seed that got furthest: those at the greatest number of seconds that any has.
    pub fn last(&self) -> Vec<&'a Measurement> {
        let furthest = self.measurements().max_by(|a, b| a.seconds.total_cmp(&b.seconds));
        furthest.map(|last| self.at(last.budget).collect()).unwrap_or_default()
    }

    /// (cost, error) by seed.
    pub fn runs(&self, cost: Cost, measure: Measure) -> Vec<Vec<(f64, f64)>> {
        let point = |r: &&Measurement| (cost.of(r), measure.of(&r.error));
        self.runs.values().map(|run| run.iter().map(point).collect()).collect()
    }

    /// Medians and bands by budget, in the order of the cost.
    pub fn points(&self, cost: Cost, measure: Measure) -> Vec<Point> {
        let budgets = sorted(self.measurements().map(|r| r.budget));
        let mut points: Vec<Point> = budgets
            .into_iter()
            .filter_map(|budget| {
                let x = spread(self.at(budget).map(|r| cost.of(r)))?;
                Some(Point { x, y: spread(self.at(budget).map(|r| measure.of(&r.error)))? })
            })
            .collect();
        points.sort_by(|a, b| a.x.median.total_cmp(&b.x.median));
        points
    }

    /// The medians of [`Self::points`].
    pub fn medians(&self, cost: Cost, measure: Measure) -> Vec<(f64, f64)> {
        self.points(cost, measure).iter().map(|p| (p.x.median, p.y.median)).collect()
    }

    /// The error at a time: each seed's curve is read there; `None` unless more than half of the seeds reach it.
    pub fn at_time(&self, seconds: f64, measure: Measure) -> Option<AtTime> {
        let runs = self.runs(Cost::Seconds, measure);
        let readings: Vec<_> = runs.iter().filter_map(|run| read(run, seconds)).collect();
        let inside = readings.iter().all(|r| r.inside);
        let error = spread(readings.into_iter().map(|r| r.y))?;
        (2 * error.count > runs.len()).then_some(AtTime { error, inside })
    }

    /// The median error when a budget is used up: at equal time, or at equal passes.
    pub fn at_budget(&self, budget: Budget, measure: Measure) -> Option<f64> {
        match budget {
            Budget::Seconds(seconds) => self.at_time(seconds, measure).map(|at| at.error.median),
            Budget::Passes(_) => spread(self.at(budget).map(|r| measure.of(&r.error))).map(|s| s.median),
        }
    }

    /// The same with one seed only.
    pub fn seed(&self, seed: u64) -> Self {
        Self { runs: self.runs.get(&seed).map(|run| (seed, run.clone())).into_iter().collect() }
    }
}

/// Each name once, in the order of appearance.
fn once<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for name in names {
        if !found.contains(name) {
            found.push(name.clone());
        }
    }
    found
}

/// The scenes of a study that have points.
pub fn measured_scenes(results: &Results) -> Vec<String> {
    once(results.measurements.iter().map(|r| &r.scene))
}

/// All scenes of a study, also those with decompositions only.
pub fn scenes(results: &Results) -> Vec<String> {
    once(results.measurements.iter().map(|r| &r.scene).chain(results.decompositions.iter().map(|d| &d.scene)))
}

/// All variants of a study.
pub fn variants(results: &Results) -> Vec<String> {
    once(results.measurements.iter().map(|r| &r.variant).chain(results.decompositions.iter().map(|d| &d.variant)))
}

/// Other renderers, by name.
pub fn peers(results: &Results) -> Vec<String> {
    let mut names = once(results.peers.iter().map(|p| &p.name));
    names.sort();
    names
}

/// (seconds, error) of another renderer on a scene, in the order of the seconds.
pub fn peer_curve(results: &Results, scene: &str, name: &str, measure: Measure) -> Vec<(f64, f64)> {
    let runs = results.peers.iter().filter(|p| p.scene == scene && p.name == name);
    let mut points: Vec<_> = runs.map(|p| (p.seconds, measure.of_peer(p))).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// All budgets: seconds before passes, the least first.
pub fn budgets(results: &Results) -> Vec<Budget> {
    sorted(results.measurements.iter().map(|r| r.budget))
}

/// All seeds.
pub fn seeds(results: &Results) -> Vec<u64> {
    let mut seeds: Vec<u64> = results.measurements.iter().map(|r| r.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    seeds
}

fn sorted(budgets: impl Iterator<Item = Budget>) -> Vec<Budget> {
    let key = |budget: &Budget| match *budget {
        Budget::Seconds(s) => (0, s, 0),
        Budget::Passes(p) => (1, 0.0, p),
    };
    let mut budgets: Vec<Budget> = budgets.collect();
    budgets.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2))
    });
    budgets.dedup();
    budgets
}

/// The times at which a scene's errors are compared: the budgets in seconds, or without any 1, 3, 10, 30 ... as far as
/// its measurements reach.
pub fn times(results: &Results, scene: &str) -> Vec<f64> {
    let mine = || results.measurements.iter().filter(|r| r.scene == scene);
    let given = sorted(mine().map(|r| r.budget));
    let given: Vec<f64> = given
        .iter()
        .filter_map(|b| match b {
            Budget::Seconds(s) => Some(*s),
            Budget::Passes(_) => None,
        })
        .collect();
    if given.is_empty() { steps(mine().map(|r| r.seconds)) } else { given }
}

/// 1, 3, 10, 30 ... between the least and the greatest of some values (what has no logarithm is left out).
pub fn steps(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
    let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if !low.is_finite() {
        return Vec::new();
    }
    let decades = low.floor() as i32..=high.floor() as i32;
    let all = decades.flat_map(|d| [format!("1e{d}"), format!("3e{d}")]);
    all.filter_map(|text| text.parse::<f64>().ok()).filter(|v| *v > 0.0 && (low..=high).contains(&v.log10())).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A measurement with this relMSE; the other fields are constant.
    pub(in crate::study) fn measurement(
        scene: &str,
        variant: &str,
        seed: u64,
        seconds: f64,
        relmse: f64,
    ) -> Measurement {
        Measurement {
            scene: scene.into(),
            variant: variant.into(),
            settings: [("method".to_owned(), variant.to_owned())].into(),
            seed,
            budget: Budget::Seconds(seconds),
            passes: (8.0 * seconds) as u64,
            photons: (1e5 * seconds) as u64,
            seconds,
            error: TrueError {
                mse: 0.1 * relmse,
                relmse: 2.0 * relmse,
                relmse_trimmed: relmse,
                smape: relmse.sqrt(),
                flip: None,
                mean_ratio: 1.0,
            },
            estimated_error: (variant == "fast").then(|| 3.0 * (2.0 * relmse).sqrt()),
            time_split: [("trace", 3.0), ("gather", 1.0), ("denoise", 0.0)]
                .map(|(k, v)| (k.to_owned(), v * seconds))
                .into(),
            device_bytes: (3 + seed) << 20,
            left_out: vec!["textures".into()],
        }
    }

    fn results(measurements: Vec<Measurement>) -> Results {
        Results { measurements, ..Default::default() }
    }

    #[test]
    fn a_time_that_few_seeds_reach_says_nothing() {
        let mut measurements = vec![measurement("s", "v", 0, 100.0, 0.01), measurement("s", "v", 0, 1.0, 1.0)];
        measurements.extend([measurement("s", "v", 1, 1.0, 3.0), measurement("s", "other", 1, 10.0, 9.0)]);
        let results = results(measurements);
        let cell = Cell::of(&results, "s", "v");
        assert_eq!(cell.at_time(10.0, Measure::Trimmed), None, "one of two seeds");
        let at = cell.at_time(1.0, Measure::Plain).expect("both seeds");
        assert_eq!((at.error.median, at.error.count, at.inside), (4.0, 2, true));
        assert!(!cell.at_time(0.95, Measure::Trimmed).expect("nearly there").inside);
        let alone = cell.seed(0).at_time(10.0, Measure::Trimmed).expect("its own seed").error.median;
        assert!((alone - 0.1).abs() < 1e-12, "{alone}");
        assert_eq!(cell.seed(7).measurements().count(), 0);
    }

    #[test]
    fn points_are_medians_of_the_seeds_at_a_budget() {
        let measurements: Vec<Measurement> = [(0, 1.0), (1, 5.0), (2, 2.0)]
            .into_iter()
            .flat_map(|(seed, error)| {
                [measurement("s", "v", seed, 10.0, 0.1 * error), measurement("s", "v", seed, 1.0, error)]
            })
            .collect();
        let results = results(measurements);
        let cell = Cell::of(&results, "s", "v");
        let medians = cell.medians(Cost::Photons, Measure::Trimmed);
        assert_eq!(medians, [(1e5, 2.0), (1e6, 0.2)], "in the order of the cost");
        assert_eq!(cell.last().len(), 3);
        assert!(cell.last().iter().all(|r| r.seconds == 10.0));
        assert_eq!(cell.at_budget(Budget::Passes(3), Measure::Trimmed), None);
    }

    #[test]
    fn budgets_are_in_order_and_times_are_found_without_any() {
        let mut results = results(vec![measurement("s", "v", 0, 45.0, 1.0), measurement("s", "v", 0, 0.9, 1.0)]);
        assert_eq!(times(&results, "s"), [0.9, 45.0]);
        assert_eq!(times(&results, "other"), [0.0; 0]);
        results.measurements[0].budget = Budget::Passes(64);
        assert_eq!(budgets(&results), [Budget::Seconds(0.9), Budget::Passes(64)]);
        results.measurements[1].budget = Budget::Passes(8);
        assert_eq!(budgets(&results), [Budget::Passes(8), Budget::Passes(64)]);
        assert_eq!(times(&results, "s"), [1.0, 3.0, 10.0, 30.0]);
        assert_eq!(Cell::of(&results, "s", "v").at_budget(Budget::Passes(8), Measure::Plain), Some(2.0));
    }

    #[test]
    fn steps_go_by_threes() {
        assert_eq!(steps([0.02, 3.0, 0.0, f64::NAN, f64::INFINITY].into_iter()), [0.03, 0.1, 0.3, 1.0, 3.0]);
        assert_eq!(steps([5.0].into_iter()), [0.0; 0]);
        assert_eq!(steps([0.0].into_iter()), [0.0; 0]);
    }
}
