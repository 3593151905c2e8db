//! The choice of a density estimator: what it builds from the photons of a pass, and how it gathers at the eye hits.

use super::settings::Settings;
use super::upload::DeviceScene;
use crate::graph::{Buf, Graph, Lanes};
use crate::kernels::gather::{self, Band, Points, Program};
use crate::kernels::lbvh;
use crate::kernels::photon::{self, Deposits, PhotonMap};

/// How the light of the photons is estimated at the eye hits. All give the same picture; they differ in time and memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// A bounding-volume hierarchy over the photons' footprints (Fabianowski and Dingliana 2009).
    Bvh,
    /// Every photon at every eye hit: slow, the answer that the others must give.
    Brute,
}

impl Estimator {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Bvh, Self::Brute];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Brute => "brute",
        }
    }

    /// What it is, for the command line.
    pub fn help(self) -> &'static str {
        match self {
            Self::Bvh => "Bounding-volume hierarchy over the footprints",
            Self::Brute => "Every photon at every hit: for small scenes, the answer that the others must give",
        }
    }

    /// Whether it goes through lists of photons, of which a part can be skipped (`--sampling stochastic`).
    pub fn walks(self) -> bool {
        match self {
            Self::Bvh | Self::Brute => true,
        }
    }

    /// The fastest of them on a kind of device, as measured (ARCHITECTURE.md).
    pub fn default_for(_lanes: Lanes) -> Self {
        Self::Bvh
    }
}

/// What an estimator keeps of the photons of a pass.
pub(super) enum Structure {
    Bvh(PhotonMap),
    /// The deposits as they are.
    Brute,
}

/// Builds what `estimator` gathers from.
pub(super) fn build(
    g: &mut Graph,
    estimator: Estimator,
    device: &DeviceScene,
    settings: &Settings,
    deposits: &Deposits,
) -> Structure {
    match estimator {
        Estimator::Bvh => {
            let options = lbvh::Options { leaf_items: settings.leaf_photons, fences: device.fences };
            Structure::Bvh(photon::map(g, deposits, options))
        }
        Estimator::Brute => Structure::Brute,
    }
}

/// Writes the gathered radiance of a band's eye hits: per slot caustic, then other light.
pub(super) fn gather(
    g: &mut Graph,
    program: Program,
    (structure, deposits): (&Structure, &Deposits),
    (points, _band): (Points<'_>, Band<'_>),
    gathered: &mut Buf<[f32; 4]>,
) {
    match structure {
        Structure::Bvh(map) => gather::bvh(g, program, points, map, gathered),
        Structure::Brute => gather::brute(g, program, points, (&deposits.photons, &deposits.count), gathered),
    }
}
