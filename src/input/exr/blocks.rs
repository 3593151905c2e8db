//! The blocks of a part, found through its table of offsets and unpacked one at a time.

use std::io::{Read, Seek, SeekFrom};

use ::exr::block::UncompressedBlock;
use ::exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates};
use ::exr::math::Vec2;
use ::exr::meta::attribute::SampleType;
use ::exr::prelude::f16;

use super::header::{Blocks, Part, damaged};
use super::{Reader, guarded};
use crate::input::Fault;

/// Some samples of one channel in one row.
pub struct Line<'a> {
    /// Index into [`Part::channels`].
    pub channel: usize,
    /// First column, from the left of the data window.
    pub x: u64,
    /// Row, from the top of the data window.
    pub y: u64,
    /// The samples from there to the right.
    pub samples: Samples<'a>,
}

/// Samples as bytes of this machine's order.
#[derive(Clone, Copy)]
pub enum Samples<'a> {
    /// Half floats.
    F16(&'a [u8]),
    /// Floats.
    F32(&'a [u8]),
    /// Unsigned integers.
    U32(&'a [u8]),
}

impl<'a> Samples<'a> {
    /// Their values as floats, integers rounded.
    pub fn floats(self) -> impl Iterator<Item = f32> + 'a {
        let size = if matches!(self, Self::F16(_)) { 2 } else { 4 };
        let (Self::F16(bytes) | Self::F32(bytes) | Self::U32(bytes)) = self;
        bytes.chunks_exact(size).map(move |sample| match (self, sample) {
            (Self::F16(_), &[a, b]) => f16::from_bits(u16::from_ne_bytes([a, b])).to_f32(),
            (Self::F32(_), &[a, b, c, d]) => f32::from_ne_bytes([a, b, c, d]),
            (_, &[a, b, c, d]) => u32::from_ne_bytes([a, b, c, d]) as f32,
            _ => 0.0,
        })
    }

    /// Their values as integers; `None` if they are floats.
    pub fn integers(self) -> Option<impl Iterator<Item = u32> + 'a> {
        let Self::U32(bytes) = self else { return None };
        Some(bytes.as_chunks::<4>().0.iter().map(|word| u32::from_ne_bytes(*word)))
    }
}

impl Part {
    /// Columns and rows of a block that is not at the border.
    pub(super) fn block_sides(&self) -> [u64; 2] {
        match self.blocks {
            Blocks::Rows(rows) => [self.data.size[0], rows],
            Blocks::Tiles(sides) => sides,
        }
    }

    /// Columns and rows of blocks.
    fn block_grid(&self) -> [u64; 2] {
        let sides = self.block_sides();
        [self.data.size[0].div_ceil(sides[0].max(1)), self.data.size[1].div_ceil(sides[1].max(1))]
    }

    /// Blocks of the largest level.
    pub(super) fn block_count(&self) -> u64 {
        let [columns, rows] = self.block_grid();
        columns * rows
    }
}

impl<R: Read + Seek> Reader<R> {
    /// Unpacks the part and passes on its lines: block by block in the order of the table, in each block row by row,
    /// in each row channel by channel.
    ///
    /// # Errors
    /// [`Fault::Io`] if it cannot be read, [`Fault::Content`] if it is damaged, deep or subsampled.
    pub fn lines(&mut self, part: usize, mut take: impl FnMut(Line<'_>)) -> Result<(), Fault> {
        let known = &self.layout.parts[part];
        if known.deep {
            return Err(Fault::Content("OpenEXR with deep pixels is not supported".into()));
        }
        if let Some(channel) = known.channels.iter().find(|channel| channel.subsampled) {
            let what = format!("OpenEXR with subsampled channels ('{}') is not supported", channel.name);
            return Err(Fault::Content(what));
        }
        let offsets = self.offsets(part)?;
        for (index, offset) in (0..).zip(offsets) {
            let chunk = self.chunk(part, index, offset)?;
            let meta = &self.meta;
            let block = guarded(|| UncompressedBlock::decompress_chunk(chunk, meta, false))?;
            let channels = &meta.headers[part].channels;
            for line in block.lines(channels) {
                let samples = match channels.list[line.location.channel].sample_type {
                    SampleType::F16 => Samples::F16(line.value),
                    SampleType::F32 => Samples::F32(line.value),
                    SampleType::U32 => Samples::U32(line.value),
                };
                let Vec2(x, y) = line.location.position;
                take(Line { channel: line.location.channel, x: x as u64, y: y as u64, samples });
            }
        }
        Ok(())
    }

    /// Where the blocks of the largest level of a part begin: row by row, in a row from the left.
    fn offsets(&mut self, part: usize) -> Result<Vec<u64>, Fault> {
        let parts = &self.layout.parts;
        let count = parts[part].block_count();
        // A file with one part need not say how many entries its table has.
        let before: u64 = parts[..part].iter().map(|part| part.chunk_count).sum();
        let start = self.layout.tables + 8 * before;
        if start.saturating_add(8 * count) > self.length {
            return Err(damaged("the table of its blocks is cut"));
        }
        self.source.seek(SeekFrom::Start(start))?;
        let mut table = vec![0; 8 * count as usize];
        self.source.read_exact(&mut table)?;
        Ok(table.as_chunks::<8>().0.iter().map(|entry| u64::from_le_bytes(*entry)).collect())
    }

    fn int(&mut self) -> Result<i32, Fault> {
        let mut bytes = [0; 4];
        self.source.read_exact(&mut bytes)?;
        Ok(i32::from_le_bytes(bytes))
    }

    /// The packed block at `offset`, which has to be the one of this index.
    fn chunk(&mut self, part: usize, index: u64, offset: u64) -> Result<Chunk, Fault> {
        self.source.seek(SeekFrom::Start(offset))?;
        if self.layout.multipart && self.int()? != part as i32 {
            return Err(damaged("a block belongs to another part"));
        }
        let known = &self.layout.parts[part];
        let [columns, _] = known.block_grid();
        let [column, row] = [index % columns, index / columns];
        let y = known.data.min[1] + (row * known.block_sides()[1]) as i64;
        let tiles = matches!(known.blocks, Blocks::Tiles(_));
        let expected = if tiles { vec![column as i64, row as i64, 0, 0] } else { vec![y] };
        for place in expected {
            if i64::from(self.int()?) != place {
                return Err(damaged("a block is not where the table says"));
            }
        }
        let bytes = self.packed()?;
        check_dwa(&self.layout.parts[part], &bytes)?;
        let compressed_block = match tiles {
            true => CompressedBlock::Tile(CompressedTileBlock {
                coordinates: TileCoordinates {
                    tile_index: Vec2(column as usize, row as usize),
                    level_index: Vec2(0, 0),
                },
                compressed_pixels_le: bytes,
            }),
            false => CompressedBlock::ScanLine(CompressedScanLineBlock {
                y_coordinate: y as i32,
                compressed_pixels_le: bytes,
            }),
        };
        Ok(Chunk { layer_index: part, compressed_block })
    }

    /// Bytes with their count before them.
    fn packed(&mut self) -> Result<Vec<u8>, Fault> {
        let size = u64::try_from(self.int()?).ok().filter(|size| *size <= self.length);
        let size = size.ok_or_else(|| damaged("a block goes beyond the file"))?;
        let mut bytes = vec![0; size as usize];
        self.source.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

/// Refuses a DWA block whose counters go beyond what its pixels can need: the decoder allocates what they say
/// (OpenEXR, `internal_dwa_compressor.h`: eleven 64-bit counters before everything else).
fn check_dwa(part: &Part, block: &[u8]) -> Result<(), Fault> {
    const DWA: [u8; 2] = [8, 9];
    let sides = part.block_sides();
    let [width, height] = [sides[0].min(part.data.size[0]), sides[1].min(part.data.size[1])];
    let pixel_bytes: u64 = part.channels.iter().map(|channel| channel.bytes).sum();
    let (counters, _) = block.as_chunks::<8>();
    // A block of that size is stored as it is.
    let raw = width * height * pixel_bytes;
    if !DWA.contains(&part.compression) || block.len() as u64 == raw || counters.len() < 11 {
        return Ok(());
    }
    let squares = width.div_ceil(8) * height.div_ceil(8) * part.channels.len() as u64;
    // Uncompressed bytes of other channels, run lengths unpacked by deflate and unpacked wholly, coefficients of the
    // transform (63 of 64, and an end, for each square), means (one for each square).
    let most = [(1, raw), (6, 2 * raw + 64), (7, raw), (8, 65 * squares), (9, squares)];
    match most.iter().all(|&(at, most)| u64::from_le_bytes(counters[at]) <= most) {
        true => Ok(()),
        false => Err(damaged("a block announces more than its pixels need")),
    }
}
