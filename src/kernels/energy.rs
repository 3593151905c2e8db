//! Where the light of photons goes: what a class of them emitted, and what became of it.
//!
//! Every photon keeps what was taken of it on its way and how its way ended (glsl/kernels/photon/photon_bounce.comp).
//! One dispatch after the emission and one after the last bounce sum this over all photons; nothing is counted at the
//! bounces. A photon that is lost on its way (dropped from a list, overwritten by another) ends nowhere, and so what
//! was emitted is not accounted for.

use super::generated::{PhotonCut, PhotonCutBindings, PhotonEnergy, PhotonEnergyBindings, PhotonEnergyParams};
pub use crate::constants::ENERGIES;
use crate::constants::{
    ENERGY_ABSORBED, ENERGY_CLAMPED, ENERGY_CUT, ENERGY_ENDED, ENERGY_ESCAPED, ENERGY_IN_FLIGHT, ENERGY_LOST,
    PATH_END_SHIFT,
};
use crate::graph::{Buf, Graph, Grid};

/// Workgroups of a sum, on every device: their results are added by the host.
const GROUPS: u32 = 64;

/// What became of the light of one class of photons [W, mean of the channels].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Ledger {
    /// Left the lights.
    pub emitted: f64,
    /// Taken by surfaces and media, less what surviving photons carry for those that were absorbed.
    pub absorbed: f64,
    /// Left the scene.
    pub escaped: f64,
    /// Not followed further: no environment map knows of a surface ([`crate::kernels::maps`]).
    pub lost: f64,
    /// Brought by caustic photons to surfaces that scatter widely, where these photons end with what they stored.
    pub ended: f64,
    /// Still in flight at the limit of bounces.
    pub cut: f64,
    /// Refused by a guard: grazing, or not finite.
    pub clamped: f64,
}

impl Ledger {
    /// Of a pass, from the sums after the emission and those after the last bounce.
    pub fn of(emitted: &[[f32; 2]], ended: &[[f32; 2]]) -> Self {
        let (start, end) = (total(emitted), total(ended));
        let at = |energy: u32| end[energy as usize];
        Self {
            emitted: start[ENERGY_IN_FLIGHT as usize],
            absorbed: at(ENERGY_ABSORBED),
            escaped: at(ENERGY_ESCAPED),
            lost: at(ENERGY_LOST),
            ended: at(ENERGY_ENDED),
            cut: at(ENERGY_CUT),
            clamped: at(ENERGY_CLAMPED),
        }
    }

    /// The entries by name.
    pub fn entries(&self) -> [(&'static str, f64); 7] {
        let Self { emitted, absorbed, escaped, lost, ended, cut, clamped } = *self;
        [
            ("emitted", emitted),
            ("absorbed", absorbed),
            ("escaped", escaped),
            ("lost", lost),
            ("ended", ended),
            ("cut", cut),
            ("clamped", clamped),
        ]
    }

    /// From entries by name; missing ones are 0.
    pub fn from_entries(entry: impl Fn(&str) -> f64) -> Self {
        let [emitted, absorbed, escaped, lost, ended, cut, clamped] =
            Self::default().entries().map(|(name, _)| entry(name));
        Self { emitted, absorbed, escaped, lost, ended, cut, clamped }
    }

    /// Adds the light of another pass.
    pub fn add(&mut self, other: &Self) {
        let (ours, theirs) = (self.entries().map(|e| e.1), other.entries().map(|e| e.1));
        let sum: [f64; 7] = std::array::from_fn(|k| ours[k] + theirs[k]);
        *self = Self::from_entries(|name| {
            self.entries().iter().position(|(known, _)| *known == name).map_or(0.0, |place| sum[place])
        });
    }

    /// The part of the emitted light that is not accounted for; 0 where none was emitted.
    pub fn imbalance(&self) -> f64 {
        let Self { emitted, absorbed, escaped, lost, ended, cut, clamped } = *self;
        if emitted == 0.0 { 0.0 } else { (absorbed + escaped + lost + ended + cut + clamped) / emitted - 1.0 }
    }
}

/// What the workgroups found, added.
fn total(partial: &[[f32; 2]]) -> [f64; ENERGIES as usize] {
    let mut sums = [0.0; ENERGIES as usize];
    for (index, [high, low]) in partial.iter().enumerate() {
        sums[index % ENERGIES as usize] += f64::from(*high) + f64::from(*low);
    }
    sums
}

/// Photons by place.
#[derive(Clone, Copy)]
pub struct Photons<'a> {
    /// Two vectors each: w of the first is what was taken of the photon.
    pub rays: &'a Buf<[f32; 4]>,
    /// What they carry.
    pub flux: &'a Buf<[f32; 4]>,
    /// What became of them, in the highest bits.
    pub states: &'a Buf<u32>,
}

/// Sums over all photons, [`ENERGIES`] of each workgroup, for [`Ledger::of`].
pub fn sum(g: &mut Graph, photons: Photons<'_>) -> Buf<[f32; 2]> {
    let Photons { rays, flux, states } = photons;
    let mut partial = g.buffer("photon_energies", GROUPS * ENERGIES);
    let bind = PhotonEnergyBindings { rays, flux, states, partial: &mut partial };
    g.dispatch(PhotonEnergy, Grid::Groups([GROUPS, 1]), PhotonEnergyParams { count: states.len() }, bind);
    partial
}

/// Marks the photons of a list as cut at the limit of bounces.
pub fn cut(g: &mut Graph, (list, count): (&Buf<u32>, &Buf<u32>), grid: Grid<'_>, states: &mut Buf<u32>) {
    g.dispatch(PhotonCut, grid, (), PhotonCutBindings { list, count, states });
}

/// The specification of [`sum`]: energies by [`ENERGIES`].
pub fn reference(rays: &[[f32; 4]], flux: &[[f32; 4]], states: &[u32]) -> [f64; ENERGIES as usize] {
    let mut sums = [0.0; ENERGIES as usize];
    for (index, ([r, g, b, _], state)) in flux.iter().zip(states).enumerate() {
        let energy = (r + g + b) * (1.0 / 3.0);
        if [r, g, b].iter().all(|x| x.is_finite()) {
            sums[(state >> PATH_END_SHIFT) as usize] += f64::from(energy);
            sums[ENERGY_ABSORBED as usize] += f64::from(rays[2 * index][3]);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ledger_closes_only_if_all_is_there() {
        let ledger =
            Ledger { emitted: 6.25, absorbed: 1.0, escaped: 2.0, lost: 0.25, ended: 1.5, cut: 1.0, clamped: 0.5 };
        assert_eq!(ledger.imbalance(), 0.0);
        let mut two = ledger;
        two.add(&ledger);
        assert_eq!((two.emitted, two.clamped, two.imbalance()), (12.5, 1.0, 0.0));
        let entries = ledger.entries();
        let named = |name: &str| entries.iter().find(|(known, _)| *known == name).map_or(0.0, |(_, value)| *value);
        assert_eq!(Ledger::from_entries(named), ledger);
        for (missing, _) in &entries[1..] {
            let broken = Ledger::from_entries(|name| if name == *missing { 0.0 } else { named(name) });
            assert!(broken.imbalance() < -1e-6, "without {missing}");
        }
        assert_eq!(Ledger::default().imbalance(), 0.0);
    }

    #[test]
    fn sums_of_workgroups_are_added() {
        let group = |scale: f32| (0..ENERGIES).map(move |k| [scale * k as f32, scale * 1e-9]);
        let partial: Vec<[f32; 2]> = group(1.0).chain(group(2.0)).collect();
        let ledger = Ledger::of(&partial, &partial);
        assert!((ledger.clamped - 15.0 - 3e-9).abs() < 1e-12, "{ledger:?}");
        assert!((ledger.emitted - 3e-9).abs() < 1e-12, "{ledger:?}");
    }
}
