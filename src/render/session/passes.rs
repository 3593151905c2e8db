//! Runs passes and counts what happens in them.

use std::time::Instant;

use super::Session;
use super::statistics::add_by_name;
use crate::error::{Error, MemoryCause, Result};
use crate::kernels::generated::{Pass, Photon};
use crate::render::pass::recording::Recording;

impl Session {
    /// Renders the pass with this global index and adds it to the film. Its content depends on nothing but the scene,
    /// the settings and the index.
    ///
    /// # Errors
    /// [`Error::Usage`] if the pass is in the film already, and those of the device.
    pub fn run_pass(&mut self, index: u64) -> Result<()> {
        if self.passes.contains(index) {
            return Err(Error::Usage(format!("pass {index} is in the film already")));
        }
        let (is_other, own) = self.turn_of(index)?;
        match &mut self.other {
            Some(other) if is_other => other.session.run_pass(own)?,
            _ => self.repeat_pass(own)?,
        }
        self.passes.insert(index);
        self.note_turn(own, is_other);
        Ok(())
    }

    /// The work of [`Self::run_pass`], any number of times, to measure it; where methods take turns, that of the first
    /// one. Afterwards the film is no picture of the scene.
    ///
    /// # Errors
    /// Those of the device.
    pub fn repeat_pass(&mut self, index: u64) -> Result<()> {
        let start = Instant::now();
        // What is chosen for the film is chosen by the scene as it is when the shutter opens.
        self.prepare()?;
        self.follow_motion(index)?;
        let pass = Pass {
            index: index as u32,
            seed: self.settings.seed ^ ((index >> 32) as u32).wrapping_mul(0x9e37_79b9),
            radius_scale: self.settings.radius_scale(index),
            reserved: 0,
        };
        loop {
            let overflow = self.recording.run(pass)?;
            if overflow == 0 {
                break;
            }
            self.grow(overflow)?;
        }
        self.count(start);
        Ok(())
    }

    /// Makes room for deposits that did not fit; the pass was not added and is repeated.
    fn grow(&mut self, overflow: u64) -> Result<()> {
        let (needed, most) = (u64::from(self.budget.capacity) + overflow, u64::from(self.device_scene.most_deposits));
        if needed > most {
            return Err(Error::OutOfMemory {
                object: "photon map".into(),
                bytes: needed * size_of::<Photon>() as u64,
                cause: MemoryCause::TooManyPhotons { most },
            });
        }
        self.statistics.repeated += 1;
        self.budget.capacity = (needed * 5 / 4).min(most) as u32;
        self.recording = Recording::new(&self.runtime, self.content(), &self.budget, &self.state)?;
        Ok(())
    }

    fn count(&mut self, start: Instant) {
        let (photons_truncated, eye_truncated) =
            (self.recording.sum(|r| &r.truncated), self.recording.sum(|r| &r.eye_truncated));
        let deposits = self.recording.first(|r| r.deposits.as_ref());
        let (counters, pairs) = (self.recording.counters(), self.recording.pairs());
        let structure = self.recording.structure();
        let s = &mut self.statistics;
        s.pairs_tested += pairs[0];
        s.pairs_accepted += pairs[1];
        s.passes += 1;
        s.photons += self.budget.emissions.iter().map(|e| u64::from(e.count)).sum::<u64>();
        s.deposits += deposits;
        s.photons_truncated += photons_truncated;
        s.eye_paths_truncated += eye_truncated;
        for ((_, total), value) in s.counters.iter_mut().zip(counters) {
            *total += u64::from(value);
        }
        for (caustic, energy) in self.recording.energies() {
            s.energies[usize::from(!caustic)].add(&energy);
        }
        add_by_name(&mut s.structure_counts, structure);
        add_by_name(&mut s.work, self.recording.work());
        let seconds = start.elapsed().as_secs_f64();
        s.seconds += seconds;
        self.last_seconds = Some(seconds);
    }
}
