//! Density estimation from lists of photons per tile of the image (Mara, Luebke and McGuire 2013, "Tiled").
//!
//! Tiles are known by what their eye hits span: a box in space, a range of depths, a window of the image. Photons are
//! counted into the tiles they reach, places follow from a scan, pairs of tile and photon are written photon by photon
//! and sorted by tile, which keeps their order. Tiles come in levels, each of twice the side of the one below, up to a
//! single tile; a photon goes to the lowest level where it needs at most [`MOST_TILES`]. So no list overflows, whatever
//! the photons, and memory is bounded: [`PHOTON_BYTES`] per photon and [`ENTRY_BYTES`] for each of its possible
//! entries. Records of 20 bytes are found by entry, like photons; those of 12 bytes are copied for each entry, relative
//! to its tile, as in the paper, and need [`RECORD_BYTES`] more for each.
//!
//! Only hits at their pixel's place in space belong here; those seen by way of mirrors and glass need another
//! estimator.

use super::{Band, Points, Program};
pub use crate::constants::MOST_TILES;
use crate::constants::{PIXEL_ROWS, TILE_VECTORS};
use crate::graph::{Buf, DeviceClass, DispatchArgs, Graph, Grid};
use crate::kernels::deposits::Deposits;
use crate::kernels::generated::{
    Aabb, Camera, EyeHit, GatherTiled, GatherTiledBindings, GatherTiledParams, Pass, Photon, RadiusRange, TiledBounds,
    TiledBoundsBindings, TiledBoundsParams, TiledCover, TiledCoverBindings, TiledCoverParams, TiledFill,
    TiledFillBindings, TiledFillParams, TiledLevels, TiledLevelsBindings, TiledLevelsParams, TiledMark,
    TiledMarkBindings, TiledPack, TiledPackBindings, TiledRanges, TiledRangesBindings,
};
use crate::kernels::records::{Record, Records};
use crate::kernels::{Items, scan, sort};

/// Bytes per stored photon beside the photon and its box: tiles, count, place, and whether any tile has it.
pub const PHOTON_BYTES: u32 = 8 + 4 + 4 + 4;

/// Bytes per entry while entries are sorted: tile and photon, twice.
pub const ENTRY_BYTES: u32 = 16;

/// Bytes per entry of a record of 12 bytes.
pub const RECORD_BYTES: u32 = 12;

/// Pixels along a side of the block of a workgroup.
const BLOCK: u32 = 8;

/// The tiles of a band.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Tiles {
    /// Logarithm of the side in pixels at the lowest level.
    shift: u32,
    /// Columns and rows of the lowest level.
    lowest: [u32; 2],
    /// First row of tiles, in the image.
    first_row: u32,
    /// Levels; the last one is a single tile.
    levels: u32,
}

impl Tiles {
    fn new(class: DeviceClass, band: Band<'_>) -> Self {
        // On a CPU as large as the block of a workgroup. A GPU sorts with ease what it saves there by fewer, larger
        // tiles.
        let shift = match class {
            DeviceClass::Cpu => 3,
            DeviceClass::Gpu => 4,
        };
        let [width, height] = band.size;
        let row_of = |pixel: u32| (pixel / (PIXEL_ROWS * width) * PIXEL_ROWS).min(height - 1);
        let first_row = row_of(band.first_pixel) >> shift;
        let last_line = (row_of(band.first_pixel + band.pixels - 1) + PIXEL_ROWS - 1).min(height - 1);
        let lowest = [((width - 1) >> shift) + 1, (last_line >> shift) + 1 - first_row];
        let levels = u32::BITS - (lowest[0].max(lowest[1]) - 1).leading_zeros() + 1;
        Self { shift, lowest, first_row, levels }
    }

    /// Tiles of all levels.
    fn count(&self) -> u32 {
        (0..self.levels).map(|level| self.lowest.map(|n| ((n - 1) >> level) + 1).iter().product::<u32>()).sum()
    }

    /// Workgroups of the gather.
    fn blocks(&self) -> [u32; 2] {
        self.lowest.map(|n| n << self.shift >> BLOCK.trailing_zeros())
    }
}

/// Photons by tile.
struct Lists {
    /// Photons, tile after tile.
    entries: Buf<u32>,
    /// Where the entries of each tile begin, and after the last tile where they end.
    begins: Buf<u32>,
    /// Number of entries.
    total: Buf<u32>,
    /// With records of 12 bytes, those of the entries: places, powers, looks.
    records: Option<[Buf<u32>; 3]>,
}

/// Writes the gathered radiance of the listed slots: caustic, then other light. All must lie at their pixel's place in
/// space, and so in the first slot of their pixel. With records ([`crate::kernels::records::pack`]) these are gathered.
/// Sets `touched` to 1 for every photon that is put into a tile, and returns the number of entries in all tiles.
///
/// # Panics
/// If `touched` is shorter than the deposits, or there is room for 2^27 deposits or more.
pub fn tiled(
    g: &mut Graph,
    program: Program,
    (points, band): (Points<'_>, Band<'_>),
    (deposits, packed, touched): (&Deposits, Option<&Records>, &mut Buf<u32>),
    gathered: &mut Buf<[f32; 4]>,
) -> Buf<u32> {
    assert!(touched.len() >= deposits.photons.len(), "a photon has no place for its mark");
    let tiles = Tiles::new(g.device_class(), band);
    let mut seen = g.buffer("tiled_seen", band.pixels);
    g.fill(&mut seen, 0);
    let bind = TiledMarkBindings { list: points.list, count: points.count, seen: &mut seen };
    g.dispatch(TiledMark, Grid::Indirect(points.args), (), bind);
    let (bounds, lists) = g.scope("tile lists", |g| {
        let (bounds, slack) = bounds(g, tiles, (points, band), &seen);
        let lists = bin(g, tiles, band, (&bounds, &slack), (deposits, packed, touched));
        (bounds, lists)
    });
    let stored = Stored { deposits, packed, bounds: &bounds, lists: &lists };
    let Points { pass, hits, lobes, .. } = points;
    let at = Pixels { camera: band.camera, pass, hits, lobes, seen: &seen, tiles };
    g.scope("tile gather", |g| gather(g, program, at, stored, gathered));
    lists.total
}

/// What the hits of each tile span, level by level, and how far hits lie outside of their tile [bits of a float,
/// pixels].
fn bounds(
    g: &mut Graph,
    tiles: Tiles,
    (points, band): (Points<'_>, Band<'_>),
    seen: &Buf<u32>,
) -> (Buf<[f32; 4]>, Buf<u32>) {
    let (mut bounds, mut slack) = (g.buffer("tile_bounds", TILE_VECTORS * tiles.count()), g.buffer("tile_slack", 1));
    g.fill(&mut slack, 0);
    let bind =
        TiledBoundsBindings { camera: band.camera, seen, eye_hits: points.hits, tiles: &mut bounds, slack: &mut slack };
    let params = TiledBoundsParams { lowest: tiles.lowest, first_row: tiles.first_row };
    g.dispatch(TiledBounds { tile_shift: tiles.shift }, Grid::Groups(tiles.lowest), params, bind);
    if tiles.levels > 1 {
        let params = TiledLevelsParams { lowest: tiles.lowest, levels: tiles.levels };
        g.dispatch(TiledLevels, Grid::Groups([1, 1]), params, TiledLevelsBindings { tiles: &mut bounds });
    }
    (bounds, slack)
}

/// Counts, scans, copies and sorts.
fn bin(
    g: &mut Graph,
    tiles: Tiles,
    band: Band<'_>,
    (bounds, slack): (&Buf<[f32; 4]>, &Buf<u32>),
    (deposits, packed, touched): (&Deposits, Option<&Records>, &mut Buf<u32>),
) -> Lists {
    let n = deposits.photons.len();
    let most = n.checked_mul(MOST_TILES).expect("fewer than 2^27 deposits").max(1);
    let (mut covers, mut counts, mut places) =
        (g.buffer("tile_covers", n), g.buffer("tile_counts", n), g.buffer("tile_places", n));
    let mut total = g.buffer("tile_entries", 1);
    let bind = TiledCoverBindings {
        camera: band.camera,
        photon_count: &deposits.count,
        photons: &deposits.photons,
        boxes: &deposits.boxes,
        tiles: bounds,
        slack,
        covers: &mut covers,
        counts: &mut counts,
        touched,
    };
    let params = TiledCoverParams { lowest: tiles.lowest, first_row: tiles.first_row, levels: tiles.levels };
    let record = packed.map_or(Record::Full, |p| p.record).code();
    g.dispatch(TiledCover { tile_shift: tiles.shift, record }, Grid::Threads(n), params, bind);
    scan::exclusive(g, Items::All, &counts, &mut places, &mut total);
    let (mut keys, mut entries) = (g.buffer("tile_keys", most), g.buffer("tile_list", most));
    let bind = TiledFillBindings { covers: &covers, places: &places, keys: &mut keys, entries: &mut entries };
    g.dispatch(TiledFill, Grid::Threads(n), TiledFillParams { lowest: tiles.lowest, photons: n }, bind);
    let bits = u32::BITS - (tiles.count() - 1).leading_zeros();
    let (keys, entries) = sort::pairs(g, Items::Counted(&total), keys, entries, bits);
    let tiles_and_end = tiles.count() + 1;
    let mut begins = g.buffer("tile_begins", tiles_and_end);
    let bind = TiledRangesBindings { keys: &keys, total: &total, begins: &mut begins };
    g.dispatch(TiledRanges, Grid::Threads(tiles_and_end), (), bind);
    let records = packed
        .filter(|records| records.record == Record::Packed12)
        .map(|records| entry_records(g, (&total, &keys, &entries), bounds, (deposits, records)));
    Lists { entries, begins, total, records }
}

/// Copies of the photons in the tiles, relative to these.
fn entry_records(
    g: &mut Graph,
    (total, keys, entries): (&Buf<u32>, &Buf<u32>, &Buf<u32>),
    tiles: &Buf<[f32; 4]>,
    (deposits, packed): (&Deposits, &Records),
) -> [Buf<u32>; 3] {
    let n = entries.len();
    let [mut places, mut powers, mut looks] =
        ["tile_record_places", "tile_record_powers", "tile_record_looks"].map(|name| g.buffer(name, n));
    let bind = TiledPackBindings {
        total,
        keys,
        entries,
        discs: &deposits.photons,
        tiles,
        ranges: &packed.range,
        places: &mut places,
        powers: &mut powers,
        looks: &mut looks,
    };
    g.dispatch(TiledPack, Grid::Threads(n), (), bind);
    [places, powers, looks]
}

/// The pixels that are gathered at.
struct Pixels<'a> {
    camera: &'a Buf<Camera>,
    pass: &'a Buf<Pass>,
    hits: &'a Buf<EyeHit>,
    lobes: &'a Buf<u32>,
    /// Per pixel of the band: 1 where its hit is listed.
    seen: &'a Buf<u32>,
    tiles: Tiles,
}

/// Photons, and the tiles that they are put into.
#[derive(Clone, Copy)]
struct Stored<'a> {
    deposits: &'a Deposits,
    packed: Option<&'a Records>,
    bounds: &'a Buf<[f32; 4]>,
    lists: &'a Lists,
}

fn gather(g: &mut Graph, program: Program, at: Pixels<'_>, stored: Stored<'_>, gathered: &mut Buf<[f32; 4]>) {
    let Pixels { camera, pass, hits, lobes, seen, tiles } = at;
    let Stored { deposits, packed, bounds, lists } = stored;
    let chunks = g.device_class() == DeviceClass::Gpu;
    let none = g.upload("no_records", &[0u32]);
    let (no_range, no_photons) = (g.upload("no_range", &[RadiusRange::default()]), no_photons(g));
    let no_boxes = g.upload("no_boxes", &[Aabb::default()]);
    let (places, powers, looks) = match (&lists.records, packed) {
        (Some([places, powers, looks]), _) => (places, powers, looks),
        (None, Some(packed)) => (&packed.records, &*none, &*none),
        (None, None) => (&*none, &*none, &*none),
    };
    // What is not looked at does not have to be kept.
    let photons = if packed.is_some() { &no_photons } else { &deposits.photons };
    let boxes = if lists.records.is_some() { &*no_boxes } else { &deposits.boxes };
    let entries = if lists.records.is_some() { &*none } else { &lists.entries };
    let kernel = || GatherTiled {
        glossy: program.glossy,
        smooth_normals: program.smooth_normals,
        blinn_phong: program.blinn_phong,
        weight: program.weight.code(),
        count_pairs: program.count_pairs,
        tile_shift: tiles.shift,
        chunks,
        walk_stride: program.walk.stride,
        walk_ratio: program.walk.ratio,
        record: packed.map_or(Record::Full, |p| p.record).code(),
    };
    let most = entries_per_dispatch(program);
    let blocks = tiles.blocks();
    let (mut more, mut unused) = (g.buffer::<DispatchArgs>("tile_more", 1), g.buffer("tile_no_more", 1));
    g.fill(&mut more, 0);
    // A photon is at most once in the lists that a pixel reads: in one level, and there in each tile once.
    for first in (0..deposits.photons.len().max(1)).step_by(most as usize) {
        let params = GatherTiledParams {
            lowest: tiles.lowest,
            first_row: tiles.first_row,
            levels: tiles.levels,
            first,
            most,
            stride: stride(blocks[1]),
        };
        let (grid, target) = match first {
            0 => (Grid::Groups(blocks), &mut more),
            _ => (Grid::Indirect(&more), &mut unused),
        };
        let bind = GatherTiledBindings {
            camera,
            pass,
            seen,
            eye_hits: hits,
            lobes,
            begins: &lists.begins,
            entries,
            photons,
            boxes,
            tiles: bounds,
            records: places,
            powers,
            looks,
            ranges: packed.map_or(&*no_range, |p| &p.range),
            gathered: &mut *gathered,
            more: target,
        };
        g.dispatch(kernel(), grid, params, bind);
    }
}

fn no_photons(g: &mut Graph) -> Buf<Photon> {
    let mut nothing = g.buffer("no_photons", 1);
    g.fill(&mut nothing, 0);
    nothing
}

/// Entries that a dispatch takes from the lists of a pixel: a quarter of what the driver runs, where it ends loops,
/// because there are loops around and inside of the counted one; elsewhere what no watchdog notices.
fn entries_per_dispatch(program: Program) -> u32 {
    program.loop_limit.map_or(1 << 18, |limit| (limit / 4).max(1))
}

/// A step with which all of `rows` are visited, far from the neighbours: near the golden section, without common
/// divisor.
fn stride(rows: u32) -> u32 {
    let coprime = |n: &u32| {
        let (mut a, mut b) = (*n, rows);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a == 1
    };
    let golden = (f64::from(rows) * 0.618) as u32;
    (golden.max(1)..=rows.max(1)).find(coprime).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strides_visit_every_row() {
        for rows in 1..200 {
            let mut rows_seen: Vec<u32> = (0..rows).map(|i| i * stride(rows) % rows).collect();
            rows_seen.sort_unstable();
            assert!(rows_seen.into_iter().eq(0..rows), "{rows} rows");
        }
    }

    /// Every pixel of a band is in a tile, and the top level is a single one.
    #[test]
    fn tiles_hold_the_band() {
        let mut g = Graph::new();
        let camera = g.buffer("camera", 1);
        for (size, first_pixel, pixels) in
            [([1, 1], 0, 1), ([320, 240], 0, 76_800), ([30, 21], 130, 77), ([7, 3], 20, 1), ([5000, 9], 44_000, 1000)]
        {
            for class in [DeviceClass::Cpu, DeviceClass::Gpu] {
                let tiles = Tiles::new(class, Band { camera: &camera, size, first_pixel, pixels });
                for pixel in first_pixel..first_pixel + pixels {
                    let strip = pixel / (PIXEL_ROWS * size[0]);
                    let rows = PIXEL_ROWS.min(size[1] - strip * PIXEL_ROWS);
                    let y = strip * PIXEL_ROWS + (pixel - strip * PIXEL_ROWS * size[0]) % rows;
                    let row = y >> tiles.shift;
                    assert!(row >= tiles.first_row && row - tiles.first_row < tiles.lowest[1], "{size:?}, {pixel}");
                }
                assert_eq!(tiles.lowest.map(|n| (n - 1) >> (tiles.levels - 1)), [0, 0], "{size:?}");
            }
        }
    }
}
