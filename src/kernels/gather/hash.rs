//! Density estimation from a hash grid: the "HashGrid" of Mara, Luebke and McGuire 2013, with levels.
//!
//! The paper has one cell size, so that every photon's sphere has to reach as far as the largest one's. Footprints by
//! photon differentials differ several hundredfold, and the few photons of diffuse light between caustic ones would
//! make every cell a crowd. Here a photon is filed at the level of its size, levels a factor of two apart, and a hit
//! visits eight cells of every level that is in use: up to 128 look-ups, against thousands of photons too many.
//! [`Options::levels`] = 1 is the paper's grid, for comparisons.
//!
//! Photons are sorted by a 32-bit key of level and hashed cell and copied in that order, so that those of a cell are
//! contiguous; an open-addressing table with quadratic probing and power-of-two size maps a key to its run. Two cells
//! of a level may have one key: that costs tests. The table's layout may differ between runs, what is found does not.

use super::brute::finish;
use super::{Points, Program};
pub use crate::constants::{HASH_LEVEL_SHIFT as HASH_BITS, HASH_LEVELS as LEVELS, HASH_NONE as NONE};
use crate::graph::{Buf, Graph, Grid};
use crate::kernels::deposits::Deposits;
use crate::kernels::generated::{
    Aabb, GatherHash, GatherHashBindings, GatherHashParams, HashExtent, HashExtentBindings, HashFile, HashFileBindings,
    HashInsert, HashInsertBindings, HashInsertParams, HashLevel, HashLevels, HashLevelsBindings, HashPack,
    HashPackBindings, HashSlot, Photon, PhotonSort, PhotonSortBindings, RadiusRange,
};
use crate::kernels::records::{Record, Records};
use crate::kernels::{Items, reduce, sort};

/// How to build.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Levels of cells, 1 to [`LEVELS`]; the last one takes all smaller photons.
    pub levels: u32,
    /// Bits of a cell's hash, 1 to [`HASH_BITS`]; fewer let cells share runs, for tests.
    pub hash_bits: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self { levels: LEVELS, hash_bits: HASH_BITS }
    }
}

/// A hash grid on the device.
#[derive(Debug)]
pub struct HashGrid {
    /// Photons in the order of their keys, those in no cell last; a single unused one if there are records.
    pub photons: Buf<Photon>,
    /// Packed photons in that order, if they were asked for.
    pub packed: Option<PackedCells>,
    /// How many.
    pub count: Buf<u32>,
    /// Keys of the photons, ascending.
    pub keys: Buf<u32>,
    /// The deposits that the photons were.
    pub order: Buf<u32>,
    /// Slots, a power of two of at least twice as many as there is room for photons.
    pub table: Buf<HashSlot>,
    /// By the first photon of a run: one past its last one. Elsewhere anything.
    pub ends: Buf<u32>,
    /// The levels, [`LEVELS`].
    pub levels: Buf<HashLevel>,
    /// One word: bit l is set if level l has photons.
    pub in_use: Buf<u32>,
    /// Box of all footprints.
    pub bounds: Buf<Aabb>,
    hash_bits: u32,
}

/// Packed photons of a grid.
#[derive(Debug)]
pub struct PackedCells {
    /// 20 or 12 bytes; those of 12 bytes are three words, positions relative to the photon's own cell.
    pub records: Records,
    /// With 12 bytes: of each photon's cell another hash than its key. A run may hold photons of several cells, and
    /// relative places mean nothing in another one. Otherwise unused.
    pub checks: Buf<u32>,
}

/// Slots of the table for this many photons.
pub fn slots(capacity: u32) -> u32 {
    (2 * capacity).next_power_of_two().max(2)
}

/// Bytes of a grid with room for `capacity` photons, per photon: the photon (64), its key and place (8), the end of its
/// run (4), and two to four slots of 8 bytes. Between 92 and 108. Records of 20 bytes save 44 of them, those of 12
/// bytes 48, because each has a check of 4.
pub fn bytes_per_photon(capacity: u32) -> f64 {
    64.0 + 8.0 + 4.0 + 8.0 * f64::from(slots(capacity)) / f64::from(capacity.max(1))
}

/// Builds the grid over the deposits, of `records` if there are any ([`crate::kernels::records::pack`]).
///
/// # Panics
/// If the options are out of range or there is room for more than 2^27 deposits.
pub fn hash_grid(g: &mut Graph, deposits: &Deposits, options: Options, records: Option<&Records>) -> HashGrid {
    assert!((1..=LEVELS).contains(&options.levels), "{} levels, 1 to {LEVELS} can be", options.levels);
    assert!((1..=HASH_BITS).contains(&options.hash_bits), "{} bits, 1 to {HASH_BITS} can be", options.hash_bits);
    let capacity = deposits.photons.len();
    assert!(capacity <= 1 << 27, "{capacity} photons, at most 2^27 can be filed");
    g.scope("hash grid", |g| {
        let mut bounds = g.buffer("hash_bounds", 1);
        reduce::bounds(g, Items::Counted(&deposits.count), &deposits.boxes, &mut bounds);
        let record = records.map_or(Record::Full, |r| r.record).code();
        let (extents, largest) = extents(g, deposits, record);
        let (mut levels, mut in_use) = (g.buffer("hash_levels", LEVELS), g.buffer("hash_in_use", 1));
        let bind = HashLevelsBindings { largest: &largest, bounds: &bounds, levels: &mut levels, in_use: &mut in_use };
        g.dispatch(HashLevels { record }, Grid::Groups([1, 1]), (), bind);
        let (mut keys, mut index) = (g.buffer("hash_keys", capacity), g.buffer("hash_index", capacity));
        let bind = HashFileBindings {
            count: &deposits.count,
            photons: &deposits.photons,
            boxes: &deposits.boxes,
            extents: &extents,
            largest: &largest,
            levels: &levels,
            keys: &mut keys,
            index: &mut index,
            in_use: &mut in_use,
        };
        let kernel = HashFile { levels: options.levels, hash_bits: options.hash_bits };
        g.dispatch(kernel, Grid::Threads(capacity), (), bind);
        let (keys, order) = sort::pairs(g, Items::Counted(&deposits.count), keys, index, 32);
        let (table, ends) = insert(g, deposits, &keys);
        let mut count = g.buffer("hash_count", 1);
        g.copy(&deposits.count, &mut count);
        let cells = (&keys, &levels, &bounds);
        let packed = records.map(|records| packed(g, deposits, &order, cells, records));
        let photons = if packed.is_some() { unused(g) } else { sorted(g, deposits, &order) };
        HashGrid {
            photons,
            packed,
            count,
            keys,
            order,
            table,
            ends,
            levels,
            in_use,
            bounds,
            hash_bits: options.hash_bits,
        }
    })
}

/// Half-extents of the photons' boxes, and the largest one, as bits of floats.
fn extents(g: &mut Graph, deposits: &Deposits, record: u32) -> (Buf<u32>, Buf<u32>) {
    let capacity = deposits.photons.len();
    let (mut extents, mut largest) = (g.buffer("hash_extents", capacity), g.buffer("hash_largest", 1));
    let bind = HashExtentBindings {
        count: &deposits.count,
        photons: &deposits.photons,
        boxes: &deposits.boxes,
        extents: &mut extents,
    };
    g.dispatch(HashExtent { record }, Grid::Threads(capacity), (), bind);
    // Floats that are not negative are in the order of their bits.
    reduce::u32s(g, Items::Counted(&deposits.count), reduce::Op::Max, &extents, &mut largest);
    (extents, largest)
}

/// The table, and the ends of the runs.
fn insert(g: &mut Graph, deposits: &Deposits, keys: &Buf<u32>) -> (Buf<HashSlot>, Buf<u32>) {
    let capacity = deposits.photons.len();
    let (mut table, mut ends) = (g.buffer("hash_table", slots(capacity)), g.buffer("hash_ends", capacity));
    g.fill(&mut table, NONE);
    let bind = HashInsertBindings { count: &deposits.count, keys, table: &mut table, ends: &mut ends };
    g.dispatch(HashInsert, Grid::Threads(capacity), HashInsertParams { mask: slots(capacity) - 1 }, bind);
    (table, ends)
}

fn sorted(g: &mut Graph, deposits: &Deposits, order: &Buf<u32>) -> Buf<Photon> {
    let mut photons = g.buffer("hash_photons", deposits.photons.len());
    let bind = PhotonSortBindings { order, count: &deposits.count, photons: &deposits.photons, sorted: &mut photons };
    g.dispatch(PhotonSort, Grid::Threads(deposits.photons.len()), (), bind);
    photons
}

/// A buffer where a kernel does not look.
fn unused<T: bytemuck::Pod>(g: &mut Graph) -> Buf<T> {
    let mut nothing = g.buffer("hash_unused", 1);
    g.fill(&mut nothing, 0);
    nothing
}

/// The records in the order of the cells.
fn packed(
    g: &mut Graph,
    deposits: &Deposits,
    order: &Buf<u32>,
    (keys, levels, bounds): (&Buf<u32>, &Buf<HashLevel>, &Buf<Aabb>),
    records: &Records,
) -> PackedCells {
    if records.record != Record::Packed12 {
        return PackedCells { records: records.sorted(g, order, &deposits.count), checks: unused(g) };
    }
    let capacity = deposits.photons.len();
    let (mut words, mut checks) = (g.buffer("cell_records", 3 * capacity), g.buffer("cell_checks", capacity));
    let bind = HashPackBindings {
        order,
        count: &deposits.count,
        keys,
        discs: &deposits.photons,
        levels,
        bounds,
        ranges: &records.range,
        records: &mut words,
        checks: &mut checks,
    };
    g.dispatch(HashPack, Grid::Threads(capacity), (), bind);
    let mut range = g.buffer("cell_range", 1);
    g.copy(&records.range, &mut range);
    PackedCells { records: Records { record: records.record, records: words, range }, checks }
}

/// Writes the gathered radiance of the listed slots: caustic, then other light.
pub fn hash(
    g: &mut Graph,
    program: Program,
    points: Points<'_>,
    (grid, deposits): (&HashGrid, &Deposits),
    gathered: &mut Buf<[f32; 4]>,
) {
    let (none, no_range) = (g.upload("no_records", &[0u32]), g.upload("no_range", &[RadiusRange::default()]));
    let (records, checks, ranges) = match &grid.packed {
        Some(packed) => (&packed.records.records, &packed.checks, &packed.records.range),
        None => (&*none, &*none, &*no_range),
    };
    let kernel = GatherHash {
        glossy: program.glossy,
        smooth_normals: program.smooth_normals,
        blinn_phong: program.blinn_phong,
        weight: program.weight.code(),
        count_pairs: program.count_pairs,
        step_limit: program.step_limit(),
        hash_bits: grid.hash_bits,
        walk_stride: program.walk.stride,
        walk_ratio: program.walk.ratio,
        record: grid.packed.as_ref().map_or(Record::Full, |p| p.records.record).code(),
    };
    let bind = GatherHashBindings {
        pass: points.pass,
        list: points.list,
        count: points.count,
        eye_hits: points.hits,
        lobes: points.lobes,
        bounds: &grid.bounds,
        levels: &grid.levels,
        in_use: &grid.in_use,
        table: &grid.table,
        ends: &grid.ends,
        photons: &grid.photons,
        records,
        checks,
        ranges,
        gathered,
    };
    g.dispatch(kernel, Grid::Indirect(points.args), GatherHashParams { mask: grid.table.len() - 1 }, bind);
    // Sorted photons give the same bits as the grid's full ones; of packed ones the deposits are the discs.
    let photons = if grid.packed.is_some() { &deposits.photons } else { &grid.photons };
    finish(g, program, points, (photons, &grid.count), gathered);
}
