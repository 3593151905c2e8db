//! Counts of a session over all its passes.

use crate::film::film_file::Totals;
use crate::kernels::deposits::COUNTERS;
use crate::kernels::energy::Ledger;

/// Counts over all passes so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statistics {
    /// Passes in the film.
    pub passes: u64,
    /// Passes repeated because their photons did not fit.
    pub repeated: u64,
    /// Photons emitted.
    pub photons: u64,
    /// Deposits stored in photon maps, or light vertices by [`crate::render::Method::Light`].
    pub deposits: u64,
    /// Guards that fired, by name.
    pub counters: Vec<(&'static str, u64)>,
    /// Photons that were still in flight at the bounce limit.
    pub photons_truncated: u64,
    /// Where the light of caustic photons went, and that of all others. Each class stands for all light that it is
    /// meant for, so the two are not to be added.
    pub energies: [Ledger; 2],
    /// Eye paths that ended at the depth limit.
    pub eye_paths_truncated: u64,
    /// Pixel values that were not finite and counted as black.
    pub rejected: u64,
    /// Photons tested against eye hits, if [`Settings::count_pairs`](crate::render::Settings::count_pairs).
    pub pairs_tested: u64,
    /// Photons whose footprint held the eye hit, if [`Settings::count_pairs`](crate::render::Settings::count_pairs).
    pub pairs_accepted: u64,
    /// Rays and the like by kind ([`crate::kernels::eye::EYE_RAYS`] and others), if
    /// [`Settings::count_work`](crate::render::Settings::count_work); of the passes of this session alone.
    pub work: Vec<(&'static str, u64)>,
    /// What the estimator built, by name: `photons_in_tiles` and `tile_entries` of [`crate::render::Estimator::Tiled`].
    pub structure_counts: Vec<(&'static str, u64)>,
    /// Seconds spent in passes.
    pub seconds: f64,
}

/// What [`crate::render::Estimator::Tiled`] counts.
const STRUCTURE_COUNTS: [&str; 2] = ["photons_in_tiles", "tile_entries"];

/// Names of the classes of photons, in the order of [`Statistics::energies`].
pub const CLASSES: [&str; 2] = ["caustic", "global"];

impl Statistics {
    /// Those of a session without passes: every counter is there and 0.
    pub(super) fn none() -> Self {
        Self { counters: COUNTERS.iter().map(|name| (*name, 0)).collect(), ..Self::default() }
    }

    /// Adds the counts of other passes.
    pub(super) fn add(&mut self, other: &Self) {
        self.passes += other.passes;
        self.repeated += other.repeated;
        self.photons += other.photons;
        self.deposits += other.deposits;
        for ((_, ours), (_, theirs)) in self.counters.iter_mut().zip(&other.counters) {
            *ours += theirs;
        }
        self.photons_truncated += other.photons_truncated;
        self.energies.iter_mut().zip(&other.energies).for_each(|(ours, theirs)| ours.add(theirs));
        self.eye_paths_truncated += other.eye_paths_truncated;
        self.pairs_tested += other.pairs_tested;
        self.pairs_accepted += other.pairs_accepted;
        add_by_name(&mut self.work, other.work.iter().copied());
        self.seconds += other.seconds;
    }

    /// As they are kept with a film.
    pub fn totals(&self) -> Totals {
        let map = |counts: &[(&str, u64)]| counts.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect();
        Totals {
            seconds: self.seconds,
            repeated: self.repeated,
            photons: self.photons,
            deposits: self.deposits,
            photons_truncated: self.photons_truncated,
            eye_paths_truncated: self.eye_paths_truncated,
            pairs: [self.pairs_tested, self.pairs_accepted],
            counters: map(&self.counters),
            structure: map(&self.structure_counts),
            energies: CLASSES.iter().zip(&self.energies).flat_map(|(class, energy)| named(class, energy)).collect(),
        }
    }

    /// From what was kept with a film of so many passes; names that this program does not count are left out.
    pub(super) fn restored(totals: &Totals, passes: u64) -> Self {
        let known = |names: &[&'static str], counts: &std::collections::BTreeMap<String, u64>| {
            names.iter().filter_map(|name| Some((*name, *counts.get(*name)?))).collect::<Vec<_>>()
        };
        let counter = |name: &&'static str| (*name, totals.counters.get(*name).copied().unwrap_or(0));
        Self {
            passes,
            repeated: totals.repeated,
            photons: totals.photons,
            deposits: totals.deposits,
            counters: COUNTERS.iter().map(counter).collect(),
            photons_truncated: totals.photons_truncated,
            energies: CLASSES.map(|class| {
                Ledger::from_entries(|name| totals.energies.get(&format!("{class}.{name}")).copied().unwrap_or(0.0))
            }),
            eye_paths_truncated: totals.eye_paths_truncated,
            rejected: 0,
            pairs_tested: totals.pairs[0],
            pairs_accepted: totals.pairs[1],
            work: vec![],
            structure_counts: known(&STRUCTURE_COUNTS, &totals.structure),
            seconds: totals.seconds,
        }
    }
}

/// Adds amounts to those of the same names.
pub(super) fn add_by_name(sums: &mut Vec<(&'static str, u64)>, amounts: impl IntoIterator<Item = (&'static str, u64)>) {
    for (name, amount) in amounts {
        match sums.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += amount,
            None => sums.push((name, amount)),
        }
    }
}

/// The entries of a class as they are kept with a film.
fn named(class: &str, energy: &Ledger) -> Vec<(String, f64)> {
    // A film's text has no word for what is not finite.
    let finite = energy.entries().into_iter().filter(|(_, value)| value.is_finite());
    finite.map(|(name, value)| (format!("{class}.{name}"), value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_come_back() {
        let statistics = Statistics {
            passes: 3,
            repeated: 1,
            photons: 300,
            deposits: 200,
            counters: COUNTERS.iter().zip(1..).map(|(name, n)| (*name, n)).collect(),
            photons_truncated: 4,
            energies: [1.0, 2.0].map(|emitted| Ledger { emitted, cut: 0.5 * emitted, ..Ledger::default() }),
            eye_paths_truncated: 5,
            rejected: 0,
            pairs_tested: 6,
            pairs_accepted: 7,
            work: vec![],
            structure_counts: vec![("photons_in_tiles", 8), ("tile_entries", 9)],
            seconds: 1.5,
        };
        assert_eq!(Statistics::restored(&statistics.totals(), 3), statistics);
    }
}
