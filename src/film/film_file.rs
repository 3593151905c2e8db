//! Films in files: an OpenEXR picture that anyone can look at, with the exact sums behind it as further channels of
//! 32-bit unsigned integers, and everything that is needed to go on with them as one JSON text in the metadata.
//!
//! Checkpoints, parts of a render and merged films are the same kind of file. A sum is four channels, least significant
//! word first: `film.value.R.0` ... `film.value.R.3`; those of a second method begin with `second`. The attribute
//! `nephroid.film` holds [`About`], with a SHA-256 of the sums, so that a damaged file is refused rather than shown.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Seek, Write};
use std::path::Path;

use ::exr::prelude::{AnyChannel, AttributeValue, Blocks, Compression, Encoding, FlatSamples, LineOrder};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::accumulate::{Film, LAYER_SUMS, PassSet, SUMS};
use super::exact::ExactSum;
use super::mix::Turns;
pub use super::totals::Totals;
use crate::error::{Error, Result};
use crate::input::exr::{Part, Reader};
use crate::input::{self, Fault};
use crate::picture::exr::{self, Metadata, Value};
use crate::picture::image::Picture;

/// Changes whenever the meaning of the channels or of [`About`] does.
const FORMAT: u32 = 1;

/// The format of films of two methods: a program that knows but one would take a part of their passes for all. Format 2
/// had other turns.
const FORMAT_OF_TWO: u32 = 3;

fn format_of(turns: Option<Turns>) -> u32 {
    if turns.is_some() { FORMAT_OF_TWO } else { FORMAT }
}

/// The attribute with [`About`], without our prefix.
const KEY: &str = "film";

/// Names of the sums of a pixel.
const SUM_NAMES: [&str; SUMS] =
    ["value.R", "value.G", "value.B", "square.R", "square.G", "square.B", "scaled.R", "scaled.G", "scaled.B"];

/// Names of the sums of a pixel's layers.
const LAYER_NAMES: [&str; LAYER_SUMS] = [
    "albedo.R",
    "albedo.G",
    "albedo.B",
    "normal.X",
    "normal.Y",
    "normal.Z",
    "depth.Z",
    "coverage.A",
    "direct.R",
    "direct.G",
    "direct.B",
    "indirect.R",
    "indirect.G",
    "indirect.B",
    "caustic.R",
    "caustic.G",
    "caustic.B",
];

/// What determines the passes of a render: two films belong together if all of it is equal.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Identity {
    /// SHA-256 of the scene's content as loaded, in hexadecimal: independent of names and folders.
    pub scene: String,
    /// Settings by name, as text, in the order in which a refusal looks for the first that differs.
    pub settings: Vec<(String, String)>,
}

/// The first thing in which two renders differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Name of the setting, or `scene`.
    pub name: String,
    /// Its value in the first, `none` where it has no such setting.
    pub ours: String,
    /// Its value in the second.
    pub theirs: String,
}

impl Identity {
    /// The first difference; `None` if films of both may be added.
    pub fn difference(&self, other: &Self) -> Option<Difference> {
        let value = |settings: &[(String, String)], name: &str| {
            settings.iter().find(|(known, _)| known == name).map_or("none".to_owned(), |(_, value)| value.clone())
        };
        let names = self.settings.iter().chain(&other.settings).map(|(name, _)| name);
        let difference = |name: &String| {
            let (ours, theirs) = (value(&self.settings, name), value(&other.settings, name));
            (ours != theirs).then(|| Difference { name: name.clone(), ours, theirs })
        };
        let scene = || {
            let short = |hash: &str| format!("content {}", hash.chars().take(12).collect::<String>());
            let (ours, theirs) = (short(&self.scene), short(&other.scene));
            (self.scene != other.scene).then(|| Difference { name: "scene".into(), ours, theirs })
        };
        scene().or_else(|| names.into_iter().find_map(difference))
    }
}

/// A film and what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmFile {
    /// The sums.
    pub film: Film,
    /// What determines its passes.
    pub identity: Identity,
    /// Devices and drivers that rendered it. Passes of different ones may be added, but bits repeat on one only.
    pub devices: Vec<String>,
    /// Counts over its passes.
    pub totals: Totals,
}

/// All of a [`FilmFile`] but the sums; cheap to read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct About {
    format: u32,
    /// Passes in the film, as [`PassSet`] writes them.
    passes: String,
    /// [`Film::exponents`].
    exponents: [i32; 2],
    /// [`Film::rejected`].
    rejected: u64,
    /// Whether sums of layers are there.
    layers: bool,
    /// Which passes are of a second method, whose sums follow those of the first; none where there is one method.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    turns: Option<Turns>,
    /// What determines the passes.
    pub identity: Identity,
    /// [`FilmFile::devices`].
    pub devices: Vec<String>,
    /// [`FilmFile::totals`].
    pub totals: Totals,
    /// SHA-256 of the words of all sums, pixel by pixel, in hexadecimal.
    sums: String,
    /// Width and height; from the file's own header.
    #[serde(skip)]
    pub size: [u32; 2],
}

impl About {
    /// The passes in the film.
    ///
    /// # Errors
    /// [`Error::Usage`] if the text is not a set; never for what [`read_about`] returned.
    pub fn passes(&self) -> Result<PassSet> {
        self.passes.parse()
    }
}

/// How the file is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Packing {
    /// Run lengths: for files that are soon written again.
    Fast,
    /// ZIP.
    Small,
}

impl FilmFile {
    /// Adds the passes of another film.
    ///
    /// # Errors
    /// Those of [`Film::merge`].
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        self.film.merge(&other.film)?;
        self.totals.add(&other.totals);
        let new: Vec<String> = other.devices.iter().filter(|name| !self.devices.contains(name)).cloned().collect();
        self.devices.extend(new);
        Ok(())
    }
}

/// Writes the film behind its picture. `path` only names the file in errors.
///
/// # Errors
/// [`Error::Io`] if `sink` fails or the format cannot hold it.
pub fn write(
    sink: impl Write + Seek,
    path: &Path,
    (picture, metadata): (&Picture, &Metadata),
    file: &FilmFile,
    packing: Packing,
) -> Result<()> {
    let film = &file.film;
    let about = About {
        format: format_of(film.mix.as_ref().map(|mix| mix.turns)),
        passes: film.passes.to_string(),
        exponents: film.exponents,
        rejected: film.rejected,
        layers: !film.layers.is_empty(),
        turns: film.mix.as_ref().map(|mix| mix.turns),
        identity: file.identity.clone(),
        devices: file.devices.clone(),
        totals: file.totals.clone(),
        sums: digest(film),
        size: [film.width, film.height],
    };
    let json = serde_json::to_string(&about).map_err(|cause| Error::io(path, "write", std::io::Error::other(cause)))?;
    let mut metadata = metadata.clone();
    metadata.insert(KEY.into(), Value::Text(json));
    let encoding = match packing {
        Packing::Small => Encoding::SMALL_LOSSLESS,
        Packing::Fast => {
            Encoding { compression: Compression::RLE, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing }
        }
    };
    exr::write_channels(sink, path, (picture, &metadata), film_channels(film), encoding)
}

/// SHA-256 of all words of a film.
fn digest(film: &Film) -> String {
    let mut hash = Sha256::new();
    let mut row = Vec::new();
    // In pieces of some length: the hash is much faster than one call a number.
    for sums in film.all_sums() {
        row.extend(sums.iter().flat_map(|sum| sum.0.to_le_bytes()));
        if row.len() > 1 << 16 {
            hash.update(&row);
            row.clear();
        }
    }
    hash.update(&row);
    hex(&hash.finalize())
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn film_channels(film: &Film) -> Vec<AnyChannel<FlatSamples>> {
    let mut channels = planes(&film.sums, &SUM_NAMES, FIRST);
    channels.extend(planes(&film.layers, &LAYER_NAMES, FIRST));
    if let Some(mix) = &film.mix {
        channels.extend(planes(&mix.sums, &SUM_NAMES, SECOND));
        channels.extend(planes(&mix.layers, &LAYER_NAMES, SECOND));
    }
    channels
}

/// How the names of the channels of either method begin.
const FIRST: &str = "film";
const SECOND: &str = "second";

/// Channels of all words of the sums; none without pixels.
fn planes<const N: usize>(pixels: &[[ExactSum; N]], names: &[&str; N], prefix: &str) -> Vec<AnyChannel<FlatSamples>> {
    if pixels.is_empty() {
        return vec![];
    }
    let plane = |k: usize, word: usize| pixels.iter().map(|sums| sums[k].words()[word]).collect();
    (0..N)
        .flat_map(|k| (0..4).map(move |word| (k, word)))
        .map(|(k, word)| {
            let name = exr::text(&channel_name(prefix, names[k], word));
            AnyChannel::new(name, FlatSamples::U32(plane(k, word)))
        })
        .collect()
}

fn channel_name(prefix: &str, sum: &str, word: usize) -> String {
    format!("{prefix}.{sum}.{word}")
}

/// Reads what a film file says about itself, without its sums.
///
/// # Errors
/// [`Error::Io`] if the file cannot be opened or read, [`Error::Scene`] if it is damaged or holds no film.
pub fn read_about(path: &Path) -> Result<About> {
    Ok(open(path)?.about)
}

/// An open film file.
struct Opened {
    file: Reader<BufReader<File>>,
    length: u64,
    about: About,
}

fn open(path: &Path) -> Result<Opened> {
    let opened = || {
        let (source, length) = input::open(path)?;
        Ok((Reader::new(source, length)?, length))
    };
    let (file, length) = opened().map_err(|fault: Fault| fault.at(path))?;
    let json = file.header(0).own_attributes.other.iter().find_map(|(name, value)| match value {
        AttributeValue::Text(text) if exr::string(name) == exr::PREFIX.to_owned() + KEY => Some(exr::string(text)),
        _ => None,
    });
    let json = json.ok_or_else(|| {
        Error::scene(path, "a picture without a film: only checkpoints, parts and merged films can be gone on with")
    })?;
    let mut about = parse_about(&json, path)?;
    // Sides of a part are below 2^20.
    about.size = file.parts()[0].data.size.map(|side| side as u32);
    Ok(Opened { file, length, about })
}

/// Passes of a film. Some sums run over them, and a million a day for two months is more than anyone renders.
const MOST_PASSES: u64 = 1 << 26;

/// The description of a film, with every number in the range that the program relies on.
fn parse_about(json: &str, path: &Path) -> Result<About> {
    let damaged = |cause: &str| Error::scene(path, format!("the description of its film is damaged: {cause}"));
    let about: About = serde_json::from_str(json).map_err(|cause| damaged(&cause.to_string()))?;
    if about.format != format_of(about.turns) {
        let cause = format!("film format {}, this program reads {FORMAT} and {FORMAT_OF_TWO}", about.format);
        return Err(Error::scene(path, cause));
    }
    let passes = about.passes().map_err(|cause| damaged(&cause.to_string()))?;
    let last = passes.ranges().last().map_or(0, |range| range.end);
    // As --pass-range has it; the count cannot overflow then.
    if last > 1 << 32 || passes.count() > MOST_PASSES {
        return Err(damaged("more passes than can be rendered"));
    }
    // Far beyond any scene in f32, and far from the limits of f64.
    if about.turns.is_some_and(|turns| !turns.fit(&passes)) {
        return Err(damaged("turns that its passes do not fit"));
    }
    if about.exponents.iter().any(|exponent| exponent.unsigned_abs() > 300) || !about.totals.seconds.is_finite() {
        return Err(damaged("numbers out of range"));
    }
    Ok(about)
}

/// Reads a film.
///
/// # Errors
/// [`Error::Io`] if the file cannot be opened or read, [`Error::Scene`] if it is damaged or holds no film.
pub fn read(path: &Path) -> Result<FilmFile> {
    let Opened { mut file, length, about } = open(path)?;
    let [width, height] = about.size;
    let slots = slots(&file.parts()[0], about.layers, about.turns).map_err(|cause| Error::scene(path, cause))?;
    check_bytes(about.size, (about.layers, about.turns), length).map_err(|cause| Error::scene(path, cause))?;
    let mut film = Film::new(width, height, about.exponents, about.layers).with_turns(about.turns);
    file.lines(0, |line| {
        let (Some((sum, word)), Some(words)) = (slots[line.channel], line.samples.integers()) else { return };
        let first = line.y as usize * width as usize + line.x as usize;
        for (at, bits) in (first..).zip(words) {
            let sum = match (sum, &mut film.mix) {
                (Sum::Pixel(k), _) => &mut film.sums[at][k],
                (Sum::Layer(k), _) => &mut film.layers[at][k],
                (Sum::SecondPixel(k), Some(mix)) => &mut mix.sums[at][k],
                (Sum::SecondLayer(k), Some(mix)) => &mut mix.layers[at][k],
                (Sum::SecondPixel(_) | Sum::SecondLayer(_), None) => return,
            };
            sum.0 |= i128::from(bits) << (32 * word);
        }
    })
    .map_err(|fault| fault.at(path))?;
    film.passes = about.passes()?;
    film.rejected = about.rejected;
    if digest(&film) != about.sums {
        return Err(Error::scene(path, "the sums of its film are damaged: their checksum is another"));
    }
    Ok(FilmFile { film, identity: about.identity, devices: about.devices, totals: about.totals })
}

/// A sum of a pixel, or of its layers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sum {
    Pixel(usize),
    Layer(usize),
    SecondPixel(usize),
    SecondLayer(usize),
}

/// Which sum, and which word of it, each channel holds; an error if one of the film's channels is not there.
fn slots(part: &Part, layers: bool, turns: Option<Turns>) -> std::result::Result<Vec<Option<(Sum, usize)>>, String> {
    let names: BTreeMap<&str, usize> =
        part.channels.iter().enumerate().filter(|(_, c)| c.integers).map(|(at, c)| (c.name.as_str(), at)).collect();
    type Place = fn(usize) -> Sum;
    let of = |prefix: &'static str, pixel: Place, layer: Place| {
        let pixels = SUM_NAMES.iter().enumerate().map(move |(k, name)| (pixel(k), prefix, name));
        let of_layers = LAYER_NAMES.iter().enumerate().map(move |(k, name)| (layer(k), prefix, name));
        pixels.chain(of_layers.filter(move |_| layers))
    };
    let second = of(SECOND, Sum::SecondPixel, Sum::SecondLayer).filter(|_| turns.is_some());
    let mut slots = vec![None; part.channels.len()];
    for (sum, prefix, name) in of(FIRST, Sum::Pixel, Sum::Layer).chain(second) {
        for word in 0..4 {
            let name = channel_name(prefix, name, word);
            let at = names.get(name.as_str()).ok_or_else(|| format!("its film has no whole channel '{name}'"))?;
            slots[*at] = Some((sum, word));
        }
    }
    Ok(slots)
}

/// Bytes of a film from a small file: black, without layers, 1.4 million pixels.
const FILM_BYTES: u64 = 192 << 20;

/// Further bytes of a film for each byte of its file.
const FILM_BYTES_PER_BYTE: u64 = 36;

/// Refuses a film that a file of `length` bytes cannot account for.
fn check_bytes(
    [width, height]: [u32; 2],
    (layers, turns): (bool, Option<Turns>),
    length: u64,
) -> std::result::Result<(), String> {
    let methods = if turns.is_some() { 2 } else { 1 };
    let sums = methods * if layers { SUMS + LAYER_SUMS } else { SUMS };
    let bytes = u64::from(width) * u64::from(height) * (sums * size_of::<ExactSum>()) as u64;
    match bytes <= FILM_BYTES.saturating_add(length.saturating_mul(FILM_BYTES_PER_BYTE)) {
        true => Ok(()),
        false => Err(format!("a film of {width} x {height} pixels announced, but the file has only {length} bytes")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::mix::Round;
    use super::*;
    use crate::picture::image::Channels;
    use proptest::prelude::*;
    use std::io::Cursor;

    fn sample(with_layers: bool) -> FilmFile {
        let mut film = Film::new(5, 19, [3, -2], with_layers);
        film.passes = "0..3,7..9".parse().expect("a set");
        film.rejected = 4;
        for (at, sum) in film.sums.iter_mut().flatten().enumerate() {
            *sum = ExactSum((at as i128 - 400) << (at % 90));
        }
        for (at, sum) in film.layers.iter_mut().flatten().enumerate() {
            *sum = ExactSum(-(at as i128) << (at % 100));
        }
        let settings = [("size", "5x19"), ("seed", "0")].map(|(name, value)| (name.to_owned(), value.to_owned()));
        let identity = Identity { scene: "ab".repeat(32), settings: settings.to_vec() };
        let counters = BTreeMap::from([("photons_not_finite".to_owned(), 2)]);
        let totals = Totals { seconds: 1.25, photons: u64::MAX, pairs: [1, 2], counters, ..Totals::default() };
        FilmFile { film, identity, devices: vec!["a (\u{30ab} 1)".into()], totals }
    }

    fn of_two_methods(with_layers: bool) -> FilmFile {
        let file = sample(with_layers);
        let mut film = file.film.with_turns(Some(Turns::always(Round { first: 1, second: 3 })));
        let mix = film.mix.as_mut().expect("a second method");
        for (at, sum) in mix.sums.iter_mut().flatten().chain(mix.layers.iter_mut().flatten()).enumerate() {
            *sum = ExactSum((at as i128 + 1) << (at % 80));
        }
        FilmFile { film, ..file }
    }

    fn encoded(file: &FilmFile, packing: Packing) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let metadata = Metadata::from([("seed".to_owned(), Value::Count(7))]);
        write(&mut bytes, Path::new("x.exr"), (&file.film.picture(), &metadata), file, packing).expect("in memory");
        bytes.into_inner()
    }

    fn with_bytes<T>(bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
        let file = tempfile::NamedTempFile::new().expect("a temporary file");
        std::fs::write(file.path(), bytes).expect("written");
        read(file.path())
    }

    #[test]
    fn what_is_written_comes_back_and_is_a_picture() {
        let files = [
            (sample(false), Packing::Small),
            (sample(true), Packing::Small),
            (sample(true), Packing::Fast),
            (of_two_methods(false), Packing::Small),
            (of_two_methods(true), Packing::Fast),
        ];
        for (file, packing) in files {
            let bytes = encoded(&file, packing);
            let back = with_bytes(&bytes, read).expect("our own file");
            assert_eq!(back, file);
            let mut flipped = back;
            flipped.film.sums[40][8].0 ^= 1 << 96;
            assert_ne!(flipped, file, "the check can fail");
            let about = with_bytes(&bytes, read_about).expect("our own file");
            assert_eq!((about.size, about.passes().expect("a set")), ([5, 19], file.film.passes.clone()));
            let (picture, metadata) = with_bytes(&bytes, exr::read).expect("a picture");
            let names = |picture: &Picture| picture.layers.iter().map(|l| l.name.clone()).collect::<Vec<_>>();
            assert_eq!(names(&picture).len(), file.film.picture().layers.len());
            assert_eq!(picture.beauty(), file.film.picture().beauty());
            assert_eq!(metadata["seed"], Value::Count(7));
        }
    }

    /// One bit of one word, repacked as a well-formed file: the decoder is content, the checksum is not.
    #[test]
    fn a_flipped_bit_is_found_by_the_checksum() {
        let file = sample(true);
        let bytes = encoded(&file, Packing::Fast);
        let mut other = file.clone();
        other.film.layers[94][16].0 ^= 1;
        let about = |bytes: &[u8]| with_bytes(bytes, read_about).expect("ours").sums;
        let changed = encoded(&other, Packing::Fast);
        let (ours, theirs) = (about(&bytes), about(&changed));
        assert_ne!(ours, theirs);
        let at = changed.windows(64).position(|window| window == theirs.as_bytes()).expect("a checksum");
        let mut forged = changed;
        forged[at..at + 64].copy_from_slice(ours.as_bytes());
        let message = with_bytes(&forged, read).expect_err("damaged").to_string();
        assert!(message.contains("checksum"), "{message}");
    }

    #[test]
    fn pictures_and_foreign_descriptions_are_refused_in_a_sentence() {
        let mut picture = Picture::new(1, 1);
        picture.push("", Channels::Rgb, vec![0.5; 3]);
        let refusal = |text: Option<&str>| {
            let metadata = text.map(|text| (KEY.to_owned(), Value::Text(text.to_owned()))).into_iter().collect();
            let mut bytes = Cursor::new(Vec::new());
            exr::write(&mut bytes, Path::new("x.exr"), &picture, &metadata).expect("in memory");
            let error = with_bytes(bytes.get_ref(), read).expect_err("no film");
            assert_eq!((error.exit_code(), error.to_string().lines().count()), (2, 1), "{error}");
            error.to_string()
        };
        assert!(refusal(None).contains("a picture without a film"));
        assert!(refusal(Some("{}")).contains("description of its film is damaged"));
        let about = |change: fn(&mut About)| {
            let file = sample(false);
            let mut about = with_bytes(&encoded(&file, Packing::Fast), read_about).expect("ours");
            change(&mut about);
            serde_json::to_string(&about).expect("JSON")
        };
        assert!(refusal(Some(&about(|_| ()))).contains("no whole channel 'film.value.R.0'"));
        assert!(refusal(Some(&about(|about| about.format = 2))).contains("film format 2"));
        assert!(refusal(Some(&about(|about| about.passes = "3..1".into()))).contains("not a list of passes"));
        assert!(refusal(Some(&about(|about| about.exponents = [i32::MIN + 1, 0]))).contains("out of range"));
    }

    #[test]
    fn merging_adds_everything() {
        let mut one = sample(true);
        let mut two = FilmFile { devices: vec!["b".into()], ..sample(true) };
        two.film.passes = PassSet::of(3..7);
        one.merge(&two).expect("apart");
        assert_eq!(one.film.passes, PassSet::of(0..9));
        assert_eq!(one.devices, ["a (\u{30ab} 1)", "b"]);
        assert_eq!((one.totals.seconds, one.totals.photons, one.totals.pairs), (2.5, u64::MAX, [2, 4]));
        assert_eq!(one.totals.counters["photons_not_finite"], 4);
        assert!(one.merge(&two).is_err(), "twice");
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = encoded(&sample(false), Packing::Fast);
        for length in (0..bytes.len()).step_by(97) {
            assert!(with_bytes(&bytes[..length], read).is_err(), "{length} of {} bytes", bytes.len());
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn random_damage_never_panics_and_never_changes_the_sums(
            edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        ) {
            let file = sample(false);
            let mut bytes = encoded(&file, Packing::Fast);
            for (at, value) in edits {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            match with_bytes(&bytes, read) {
                Ok(back) => prop_assert_eq!(back.film.sums, file.film.sums),
                Err(error) => prop_assert_eq!(error.exit_code(), 2),
            }
        }
    }
}
