//! OpenEXR files: one part, 32-bit floats, ZIP in blocks of 16 rows, layers as `LAYER.CHANNEL` (`R`, `albedo.R`,
//! `normal.X`, `depth.Z`), and what the render was as attributes named `nephroid.KEY`.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Seek, Write};
use std::path::Path;

use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer as ImagePart, LayerAttributes, Text,
    WritableImage,
};

use crate::error::{Error, Result};
use crate::input::exr::{Part, Reader};
use crate::input::{self, Fault};
use crate::picture::image::{Channels, Layer, Picture};

/// One number or text of a file's metadata.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Text in UTF-8.
    Text(String),
    /// A count. OpenEXR integers have 31 bits, so a greater one is written, and comes back, as decimal text.
    Count(u64),
    /// A real number.
    Number(f64),
}

/// Metadata by key, without the `nephroid.` that the file puts before it.
pub type Metadata = BTreeMap<String, Value>;

/// What every render writes about itself.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RenderInfo {
    /// Passes in the picture.
    pub passes: u64,
    /// Seed.
    pub seed: u64,
    /// Rendering time in seconds, without loading and set-up.
    pub seconds: f64,
    /// Device name.
    pub device: String,
    /// Scene file as the user named it.
    pub scene: String,
}

impl RenderInfo {
    /// As metadata, with the version of this crate: keys `passes`, `seed`, `seconds`, `device`, `scene`, `version`.
    pub fn metadata(&self) -> Metadata {
        let text = |text: &str| Value::Text(text.to_owned());
        [
            ("passes", Value::Count(self.passes)),
            ("seed", Value::Count(self.seed)),
            ("seconds", Value::Number(self.seconds)),
            ("device", text(&self.device)),
            ("scene", text(&self.scene)),
            ("version", text(env!("CARGO_PKG_VERSION"))),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
    }
}

/// Starts every attribute name of ours.
pub(crate) const PREFIX: &str = "nephroid.";

/// Writes a picture of at least one pixel and one layer. `path` only names the file in errors.
///
/// # Errors
/// [`Error::Io`] if `sink` fails or the format cannot hold the picture.
pub fn write(sink: impl Write + Seek, path: &Path, picture: &Picture, metadata: &Metadata) -> Result<()> {
    write_channels(sink, path, (picture, metadata), vec![], Encoding::SMALL_LOSSLESS)
}

/// [`write`] with further channels of the same size.
pub(crate) fn write_channels(
    sink: impl Write + Seek,
    path: &Path,
    (picture, metadata): (&Picture, &Metadata),
    further: Vec<AnyChannel<FlatSamples>>,
    encoding: Encoding,
) -> Result<()> {
    let channels = picture.layers.iter().flat_map(channels_of).chain(further);
    let mut attributes = LayerAttributes {
        software_name: Some(text(concat!("nephroid ", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    for (key, value) in metadata {
        attributes.other.insert(text(&format!("{PREFIX}{key}")), attribute(value));
    }
    let size = (picture.width as usize, picture.height as usize);
    let part = ImagePart::new(size, attributes, encoding, AnyChannels::sort(channels.collect()));
    let image = Image::from_layer(part);
    image.write().to_buffered(sink).map_err(|cause| match cause {
        ::exr::error::Error::Io(source) => Error::io(path, "write", source),
        other => Error::io(path, "write", std::io::Error::other(other.to_string())),
    })
}

fn channels_of(layer: &Layer) -> impl Iterator<Item = AnyChannel<FlatSamples>> {
    let names = layer.channels.names();
    names.iter().enumerate().map(move |(offset, channel)| {
        let name = if layer.name.is_empty() { (*channel).to_owned() } else { format!("{}.{channel}", layer.name) };
        let numbers = layer.data.iter().skip(offset).step_by(names.len()).copied();
        AnyChannel::new(text(&name), FlatSamples::F32(numbers.collect()))
    })
}

fn attribute(value: &Value) -> AttributeValue {
    match value {
        Value::Text(content) => AttributeValue::Text(text(content)),
        Value::Number(number) => AttributeValue::F64(*number),
        Value::Count(count) => {
            i32::try_from(*count).map_or_else(|_| AttributeValue::Text(text(&count.to_string())), AttributeValue::I32)
        }
    }
}

/// The crate takes characters for single bytes; OpenEXR wants UTF-8.
pub(crate) fn text(content: &str) -> Text {
    Text::from_bytes_unchecked(content.bytes().collect())
}

pub(crate) fn string(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// Reads the first part of a file that is not deep: its layers with the channels R G B, X Y Z or Z, and the metadata
/// of ours. Other channels are left out; half floats and integers become f32.
///
/// # Errors
/// [`Error::Io`] if the file cannot be opened or read, [`Error::Scene`] if it is not a regular file, damaged, not
/// supported, larger than its bytes can account for, or holds no layer.
pub fn read(path: &Path) -> Result<(Picture, Metadata)> {
    let read = || {
        let (source, length) = input::open(path)?;
        let mut file = Reader::new(source, length)?;
        let first = file.parts().iter().position(|part| !part.deep);
        let part = first.ok_or_else(|| Fault::Content("OpenEXR file with deep pixels only".into()))?;
        let metadata = file.header(part).own_attributes.other.iter().filter_map(our_attribute).collect();
        Ok((picture_from(&mut file, part, length)?, metadata))
    };
    read().map_err(|fault: Fault| fault.at(path))
}

fn our_attribute((name, value): (&Text, &AttributeValue)) -> Option<(String, Value)> {
    let key = string(name).strip_prefix(PREFIX)?.to_owned();
    let value = match value {
        AttributeValue::Text(content) => Value::Text(string(content)),
        AttributeValue::I32(count) => Value::Count(u64::try_from(*count).ok()?),
        AttributeValue::F64(number) => Value::Number(*number),
        _ => return None,
    };
    Some((key, value))
}

/// Bytes of a picture from a small file: 4096 x 2048 pixels of one colour. A comparison reads two.
const PICTURE_BYTES: u64 = 96 << 20;

/// Further bytes of a picture for each byte of its file. A picture that is black but for a corner needs many.
const PICTURE_BYTES_PER_BYTE: u64 = 32;

/// Where a channel goes: index of the layer, and which of its interleaved numbers.
type Slots = Vec<Option<(usize, usize)>>;

fn picture_from(file: &mut Reader<BufReader<File>>, index: usize, length: u64) -> std::result::Result<Picture, Fault> {
    let part = &file.parts()[index];
    let (layers, slots) = layers_of(part);
    if layers.is_empty() {
        return Err(Fault::Content("no layer with channels R G B, X Y Z or Z".into()));
    }
    let numbers: u64 = layers.iter().map(|(_, channels)| channels.count() as u64).sum();
    check_bytes(part.data.size, numbers, length)?;
    let [width, height] = part.data.size;
    // Sides of a part are below 2^20.
    let mut picture = Picture::new(width as u32, height as u32);
    for (name, channels) in layers {
        picture.push(&name, channels, vec![0.0; picture.pixel_count() * channels.count()]);
    }
    file.lines(index, |line| {
        let Some((layer, offset)) = slots[line.channel] else { return };
        let Layer { channels, data, .. } = &mut picture.layers[layer];
        let first = (line.y * width + line.x) as usize * channels.count() + offset;
        let numbers = data[first..].iter_mut().step_by(channels.count());
        numbers.zip(line.samples.floats()).for_each(|(number, value)| *number = value);
    })?;
    Ok(picture)
}

/// Refuses a picture that a file of `length` bytes cannot account for.
fn check_bytes([width, height]: [u64; 2], numbers: u64, length: u64) -> std::result::Result<(), Fault> {
    let most = PICTURE_BYTES.saturating_add(length.saturating_mul(PICTURE_BYTES_PER_BYTE));
    if width.saturating_mul(height).saturating_mul(4 * numbers) <= most {
        return Ok(());
    }
    let what = format!("{width} x {height} pixels of {numbers} channels announced");
    Err(Fault::Content(format!("{what}, but the file has only {length} bytes")))
}

/// The layers that a picture can hold, and where each channel of the part goes.
fn layers_of(part: &Part) -> (Vec<(String, Channels)>, Slots) {
    let mut found: BTreeMap<&str, BTreeMap<&str, usize>> = BTreeMap::new();
    for (index, channel) in part.channels.iter().enumerate() {
        let (layer, name) = channel.name.rsplit_once('.').unwrap_or(("", &channel.name));
        found.entry(layer).or_default().insert(name, index);
    }
    let (mut layers, mut slots) = (Vec::new(), vec![None; part.channels.len()]);
    for (name, channels) in &found {
        let kinds = [Channels::Rgb, Channels::Vector, Channels::Scalar];
        let whole = |kind: &Channels| kind.names().iter().all(|channel| channels.contains_key(channel));
        let Some(kind) = kinds.into_iter().find(whole) else { continue };
        for (offset, channel) in kind.names().iter().enumerate() {
            slots[channels[channel]] = Some((layers.len(), offset));
        }
        layers.push(((*name).to_owned(), kind));
    }
    (layers, slots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Cursor;

    fn sample() -> Picture {
        let mut picture = Picture::new(5, 19);
        let numbers = |count: usize, scale: f32| (0..count * 95).map(|i| (i as f32 - 30.0) * scale).collect();
        picture.push("", Channels::Rgb, numbers(3, 0.1));
        picture.push("albedo", Channels::Rgb, numbers(3, 0.01));
        picture.push("depth", Channels::Scalar, numbers(1, 1e30));
        picture.push("normal", Channels::Vector, numbers(3, 1e-30));
        picture
    }

    fn info() -> RenderInfo {
        let (device, scene) = ("llvmpipe".into(), "sz\u{e9}nen/\u{30ab}.gltf".into());
        RenderInfo { passes: 118, seed: u64::MAX, seconds: 30.125, device, scene }
    }

    fn encoded() -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        write(&mut bytes, Path::new("x.exr"), &sample(), &info().metadata()).expect("in memory");
        bytes.into_inner()
    }

    fn read_bytes(bytes: &[u8]) -> Result<(Picture, Metadata)> {
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        std::fs::write(file.path(), bytes).expect("written");
        read(file.path())
    }

    #[test]
    fn what_is_written_comes_back() {
        let (picture, metadata) = read_bytes(&encoded()).expect("our own file");
        assert_eq!(picture, sample());
        let mut expected = info().metadata();
        expected.insert("seed".into(), Value::Text(u64::MAX.to_string()));
        assert_eq!(metadata, expected);
        assert_eq!(metadata["passes"], Value::Count(118));
    }

    #[test]
    fn infinities_and_nan_survive() {
        let mut picture = Picture::new(1, 1);
        picture.push("", Channels::Rgb, vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
        let mut bytes = Cursor::new(Vec::new());
        write(&mut bytes, Path::new("x.exr"), &picture, &Metadata::new()).expect("in memory");
        let back = read_bytes(bytes.get_ref()).expect("our own file").0;
        let bits = |picture: &Picture| picture.layers[0].data.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&back), bits(&picture));
    }

    #[test]
    fn the_file_has_the_usual_names_and_compression() {
        let meta =
            ::exr::meta::MetaData::read_from_buffered(Cursor::new(encoded()), true).expect("valid by the strict rules");
        let header = &meta.headers[0];
        let names: Vec<String> = header.channels.list.iter().map(|channel| string(&channel.name)).collect();
        let expected = "B G R albedo.B albedo.G albedo.R depth.Z normal.X normal.Y normal.Z";
        assert_eq!(names.join(" "), expected);
        assert_eq!(meta.headers.len(), 1);
        assert_eq!(header.compression, ::exr::prelude::Compression::ZIP16);
        assert!(header.channels.list.iter().all(|c| c.sample_type == ::exr::prelude::SampleType::F32));
    }

    #[test]
    fn a_file_that_is_not_there_is_an_io_error() {
        let error = read(Path::new("no/such/file.exr")).expect_err("absent");
        assert!(matches!(error, Error::Io { action: "read", .. }), "{error}");
        assert!(matches!(read(&std::env::temp_dir()), Err(Error::Scene { .. } | Error::Io { .. })));
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = encoded();
        for length in (0..bytes.len()).step_by(7) {
            assert!(read_bytes(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
        }
    }

    #[test]
    fn a_huge_picture_in_a_small_file_is_refused() {
        // The data window is the 16 bytes after `dataWindow box2i` and a size; make it 2^27 pixels wide.
        let mut bytes = encoded();
        let key = b"dataWindow\0box2i\0";
        let start = bytes.windows(key.len()).position(|window| window == key).expect("a data window") + key.len() + 4;
        bytes[start + 8..start + 12].copy_from_slice(&((1_i32 << 27) - 1).to_le_bytes());
        let message = read_bytes(&bytes).expect_err("too large").to_string();
        assert!(message.contains("134217728 x 19 pixels of 10 channels announced"), "{message}");
    }

    #[test]
    fn channels_are_counted_before_there_is_memory_for_them() {
        // 8192 x 8192 black pixels take 256 MiB a channel; ZIP stores them in a few hundred KiB.
        let message = check_bytes([8192, 8192], 10, 1 << 20).expect_err("too much").to_string();
        assert_eq!(message, "8192 x 8192 pixels of 10 channels announced, but the file has only 1048576 bytes");
        assert!(check_bytes([8192, 8192], 1, 1 << 20).is_err() && check_bytes([8192, 8192], 1, 6 << 20).is_ok());
        assert!(check_bytes([u64::MAX, 2], 1, u64::MAX).is_ok(), "no overflow");
    }

    #[test]
    fn a_black_picture_is_not_taken_for_a_bomb() {
        let mut picture = Picture::new(2048, 512);
        picture.push("", Channels::Rgb, vec![0.0; 3 * 2048 * 512]);
        let mut bytes = Cursor::new(Vec::new());
        write(&mut bytes, Path::new("x.exr"), &picture, &Metadata::new()).expect("in memory");
        assert_eq!(read_bytes(bytes.get_ref()).expect("our own file").0, picture);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]
        #[test]
        fn random_damage_never_panics(
            edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8)
        ) {
            let mut bytes = encoded();
            for (at, value) in edits {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            if let Err(error) = read_bytes(&bytes) {
                prop_assert_eq!(error.exit_code(), 2);
            }
        }
    }
}
