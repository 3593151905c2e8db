//! OpenEXR files: one part, 32-bit floats, ZIP in blocks of 16 rows, layers as `LAYER.CHANNEL` (`R`, `albedo.R`,
//! `normal.X`, `depth.Z`), and what the render was as attributes named `nephroid.KEY`.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Once;

use ::exr::meta::MetaData;
use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer as Part, LayerAttributes,
    ReadChannels, ReadLayers, Text, WritableImage, read as reader,
};

use crate::error::{Error, Result};
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
    let part = Part::new(size, attributes, encoding, AnyChannels::sort(channels.collect()));
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
/// [`Error::Io`] if the file cannot be opened or read, [`Error::Scene`] if it is damaged, not supported, larger than
/// its bytes can account for, or holds no layer.
pub fn read(path: &Path) -> Result<(Picture, Metadata)> {
    let (mut input, bytes) = open(path)?;
    check_size(&mut input, bytes, path)?;
    input.rewind().map_err(|source| Error::io(path, "read", source))?;
    let part = decode(&mut input, path)?;
    let metadata = part.attributes.other.iter().filter_map(our_attribute).collect();
    Ok((picture_from(&part, path)?, metadata))
}

/// The first part that is not deep, with all its channels.
pub(crate) fn decode(input: &mut BufReader<File>, path: &Path) -> Result<Part<AnyChannels<FlatSamples>>> {
    let image = guarded(path, || {
        reader()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(input)
    })?;
    Ok(image.layer_data)
}

/// A regular file and its length in bytes.
pub(crate) fn open(path: &Path) -> Result<(BufReader<File>, u64)> {
    let io = |source| Error::io(path, "read", source);
    let file = File::open(path).map_err(io)?;
    let status = file.metadata().map_err(io)?;
    if !status.is_file() {
        return Err(Error::scene(path, "not a regular file"));
    }
    Ok((BufReader::new(file), status.len()))
}

/// Refuses a header that announces more samples than the file can hold, before anything is allocated for them: no
/// compression of OpenEXR goes beyond deflate's 1 : 1032.
pub(crate) fn check_size(input: &mut impl Read, file_bytes: u64, path: &Path) -> Result<()> {
    const GREATEST_RATIO: u64 = 1032;
    let meta = guarded(path, || MetaData::read_from_buffered(input, false))?;
    for header in &meta.headers {
        let [width, height] = [header.layer_size.width(), header.layer_size.height()].map(|side| side as u64);
        let samples = width.checked_mul(height).and_then(|n| n.checked_mul(header.channels.list.len() as u64));
        // Two bytes: the smallest sample type.
        if samples.is_none_or(|n| n.saturating_mul(2) > file_bytes.saturating_mul(GREATEST_RATIO)) {
            let what = format!("{width} x {height} pixels announced, but the file has only {file_bytes} bytes");
            return Err(Error::scene(path, what));
        }
    }
    Ok(())
}

/// Runs the decoder and turns its errors and panics into ours. It is safe code that checks most of what it reads, but
/// indexes and subtracts with sizes from the file in places, so that damaged input can make it panic. A panic leaves
/// nothing behind but the reader and the picture, and both are dropped here.
pub(crate) fn guarded<T>(path: &Path, decode: impl FnOnce() -> ::exr::error::Result<T>) -> Result<T> {
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
        Ok(Err(::exr::error::Error::Io(source))) => Err(Error::io(path, "read", source)),
        Ok(Err(cause)) => Err(Error::scene(path, format!("OpenEXR file {cause}"))),
        Err(_) => Err(Error::scene(path, "OpenEXR file damaged: its sizes contradict each other")),
    }
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

fn picture_from(part: &Part<AnyChannels<FlatSamples>>, path: &Path) -> Result<Picture> {
    let side = |side: usize| u32::try_from(side).map_err(|_| Error::scene(path, format!("{side} pixels wide or high")));
    let mut picture = Picture::new(side(part.size.width())?, side(part.size.height())?);
    let mut layers: BTreeMap<String, BTreeMap<String, &AnyChannel<FlatSamples>>> = BTreeMap::new();
    for channel in &part.channel_data.list {
        let full = string(&channel.name);
        let (layer, name) = full.rsplit_once('.').unwrap_or(("", &full));
        layers.entry(layer.to_owned()).or_default().insert(name.to_owned(), channel);
    }
    for (name, found) in &layers {
        let kind = [Channels::Rgb, Channels::Vector, Channels::Scalar]
            .into_iter()
            .find(|kind| kind.names().iter().all(|channel| found.contains_key(*channel)));
        let Some(kind) = kind else { continue };
        let planes: Vec<&AnyChannel<FlatSamples>> = kind.names().iter().map(|channel| found[*channel]).collect();
        let data = interleave(&planes, picture.pixel_count())
            .ok_or_else(|| Error::scene(path, format!("layer '{name}' is subsampled, which is not supported")))?;
        picture.push(name, kind, data);
    }
    if picture.layers.is_empty() {
        return Err(Error::scene(path, "no layer with channels R G B, X Y Z or Z"));
    }
    Ok(picture)
}

/// Interleaves full planes; `None` if one has not a number for each pixel.
fn interleave(planes: &[&AnyChannel<FlatSamples>], pixel_count: usize) -> Option<Vec<f32>> {
    let mut data = vec![0.0; pixel_count * planes.len()];
    for (offset, plane) in planes.iter().enumerate() {
        if plane.sample_data.len() != pixel_count {
            return None;
        }
        let numbers = data.iter_mut().skip(offset).step_by(planes.len());
        numbers.zip(plane.sample_data.values_as_f32()).for_each(|(number, value)| *number = value);
    }
    Some(data)
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
        let meta = MetaData::read_from_buffered(Cursor::new(encoded()), true).expect("valid by the strict rules");
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
        assert!(message.contains("134217728 x 19 pixels announced"), "{message}");
    }

    #[test]
    fn a_black_picture_is_not_taken_for_a_bomb() {
        let mut picture = Picture::new(2048, 512);
        picture.push("", Channels::Rgb, vec![0.0; 3 * 2048 * 512]);
        let mut bytes = Cursor::new(Vec::new());
        write(&mut bytes, Path::new("x.exr"), &picture, &Metadata::new()).expect("in memory");
        assert_eq!(read_bytes(bytes.get_ref()).expect("our own file").0, picture);
    }

    #[test]
    fn the_panic_guard_turns_a_panic_into_one_sentence() {
        let error = guarded::<()>(Path::new("a.exr"), || panic!("index out of range")).expect_err("a panic");
        assert_eq!(error.to_string(), "a.exr: OpenEXR file damaged: its sizes contradict each other");
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
