//! Runs the work that a study has left, and gathers its results.

use std::time::Instant;

use super::config::Study;
use super::measure::{self, Meter, Order};
use super::moments::Moments;
use super::plan::{Plan, Unit, Work, references};
use super::reference::file_name;
use super::results::{Decomposition, Measurement, Results};
use super::store::Entry;
use crate::error::{Error, Result};
use crate::graph::Runtime;
use crate::picture::exr::RenderInfo;
use crate::picture::image::Picture;
use crate::picture::output::Output;
use crate::picture::tonemap::ToneMap;
use crate::render::Settings;

/// Receives notes and progress of a study, and can end it.
pub trait Observer {
    /// Takes a sentence for the user.
    fn note(&mut self, sentence: &str);
    /// Takes the progress; called for each pass.
    fn progress(&mut self, progress: &Progress<'_>);
    /// Whether the study is to end.
    fn is_stopped(&self) -> bool;
}

/// How far a study is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress<'a> {
    /// The piece of work that is running.
    pub what: &'a str,
    /// Its number among all, from 1.
    pub number: usize,
    /// Pieces of work in all.
    pub total: usize,
    /// Its passes.
    pub passes: u64,
    /// Its rendering time in seconds.
    pub seconds: f64,
    /// Time that the study still needs, in seconds, where there is anything to tell it from.
    pub remaining: Option<f64>,
}

/// Makes the folders, does what is left to do and returns everything that has been measured. After an error or a stop,
/// `results` of a new plan returns what was measured until then.
///
/// # Errors
/// Those of the plan, of the device and of writing; [`Error::Interrupted`] if `observer` stopped it.
pub fn run(study: &Study, runtime: &Runtime, observer: &mut dyn Observer) -> Result<Results> {
    let mut plan = Plan::new(study, runtime)?;
    plan.notes.iter().for_each(|note| observer.note(note));
    complete(&mut plan, observer)?;
    Ok(results(&plan))
}

/// Runs the work that is left. Finished work is in the store even if an error or a stop follows.
///
/// # Errors
/// As [`run`].
pub fn complete(plan: &mut Plan<'_>, observer: &mut dyn Observer) -> Result<()> {
    make_folders(plan.study)?;
    let units = plan.units.clone();
    let mut pace = Pace::default();
    for (index, unit) in units.iter().enumerate().filter(|(_, unit)| !matches!(unit.work, Work::Reference)) {
        if plan.is_done(unit) {
            continue;
        }
        let reference = units.iter().position(|other| other.scene == unit.scene && other.work == Work::Reference);
        let reference = reference.filter(|index| !plan.is_done(&units[*index]));
        for index in reference.into_iter().chain([index]) {
            if observer.is_stopped() {
                return Err(Error::Interrupted);
            }
            let begin = Instant::now();
            let estimate = plan.estimate(&units[index]);
            let rest = pace.remaining(plan, &units[index]);
            one(plan, (&units, index), rest, observer).map_err(|error| named(error, &plan.describe(&units[index])))?;
            pace.add(begin.elapsed().as_secs_f64(), estimate);
        }
    }
    Ok(())
}

fn make_folders(study: &Study) -> Result<()> {
    let pictures = study.keep_pictures.then(|| study.output.join("pictures"));
    for folder in [Some(study.output.clone()), Some(references(&study.output)), pictures].into_iter().flatten() {
        std::fs::create_dir_all(&folder).map_err(|source| Error::io(&folder, "create", source))?;
    }
    Ok(())
}

/// Says where settings were refused.
fn named(error: Error, what: &str) -> Error {
    match error {
        Error::Usage(cause) => Error::Usage(format!("{what}: {cause}")),
        Error::Setting { settings, cause } => Error::Setting { settings, cause: format!("{cause} ({what})") },
        other => other,
    }
}

/// How long work took beside what was estimated.
#[derive(Default)]
struct Pace {
    done: f64,
    wall: f64,
    /// Wall time beyond the estimates.
    excess: f64,
    estimated: f64,
}

impl Pace {
    fn add(&mut self, wall: f64, estimate: Option<f64>) {
        self.done += 1.0;
        self.wall += wall;
        if let Some(estimate) = estimate {
            self.estimated += 1.0;
            self.excess += (wall - estimate).max(0.0);
        }
    }

    /// Time for one piece of work, with set-up and measuring.
    fn of(&self, estimate: Option<f64>) -> Option<f64> {
        let excess = if self.estimated > 0.0 { self.excess / self.estimated } else { 0.0 };
        estimate.map(|seconds| seconds + excess).or((self.done > 0.0).then_some(self.wall / self.done))
    }

    /// Time for `next` and for all that is left after it.
    fn remaining(&self, plan: &Plan<'_>, next: &Unit) -> (Option<f64>, Option<f64>) {
        let mut rest = Some(0.0);
        for unit in plan.units.iter().filter(|unit| *unit != next && !plan.is_done(unit)) {
            rest = rest.zip(self.of(plan.estimate(unit))).map(|(sum, seconds)| sum + seconds);
        }
        (self.of(plan.estimate(next)), rest)
    }
}

/// Does one piece of work and stores its result.
fn one(
    plan: &mut Plan<'_>,
    (units, index): (&[Unit], usize),
    (own, rest): (Option<f64>, Option<f64>),
    observer: &mut dyn Observer,
) -> Result<()> {
    let unit = &units[index];
    let what = plan.describe(unit);
    let begin = Instant::now();
    let mut proceed = |passes: u64, seconds: f64| {
        let left = own.map(|own| (own - begin.elapsed().as_secs_f64()).max(0.0));
        let remaining = left.zip(rest).map(|(left, rest)| left + rest);
        observer.progress(&Progress { what: &what, number: index + 1, total: units.len(), passes, seconds, remaining });
        !observer.is_stopped()
    };
    let entry = match unit.work {
        Work::Reference => {
            let loaded = &plan.scenes[unit.scene];
            loaded.reference.make(plan.runtime, &loaded.scene, proceed)?;
            return loaded.reference.read(&loaded.entry).map(drop);
        }
        Work::Render { variant, seed } => Entry::Measurements(render(plan, unit.scene, (variant, seed), &mut proceed)?),
        Work::Decomposition { variant } => Entry::Decompositions(decompose(plan, unit.scene, variant, &mut proceed)?),
    };
    plan.store.put(unit.key.clone(), entry)
}

fn render(
    plan: &Plan<'_>,
    scene: usize,
    (variant, seed): (usize, u32),
    proceed: &mut dyn FnMut(u64, f64) -> bool,
) -> Result<Vec<Measurement>> {
    let loaded = &plan.scenes[scene];
    let variant_settings = &plan.study.variants[variant];
    let settings = plan.settings(scene, variant, seed);
    let mut blank = measure::blank(&loaded.entry.name, &variant_settings.name, seed);
    blank.settings = variant_settings.settings();
    blank.time_split.insert("load".into(), loaded.seconds);
    let reference = loaded.reference.read(&loaded.entry)?;
    let (budgets, flip) = (&plan.study.budgets, plan.study.flip);
    let order = Order { scene: &loaded.scene, settings: &settings, budgets, reference: &reference, flip, blank };
    let (mut measurements, picture) = measure::render(plan.runtime, &order, proceed)?;
    if plan.study.keep_pictures {
        let seconds = write_picture(plan, &picture, &settings, &measurements)?;
        if let Some(last) = measurements.iter_mut().max_by_key(|measurement| measurement.passes) {
            last.time_split.insert("write".into(), seconds);
        }
    }
    Ok(measurements)
}

/// Writes the last picture of a render and returns the time that it took in seconds.
fn write_picture(plan: &Plan<'_>, picture: &Picture, settings: &Settings, measurements: &[Measurement]) -> Result<f64> {
    let Some(last) = measurements.iter().max_by_key(|measurement| measurement.passes) else { return Ok(0.0) };
    let name = format!("{}-{}-{}.exr", file_name(&last.scene), file_name(&last.variant), settings.seed);
    let output = Output::check(&plan.study.output.join("pictures").join(name))?;
    let info = RenderInfo {
        passes: last.passes,
        seed: settings.seed.into(),
        seconds: last.seconds,
        device: plan.runtime.device().info().name.clone(),
        scene: last.scene.clone(),
    };
    let begin = Instant::now();
    output.write(picture, &info.metadata(), ToneMap::default())?;
    Ok(begin.elapsed().as_secs_f64())
}

/// Bias and variance after each number of passes, from renders of many seeds.
fn decompose(
    plan: &Plan<'_>,
    scene: usize,
    variant: usize,
    proceed: &mut dyn FnMut(u64, f64) -> bool,
) -> Result<Vec<Decomposition>> {
    let Some(wanted) = &plan.study.decomposition else { return Ok(vec![]) };
    let loaded = &plan.scenes[scene];
    let variant_settings = &plan.study.variants[variant];
    let reference = loaded.reference.read(&loaded.entry)?;
    let reference = reference.beauty().map(|layer| layer.data.as_slice()).unwrap_or_default();
    let mut moments = vec![Moments::default(); wanted.passes.len()];
    let (mut passes, mut seconds) = (0, 0.0);
    for &seed in &wanted.seeds {
        let mut meter = Meter::new(plan.runtime, &loaded.scene, &plan.settings(scene, variant, seed))?;
        for (moments, &count) in moments.iter_mut().zip(&wanted.passes) {
            while meter.passes() < count {
                if !proceed(passes + meter.passes(), seconds + meter.seconds()) {
                    return Err(Error::Interrupted);
                }
                meter.pass()?;
            }
            moments.add(meter.picture()?.beauty().map(|layer| layer.data.as_slice()).unwrap_or_default());
        }
        (passes, seconds) = (passes + meter.passes(), seconds + meter.seconds());
    }
    plan.runtime.device().check_validation()?;
    let result = |(moments, &passes): (&Moments, &u64)| {
        let found = moments.relative(reference)?;
        Some(Decomposition {
            scene: loaded.entry.name.clone(),
            variant: variant_settings.name.clone(),
            settings: variant_settings.settings(),
            passes,
            seeds: moments.count(),
            bias_squared: found.bias_squared,
            variance: found.variance,
        })
    };
    Ok(moments.iter().zip(&wanted.passes).filter_map(result).collect())
}

/// Everything that has been measured of a plan, in its order, under the names that scenes and variants have now.
pub fn results(plan: &Plan<'_>) -> Results {
    let mut results = Results {
        title: plan.study.title.clone(),
        device: plan.device(),
        version: env!("CARGO_PKG_VERSION").into(),
        peers: plan.peers.clone(),
        ..Results::default()
    };
    for unit in &plan.units {
        let (Work::Render { variant, .. } | Work::Decomposition { variant }) = unit.work else { continue };
        let (scene, variant_settings) = (&plan.scenes[unit.scene].entry.name, &plan.study.variants[variant]);
        let (variant, settings) = (&variant_settings.name, variant_settings.settings());
        match plan.store.get(&unit.key) {
            Some(Entry::Measurements(measurements)) => {
                results.measurements.extend(measurements.iter().map(|measurement| Measurement {
                    scene: scene.clone(),
                    variant: variant.clone(),
                    settings: settings.clone(),
                    ..measurement.clone()
                }))
            }
            Some(Entry::Decompositions(found)) => {
                results.decompositions.extend(found.iter().map(|one| Decomposition {
                    scene: scene.clone(),
                    variant: variant.clone(),
                    settings: settings.clone(),
                    ..one.clone()
                }));
            }
            None => {}
        }
    }
    results
}
