//! Counts that a film keeps.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Counts over all passes of a film, however many sessions rendered them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Totals {
    /// Rendering time in seconds.
    pub seconds: f64,
    /// Passes repeated because their photons did not fit.
    pub repeated: u64,
    /// Photons emitted.
    pub photons: u64,
    /// Deposits stored in photon maps.
    pub deposits: u64,
    /// Photons that were still in flight at the bounce limit.
    pub photons_truncated: u64,
    /// Eye paths that ended at the depth limit.
    pub eye_paths_truncated: u64,
    /// Photons tested against eye hits and accepted, where they are counted.
    pub pairs: [u64; 2],
    /// Guards that fired, by name.
    pub counters: BTreeMap<String, u64>,
    /// What the estimator built, by name.
    pub structure: BTreeMap<String, u64>,
    /// Where the light of each class of photons went in watts, by class and entry; empty in films of older programs.
    #[serde(default)]
    pub energies: BTreeMap<String, f64>,
}

impl Totals {
    /// Adds the counts of other passes.
    pub fn add(&mut self, other: &Self) {
        self.seconds += other.seconds;
        // Saturating: the numbers may come from a damaged file.
        let add = |ours: &mut u64, theirs: &u64| *ours = ours.saturating_add(*theirs);
        add(&mut self.repeated, &other.repeated);
        add(&mut self.photons, &other.photons);
        add(&mut self.deposits, &other.deposits);
        add(&mut self.photons_truncated, &other.photons_truncated);
        add(&mut self.eye_paths_truncated, &other.eye_paths_truncated);
        self.pairs.iter_mut().zip(&other.pairs).for_each(|(ours, theirs)| add(ours, theirs));
        for (ours, theirs) in [(&mut self.counters, &other.counters), (&mut self.structure, &other.structure)] {
            theirs.iter().for_each(|(name, count)| add(ours.entry(name.clone()).or_default(), count));
        }
        for (name, energy) in &other.energies {
            *self.energies.entry(name.clone()).or_default() += energy;
        }
    }
}
