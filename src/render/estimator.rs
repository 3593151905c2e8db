//! The choice of a density estimator: what it builds from the photons of a pass, and how it gathers at the eye hits.

use super::leaf_size;
use super::settings::{Record, Settings};
use super::upload::DeviceScene;
use crate::graph::{Buf, Graph, Lanes};
use crate::kernels::gather::{self, Band, HashGrid, Points, Program, hash};
use crate::kernels::lbvh;
use crate::kernels::photon::{self, Deposits, PhotonMap};

/// How the light of the photons is estimated at the eye hits. All but [`Estimator::Knn`] give the same
/// picture; they differ in time and memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// A bounding-volume hierarchy over the photons' footprints (Fabianowski and Dingliana 2009).
    Bvh,
    /// A grid of cells in a hash table, one for each size of footprint (after Mara, Luebke and McGuire 2013).
    Hash,
    /// The k nearest photons at every eye hit (Jensen 2001), another estimate: radii follow the density of photons wherever more
    /// than k footprints overlap.
    Knn,
    /// Every photon at every eye hit: slow, the answer that the others must give.
    Brute,
}

impl Estimator {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Bvh, Self::Hash, Self::Knn, Self::Brute];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Hash => "hash",
            Self::Knn => "knn",
            Self::Brute => "brute",
        }
    }

    /// What it is, for the command line.
    pub fn help(self) -> &'static str {
        match self {
            Self::Bvh => "Bounding-volume hierarchy over the footprints",
            Self::Hash => "Hash grid, a level of cells for each size of footprint",
            Self::Knn => {
                "The --knn-photons nearest photons of each class, radii cut to the farthest: another, smaller blur"
            }
            Self::Brute => "Every photon at every hit: for small scenes, the answer that the others must give",
        }
    }

    /// Whether it goes through lists of photons, of which a part can be skipped (`--sampling stochastic`).
    pub fn walks(self) -> bool {
        match self {
            Self::Bvh | Self::Hash | Self::Brute => true,
            Self::Knn => false,
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
    Hash(HashGrid),
    /// With the number of photons to seek.
    Knn(gather::KnnMap, u32),
    /// The deposits as they are.
    Brute,
}

/// Builds what `estimator` gathers from.
pub(super) fn build(
    g: &mut Graph,
    estimator: Estimator,
    device: &DeviceScene,
    settings: &Settings,
    deposits: &mut Deposits,
) -> Structure {
    match estimator {
        Estimator::Bvh => {
            let options =
                lbvh::Options { leaf_items: settings.leaf_photons.unwrap_or(leaf_size::LEAST), fences: device.fences };
            Structure::Bvh(photon::map(g, deposits, options, settings.record == Record::Packed20))
        }
        Estimator::Knn => {
            let k = settings.knn_photons.clamp(1, gather::MAX_NEIGHBOURS);
            Structure::Knn(gather::knn_map(g, deposits, device.fences), k)
        }
        Estimator::Hash => Structure::Hash(gather::hash_grid(g, deposits, hash::Options::default())),
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
        Structure::Bvh(map) => gather::bvh(g, program, points, (map, deposits), gathered),
        Structure::Hash(grid) => gather::hash(g, program, points, grid, gathered),
        Structure::Knn(map, k) => gather::knn(g, (program, *k), points, (map, deposits), gathered),
        Structure::Brute => gather::brute(g, program, points, (&deposits.photons, &deposits.count), gathered),
    }
}
