//! What photons leave in a pass: the list that maps, gathers and connections to the camera are made of.

use super::generated::{Aabb, Photon};
use crate::constants;
use crate::graph::{Buf, Graph};

/// Names of the entries of [`Deposits::counters`].
pub const COUNTERS: [&str; constants::COUNTERS as usize] = {
    let mut names = [""; constants::COUNTERS as usize];
    names[constants::COUNT_MIN_RADIUS as usize] = "footprints_raised_to_minimum";
    names[constants::COUNT_MAX_RADIUS as usize] = "footprints_cut_to_maximum";
    names[constants::COUNT_ANISOTROPY as usize] = "footprints_beyond_anisotropy";
    names[constants::COUNT_GRAZING as usize] = "deposits_refused_as_grazing";
    names[constants::COUNT_OVERFLOW as usize] = "photons_without_room";
    names[constants::COUNT_NOT_FINITE as usize] = "photons_not_finite";
    names
};

/// Deposits of all classes, in order of emission class, bounce and photon.
#[derive(Debug)]
pub struct Deposits {
    /// Photons with their footprints.
    pub photons: Buf<Photon>,
    /// Boxes of the footprints.
    pub boxes: Buf<Aabb>,
    /// How many.
    pub count: Buf<u32>,
    /// How many did not fit.
    pub overflow: Buf<u32>,
    /// Guards that fired, [`COUNTERS`].
    pub counters: Buf<u32>,
    /// Per class: photons still in flight after the last bounce.
    pub truncated: Vec<Buf<u32>>,
    /// Per class: where its light went.
    pub energies: Vec<Energies>,
}

/// Energies of one class ([`super::energy`]).
#[derive(Debug)]
pub struct Energies {
    /// Whether these are caustic photons.
    pub caustic: bool,
    /// Sums after the emission.
    pub emitted: Buf<[f32; 2]>,
    /// Sums after the last bounce.
    pub ended: Buf<[f32; 2]>,
}

impl Deposits {
    /// An empty map with room for `capacity` deposits.
    pub fn new(g: &mut Graph, capacity: u32) -> Self {
        let mut deposits = Self {
            photons: g.buffer("deposits", capacity),
            boxes: g.buffer("deposit_boxes", capacity),
            count: g.buffer("deposit_count", 1),
            overflow: g.buffer("deposit_overflow", 1),
            counters: g.buffer("photon_counters", COUNTERS.len() as u32),
            truncated: Vec::new(),
            energies: Vec::new(),
        };
        g.fill(&mut deposits.count, 0);
        g.fill(&mut deposits.overflow, 0);
        g.fill(&mut deposits.counters, 0);
        deposits
    }

    /// Room for `capacity` light vertices ([`super::photon::trace_vertices`]), which have no boxes.
    pub fn vertices(g: &mut Graph, capacity: u32) -> Self {
        Self { boxes: g.buffer("no_boxes", 1), ..Self::new(g, capacity) }
    }
}
