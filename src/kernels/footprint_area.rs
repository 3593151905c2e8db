//! Sum of the areas of all footprints: with the area of the scene, how many photons a point of it meets on average.

use super::generated::{Photon, PhotonArea, PhotonAreaBindings};
use super::{Items, reduce};
use crate::graph::{Buf, Graph, Grid};

/// Sum in square scene units over the first `count[0]` photons, at most all; infinite where it is beyond single precision.
pub fn sum(g: &mut Graph, count: &Buf<u32>, photons: &Buf<Photon>) -> Buf<f32> {
    g.scope("footprint area", |g| {
        let mut areas = g.buffer("footprint_areas", photons.len());
        let bind = PhotonAreaBindings { count, photons, areas: &mut areas };
        g.dispatch(PhotonArea, Grid::Threads(photons.len()), (), bind);
        let mut total = g.buffer("footprint_area", 1);
        reduce::sum_f32(g, Items::Counted(count), &areas, &mut total);
        total
    })
}

/// The specification: area of one footprint, in square scene units.
pub fn area(photon: &Photon) -> f32 {
    1.0 / f32::from_bits(photon.d[3]).abs()
}
