//! Photons as small records (Mara, Luebke and McGuire 2013, section 4): 20 bytes instead of 64, or 12 relative to a
//! cell or tile. The layouts, and what they lose, stand in glsl/lib/packed_photon.glsl.

use super::deposits::Deposits;
use super::generated::{
    Photon, PhotonPack, PhotonPackBindings, PhotonRadii, PhotonRadiiBindings, PhotonSortRecords,
    PhotonSortRecordsBindings, RadiusRange,
};
use super::{Items, reduce};
use crate::constants::PACKED_WORDS;
use crate::graph::{Buf, Graph, Grid};

/// How photons are stored for the gather. Packed ones are discs, with what glsl/lib/packed_photon.glsl loses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Record {
    /// 64 bytes: everything in full precision.
    #[default]
    Full,
    /// 20 bytes, position in full precision.
    Packed20,
    /// 12 bytes, position relative to a cell or tile.
    Packed12,
}

impl Record {
    /// RECORD of glsl/lib/packed_photon.glsl: bytes, or 0 for full precision.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Full => 0,
            Self::Packed20 => 20,
            Self::Packed12 => 12,
        }
    }
}

/// Packed photons.
#[derive(Debug)]
pub struct Records {
    /// 20 or 12 bytes.
    pub record: Record,
    /// Five words a photon. With 12 bytes a single unused one: places are packed where cells or tiles are known.
    pub records: Buf<u32>,
    /// One entry: what radius codes mean.
    pub range: Buf<RadiusRange>,
}

/// Packs the deposits, and replaces them and their boxes by the discs that the records stand for: whatever is built of
/// them, and whatever looks at them in full, is built of what will be gathered. With 12 bytes the discs are still at
/// their exact places. Nothing with [`Record::Full`].
pub fn pack(g: &mut Graph, deposits: &mut Deposits, record: Record) -> Option<Records> {
    let words = match record {
        Record::Full => return None,
        Record::Packed20 => PACKED_WORDS * deposits.photons.len(),
        Record::Packed12 => 1,
    };
    let capacity = deposits.photons.len();
    let mut radii = g.buffer("photon_radii", capacity);
    let bind = PhotonRadiiBindings { count: &deposits.count, photons: &deposits.photons, radii: &mut radii };
    g.dispatch(PhotonRadii, Grid::Threads(capacity), (), bind);
    let (smallest, largest) = range_of(g, deposits, &radii);
    let mut packed = Records { record, records: g.buffer("photon_records", words), range: g.buffer("radius_range", 1) };
    let mut discs = g.buffer::<Photon>("photon_discs", capacity);
    if record == Record::Packed12 {
        g.fill(&mut packed.records, 0);
    }
    let bind = PhotonPackBindings {
        count: &deposits.count,
        photons: &deposits.photons,
        smallest: &smallest,
        largest: &largest,
        ranges: &mut packed.range,
        records: &mut packed.records,
        boxes: &mut deposits.boxes,
        discs: &mut discs,
    };
    g.dispatch(PhotonPack { record: record.code() }, Grid::Threads(capacity.max(1)), (), bind);
    deposits.photons = discs;
    Some(packed)
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
    /// The records of 20 bytes in another order, `order[..count[0]]`.
    pub fn sorted(&self, g: &mut Graph, order: &Buf<u32>, count: &Buf<u32>) -> Self {
        let words = self.records.len();
        let mut sorted = g.buffer("sorted_records", words);
        let bind = PhotonSortRecordsBindings { order, count, records: &self.records, sorted: &mut sorted };
        g.dispatch(PhotonSortRecords, Grid::Threads(words / PACKED_WORDS), (), bind);
        let mut range = g.buffer("sorted_range", 1);
        g.copy(&self.range, &mut range);
        Self { record: self.record, records: sorted, range }
    }
}
