//! The header of an OpenEXR file, read before any decoder sees the file (OpenEXR documentation, "File Layout").
//!
//! Only what sizes follow from is kept. Nothing is allocated here beyond the names of channels and parts.

use std::io::{Read, Seek, SeekFrom};

use crate::input::Fault;

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Window {
    /// First column and row.
    pub min: [i64; 2],
    /// Columns and rows, each at least 1.
    pub size: [u64; 2],
}

impl Window {
    /// Number of pixels.
    pub fn area(&self) -> u64 {
        self.size[0].saturating_mul(self.size[1])
    }
}

/// A channel of a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// Full name, such as `R` or `albedo.R`; bytes that are not UTF-8 are replaced.
    pub name: String,
    /// Bytes per sample: 2 for halves, 4 for floats and unsigned integers.
    pub bytes: u64,
    /// Unsigned integers, not floats.
    pub integers: bool,
    /// Samples only at every so many columns or rows.
    pub subsampled: bool,
}

/// How the pixels of a part are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blocks {
    /// Blocks of so many whole rows.
    Rows(u64),
    /// Tiles of so many columns and rows.
    Tiles([u64; 2]),
}

/// One part of a file: pictures of their own, often called layers.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name, empty where it has none.
    pub name: String,
    /// The channels in the order of the file.
    pub channels: Vec<Channel>,
    /// Where there are pixels.
    pub data: Window,
    /// What is to be seen.
    pub display: Window,
    /// Red, green, blue and white as CIE x and y, where the file says so.
    pub chromaticities: Option<[f32; 8]>,
    /// How pixels are stored.
    pub blocks: Blocks,
    /// Code of the compression.
    pub(super) compression: u8,
    /// More than one sample per pixel: not read here.
    pub deep: bool,
    /// Entries in the part's table of offsets; 0 where the header does not say.
    pub(super) chunk_count: u64,
}

/// The parts of a file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub parts: Vec<Part>,
    /// Chunks begin with the number of their part.
    pub multipart: bool,
    /// Where the tables of offsets begin.
    pub tables: u64,
}

/// Single part, stored in tiles.
const TILED: u32 = 0x200;
/// Single part with deep data.
const DEEP: u32 = 0x800;
const MULTIPART: u32 = 0x1000;

/// Parts of a file; renderers write a few dozen at most.
const MOST_PARTS: usize = 4096;
/// Channels of a part, and attributes. The crate keeps far more bytes for each than the file needs.
const MOST_CHANNELS: usize = 4096;
const MOST_ATTRIBUTES: usize = 1 << 16;

impl Layout {
    /// Reads the header of a file of `length` bytes.
    pub fn read(source: &mut (impl Read + Seek), length: u64) -> Result<Self, Fault> {
        source.rewind()?;
        let mut input = Input { source, left: length };
        if length < 4 || input.array::<4>()? != super::MAGIC {
            return Err(Fault::Content("OpenEXR file expected, it begins as something else".into()));
        }
        let version = u32::from_le_bytes(input.array()?);
        if version & 0xff != 2 {
            return Err(Fault::Content(format!("OpenEXR of version {} is not supported", version & 0xff)));
        }
        let multipart = version & MULTIPART != 0;
        let mut parts = Vec::new();
        while let Some(header) = Header::read(&mut input)? {
            parts.push(header.part(version)?);
            if !multipart {
                break;
            }
            if parts.len() > MOST_PARTS {
                return Err(damaged("more than 4096 parts"));
            }
        }
        if parts.is_empty() {
            return Err(damaged("no picture"));
        }
        Ok(Self { parts, multipart, tables: length - input.left })
    }
}

pub(super) fn damaged(what: &str) -> Fault {
    Fault::Content(format!("OpenEXR file damaged: {what}"))
}

/// Bytes that are counted, so that no size goes beyond the end of the file.
struct Input<'a, R> {
    source: &'a mut R,
    left: u64,
}

impl<R: Read + Seek> Input<'_, R> {
    fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let mut bytes = [0; N];
        self.source.read_exact(&mut bytes)?;
        self.left = self.left.saturating_sub(N as u64);
        Ok(bytes)
    }

    fn int(&mut self) -> Result<i32, Fault> {
        self.array().map(i32::from_le_bytes)
    }

    /// A name that ends with a zero byte.
    fn name(&mut self) -> Result<String, Fault> {
        let mut bytes = Vec::new();
        loop {
            match self.array()? {
                [0] => return Ok(String::from_utf8_lossy(&bytes).into_owned()),
                [byte] if bytes.len() < 255 => bytes.push(byte),
                _ => return Err(damaged("a name of more than 255 bytes")),
            }
        }
    }

    fn text(&mut self, bytes: u64) -> Result<String, Fault> {
        let mut text = Vec::new();
        (&mut *self.source).take(bytes).read_to_end(&mut text)?;
        self.left = self.left.saturating_sub(text.len() as u64);
        Ok(String::from_utf8_lossy(&text).into_owned())
    }

    /// Goes to where `left` bytes are left.
    fn go_to(&mut self, left: u64) -> Result<(), Fault> {
        let ahead = self.left.checked_sub(left).ok_or_else(|| damaged("an attribute is longer than it says"))?;
        self.source.seek(SeekFrom::Current(ahead as i64))?;
        self.left = left;
        Ok(())
    }

    fn window(&mut self) -> Result<Window, Fault> {
        let [x0, y0, x1, y1] = [self.int()?, self.int()?, self.int()?, self.int()?].map(i64::from);
        let side = |from: i64, to: i64| u64::try_from(to - from + 1).ok().filter(|side| *side > 0);
        match (side(x0, x1), side(y0, y1)) {
            (Some(width), Some(height)) => Ok(Window { min: [x0, y0], size: [width, height] }),
            _ => Err(damaged("a window without pixels")),
        }
    }

    /// A list of channels that ends where `end` bytes are left.
    fn channels(&mut self, end: u64) -> Result<Vec<Channel>, Fault> {
        let mut channels = Vec::new();
        while self.left > end {
            let name = self.name()?;
            if name.is_empty() {
                return Ok(channels);
            }
            let (bytes, integers) = match self.int()? {
                0 => (4, true),
                1 => (2, false),
                2 => (4, false),
                kind => return Err(damaged(&format!("channels of type {kind}"))),
            };
            let _linear: [u8; 4] = self.array()?;
            let steps = [self.int()?, self.int()?];
            if channels.len() == MOST_CHANNELS {
                return Err(damaged("more than 4096 channels"));
            }
            channels.push(Channel { name, bytes, integers, subsampled: steps != [1, 1] });
        }
        Err(damaged("the list of channels has no end"))
    }
}

/// The attributes of one part that matter.
#[derive(Default)]
struct Header {
    name: String,
    kind: Option<String>,
    channels: Option<Vec<Channel>>,
    data: Option<Window>,
    display: Option<Window>,
    chromaticities: Option<[f32; 8]>,
    compression: Option<u8>,
    tiles: Option<[u64; 2]>,
    chunk_count: u64,
}

impl Header {
    /// The next header; `None` where the list of them ends.
    fn read<R: Read + Seek>(input: &mut Input<'_, R>) -> Result<Option<Self>, Fault> {
        let mut header = Self::default();
        for count in 0..MOST_ATTRIBUTES {
            let name = input.name()?;
            if name.is_empty() {
                return Ok((count > 0).then_some(header));
            }
            let kind = input.name()?;
            let size = u64::try_from(input.int()?).map_err(|_| damaged("an attribute of negative size"))?;
            let end = input.left.checked_sub(size).ok_or_else(|| damaged("an attribute goes beyond the file"))?;
            header.take((&name, &kind), input, end)?;
            input.go_to(end)?;
        }
        Err(damaged("more than 65536 attributes"))
    }

    fn take<R: Read + Seek>(
        &mut self,
        (name, kind): (&str, &str),
        input: &mut Input<'_, R>,
        end: u64,
    ) -> Result<(), Fault> {
        match (name, kind) {
            ("name", "string") => self.name = input.text((input.left - end).min(1024))?,
            ("type", "string") => self.kind = Some(input.text((input.left - end).min(64))?),
            ("channels", "chlist") => self.channels = Some(input.channels(end)?),
            ("dataWindow", "box2i") => self.data = Some(input.window()?),
            ("displayWindow", "box2i") => self.display = Some(input.window()?),
            ("compression", "compression") => self.compression = Some(input.array::<1>()?[0]),
            ("chunkCount", "int") => self.chunk_count = u64::try_from(input.int()?).unwrap_or(0),
            ("chromaticities", "chromaticities") => {
                let mut numbers = [0.0; 8];
                for number in &mut numbers {
                    *number = f32::from_le_bytes(input.array()?);
                }
                self.chromaticities = Some(numbers);
            }
            ("tiles", "tiledesc") => {
                let sides = [input.array()?, input.array()?].map(u32::from_le_bytes);
                self.tiles = Some(sides.map(u64::from));
            }
            _ => {}
        }
        Ok(())
    }

    fn part(self, version: u32) -> Result<Part, Fault> {
        let missing = |what: &str| damaged(&format!("no {what}"));
        let compression = self.compression.ok_or_else(|| missing("compression"))?;
        let data = self.data.ok_or_else(|| missing("data window"))?;
        let kind = self.kind.as_deref();
        let tiled = if version & MULTIPART != 0 { kind == Some("tiledimage") } else { version & TILED != 0 };
        let blocks = match tiled {
            true => Blocks::Tiles(self.tiles.ok_or_else(|| missing("size of tiles"))?),
            false => Blocks::Rows(rows_of_a_block(compression)?),
        };
        Ok(Part {
            deep: version & DEEP != 0 || kind.is_some_and(|kind| kind.starts_with("deep")),
            channels: self.channels.filter(|c| !c.is_empty()).ok_or_else(|| missing("channels"))?,
            name: self.name,
            data,
            display: self.display.unwrap_or(data),
            chromaticities: self.chromaticities,
            blocks,
            compression,
            chunk_count: self.chunk_count,
        })
    }
}

/// Rows that a compression packs together.
fn rows_of_a_block(compression: u8) -> Result<u64, Fault> {
    match compression {
        0..=2 => Ok(1),
        3 | 5 => Ok(16),
        4 | 6..=8 => Ok(32),
        9 => Ok(256),
        code => Err(Fault::Content(format!("OpenEXR compression {code} is not supported"))),
    }
}
