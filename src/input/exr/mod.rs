//! OpenEXR files block by block: our own reader of headers decides what is decoded, the crate `exr` unpacks blocks.
//!
//! The crate trusts sizes in the file (an aborted allocation cannot be caught), so each is checked here first, also
//! those within a block. Only the largest level of a tiled part is read; deep parts are not.

mod blocks;
mod header;

use std::cell::Cell;
use std::io::{Read, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

use ::exr::meta::{BlockDescription, MetaData};

pub use self::blocks::{Line, Samples};
pub use self::header::{Blocks, Channel, Part, Window};
use self::header::{Layout, damaged};
use super::Fault;

/// The first bytes of an OpenEXR file.
pub const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Columns and rows of a picture, and of a tile.
const MOST_SIDE: u64 = 1 << 20;

/// Bytes of all samples that a small file may announce; some compressions store a plain picture in almost nothing.
const SAMPLE_BYTES: u64 = 256 << 20;

/// Bytes of samples for each byte of a larger file: what deflate can do at best.
const GREATEST_RATIO: u64 = 1032;

/// Bytes of one unpacked block; decoders need it several times over.
const BLOCK_BYTES: u64 = 24 << 20;

/// An OpenEXR file whose header has been read and checked.
pub struct Reader<R> {
    source: R,
    length: u64,
    layout: Layout,
    meta: MetaData,
}

impl<R: Read + Seek> Reader<R> {
    /// Reads the header of a file of `length` bytes.
    ///
    /// # Errors
    /// [`Fault::Io`] if it cannot be read, [`Fault::Content`] if it is damaged, not supported, or announces more than
    /// a file of its length can account for.
    pub fn new(mut source: R, length: u64) -> Result<Self, Fault> {
        let layout = Layout::read(&mut source, length)?;
        layout.parts.iter().filter(|part| !part.deep).try_for_each(|part| check(part, length))?;
        source.rewind()?;
        // As a trait object: the crate would otherwise be compiled once for each kind of source.
        let meta = guarded(|| MetaData::read_from_buffered(&mut source as &mut dyn Read, false))?;
        let agrees = meta.headers.len() == layout.parts.len()
            && layout.parts.iter().zip(&meta.headers).all(|(part, header)| part.deep || agree(part, header));
        if !agrees {
            return Err(damaged("its header says two things"));
        }
        Ok(Self { source, length, layout, meta })
    }

    /// The parts of the file, at least one.
    pub fn parts(&self) -> &[Part] {
        &self.layout.parts
    }

    /// The part's header as the crate reads it, for attributes.
    pub fn header(&self, part: usize) -> &::exr::meta::header::Header {
        &self.meta.headers[part]
    }
}

/// Whether the crate understands a header as we do: what is checked has to be what is decoded.
fn agree(part: &Part, header: &::exr::meta::header::Header) -> bool {
    let sides = |sides: ::exr::math::Vec2<usize>| [sides.x() as u64, sides.y() as u64];
    let bytes: Vec<u64> = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() as u64).collect();
    let blocks = match header.blocks {
        BlockDescription::ScanLines => Blocks::Rows(header.compression.scan_lines_per_block() as u64),
        BlockDescription::Tiles(tiles) => Blocks::Tiles(sides(tiles.tile_size)),
    };
    let corner = header.own_attributes.layer_position;
    !header.deep
        && sides(header.layer_size) == part.data.size
        && [corner.x(), corner.y()].map(i64::from) == part.data.min
        && bytes.iter().eq(part.channels.iter().map(|channel| &channel.bytes))
        && blocks == part.blocks
}

/// Refuses sizes that a file of `length` bytes cannot account for.
fn check(part: &Part, length: u64) -> Result<(), Fault> {
    let [width, height] = part.data.size;
    let pixel_bytes: u64 = part.channels.iter().map(|channel| channel.bytes).sum();
    let most = SAMPLE_BYTES.saturating_add(length.saturating_mul(GREATEST_RATIO));
    let within = width <= MOST_SIDE && height <= MOST_SIDE && width * height <= most / pixel_bytes;
    if !within {
        let count = part.channels.len();
        let what = format!("{width} x {height} pixels of {count} channels announced");
        return Err(Fault::Content(format!("{what}, but the file has only {length} bytes")));
    }
    let [columns, rows] = part.block_sides();
    if columns == 0 || rows == 0 || columns > MOST_SIDE || rows > MOST_SIDE {
        return Err(damaged(&format!("tiles of {columns} x {rows} pixels")));
    }
    let block = columns.min(width) * rows.min(height) * pixel_bytes;
    if block > BLOCK_BYTES + 3 * length {
        let what = format!("blocks of {block} bytes announced, but the file has only {length} bytes");
        return Err(Fault::Content(what));
    }
    check_count(part, length)
}

/// Refuses more blocks than the file has room for. Two decoders set up large tables for each.
fn check_count(part: &Part, length: u64) -> Result<(), Fault> {
    /// PIZ and both kinds of DWA.
    const WITH_TABLES: [u8; 3] = [4, 8, 9];
    let count = part.block_count();
    let most = if WITH_TABLES.contains(&part.compression) { (1 << 14) + length / 512 } else { length / 8 };
    if count > most.min(length / 8) {
        let what = format!("{count} blocks announced, but the file has only {length} bytes");
        return Err(Fault::Content(what));
    }
    Ok(())
}

/// Runs the decoder and turns its errors and panics into ours. It is safe code that checks most of what it reads, but
/// indexes and subtracts with sizes from the file in places, so that damaged input can make it panic. A panic leaves
/// nothing behind but the reader and the picture, and both are dropped then.
fn guarded<T>(decode: impl FnOnce() -> ::exr::error::Result<T>) -> Result<T, Fault> {
    thread_local!(static DECODING: Cell<bool> = const { Cell::new(false) });
    static QUIET: Once = Once::new();
    // The default hook would print to stderr, which a library must not do; other threads keep theirs.
    QUIET.call_once(|| {
        let previous = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !DECODING.get() {
                previous(info);
            }
        }));
    });
    DECODING.set(true);
    let result = catch_unwind(AssertUnwindSafe(decode));
    DECODING.set(false);
    match result {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(::exr::error::Error::Io(source))) => Err(Fault::Io(source)),
        Ok(Err(cause)) => Err(damaged(&cause.to_string())),
        Err(_) => Err(damaged("its sizes contradict each other")),
    }
}

#[cfg(test)]
mod tests;
