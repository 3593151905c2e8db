//! Numbers that a pass brings to the host.

use crate::graph::{Graph, Readback, Tally};
use crate::kernels::deposits::Deposits;
use crate::kernels::generated::Photon;

/// Numbers that a pass brings to the host.
#[derive(Default)]
pub struct Reports {
    pub deposits: Option<Readback<u32>>,
    pub overflow: Option<Readback<u32>>,
    pub counters: Option<Readback<u32>>,
    pub truncated: Vec<Readback<u32>>,
    /// Energies of each class of photons, caustic or not.
    pub energies: Vec<(bool, [Readback<[f32; 2]>; 2])>,
    pub eye_truncated: Vec<Readback<u32>>,
    /// What the estimator built, by name; equal names are added up.
    pub structure: Vec<(&'static str, Readback<u32>)>,
    /// What was gathered, where pairs are counted.
    pub gathered: Vec<Readback<[f32; 4]>>,
    /// Counts of work, where they are wanted.
    pub work: Vec<Tally>,
    /// The deposits, where they are wanted.
    pub photons: Option<Readback<Photon>>,
}

impl Reports {
    /// Adds what is known of the photons.
    pub fn with_photons(self, g: &mut Graph, deposits: &Deposits, read_photons: bool) -> Self {
        let energies = deposits.energies.iter();
        let energies = energies.map(|e| (e.caustic, [g.readback(&e.emitted), g.readback(&e.ended)])).collect();
        Self {
            energies,
            deposits: Some(g.readback(&deposits.count)),
            overflow: Some(g.readback(&deposits.overflow)),
            counters: Some(g.readback(&deposits.counters)),
            truncated: deposits.truncated.iter().map(|count| g.readback(count)).collect(),
            photons: read_photons.then(|| g.readback(&deposits.photons)),
            ..self
        }
    }
}
