//! The choice of a density estimator: what it builds from the photons of a pass, and how it gathers at the eye hits.

use super::settings::Settings;
use super::upload::DeviceScene;
use crate::graph::{Buf, Graph, Lanes};
use crate::kernels::gather::{self, Band, Points, Program};
use crate::kernels::photon::{self, Deposits, PhotonMap};
use crate::kernels::{Items, lbvh, reduce};

/// How the light of the photons is estimated at the eye hits. All give the same picture; they differ in time and memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// A bounding-volume hierarchy over the photons' footprints (Fabianowski and Dingliana 2009).
    Bvh,
    /// Lists of photons per tile of the image (Mara, Luebke and McGuire 2013); a hierarchy behind mirrors and glass.
    Tiled,
    /// Every photon at every eye hit: slow, the answer that the others must give.
    Brute,
}

impl Estimator {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Bvh, Self::Tiled, Self::Brute];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Tiled => "tiled",
            Self::Brute => "brute",
        }
    }

    /// What it is, for the command line.
    pub fn help(self) -> &'static str {
        match self {
            Self::Bvh => "Bounding-volume hierarchy over the footprints",
            Self::Tiled => "Lists of photons per tile of the image; hits behind mirrors and glass by bvh",
            Self::Brute => "Every photon at every hit: for small scenes, the answer that the others must give",
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
    /// For hits at their pixel's place nothing but the deposits; a map for others.
    Tiled {
        touched: Buf<u32>,
        bent: Option<PhotonMap>,
        entries: Vec<Buf<u32>>,
    },
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
    let options = lbvh::Options { leaf_items: settings.leaf_photons, fences: device.fences };
    match estimator {
        Estimator::Bvh => Structure::Bvh(photon::map(g, deposits, options)),
        Estimator::Tiled => {
            let mut touched = g.buffer("tiled_touched", deposits.photons.len());
            g.fill(&mut touched, 0);
            let bent = device.variant.glossy.then(|| photon::map(g, deposits, options));
            Structure::Tiled { touched, bent, entries: vec![] }
        }
        Estimator::Brute => Structure::Brute,
    }
}

/// Writes the gathered radiance of a band's eye hits: per slot caustic, then other light.
pub(super) fn gather(
    g: &mut Graph,
    program: Program,
    (structure, deposits): (&mut Structure, &Deposits),
    (points, band): (Points<'_>, Band<'_>),
    gathered: &mut Buf<[f32; 4]>,
) {
    match structure {
        Structure::Bvh(map) => gather::bvh(g, program, points, map, gathered),
        Structure::Tiled { touched, bent: None, entries } => {
            entries.push(gather::tiled(g, program, (points, band), (deposits, touched), gathered));
        }
        Structure::Tiled { touched, bent: Some(map), entries } => {
            let (straight, bent) = gather::split(g, points);
            let straight = (straight.points(points.hits), band);
            entries.push(gather::tiled(g, program, straight, (deposits, touched), gathered));
            gather::bvh(g, program, bent.points(points.hits), map, gathered);
        }
        Structure::Brute => gather::brute(g, program, points, (&deposits.photons, &deposits.count), gathered),
    }
}

/// Numbers to report of what the estimator built, by name; equal names are added up.
pub(super) fn counts(g: &mut Graph, structure: &Structure) -> Vec<(&'static str, Buf<u32>)> {
    match structure {
        Structure::Tiled { touched, entries, .. } => {
            let mut photons = g.buffer("photons_in_tiles", 1);
            reduce::u32s(g, Items::All, reduce::Op::Sum, touched, &mut photons);
            let mut counts = vec![("photons_in_tiles", photons)];
            for entries in entries {
                let mut copy = g.buffer("tile_entries", 1);
                g.copy(entries, &mut copy);
                counts.push(("tile_entries", copy));
            }
            counts
        }
        Structure::Bvh(_) | Structure::Brute => vec![],
    }
}
