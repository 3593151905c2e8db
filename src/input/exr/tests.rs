//! Files of the crate, whole and with sizes changed by hand.

use super::*;
use ::exr::math::Vec2;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks as Stored, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, WritableImage, f16,
};
use std::io::Cursor;

const SIZE: [usize; 2] = [37, 21];

/// A picture with a channel of each kind. The value of a sample is a number below 2^11 that tells its place.
fn encoded(compression: Compression, blocks: Stored, line_order: LineOrder) -> Vec<u8> {
    let places = || (0..SIZE[0] * SIZE[1]).map(|at| at as u32);
    let channels = vec![
        AnyChannel::new("H", FlatSamples::F16(places().map(|at| f16::from_f32(at as f32)).collect())),
        AnyChannel::new("F", FlatSamples::F32(places().map(|at| -(at as f32)).collect())),
        AnyChannel::new("U", FlatSamples::U32(places().map(|at| u32::MAX - at).collect())),
    ];
    let encoding = Encoding { compression, blocks, line_order };
    let attributes = LayerAttributes { layer_position: Vec2(-5, 7), ..LayerAttributes::named("x") };
    let mut bytes = Cursor::new(Vec::new());
    let layer = Layer::new((SIZE[0], SIZE[1]), attributes, encoding, AnyChannels::sort(channels.into_iter().collect()));
    Image::from_layer(layer).write().to_buffered(&mut bytes).expect("in memory");
    bytes.into_inner()
}

fn open(bytes: &[u8]) -> Result<Reader<Cursor<&[u8]>>, Fault> {
    Reader::new(Cursor::new(bytes), bytes.len() as u64)
}

/// Reads everything: the number of samples, or why it is refused.
fn read(bytes: &[u8]) -> Result<usize, Fault> {
    let mut count = 0;
    let mut file = open(bytes)?;
    for part in 0..file.parts().len() {
        file.lines(part, |line| count += line.samples.floats().count())?;
    }
    Ok(count)
}

fn zip() -> Vec<u8> {
    encoded(Compression::ZIP16, Stored::ScanLines, LineOrder::Increasing)
}

/// The place of an attribute's value.
fn value_at(bytes: &[u8], name_and_type: &[u8]) -> usize {
    bytes.windows(name_and_type.len()).position(|w| w == name_and_type).expect("attribute") + name_and_type.len() + 4
}

fn patched(mut bytes: Vec<u8>, name_and_type: &[u8], offset: usize, new: &[u8]) -> Vec<u8> {
    let at = value_at(&bytes, name_and_type) + offset;
    bytes[at..at + new.len()].copy_from_slice(new);
    bytes
}

fn message(bytes: &[u8]) -> String {
    read(bytes).expect_err("refused").to_string()
}

#[test]
fn every_compression_and_order_gives_every_sample_once() {
    use Compression::{PIZ, RLE, Uncompressed, ZIP1, ZIP16};
    let tiles = Stored::Tiles(Vec2(8, 16));
    for (compression, blocks, order) in [Uncompressed, RLE, ZIP1, ZIP16, PIZ]
        .into_iter()
        .flat_map(|c| [(c, Stored::ScanLines, LineOrder::Increasing), (c, tiles, LineOrder::Increasing)])
        .chain([(ZIP16, Stored::ScanLines, LineOrder::Decreasing), (ZIP16, tiles, LineOrder::Decreasing)])
    {
        let bytes = encoded(compression, blocks, order);
        let mut file = open(&bytes).expect("a whole file");
        assert_eq!(file.parts()[0].data, Window { min: [-5, 7], size: [37, 21] });
        let names: Vec<String> = file.parts()[0].channels.iter().map(|c| c.name.clone()).collect();
        assert_eq!(names.concat(), "FHU");
        let mut seen = vec![[0; 3]; SIZE[0] * SIZE[1]];
        let samples = |line: Line<'_>| {
            let first = line.y as usize * SIZE[0] + line.x as usize;
            match line.samples.integers() {
                Some(words) => (first..).zip(words).for_each(|(at, word)| {
                    seen[at][2] += i32::from(word == u32::MAX - at as u32);
                }),
                None => (first..).zip(line.samples.floats()).for_each(|(at, value)| {
                    seen[at][line.channel] += i32::from(value.abs() == at as f32);
                }),
            }
        };
        file.lines(0, samples).expect("whole");
        assert!(seen.iter().all(|counts| *counts == [1; 3]), "{compression:?} {blocks:?} {order:?}");
    }
}

#[test]
fn windows_that_a_small_file_cannot_account_for_are_refused() {
    let key = b"dataWindow\0box2i\0";
    let wide = |side: i32| patched(zip(), key, 8, &(side - 1 - 5).to_le_bytes());
    assert!(message(&wide(1 << 27)).contains("134217728 x 21 pixels of 3 channels announced, but the file has only"));
    assert!(message(&wide(1 << 20)).contains("announced"));
    assert!(message(&patched(zip(), key, 8, &i32::MIN.to_le_bytes())).contains("a window without pixels"));
    let all = [i32::MIN, i32::MIN, i32::MAX, i32::MAX].map(i32::to_le_bytes).concat();
    assert!(message(&patched(zip(), key, 0, &all)).contains("4294967296 x 4294967296 pixels"));
}

#[test]
fn tiles_that_a_small_file_cannot_account_for_are_refused() {
    let tiled = || encoded(Compression::ZIP16, Stored::Tiles(Vec2(8, 8)), LineOrder::Increasing);
    let sized = |sides: [u32; 2]| patched(tiled(), b"tiles\0tiledesc\0", 0, &sides.map(u32::to_le_bytes).concat());
    for sides in [[0, 8], [8, 0], [u32::MAX, 8], [8, 1 << 30]] {
        assert!(message(&sized(sides)).contains("tiles of "), "{sides:?}");
    }
    // A picture of one tile: the window may be large, and then the tile is.
    let window = [0, 0, 16383, 4095].map(i32::to_le_bytes).concat();
    let large = patched(sized([16384, 4096]), b"dataWindow\0box2i\0", 0, &window);
    assert!(message(&large).contains("announced"), "{}", message(&large));
    let many = patched(sized([1, 1]), b"dataWindow\0box2i\0", 0, &[0, 0, 1023, 1023].map(i32::to_le_bytes).concat());
    assert!(message(&many).contains("1048576 blocks announced"), "{}", message(&many));
}

/// One channel of halves in waves: what DWA packs with its transform.
fn dwa() -> Vec<u8> {
    let halves = (0..64 * 32_u32).map(|at| f16::from_f32(1.0 + (at as f32 * 0.05).sin()));
    let channels = vec![AnyChannel::new("R", FlatSamples::F16(halves.collect()))];
    let encoding =
        Encoding { compression: Compression::DWAA(None), blocks: Stored::ScanLines, line_order: LineOrder::Increasing };
    let layer =
        Layer::new((64, 32), LayerAttributes::default(), encoding, AnyChannels::sort(channels.into_iter().collect()));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).expect("in memory");
    bytes.into_inner()
}

#[test]
fn a_dwa_block_cannot_ask_for_more_than_its_pixels_need() {
    let whole = dwa();
    assert_eq!(read(&whole).expect("a whole file"), 64 * 32);
    let tables = open(&whole).expect("a whole file").layout.tables as usize;
    // One entry in the table, row and size of the block, then the counters.
    let counters = tables + 8 + 8;
    for counter in [1, 6, 7, 8, 9] {
        for value in [1 << 20, 1 << 40, u64::MAX >> 1, u64::MAX] {
            let mut bytes = whole.clone();
            bytes[counters + 8 * counter..][..8].copy_from_slice(&u64::to_le_bytes(value));
            assert!(message(&bytes).contains("more than its pixels need"), "counter {counter}: {}", message(&bytes));
        }
    }
}

#[test]
fn blocks_are_where_the_table_says() {
    let whole = zip();
    let tables = open(&whole).expect("a whole file").layout.tables as usize;
    let table = |entry: u64| {
        let mut bytes = whole.clone();
        bytes[tables + 8..tables + 16].copy_from_slice(&entry.to_le_bytes());
        message(&bytes)
    };
    let first = u64::from_le_bytes(whole[tables..tables + 8].try_into().expect("eight bytes"));
    assert!(table(first).contains("a block is not where the table says"), "the first block twice");
    assert!(table(u64::MAX).contains("ends too early") || table(u64::MAX).contains("cannot be read"));
    assert!(table(whole.len() as u64).contains("ends too early"));
}

#[test]
fn a_header_that_says_two_things_is_refused() {
    // A second data window before the end of the header: whoever takes the first one would decode another size.
    let mut bytes = zip();
    let end = open(&bytes).expect("whole").layout.tables as usize - 1;
    let mut second = b"dataWindow\0box2i\0".to_vec();
    second.extend([16, -5, 7, 3, 8].iter().flat_map(|n: &i32| n.to_le_bytes()));
    bytes.splice(end..end, second);
    let refused = open(&bytes).err().map(|fault| fault.to_string());
    // Our reader takes the last; the crate may do the same, and then the table does not fit.
    assert!(refused.is_some() || read(&bytes).is_err());
}

#[test]
fn every_cut_is_an_error_and_says_so() {
    for bytes in [zip(), dwa(), encoded(Compression::RLE, Stored::Tiles(Vec2(8, 8)), LineOrder::Increasing)] {
        for length in (0..bytes.len()).step_by(5) {
            assert!(read(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
        }
    }
}

#[test]
fn a_panic_of_the_decoder_becomes_one_sentence() {
    let fault = guarded::<()>(|| panic!("index out of range")).expect_err("a panic");
    assert_eq!(fault.to_string(), "OpenEXR file damaged: its sizes contradict each other");
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(400))]
    #[test]
    fn random_damage_never_panics(
        edits in proptest::collection::vec(
            (proptest::prelude::any::<proptest::sample::Index>(), proptest::prelude::any::<u8>()),
            1..8,
        ),
        kind in 0..3,
    ) {
        let mut bytes = match kind {
            0 => zip(),
            1 => dwa(),
            _ => encoded(Compression::PIZ, Stored::Tiles(Vec2(8, 8)), LineOrder::Increasing),
        };
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        // Whatever comes out, nothing panics and nothing large is allocated.
        let _ = read(&bytes);
    }
}
