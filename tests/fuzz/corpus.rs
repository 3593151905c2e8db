//! Sound files of each kind, to be damaged.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::{Encoding, Image, WritableImage};
use nephroid::low_level::film::accumulate::Film;
use nephroid::low_level::film::film_file::{self, FilmFile, Identity, Packing, Totals};
use nephroid::low_level::picture::exr as our_exr;
use nephroid::low_level::picture::exr::Metadata;
use nephroid::low_level::picture::image::{Channels, Picture};
use serde_json::Value;

use super::damage;
use crate::support::files::{glb, triangle, triangle_bin};
use crate::support::random::Random;
use crate::support::repository;

/// Files of one kind by name, and whether they are glTF, whose JSON is damaged as such.
pub struct Corpus {
    files: Vec<(String, Vec<u8>)>,
    is_gltf: bool,
}

impl Corpus {
    pub fn of(name: &str, bytes: Vec<u8>) -> Self {
        Self { files: vec![(name.into(), bytes)], is_gltf: false }
    }

    /// The files as they are.
    pub fn sound(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice()))
    }

    /// A file with damage.
    pub fn damaged(&self, random: &mut Random) -> Vec<u8> {
        let pick = |random: &mut Random| &self.files[damage::below(random, self.files.len())].1;
        let mut file = pick(random).clone();
        if self.is_gltf && !random.bits().is_multiple_of(4) {
            return damaged_gltf(random, &file);
        }
        let other = pick(random);
        damage::bytes(random, &mut file, other);
        file
    }
}

/// A binary glTF file whose JSON is damaged value by value.
fn damaged_gltf(random: &mut Random, file: &[u8]) -> Vec<u8> {
    let length = u32::from_le_bytes([file[12], file[13], file[14], file[15]]) as usize;
    let mut json: Value = serde_json::from_slice(&file[20..20 + length]).expect("sound JSON");
    let bin = file.get(28 + length..).unwrap_or_default();
    damage::json(random, &mut json);
    glb(&json, bin)
}

fn from_assets(folder: &str, extension: &str, most_bytes: u64) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(repository(folder)).expect("a folder of the repository").flatten() {
        let path = entry.path();
        let is_small = entry.metadata().is_ok_and(|status| status.len() <= most_bytes);
        if is_small && path.extension().is_some_and(|found| found == extension) {
            files.push((path.display().to_string(), std::fs::read(&path).expect("a file")));
        }
    }
    files.sort();
    files
}

/// The smaller scenes of the repository, and one triangle.
pub fn scenes() -> Corpus {
    let mut files = from_assets("assets", "glb", 150_000);
    files.push(("triangle".into(), glb(&triangle(), &triangle_bin())));
    Corpus { files, is_gltf: true }
}

/// The studies of the repository.
#[cfg(feature = "cli")]
pub fn studies() -> Corpus {
    Corpus { files: from_assets("studies", "toml", 1 << 20), is_gltf: false }
}

fn picture() -> Picture {
    let mut picture = Picture::new(24, 12);
    picture.push("", Channels::Rgb, (0..24 * 12 * 3).map(|n| n as f32 / 100.0).collect());
    picture.push("depth", Channels::Scalar, (0..24 * 12).map(|n| n as f32).collect());
    picture
}

/// Pictures in the ways in which OpenEXR packs them.
pub fn openexr() -> Corpus {
    let rgb = |x: usize, y: usize| (x as f32, y as f32, 0.5_f32);
    let encodings = [
        ("uncompressed", Encoding::UNCOMPRESSED),
        ("fast", Encoding::FAST_LOSSLESS),
        ("small", Encoding::SMALL_LOSSLESS),
    ];
    let mut files: Vec<(String, Vec<u8>)> = encodings
        .into_iter()
        .map(|(name, encoding)| {
            let channels = exr::prelude::SpecificChannels::rgb(|at: exr::prelude::Vec2<usize>| rgb(at.0, at.1));
            let layer =
                exr::prelude::Layer::new((32, 16), exr::prelude::LayerAttributes::default(), encoding, channels);
            let mut bytes = Cursor::new(Vec::new());
            Image::from_layer(layer).write().to_buffered(&mut bytes).expect("written");
            (name.to_owned(), bytes.into_inner())
        })
        .collect();
    let mut own = Cursor::new(Vec::new());
    our_exr::write(&mut own, Path::new("own"), &picture(), &Metadata::new()).expect("written");
    files.push(("own".into(), own.into_inner()));
    Corpus { files, is_gltf: false }
}

/// A film of a few passes.
pub fn films() -> Corpus {
    let mut film = Film::new(8, 6, [-40, -40], true);
    film.passes = "0..3".parse().expect("a set");
    let file = FilmFile {
        film,
        identity: Identity { scene: "00".into(), settings: vec![("seed".into(), "0".into())] },
        devices: vec!["device".into()],
        totals: Totals::default(),
    };
    let picture = file.film.picture();
    let pack = |packing| {
        let mut bytes = Cursor::new(Vec::new());
        film_file::write(&mut bytes, Path::new("film"), (&picture, &Metadata::new()), &file, packing).expect("written");
        bytes.into_inner()
    };
    let files = vec![("fast".into(), pack(Packing::Fast)), ("small".into(), pack(Packing::Small))];
    Corpus { files, is_gltf: false }
}

/// Radiance files: flat texels, and rows in run lengths.
pub fn radiance() -> Corpus {
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2.0\n\n";
    let flat = [header.as_bytes(), b"-Y 2 +X 4\n", &[128, 64, 32, 129].repeat(8)].concat();
    // Each component of a row of 16: a run of 12 and 4 by themselves.
    let component = [128 + 12, 100, 4, 1, 2, 3, 4];
    let row = [vec![2, 2, 0, 16], component.repeat(4)].concat();
    let packed = [header.as_bytes(), b"-Y 3 +X 16\n", &row.repeat(3)].concat();
    Corpus { files: vec![("flat".into(), flat), ("packed".into(), packed)], is_gltf: false }
}
