//! Memory of an estimator, read from plans: what grows with the photons, and what does not.

use crate::graph::{Access, BufferKind, Plan};
use crate::render::pass::budget::PhotonBudget;

/// Scopes of [`crate::render::pass::plan`] that belong to the estimator.
const BUILD: &str = "photon map";
const GATHER: &str = "gather";

/// Bytes that an estimator uses, as if no buffer shared memory with another. Bytes per photon are per photon that the
/// map has room for. Buffers whose length depends on pixels or tiles do not count there but in [`Self::fixed`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EstimatorBytes {
    /// Per photon: made once and read by the gather of every band.
    pub kept_per_photon: f64,
    /// Per photon: used while building, or made for one band and forgotten with it.
    pub scratch_per_photon: f64,
    /// Per photon: the deposits, as far as the estimator reads them. They exist whatever the estimator is.
    pub deposits_per_photon: f64,
    /// Bytes of one band that do not depend on the number of photons: lists of tiles, flags of hits.
    pub fixed: u64,
}

/// Sums in bytes, of one plan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Sums {
    kept: u64,
    scratch: u64,
    deposits: u64,
}

impl Sums {
    fn of(plan: &Plan) -> Self {
        // Of each buffer: the scope that first wrote it, and what used it afterwards.
        let none = None::<(u32, &str)>;
        let mut maker = vec![none; plan.buffers.len()];
        let mut touched = vec![false; plan.buffers.len()];
        let (mut built, mut gathered) = (touched.clone(), touched.clone());
        for pass in &plan.passes {
            let scope = pass.scopes.first().map(|&id| (id, plan.scope_names[id as usize]));
            let name = scope.map(|(_, name)| name);
            for usage in &pass.uses {
                let buffer = usage.buffer as usize;
                if !touched[buffer] && usage.access == Access::Write {
                    (maker[buffer], touched[buffer]) = (scope, true);
                }
                built[buffer] |= name == Some(BUILD);
                gathered[buffer] |= name == Some(GATHER);
            }
        }
        let mut sums = Self::default();
        // A band's buffers are gone when the next begins: the greatest band counts.
        let mut bands = std::collections::BTreeMap::<u32, u64>::new();
        for (index, info) in plan.buffers.iter().enumerate() {
            if !touched[index] || !matches!(info.kind, BufferKind::Transient) {
                continue;
            }
            match maker[index] {
                Some((_, BUILD)) if gathered[index] => sums.kept += info.bytes,
                Some((_, BUILD)) => sums.scratch += info.bytes,
                Some((band, GATHER)) => *bands.entry(band).or_default() += info.bytes,
                _ if built[index] || gathered[index] => sums.deposits += info.bytes,
                _ => {}
            }
        }
        sums.scratch += bands.values().max().unwrap_or(&0);
        sums
    }
}

/// Compares the plan of a pass with that of a pass with room for half as many photons. `None` without photons.
pub fn of(plan: impl Fn(&PhotonBudget) -> Plan, budget: &PhotonBudget) -> Option<EstimatorBytes> {
    let half = PhotonBudget { capacity: budget.capacity / 2, ..budget.clone() };
    if budget.emissions.is_empty() || half.capacity == 0 {
        return None;
    }
    let (whole, less) = (Sums::of(&plan(budget)), Sums::of(&plan(&half)));
    let photons = f64::from(budget.capacity - half.capacity);
    let slope = |of: fn(&Sums) -> u64| (of(&whole) as f64 - of(&less) as f64) / photons;
    let (kept, scratch) = (slope(|s| s.kept), slope(|s| s.scratch));
    let growing = (kept + scratch) * f64::from(budget.capacity);
    Some(EstimatorBytes {
        kept_per_photon: kept,
        scratch_per_photon: scratch,
        deposits_per_photon: slope(|s| s.deposits),
        fixed: ((whole.kept + whole.scratch) as f64 - growing).max(0.0).round() as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::Graph;

    /// An estimator made up for the test: it keeps 12 bytes per photon, uses 8 as scratch, 4 in each of two bands, and
    /// 1000 words in every band. The eye hits do not belong to it.
    fn planned(budget: &PhotonBudget) -> Plan {
        let n = budget.capacity;
        let mut g = Graph::new();
        let mut deposits = g.buffer::<[u32; 16]>("deposits", n);
        g.scope("global photons", |g| g.fill(&mut deposits, 0));
        let (mut kept, mut scratch) = (g.buffer::<[u32; 3]>("kept", n), g.buffer::<[u32; 2]>("scratch", n));
        let mut copied = g.buffer::<[u32; 16]>("copied", n.min(10));
        g.scope(BUILD, |g| {
            g.copy(&deposits, &mut copied);
            g.fill(&mut scratch, 0);
            g.fill(&mut kept, 0);
        });
        for _ in 0..2 {
            let mut hits = g.buffer::<u32>("hits", 500);
            g.fill(&mut hits, 0);
            let (mut tiles, mut entries) = (g.buffer::<u32>("tiles", 1000), g.buffer::<u32>("entries", n));
            g.scope(GATHER, |g| {
                g.fill(&mut tiles, 1);
                g.fill(&mut entries, 1);
                let mut first = g.buffer::<[u32; 3]>("first", 1);
                g.copy(&kept, &mut first);
                g.keep(&first);
                g.keep(&entries);
                g.keep(&tiles);
            });
        }
        g.keep(&scratch);
        g.keep(&copied);
        g.plan().expect("a plan")
    }

    #[test]
    fn bytes_are_found_by_their_role() {
        let emission = crate::kernels::photon::Emission {
            count: 1,
            caustic: false,
            smoothing: 1.0,
            max_bounces: 1,
            footprint: crate::kernels::photon::Footprint::default(),
            largest: 0.03,
        };
        let budget = PhotonBudget { emissions: vec![emission], capacity: 4096 };
        let found = of(planned, &budget).expect("photons");
        assert_eq!((found.kept_per_photon, found.scratch_per_photon), (12.0, 8.0 + 4.0));
        assert_eq!(found.deposits_per_photon, 64.0);
        // Tiles of one band, ten copied records, and one of three words in the least size of a buffer.
        assert_eq!(found.fixed, 4000 + 640 + 16);
        assert_eq!(of(planned, &PhotonBudget { emissions: vec![], ..budget }), None);
    }
}
