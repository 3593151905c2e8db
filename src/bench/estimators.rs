//! The density estimators side by side: the same photons, time, pairs and bytes of each (Mara, Luebke and McGuire 2013,
//! table 1).

use super::median;
use super::scene::seconds_in;
use crate::error::Result;
use crate::graph::Runtime;
use crate::render::{Estimator, EstimatorBytes, Footprint, Method, Session, Settings};
use crate::scene::{Scene, World};
use crate::vk::DeviceKind;

/// What is compared, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Size of the picture.
    pub size: [u32; 2],
    /// Photons emitted; `None` for the renderer's choice.
    pub photons: Option<u32>,
    /// Passes that are timed, at least 1.
    pub passes: u32,
    /// How large footprints are.
    pub footprint: Footprint,
    /// The estimators.
    pub estimators: Vec<Estimator>,
    /// Pairs of pixel and emitted photon beyond which [`Estimator::Brute`] is left out.
    pub most_pairs: f64,
}

impl Trial {
    /// 320 x 180 on software devices, 1920 x 1080 on others; five passes, every estimator.
    pub fn full(runtime: &Runtime) -> Self {
        let software = runtime.device().info().kind == DeviceKind::Software;
        let (size, most_pairs) = if software { ([320, 180], 1e9) } else { ([1920, 1080], 1e11) };
        let estimators = Estimator::ALL.to_vec();
        Self { size, photons: None, passes: 5, footprint: Footprint::default(), estimators, most_pairs }
    }

    /// Just enough to see that it runs; the numbers mean nothing.
    pub fn quick(runtime: &Runtime) -> Self {
        Self { size: [32, 18], photons: Some(1000), passes: 1, ..Self::full(runtime) }
    }

    pub(super) fn settings(&self, estimator: Estimator) -> Settings {
        Settings {
            width: self.size[0],
            height: self.size[1],
            photons: self.photons,
            footprint: self.footprint,
            estimator: Some(estimator),
            ..Settings::of(Method::Photons)
        }
    }

    /// Why it is not worth trying, if it is not.
    pub(super) fn refuses(&self, settings: &Settings) -> Option<String> {
        let pairs = f64::from(settings.photon_count()) * f64::from(settings.pixels());
        (settings.estimator == Some(Estimator::Brute) && pairs > self.most_pairs)
            .then(|| format!("left out: {pairs:.1e} pairs of pixel and photon, more than {:.0e}", self.most_pairs))
    }
}

/// Times of passes with the same photons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// Median seconds of building what is gathered from.
    pub build: f64,
    /// Median seconds of gathering.
    pub gather: f64,
    /// Median seconds of both in one pass.
    pub total: f64,
    /// Greatest total over the least: 1 without noise.
    pub spread: f64,
}

impl Times {
    /// Of passes: building and gathering.
    ///
    /// # Panics
    /// Without passes.
    pub fn of(passes: &[[f64; 2]]) -> Self {
        let totals: Vec<f64> = passes.iter().map(|[build, gather]| build + gather).collect();
        let (least, greatest) = totals.iter().fold((f64::INFINITY, 0.0f64), |(a, b), &t| (a.min(t), b.max(t)));
        let column = |k: usize| median(passes.iter().map(|pass| pass[k]).collect());
        Self { build: column(0), gather: column(1), total: median(totals), spread: greatest / least }
    }
}

/// What a session measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Raced {
    /// Its times.
    pub times: Times,
    /// Photons emitted in a pass.
    pub emitted: u64,
    /// Photons stored in a pass.
    pub stored: u64,
    /// Bytes that live inside of a pass, shared among buffers.
    pub transient_bytes: u64,
    /// Bytes of the estimator, not shared.
    pub bytes: Option<EstimatorBytes>,
}

/// An estimator with one kind of reflection.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// The estimator.
    pub estimator: Estimator,
    /// Gathered by Lambert's law only ([`Settings::lambert_estimate`]).
    pub lambert: bool,
    /// What was measured, or why nothing was.
    pub outcome: std::result::Result<Raced, String>,
    /// Pairs of eye hit and photon tested and accepted in a pass, where the estimator counts them.
    pub pairs: Option<[u64; 2]>,
}

/// One scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneTable {
    /// Its file, or what it is.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// Whether the scene has nothing but Lambert's law and flat triangles, so that both kinds are one program.
    pub lambert_only: bool,
    /// Full reflection first, then Lambert; estimators in the order of [`Trial::estimators`].
    pub cells: Vec<Cell>,
}

impl SceneTable {
    /// The cell of an estimator.
    pub fn cell(&self, estimator: Estimator, lambert: bool) -> Option<&Cell> {
        self.cells.iter().find(|cell| (cell.estimator, cell.lambert) == (estimator, lambert))
    }

    /// Time of a cell relative to the fastest one with the same reflection.
    pub fn ratio(&self, cell: &Cell) -> Option<f64> {
        let of = |cell: &Cell| cell.outcome.as_ref().ok().map(|raced| raced.times.total);
        let rivals = self.cells.iter().filter(|other| other.lambert == cell.lambert);
        let fastest = rivals.filter_map(of).min_by(f64::total_cmp)?;
        of(cell).map(|seconds| seconds / fastest)
    }

    /// What the cells that were measured agree upon: photons emitted and stored.
    pub fn photons(&self) -> Option<[u64; 2]> {
        self.cells.iter().find_map(|cell| cell.outcome.as_ref().ok()).map(|raced| [raced.emitted, raced.stored])
    }
}

/// Measures `scene`. What an estimator cannot do is told in its cell. `begin` hears what comes next.
pub fn table(runtime: &Runtime, scene: &Scene, trial: &Trial, begin: &mut dyn FnMut(&str)) -> SceneTable {
    let name = scene.path.display().to_string();
    let kinds = [false, true].into_iter().flat_map(|lambert| trial.estimators.iter().map(move |&e| (e, lambert)));
    let settings = |(estimator, lambert_estimate)| Settings { lambert_estimate, ..trial.settings(estimator) };
    // The Lambert variant looks at the same photons.
    let mut pairs = Vec::new();
    let mut lambert_only = false;
    for &estimator in &trial.estimators {
        let settings = settings((estimator, false));
        let mut counted = None;
        if trial.refuses(&settings).is_none() {
            begin(&format!("{name}: pairs of {}", estimator.name()));
            // An error will be met again, and told, when the estimator is timed.
            if let Ok(found) = count(runtime, scene, settings) {
                (counted, lambert_only) = found;
            }
        }
        pairs.push(counted);
    }
    let contest = kinds.clone().map(settings).collect();
    let outcomes = race(runtime, scene, trial, contest, &mut |what| begin(&format!("{name}: {what}")));
    let cells = kinds
        .zip(outcomes)
        .zip(pairs.iter().cycle())
        .map(|(((estimator, lambert), outcome), &pairs)| Cell { estimator, lambert, outcome, pairs })
        .collect();
    SceneTable { name, triangles: World::of(scene).triangles.len(), lambert_only, cells }
}

/// Pairs of one pass, if they are counted, and whether nothing but Lambert's law is gathered.
fn count(runtime: &Runtime, scene: &Scene, settings: Settings) -> Result<(Option<[u64; 2]>, bool)> {
    let mut session = Session::new(runtime.device(), scene.clone(), Settings { count_pairs: true, ..settings })?;
    session.repeat_pass(0)?;
    let variant = session.device_scene().variant;
    let counts = session.statistics()?;
    let pairs = (counts.pairs_tested > 0).then_some([counts.pairs_tested, counts.pairs_accepted]);
    Ok((pairs, !variant.gathers_glossy && !variant.gathers_smooth))
}

/// Times sessions with each of `kinds` in turn, so that a disturbance from outside meets all of them, and so that the
/// photons of every pass are the same.
pub(super) fn race(
    runtime: &Runtime,
    scene: &Scene,
    trial: &Trial,
    kinds: Vec<Settings>,
    begin: &mut dyn FnMut(&str),
) -> Vec<std::result::Result<Raced, String>> {
    let mut runners = Vec::new();
    for settings in kinds {
        if let Some(reason) = trial.refuses(&settings) {
            runners.push(Err(reason));
            continue;
        }
        begin(&format!("preparing {}", settings.estimator.map_or("", Estimator::name)));
        let session = Session::new(runtime.device(), scene.clone(), settings).and_then(|mut session| {
            session.repeat_pass(0)?; // memory is touched for the first time, and the map has grown as far as it must
            Ok((session, Vec::new()))
        });
        runners.push(session.map_err(|error| error.to_string()));
    }
    for pass in 1..=trial.passes.max(1) {
        begin(&format!("pass {pass} of {}", trial.passes.max(1)));
        for runner in &mut runners {
            let Ok((session, times)) = runner else { continue };
            match session.repeat_pass(0) {
                Ok(_) => times.push(["photon map", "gather"].map(|scope| seconds_in(session, &[scope]))),
                Err(error) => *runner = Err(error.to_string()),
            }
        }
    }
    runners.into_iter().map(|runner| runner.and_then(|(session, times)| raced(&session, &times))).collect()
}

fn raced(session: &Session, times: &[[f64; 2]]) -> std::result::Result<Raced, String> {
    let counts = session.statistics().map_err(|error| error.to_string())?;
    let times = Times::of(times);
    if counts.photons == 0 {
        return Err("the scene has no photons".into());
    }
    if times.gather <= 0.0 {
        return Err("the device has no timestamps".into());
    }
    Ok(Raced {
        times,
        emitted: counts.photons / counts.passes.max(1),
        stored: counts.deposits / counts.passes.max(1),
        transient_bytes: session.transient_bytes(),
        bytes: session.estimator_bytes(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(estimator: Estimator, lambert: bool, total: Option<f64>) -> Cell {
        let times = |total| Times { build: 0.0, gather: total, total, spread: 1.0 };
        let raced = |t| Raced { times: times(t), emitted: 9, stored: 7, transient_bytes: 0, bytes: None };
        Cell { estimator, lambert, outcome: total.map(raced).ok_or("broken".into()), pairs: None }
    }

    #[test]
    fn ratios_are_within_one_kind_of_reflection() {
        let cells = vec![
            cell(Estimator::Bvh, false, Some(0.004)),
            cell(Estimator::Brute, false, Some(0.010)),
            cell(Estimator::Bvh, true, Some(0.002)),
            cell(Estimator::Brute, true, None),
        ];
        let table = SceneTable { name: String::new(), triangles: 1, lambert_only: false, cells };
        let ratio = |estimator, lambert| table.ratio(table.cell(estimator, lambert).expect("a cell"));
        assert_eq!(ratio(Estimator::Bvh, false), Some(1.0));
        assert_eq!(ratio(Estimator::Brute, false), Some(2.5));
        assert_eq!(ratio(Estimator::Bvh, true), Some(1.0));
        assert_eq!(ratio(Estimator::Brute, true), None);
        assert_eq!(table.photons(), Some([9, 7]));
    }

    #[test]
    fn times_are_medians_of_passes() {
        let times = Times::of(&[[1.0, 5.0], [3.0, 1.0], [2.0, 8.0]]);
        assert_eq!(times, Times { build: 2.0, gather: 5.0, total: 6.0, spread: 2.5 });
    }

    #[test]
    fn only_brute_is_left_out_for_its_size() {
        let trial = Trial {
            size: [100, 100],
            photons: Some(1000),
            passes: 1,
            footprint: Footprint::default(),
            estimators: vec![],
            most_pairs: 1e7,
        };
        assert_eq!(trial.refuses(&trial.settings(Estimator::Brute)), None);
        let more = Trial { photons: Some(1001), ..trial };
        let reason = more.refuses(&more.settings(Estimator::Brute)).expect("left out");
        assert!(reason.contains("1.0e7 pairs") && reason.contains("more than 1e7"), "{reason}");
        assert_eq!(more.refuses(&more.settings(Estimator::Bvh)), None);
    }
}
