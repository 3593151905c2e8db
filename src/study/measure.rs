//! One render under measurement: passes are timed, and at each budget the picture is compared with the reference, off
//! the clock.

use std::collections::BTreeMap;
use std::time::Instant;

use super::results::{Budget, Measurement, TrueError};
use crate::compare::flip::{self, PIXELS_PER_DEGREE};
use crate::compare::metrics;
use crate::error::{Error, Result};
use crate::graph::Runtime;
use crate::picture::image::Picture;
use crate::render::{Session, Settings};
use crate::scene::{Needs, Scene};

/// A session with a clock that runs during passes only.
pub struct Meter {
    session: Session,
    runtime: Runtime,
    passes: u64,
    pass_seconds: Vec<f64>,
    scopes: BTreeMap<String, f64>,
    build: f64,
    warm_up: Option<f64>,
}

impl Meter {
    /// Opens a session. Peaks of device memory count from here.
    ///
    /// # Errors
    /// Those of [`Session::new`].
    pub fn new(runtime: &Runtime, scene: &Scene, settings: &Settings) -> Result<Self> {
        runtime.device().restart_memory_peak();
        let begin = Instant::now();
        let session = Session::new(runtime.device(), scene.clone(), settings.clone())?;
        Ok(Self {
            session,
            runtime: runtime.clone(),
            passes: 0,
            pass_seconds: vec![],
            scopes: BTreeMap::new(),
            build: begin.elapsed().as_secs_f64(),
            warm_up: None,
        })
    }

    /// Renders pass 0 and empties the film again: drivers compile at the first use of a kernel, and the photon map
    /// finds its size. What it takes beyond a usual pass is the part `compile` of the time split, and no part of the
    /// rendering time.
    ///
    /// # Errors
    /// Those of the device.
    pub fn warm_up(&mut self) -> Result<()> {
        let begin = Instant::now();
        self.session.run_pass(0)?;
        self.warm_up = Some(begin.elapsed().as_secs_f64());
        self.session.reset();
        Ok(())
    }

    /// Renders the next pass.
    ///
    /// # Errors
    /// Those of the device.
    pub fn pass(&mut self) -> Result<()> {
        let begin = Instant::now();
        self.session.run_pass(self.passes)?;
        self.pass_seconds.push(begin.elapsed().as_secs_f64());
        self.passes += 1;
        for timing in self.session.timings().into_iter().filter(|timing| timing.depth == 0) {
            let seconds = timing.end_ns.saturating_sub(timing.start_ns) as f64 * 1e-9;
            *self.scopes.entry(timing.name).or_default() += seconds;
        }
        Ok(())
    }

    /// Passes in the film.
    pub fn passes(&self) -> u64 {
        self.passes
    }

    /// Rendering time in seconds.
    pub fn seconds(&self) -> f64 {
        self.pass_seconds.iter().sum()
    }

    /// The picture so far.
    ///
    /// # Errors
    /// Those of the device.
    pub fn picture(&self) -> Result<Picture> {
        self.session.picture()
    }

    /// The picture so far, and the session's own estimate of its error.
    fn picture_and_error(&self) -> Result<(Picture, Option<f64>)> {
        let film = self.session.film()?;
        Ok((film.picture(), self.session.error_of(&film).relative))
    }

    /// Photons emitted for the film.
    fn photons(&self) -> Result<u64> {
        Ok(self.session.statistics()?.photons)
    }

    /// Where the time went in seconds: the outermost scopes of the device's timeline, `host` for what is left of the
    /// rendering time, `build` for the session, `compile` for the excess of the first pass over the median of the
    /// others.
    fn time_split(&self) -> BTreeMap<String, f64> {
        let mut split = self.scopes.clone();
        let on_device: f64 = split.values().sum();
        split.insert("host".into(), (self.seconds() - on_device).max(0.0));
        split.insert("build".into(), self.build);
        if let (Some(first), Some(usual)) = (self.warm_up, median(&self.pass_seconds)) {
            split.insert("compile".into(), (first - usual).max(0.0));
        }
        split
    }

    /// Whether a budget is used up: of the ends of passes, the one nearest to it counts, so that budgets of few passes
    /// are neither missed nor exceeded on average.
    fn has_reached(&self, budget: Budget) -> bool {
        match budget {
            Budget::Seconds(seconds) => self.seconds() * (1.0 + 0.5 / self.passes.max(1) as f64) >= seconds,
            Budget::Passes(passes) => self.passes >= passes,
        }
    }
}

fn median(numbers: &[f64]) -> Option<f64> {
    let mut sorted = numbers.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
}

/// What is rendered, and what is measured on the way.
pub struct Order<'a> {
    /// Scene.
    pub scene: &'a Scene,
    /// Settings with the seed.
    pub settings: &'a Settings,
    /// Budgets, at least one.
    pub budgets: &'a [Budget],
    /// What pictures are compared with.
    pub reference: &'a Picture,
    /// Whether HDR-FLIP is measured.
    pub flip: bool,
    /// A measurement with what is known before the render: names, settings, time of loading.
    pub blank: Measurement,
}

/// A measurement of a render that has not begun.
pub fn blank(scene: &str, variant: &str, seed: u32) -> Measurement {
    Measurement {
        scene: scene.to_owned(),
        variant: variant.to_owned(),
        settings: BTreeMap::new(),
        seed: seed.into(),
        budget: Budget::Passes(0),
        passes: 0,
        photons: 0,
        seconds: 0.0,
        error: TrueError { mse: 0.0, relmse: 0.0, relmse_trimmed: 0.0, smape: 0.0, flip: None, mean_ratio: 1.0 },
        estimated_error: None,
        time_split: BTreeMap::new(),
        device_bytes: 0,
        left_out: vec![],
    }
}

/// Renders until all budgets are used up and returns a measurement for each, in their order, and the last picture.
/// `proceed` is told passes and seconds after each pass and says whether to go on.
///
/// # Errors
/// Those of the device, [`Error::Interrupted`] if `proceed` says no before the end.
pub fn render(
    runtime: &Runtime,
    order: &Order<'_>,
    mut proceed: impl FnMut(u64, f64) -> bool,
) -> Result<(Vec<Measurement>, Picture)> {
    let mut meter = Meter::new(runtime, order.scene, order.settings)?;
    meter.warm_up()?;
    let mut measurements: Vec<Option<Measurement>> = vec![None; order.budgets.len()];
    let mut last = None;
    while measurements.iter().any(Option::is_none) {
        if !proceed(meter.passes(), meter.seconds()) {
            return Err(Error::Interrupted);
        }
        meter.pass()?;
        let reached = |(budget, measurement): &(&Budget, &mut Option<Measurement>)| {
            measurement.is_none() && meter.has_reached(**budget)
        };
        let reached: Vec<_> = order.budgets.iter().zip(&mut measurements).filter(reached).collect();
        if reached.is_empty() {
            continue;
        }
        let (picture, estimated_error) = meter.picture_and_error()?;
        let point = Measurement { estimated_error, ..point(&meter, order, &picture)? };
        reached
            .into_iter()
            .for_each(|(budget, measurement)| *measurement = Some(Measurement { budget: *budget, ..point.clone() }));
        last = Some(picture);
    }
    runtime.device().check_validation()?;
    let picture = last.ok_or_else(|| Error::Usage("a render without a budget".into()))?;
    Ok((measurements.into_iter().flatten().collect(), picture))
}

/// Everything about a render at this moment, but the budget and its own estimate.
fn point(meter: &Meter, order: &Order<'_>, picture: &Picture) -> Result<Measurement> {
    let mut time_split = meter.time_split();
    time_split.extend(order.blank.time_split.clone());
    Ok(Measurement {
        passes: meter.passes(),
        photons: meter.photons()?,
        seconds: meter.seconds(),
        error: true_error(picture, order.reference, order.flip)?,
        time_split,
        device_bytes: meter.runtime.device().memory().peak,
        left_out: Needs::of(order.scene).left_out().into_iter().map(str::to_owned).collect(),
        ..order.blank.clone()
    })
}

/// The difference between a picture and its reference.
///
/// # Errors
/// Those of [`metrics::compare`].
pub fn true_error(picture: &Picture, reference: &Picture, flip: bool) -> Result<TrueError> {
    let m = metrics::compare(picture, reference, "")?;
    let flip =
        if flip { flip::hdr(picture, reference, "", PIXELS_PER_DEGREE)?.map(|(flip, _)| flip.mean) } else { None };
    Ok(TrueError {
        mse: m.mse,
        relmse: m.relmse,
        relmse_trimmed: m.relmse_trimmed,
        smape: m.smape,
        flip,
        mean_ratio: m.mean_ratio,
    })
}
