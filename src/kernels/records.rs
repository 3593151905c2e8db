//! Photons as small records (Mara, Luebke and McGuire 2013, section 4): 20 bytes instead of 64. The layout, and what it
//! loses, stand in glsl/lib/packed_photon.glsl.

use super::generated::{
    PhotonPack, PhotonPackBindings, PhotonRadii, PhotonRadiiBindings, PhotonSortRecords, PhotonSortRecordsBindings,
    RadiusRange,
};
use super::photon::Deposits;
use super::{Items, reduce};
use crate::graph::{Buf, Graph, Grid};

/// Words of a record of 20 bytes.
const WORDS: u32 = 5;

/// Packed photons.
#[derive(Debug)]
pub struct Records {
    /// Five words a photon.
    pub records: Buf<u32>,
    /// One entry: what radius codes mean.
    pub range: Buf<RadiusRange>,
}

/// Packs the deposits, and replaces their boxes by those of the discs that the records stand for.
pub fn pack(g: &mut Graph, deposits: &mut Deposits) -> Records {
    let capacity = deposits.photons.len();
    let mut radii = g.buffer("photon_radii", capacity);
    let bind = PhotonRadiiBindings { count: &deposits.count, photons: &deposits.photons, radii: &mut radii };
    g.dispatch(PhotonRadii, Grid::Threads(capacity), (), bind);
    let (smallest, largest) = range_of(g, deposits, &radii);
    let mut packed =
        Records { records: g.buffer("photon_records", WORDS * capacity), range: g.buffer("radius_range", 1) };
    let bind = PhotonPackBindings {
        count: &deposits.count,
        photons: &deposits.photons,
        smallest: &smallest,
        largest: &largest,
        ranges: &mut packed.range,
        records: &mut packed.records,
        boxes: &mut deposits.boxes,
    };
    g.dispatch(PhotonPack, Grid::Threads(capacity.max(1)), (), bind);
    packed
}

/// Bits of the smallest and of the largest radius.
pub(super) fn range_of(g: &mut Graph, deposits: &Deposits, radii: &Buf<u32>) -> (Buf<u32>, Buf<u32>) {
    let (mut smallest, mut largest) = (g.buffer("smallest_radius", 1), g.buffer("largest_radius", 1));
    // Floats above zero compare like their bits.
    reduce::u32s(g, Items::Counted(&deposits.count), reduce::Op::Min, radii, &mut smallest);
    reduce::u32s(g, Items::Counted(&deposits.count), reduce::Op::Max, radii, &mut largest);
    (smallest, largest)
}

impl Records {
    /// The records in another order, `order[..count[0]]`.
    pub fn sorted(self, g: &mut Graph, order: &Buf<u32>, count: &Buf<u32>) -> Self {
        let words = self.records.len();
        let mut sorted = g.buffer("sorted_records", words);
        let bind = PhotonSortRecordsBindings { order, count, records: &self.records, sorted: &mut sorted };
        g.dispatch(PhotonSortRecords, Grid::Threads(words / WORDS), (), bind);
        Self { records: sorted, ..self }
    }
}
