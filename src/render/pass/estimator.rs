//! The choice of a density estimator: what it builds from the photons of a pass, and how it gathers at the eye hits.

use super::content::Content;
use crate::graph::{Buf, Graph};
use crate::kernels::deposits::Deposits;
use crate::kernels::gather::{self, Band, Bounds, HashGrid, Points, Program, Shape, hash};
use crate::kernels::photon::{self, PhotonMap};
use crate::kernels::records::{self, Records};
use crate::kernels::{Items, lbvh, reduce};
use crate::render::settings::{Estimator, Record};

/// What an estimator keeps of the photons of a pass.
pub enum Structure {
    Bvh(PhotonMap),
    Hash(HashGrid),
    /// With the number of photons to seek.
    Knn(gather::KnnMap, u32),
    /// What serves hits at their pixel's place, and a map for those behind mirrors and glass, where there may be such.
    Image(InImage, Option<PhotonMap>),
    /// The deposits as they are.
    Brute,
}

/// Estimators that work in the image: of the photons they keep the deposits as they are, or packed.
pub enum InImage {
    Tiled {
        packed: Option<Records>,
        /// Photons that any tile has.
        touched: Buf<u32>,
        /// Entries of the lists, by band.
        entries: Vec<Buf<u32>>,
    },
    Bounds(Bounds),
}

/// Builds what the chosen estimator gathers from.
pub fn build(g: &mut Graph, content: Content<'_>, deposits: &mut Deposits) -> Structure {
    let Content { device, settings, .. } = content;
    let options = lbvh::Options { leaf_items: settings.leaf_size(), fences: device.fences };
    let drawn = |shape| Bounds { shape, amplification: settings.amplification };
    let kind = match content.estimator() {
        Estimator::Bvh => {
            return Structure::Bvh(photon::map(g, deposits, options, settings.record == Record::Packed20));
        }
        Estimator::Knn => {
            return Structure::Knn(gather::knn_map(g, deposits, device.fences), settings.knn_photons);
        }
        Estimator::Hash => {
            let packed = records::pack(g, deposits, settings.record);
            return Structure::Hash(gather::hash_grid(g, deposits, hash::Options::default(), packed.as_ref()));
        }
        Estimator::Brute => return Structure::Brute,
        Estimator::Tiled => {
            let mut touched = g.buffer("tiled_touched", deposits.photons.len());
            g.fill(&mut touched, 0);
            InImage::Tiled { packed: records::pack(g, deposits, settings.record), touched, entries: vec![] }
        }
        Estimator::Bounds25d => InImage::Bounds(drawn(Shape::Polygon(settings.bound_vertices))),
        Estimator::Bounds3d => InImage::Bounds(drawn(Shape::Icosahedron)),
    };
    // Where eye paths end at their first surface nothing is left over.
    let behind = device.variant.glossy.then(|| {
        let packed = match &kind {
            InImage::Tiled { packed, .. } => packed.as_ref(),
            InImage::Bounds(_) => None,
        };
        behind_map(g, deposits, options, packed)
    });
    Structure::Image(kind, behind)
}

/// The map for hits behind mirrors and glass. It has no cells that records of 12 bytes could be relative to: their
/// discs then stay in full.
fn behind_map(g: &mut Graph, deposits: &Deposits, options: lbvh::Options, packed: Option<&Records>) -> PhotonMap {
    let tree = lbvh::build(g, Items::Counted(&deposits.count), &deposits.boxes, options);
    photon::in_order(g, deposits, tree, packed.filter(|p| p.record == Record::Packed20))
}

/// Writes the gathered radiance of a band's eye hits: per slot caustic, then other light.
pub fn gather(
    g: &mut Graph,
    program: Program,
    (structure, deposits): (&mut Structure, &Deposits),
    (points, band): (Points<'_>, Band<'_>),
    gathered: &mut Buf<[f32; 4]>,
) {
    match structure {
        Structure::Bvh(map) => gather::bvh(g, program, points, (map, deposits), gathered),
        Structure::Hash(grid) => gather::hash(g, program, points, (grid, deposits), gathered),
        Structure::Knn(map, k) => gather::knn(g, (program, *k), points, (map, deposits), gathered),
        Structure::Image(kind, None) => in_image(g, program, (kind, deposits), (points, band), gathered),
        Structure::Image(kind, Some(map)) => {
            let (straight, bent) = gather::split(g, points);
            in_image(g, program, (kind, deposits), (straight.points(points), band), gathered);
            gather::bvh(g, program, bent.points(points), (map, deposits), gathered);
        }
        Structure::Brute => gather::brute(g, program, points, (&deposits.photons, &deposits.count), gathered),
    }
}

/// The same for hits at their pixel's place.
fn in_image(
    g: &mut Graph,
    program: Program,
    (kind, deposits): (&mut InImage, &Deposits),
    at: (Points<'_>, Band<'_>),
    gathered: &mut Buf<[f32; 4]>,
) {
    match kind {
        InImage::Tiled { packed, touched, entries } => {
            entries.push(gather::tiled(g, program, at, (deposits, packed.as_ref(), touched), gathered));
        }
        InImage::Bounds(bounds) => {
            gather::bounds(g, (program, *bounds), at, (&deposits.photons, &deposits.count), gathered);
        }
    }
}

/// Numbers to report of what the estimator built, by name; equal names are added up.
pub fn counts(g: &mut Graph, structure: &Structure) -> Vec<(&'static str, Buf<u32>)> {
    match structure {
        Structure::Image(InImage::Tiled { touched, entries, .. }, _) => {
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
        _ => vec![],
    }
}
