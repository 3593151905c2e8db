//! A recorded pass: one run of the device, or two with the host's work between them.

use std::time::Instant;

use super::budget::PhotonBudget;
use super::camera_input::CameraInput;
use super::content::Content;
use super::film_state::FilmState;
use super::host_map::HostMap;
use super::plan::{Planned, plan, plan_photons, plan_picture};
use super::reports::Reports;
use crate::error::Result;
use crate::graph::{Executable, Input, Readback, Runtime, Tally, Timing};
use crate::kernels::energy::Ledger;
use crate::kernels::generated::{Aabb, Pass, Photon};
use crate::render::scene::memory::Memory;
use crate::render::settings::PhotonBuild;

/// Name of the host's work among the scopes of a pass.
const HOST_SCOPE: &str = "photon map";

/// What the device does without asking the host.
struct Part {
    executable: Executable,
    pass: Input<Pass>,
    cameras: Vec<CameraInput>,
    reports: Reports,
}

impl Part {
    fn run(&mut self, pass: Pass) -> Result<()> {
        self.executable.write(&self.pass, &[pass]);
        self.executable.run()
    }
}

/// The host's part of a pass.
struct Between {
    map: HostMap,
    boxes: Readback<Aabb>,
    leaf_items: u32,
    /// Seconds that the last map took.
    seconds: f64,
}

/// A recorded pass.
pub struct Recording {
    runtime: Runtime,
    /// One, or two with the host's work between them.
    parts: Vec<Part>,
    between: Option<Between>,
    /// The plan as text.
    pub dump: String,
    /// Passes of the plan.
    pub dispatches: usize,
    /// Seconds that planning took: checks, culling, phases, memory.
    pub planning_seconds: f64,
}

impl Recording {
    /// Plans, allocates and records one pass.
    ///
    /// # Errors
    /// [`crate::error::Error::OutOfMemory`] for what does not fit the device.
    pub fn new(runtime: &Runtime, content: Content<'_>, budget: &PhotonBudget, state: &FilmState) -> Result<Self> {
        let mut recording = Self {
            runtime: runtime.clone(),
            parts: vec![],
            between: None,
            dump: String::new(),
            dispatches: 0,
            planning_seconds: 0.0,
        };
        if content.settings.photon_build == PhotonBuild::Linear || !content.has_photon_tree(budget) {
            recording.add(plan(content, budget, state))?;
            return Ok(recording);
        }
        let map = HostMap::new(Memory::Device(runtime), budget.capacity)?;
        let (photons, boxes) = plan_photons(content, budget, &map);
        recording.add(photons)?;
        recording.add(plan_picture(content, &map, state))?;
        let leaf_items = content.settings.leaf_size();
        recording.between = Some(Between { map, boxes, leaf_items, seconds: 0.0 });
        Ok(recording)
    }

    fn add(&mut self, Planned { plan, pass, cameras, reports, seconds }: Planned) -> Result<()> {
        self.parts.push(Part { executable: self.runtime.prepare(&plan)?, pass, cameras, reports });
        self.dump += &plan.dump();
        self.dispatches += plan.passes.len();
        self.planning_seconds += seconds;
        Ok(())
    }

    /// Lets the passes that follow see by the camera of `content`.
    pub fn set_camera(&mut self, content: Content<'_>) {
        for Part { executable, cameras, .. } in &mut self.parts {
            cameras.iter().for_each(|camera| camera.write(executable, content));
        }
    }

    /// Runs the pass and returns how many photons did not fit; if any, nothing was added to the film.
    ///
    /// # Errors
    /// Those of the device.
    pub fn run(&mut self, pass: Pass) -> Result<u64> {
        self.parts[0].run(pass)?;
        let overflow = self.first(|r| r.overflow.as_ref());
        let Some(between) = &mut self.between else { return Ok(overflow) };
        if overflow > 0 {
            return Ok(overflow);
        }
        let begin = Instant::now();
        let photons = &self.parts[0];
        let mut boxes = photons.executable.read(&between.boxes);
        let stored = photons.reports.deposits.as_ref().map_or(0, |count| photons.executable.read(count)[0]);
        boxes.truncate(stored as usize);
        between.map.build(&self.runtime, &boxes, between.leaf_items)?;
        between.seconds = begin.elapsed().as_secs_f64();
        self.parts[1].run(pass)?;
        Ok(0)
    }

    /// The first word of a report, 0 where there is none.
    pub fn first(&self, pick: impl Fn(&Reports) -> Option<&Readback<u32>>) -> u64 {
        let word = |part: &Part| pick(&part.reports).map(|word| u64::from(part.executable.read(word)[0]));
        self.parts.iter().find_map(word).unwrap_or(0)
    }

    /// The sum of the first words of many reports.
    pub fn sum(&self, pick: impl Fn(&Reports) -> &[Readback<u32>]) -> u64 {
        let words = |part: &Part| {
            let word = |word| u64::from(part.executable.read(word)[0]);
            pick(&part.reports).iter().map(word).sum::<u64>()
        };
        self.parts.iter().map(words).sum()
    }

    /// [`crate::kernels::deposits::COUNTERS`] of the last pass; none without photons.
    pub fn counters(&self) -> Vec<u32> {
        let read = |part: &Part| part.reports.counters.as_ref().map(|r| part.executable.read(r));
        self.parts.iter().find_map(read).unwrap_or_default()
    }

    /// Where the light of the last pass's photons went, class by class; true for caustic ones.
    pub fn energies(&self) -> Vec<(bool, Ledger)> {
        let read = |part: &Part| {
            let ledger = |[emitted, ended]: &[Readback<[f32; 2]>; 2]| {
                Ledger::of(&part.executable.read(emitted), &part.executable.read(ended))
            };
            part.reports.energies.iter().map(|(caustic, sums)| (*caustic, ledger(sums))).collect::<Vec<_>>()
        };
        self.parts.iter().flat_map(read).collect()
    }

    /// What the estimator built in the last pass, by name; names may repeat.
    pub fn structure(&self) -> Vec<(&'static str, u64)> {
        let read = |part: &Part| {
            let count =
                |(name, word): &(&'static str, Readback<u32>)| (*name, u64::from(part.executable.read(word)[0]));
            part.reports.structure.iter().map(count).collect::<Vec<_>>()
        };
        self.parts.iter().flat_map(read).collect()
    }

    /// Counts of work of the last pass, where they are wanted; kinds repeat.
    pub fn work(&self) -> impl Iterator<Item = (&'static str, u64)> {
        self.parts.iter().flat_map(|part| {
            let count = |tally: &Tally| u64::from(tally.times) * u64::from(part.executable.read(&tally.count)[0]);
            part.reports.work.iter().map(move |tally| (tally.kind, count(tally)))
        })
    }

    /// Tested and accepted pairs of the last pass, where they are counted.
    pub fn pairs(&self) -> [u64; 2] {
        let mut sums = [0, 0];
        for part in &self.parts {
            for readback in &part.reports.gathered {
                let gathered = part.executable.read(readback);
                gathered.iter().enumerate().for_each(|(i, vector)| sums[i % 2] += vector[3] as u64);
            }
        }
        sums
    }

    /// Photons stored in the last pass, where they are wanted.
    pub fn photons(&self) -> Vec<Photon> {
        let read = |part: &Part| part.reports.photons.as_ref().map(|r| part.executable.read(r));
        let mut photons = self.parts.iter().find_map(read).unwrap_or_default();
        photons.truncate(self.first(|r| r.deposits.as_ref()) as usize);
        photons
    }

    /// Times of the scopes of the last pass. The host's work comes between those of the device, on the device's clock.
    pub fn timings(&self) -> Vec<Timing> {
        let mut parts = self.parts.iter().map(|part| part.executable.timings());
        let mut timings = parts.next().unwrap_or_default();
        if let Some(between) = &self.between {
            let start_ns = timings.iter().map(|t| t.end_ns).max().unwrap_or(0);
            let end_ns = start_ns + (between.seconds * 1e9) as u64;
            timings.push(Timing { name: HOST_SCOPE.into(), depth: 0, start_ns, end_ns });
        }
        timings.extend(parts.flatten());
        timings
    }

    /// Device bytes of transients and of the host's map.
    pub fn device_bytes(&self) -> u64 {
        let transients: u64 = self.parts.iter().map(|part| part.executable.device_bytes()).sum();
        transients + self.between.as_ref().map_or(0, |between| between.map.bytes())
    }
}
