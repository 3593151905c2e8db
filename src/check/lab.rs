//! Renders with what holds for every render, and the numbers that a case collects.

use std::ops::Range;
use std::sync::Arc;

use super::finding::{Finding, Within};
use crate::error::Result;
use crate::film::accumulate::Film;
use crate::film::error_estimate::Model;
use crate::graph::{Executable, Graph, Runtime};
use crate::kernels::generated::Photon;
use crate::picture::image::Picture;
use crate::render::{Method, Session, Settings, Statistics};
use crate::scene::Scene;
use crate::vk::Device;

/// How much work is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// As little as makes the case mean something: for the tests of every change.
    Quick,
    /// All parameters: minutes in all.
    Full,
}

/// A finished render.
pub struct Shot {
    /// Beauty and all layers.
    pub picture: Picture,
    /// Counts, guards among them.
    pub statistics: Statistics,
    /// Sums and sums of squares per pixel.
    pub moments: Vec<[f64; 9]>,
    /// The film itself.
    pub film: Film,
    /// What is known of the render besides its film.
    pub model: Model,
    /// Triangles left out of the tree.
    pub skipped: u32,
    /// Lights that photons may start from.
    pub lights: u32,
    /// Photons of the last pass, if the settings ask for them.
    pub photons: Vec<Photon>,
    /// The plan of a pass as text.
    pub plan: String,
}

/// Settings of `width` x `height` pixels with all layers and `photons` photons a pass.
pub fn settings(width: u32, height: u32, photons: u32) -> Settings {
    Settings {
        width,
        height,
        photons: Some(photons),
        layers: true,
        // Wider than the defaults: these renders have few photons, and their answers are smooth.
        caustic_smoothing: 3.0,
        global_smoothing: 4.0,
        photon_bounces: 16,
        eye_depth: 12,
        ..Settings::of(Method::Photons)
    }
}

impl Shot {
    /// Renders the passes of `passes`.
    ///
    /// # Errors
    /// Those of the session. Validation messages are errors.
    pub fn take(device: &Arc<Device>, scene: &Scene, settings: &Settings, passes: Range<u64>) -> Result<Self> {
        let mut session = Session::new(device, scene.clone(), settings.clone())?;
        passes.into_iter().try_for_each(|pass| session.run_pass(pass))?;
        Self::of(&session)
    }

    /// What a session has rendered so far.
    ///
    /// # Errors
    /// Those of the device.
    pub fn of(session: &Session) -> Result<Self> {
        let film = session.film()?;
        Ok(Self {
            picture: film.picture(),
            statistics: session.statistics()?,
            moments: film.moments(),
            film,
            model: session.error_model(),
            skipped: session.device_scene().skipped_triangles,
            lights: session.device_scene().light_count,
            photons: session.photons(),
            plan: session.plan_text().to_owned(),
        })
    }

    /// Numbers that are not finite, in the picture, in its sums and among the photons.
    pub fn not_finite(&self) -> u64 {
        let sums = self.moments.iter().flatten().filter(|x| !x.is_finite()).count() as u64;
        let pixels = u64::from(unfinished(&self.picture).is_some());
        sums + pixels + self.statistics.rejected + self.guard("photons_not_finite")
    }

    /// The largest part of the light of a class of photons that is not accounted for.
    pub fn imbalance(&self) -> f64 {
        self.statistics.energies.iter().map(|ledger| ledger.imbalance().abs()).fold(0.0, worse)
    }

    /// How often a guard fired; 0 for a name that no guard has.
    pub fn guard(&self, name: &str) -> u64 {
        self.statistics.counters.iter().find(|(known, _)| *known == name).map_or(0, |(_, count)| *count)
    }

    /// The red channel of a layer; empty if there is no such layer.
    pub fn red(&self, layer: &str) -> Vec<f64> {
        let pixels = self.picture.layer(layer).map_or(&[][..], |layer| &layer.data);
        pixels.chunks(3).map(|pixel| f64::from(pixel[0])).collect()
    }

    /// Mean of the red channel of a layer.
    pub fn mean(&self, layer: &str) -> f64 {
        mean(&self.red(layer))
    }

    /// The bits of all layers, to compare renders exactly.
    pub fn bits(&self) -> Vec<u32> {
        self.picture.layers.iter().flat_map(|layer| layer.data.iter().map(|x| x.to_bits())).collect()
    }

    /// The same without the depth, which is a length.
    pub fn bits_without_depth(&self) -> Vec<u32> {
        let layers = self.picture.layers.iter().filter(|layer| layer.name != "depth");
        layers.flat_map(|layer| layer.data.iter().map(|x| x.to_bits())).collect()
    }
}

/// The greater one; NaN if one of them is.
pub fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Mean of numbers.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Means over `n` x `n` blocks of a square image.
pub fn blocks(pixels: &[f64], n: usize) -> Vec<f64> {
    let side = (pixels.len() as f64).sqrt() as usize;
    let cell = side / n;
    let block = |bx: usize, by: usize| {
        let inside = (0..cell * cell).map(|i| pixels[(by * cell + i / cell) * side + bx * cell + i % cell]);
        inside.sum::<f64>() / (cell * cell) as f64
    };
    (0..n * n).map(|i| block(i % n, i / n)).collect()
}

/// The first layer and number that is not finite. A depth is infinite where nothing was seen.
pub fn unfinished(picture: &Picture) -> Option<(String, usize)> {
    picture.layers.iter().find_map(|layer| {
        let unseen = |x: f32| layer.name == "depth" && x == f32::INFINITY;
        let bad = |x: &f32| !(x.is_finite() || unseen(*x));
        layer.data.iter().position(bad).map(|at| (layer.name.clone(), at))
    })
}

/// Numbers that two renders do not share to the bit; a missing one is a difference.
pub fn differences(a: &[u32], b: &[u32]) -> u64 {
    let longer = a.len().max(b.len()) - a.len().min(b.len());
    a.iter().zip(b).filter(|(a, b)| a != b).count() as u64 + longer as u64
}

/// What a case measures with, and what it has measured.
pub struct Lab {
    runtime: Runtime,
    /// How much work is done.
    pub size: Size,
    findings: Vec<Finding>,
    renders: u32,
    imbalance: f64,
    not_finite: u64,
    plans: Vec<String>,
}

impl Lab {
    /// An empty one.
    pub fn new(runtime: &Runtime, size: Size) -> Self {
        let runtime = runtime.clone();
        Self { runtime, size, findings: vec![], renders: 0, imbalance: 0.0, not_finite: 0, plans: vec![] }
    }

    /// The device.
    pub fn runtime(&self) -> &Runtime {
        &self.runtime
    }

    /// One of two amounts of work.
    pub fn pick<T>(&self, quick: T, full: T) -> T {
        if self.size == Size::Quick { quick } else { full }
    }

    /// Renders, and notes what has to hold for every render.
    ///
    /// # Errors
    /// Those of [`Shot::take`].
    pub fn shot(&mut self, scene: &Scene, settings: &Settings, passes: Range<u64>) -> Result<Shot> {
        let device = self.runtime.device().clone();
        let shot = Shot::take(&device, scene, settings, passes)?;
        self.note(&shot);
        Ok(shot)
    }

    /// Notes what has to hold for every render.
    pub fn note(&mut self, shot: &Shot) {
        self.renders += 1;
        self.imbalance = worse(self.imbalance, shot.imbalance());
        self.not_finite += shot.not_finite();
        self.plans.push(shot.plan.clone());
    }

    /// Runs a graph and reads what it left.
    ///
    /// # Errors
    /// Those of the device.
    ///
    /// # Panics
    /// If the graph is declared wrong.
    pub fn run<T>(&mut self, g: Graph, read: impl FnOnce(&Executable) -> T) -> Result<T> {
        let plan = g.plan().unwrap_or_else(|error| panic!("the graph is declared wrong: {error}"));
        let mut executable = self.runtime.prepare(&plan)?;
        executable.run()?;
        self.plans.push(plan.dump());
        Ok(read(&executable))
    }

    /// Adds a number that was measured.
    pub fn found(&mut self, what: impl Into<String>, found: f64, expected: f64, within: Within) -> &mut Finding {
        self.findings.push(Finding::new(what, found, expected, within));
        self.findings.last_mut().expect("it was added")
    }

    /// Adds the one of many numbers that is farthest from what it should be, as a part of that.
    pub fn worst(&mut self, what: impl Into<String>, found: &[f64], expected: &[f64], part: f64) -> &mut Finding {
        let off = |(found, expected): &(&f64, &f64)| (*found / *expected - 1.0).abs();
        let pairs = found.iter().zip(expected);
        let worst = pairs.max_by(|a, b| off(a).total_cmp(&off(b))).map_or((f64::NAN, 1.0), |(f, e)| (*f, *e));
        self.found(what, worst.0, worst.1, Within::Part(part))
    }

    /// Adds the count of numbers that differ between two renders, which should be none.
    pub fn same(&mut self, what: impl Into<String>, found: &[u32], expected: &[u32]) -> &mut Finding {
        self.found(what, differences(found, expected) as f64, 0.0, Within::Exact)
    }

    /// Adds a statement that should hold.
    pub fn holds(&mut self, what: impl Into<String>, found: bool) -> &mut Finding {
        self.found(what, f64::from(u8::from(found)), 1.0, Within::Exact)
    }

    /// All numbers, with those that hold for every render, and the plans that ran.
    pub(super) fn close(mut self) -> (Vec<Finding>, Vec<String>) {
        if self.renders > 0 {
            let what = format!("photons' energy not accounted for, worst of {} renders", self.renders);
            self.found(what, self.imbalance, 1e-6, Within::AtMost);
            let not_finite = self.not_finite as f64;
            self.found("numbers that are not finite", not_finite, 0.0, Within::Exact);
        }
        (self.findings, self.plans)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::image::Channels;

    #[test]
    fn comparators_fail_on_sabotaged_input() {
        let render = [1.0f32, 2.0, 0.0].map(f32::to_bits);
        let mut broken = render;
        broken[1] += 1; // one ulp
        assert_eq!((differences(&render, &render), differences(&broken, &render)), (0, 1));
        assert_eq!(differences(&[1.0f32, 2.0, -0.0].map(f32::to_bits), &render), 1, "the sign of zero");
        assert_eq!(differences(&render[..2], &render), 1, "a missing number is a difference");
        let mut picture = Picture::new(1, 1);
        picture.push("depth", Channels::Scalar, vec![f32::INFINITY]);
        assert_eq!(unfinished(&picture), None);
        picture.push("", Channels::Rgb, vec![0.0, f32::NAN, 0.0]);
        assert_eq!(unfinished(&picture), Some((String::new(), 1)));
        assert!(worse(1.0, f64::NAN).is_nan() && worse(f64::NAN, 1.0).is_nan());
    }

    #[test]
    fn blocks_are_means() {
        let pixels: Vec<f64> = (0..16).map(f64::from).collect();
        assert_eq!(blocks(&pixels, 2), [2.5, 4.5, 10.5, 12.5]);
    }
}
