//! Small files that ask for much, made here: headers that lie, and pictures of one colour that pack into almost
//! nothing.

use std::io::Cursor;

use exr::math::Vec2;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder,
    WritableImage, f16,
};

/// A file, and whether every way of reading has to refuse it.
pub struct Bomb {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    pub refused: bool,
}

/// An OpenEXR file by hand.
struct Header {
    size: [i32; 2],
    display: [i32; 2],
    channels: Vec<(String, i32)>,
    compression: u8,
    tiles: Option<[u32; 2]>,
    further: Vec<(&'static str, &'static str, Vec<u8>)>,
    table: Vec<u64>,
}

impl Default for Header {
    fn default() -> Self {
        let channels = ["B", "G", "R"].map(|name| (name.to_owned(), HALF)).to_vec();
        let (size, display) = ([64, 32], [64, 32]);
        Self { size, display, channels, compression: 3, tiles: None, further: vec![], table: vec![0; 1000] }
    }
}

/// Codes of sample types.
const UINT: i32 = 0;
const HALF: i32 = 1;

impl Header {
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0x76, 0x2f, 0x31, 0x01, 2, if self.tiles.is_some() { 2 } else { 0 }, 0, 0];
        let mut attribute = |name: &str, kind: &str, value: &[u8]| {
            bytes.extend([name.as_bytes(), b"\0", kind.as_bytes(), b"\0"].concat());
            bytes.extend((value.len() as i32).to_le_bytes());
            bytes.extend(value);
        };
        let mut channels = Vec::new();
        for (name, kind) in &self.channels {
            channels.extend([name.as_bytes(), b"\0", &kind.to_le_bytes(), &[0; 4]].concat());
            channels.extend([1_i32, 1].map(i32::to_le_bytes).concat());
        }
        channels.push(0);
        let window = |[width, height]: [i32; 2]| [0, 0, width - 1, height - 1].map(i32::to_le_bytes).concat();
        attribute("channels", "chlist", &channels);
        attribute("compression", "compression", &[self.compression]);
        attribute("dataWindow", "box2i", &window(self.size));
        attribute("displayWindow", "box2i", &window(self.display));
        attribute("lineOrder", "lineOrder", &[0]);
        attribute("pixelAspectRatio", "float", &1_f32.to_le_bytes());
        attribute("screenWindowCenter", "v2f", &[0; 8]);
        attribute("screenWindowWidth", "float", &1_f32.to_le_bytes());
        if let Some(sides) = self.tiles {
            attribute("tiles", "tiledesc", &[sides.map(u32::to_le_bytes).concat(), vec![0]].concat());
        }
        for (name, kind, value) in &self.further {
            attribute(name, kind, value);
        }
        bytes.push(0);
        bytes.extend(self.table.iter().flat_map(|entry| entry.to_le_bytes()));
        bytes
    }
}

/// A picture of one colour in three halves, packed by the crate.
fn plain(side: usize, compression: Compression, blocks: Blocks) -> Vec<u8> {
    let channel = |name: &str| AnyChannel::new(name, FlatSamples::F16(vec![f16::ONE; side * side / 2]));
    let channels = AnyChannels::sort(["R", "G", "B"].map(channel).into_iter().collect());
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let mut bytes = Cursor::new(Vec::new());
    let layer = Layer::new((side, side / 2), LayerAttributes::default(), encoding, channels);
    Image::from_layer(layer).write().to_buffered(&mut bytes).expect("in memory");
    bytes.into_inner()
}

/// The description of a film with these passes, as an attribute.
fn film(size: [i32; 2], passes: &str, channels: Vec<(String, i32)>) -> Vec<u8> {
    let json = format!(
        r#"{{"format":1,"passes":"{passes}","exponents":[0,0],"rejected":0,"layers":false,
        "identity":{{"scene":"","settings":[]}},"devices":[],
        "totals":{{"seconds":0.0,"repeated":0,"photons":0,"deposits":0,"photons_truncated":0,
        "eye_paths_truncated":0,"pairs":[0,0],"counters":{{}},"structure":{{}}}},"sums":""}}"#
    );
    let further = vec![("nephroid.film", "string", json.into_bytes())];
    Header { size, display: size, channels, further, table: vec![0; 5000], ..Header::default() }.bytes()
}

/// The channels of a film's sums.
fn sums() -> Vec<(String, i32)> {
    let names = ["value", "square", "scaled"].into_iter().flat_map(|sum| ["R", "G", "B"].map(|c| format!("{sum}.{c}")));
    names.flat_map(|name| (0..4).map(move |word| (format!("film.{name}.{word}"), UINT))).collect()
}

fn radiance(header: &str, pixels: &[u8]) -> Vec<u8> {
    [format!("#?RADIANCE\n{header}").as_bytes(), pixels].concat()
}

pub fn all() -> Vec<Bomb> {
    [headers(), plain_pictures(), films(), hdrs()].into_iter().flatten().collect()
}

/// Headers that announce what is not there.
fn headers() -> Vec<Bomb> {
    let refused = |name, header: Header| Bomb { name, bytes: header.bytes(), refused: true };
    let many = |count: usize| (0..count).map(|at| (format!("c{at:06}.Z"), HALF)).collect();
    let attributes = |count: usize| vec![("a", "b", vec![]); count];
    vec![
        refused("the largest window", Header { size: [i32::MAX; 2], ..Header::default() }),
        refused(
            "one tile of gigabytes",
            Header { size: [32768, 32768], tiles: Some([32768, 32768]), ..Header::default() },
        ),
        refused("tiles beyond any size", Header { tiles: Some([u32::MAX, u32::MAX]), ..Header::default() }),
        refused("tiles without size", Header { tiles: Some([0, 0]), ..Header::default() }),
        refused("a small window in a large tile", Header { tiles: Some([1 << 30, 1 << 30]), ..Header::default() }),
        refused("tiles of one pixel", Header { size: [16384, 16384], tiles: Some([1, 1]), ..Header::default() }),
        refused("DWA over a large window", Header { size: [16384, 8192], compression: 9, ..Header::default() }),
        refused("PIZ over a large window", Header { size: [16384, 16384], compression: 4, ..Header::default() }),
        refused("4000 channels", Header { size: [16384, 64], channels: many(4000), ..Header::default() }),
        refused("100,000 channels", Header { channels: many(100_000), ..Header::default() }),
        refused("100,000 attributes", Header { further: attributes(100_000), ..Header::default() }),
        refused("an unknown compression", Header { compression: 10, ..Header::default() }),
    ]
}

/// Whole pictures of one colour: read, reduced or refused.
fn plain_pictures() -> Vec<Bomb> {
    let tiles = Blocks::Tiles(Vec2(64, 64));
    let read = |name, bytes| Bomb { name, bytes, refused: false };
    vec![
        read("white in ZIP", plain(8192, Compression::ZIP16, Blocks::ScanLines)),
        read("white in run lengths", plain(4096, Compression::RLE, Blocks::ScanLines)),
        read("white in PIZ", plain(8192, Compression::PIZ, Blocks::ScanLines)),
        read("white in small PIZ tiles", plain(4096, Compression::PIZ, tiles)),
        read("white in DWA", plain(4096, Compression::DWAB(None), Blocks::ScanLines)),
        read("a small window on a large sphere", shown_at([16384, 16384])),
    ]
}

/// A small picture in a display window of this size.
fn shown_at(display: [i32; 2]) -> Vec<u8> {
    let mut bytes = plain(64, Compression::ZIP16, Blocks::ScanLines);
    let key = b"displayWindow\0box2i\0";
    let at = bytes.windows(key.len()).position(|window| window == key).expect("a display window") + key.len() + 12;
    bytes[at..at + 8].copy_from_slice(&display.map(|side| (side - 1).to_le_bytes()).concat());
    bytes
}

fn films() -> Vec<Bomb> {
    let refused = |name, bytes| Bomb { name, bytes, refused: true };
    vec![
        refused("a film without its channels", film([8192, 8192], "0..1", Header::default().channels)),
        refused("a film of gigabytes", film([16384, 16384], "0..1", sums())),
        refused("a film that is too large for its file", film([2048, 2048], "0..1", sums())),
        refused("a film of 2^64 passes", film([8, 8], &format!("0..{}", u64::MAX), sums())),
        refused("a film of 2^64 passes in two", film([8, 8], &format!("0..1,{}..{}", u64::MAX - 1, u64::MAX), sums())),
        refused("a film of 2^32 passes", film([8, 8], "0..4294967296", sums())),
    ]
}

fn hdrs() -> Vec<Bomb> {
    let size = "\n-Y 16384 +X 16384\n";
    // A pixel and a run of 255 x 256^3 of it, for each row.
    let row = b"\x80\x80\x80\x80\x01\x01\x01\xff\x01\x01\x01\xff\x01\x01\x01\xff";
    let bomb = |name, bytes, refused| Bomb { name, bytes, refused };
    vec![
        bomb("rows of runs", radiance(size, &row.repeat(16384)), false),
        bomb("a size without pixels", radiance(size, b""), true),
        bomb("a size beyond any picture", radiance("\n-Y 4000000000 +X 4000000000\n", b""), true),
        bomb("a header without an end", radiance(&"EXPOSURE=1\n".repeat(200_000), b""), true),
        bomb("a line without an end", radiance(&"x".repeat(2 << 20), b""), true),
        bomb("a header of faults", radiance(&"EXPOSURE=x\n".repeat(9_000), b""), true),
    ]
}
