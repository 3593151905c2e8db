//! Light from infinity: equirectangular maps from .exr and .hdr files, and a procedural sky.

use std::f32::consts::{PI, TAU};
use std::io::Cursor;
use std::path::Path;

use exr::prelude::{ReadChannels, ReadLayers};
use glam::Vec3;

use super::Environment;
use super::load::{Limits, read_limited};
use crate::error::{Error, Result};

/// What an infinite texel becomes: the largest half float, because half-float files overflow to infinity.
const BRIGHTEST_HALF: f32 = 65504.0;

impl Environment {
    /// Reads an equirectangular map from an OpenEXR or Radiance HDR file (told apart by their first bytes), with
    /// warnings. NaN and negative values become 0, infinite ones 65504; maps larger than [`Limits::image_bytes`]
    /// are halved until they fit.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, [`Error::Scene`] if it is damaged, of another kind, or too large;
    /// with [`Limits::strict`] also if values had to be clamped.
    pub fn load(path: &Path, limits: &Limits) -> Result<(Self, Vec<String>)> {
        std::fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
        let bytes = read_limited(path, limits.file_bytes).map_err(|cause| Error::scene(path, cause))?;
        Self::decode(&bytes, limits).map_err(|cause| Error::scene(path, cause))
    }

    fn decode(bytes: &[u8], limits: &Limits) -> std::result::Result<(Self, Vec<String>), String> {
        let mut map = if bytes.starts_with(&EXR_MAGIC) {
            decode_exr(bytes, limits)?
        } else if bytes.starts_with(b"#?") {
            decode_hdr(bytes, limits)?
        } else {
            return Err("neither OpenEXR nor Radiance HDR".into());
        };
        let mut warnings = Vec::new();
        let clamped = map.clamp();
        if clamped > 0 {
            let warning = format!("environment: {clamped} negative or non-finite value(s) were clamped");
            if limits.strict {
                return Err(warning);
            }
            warnings.push(warning);
        }
        let (width, height) = (map.width, map.height);
        if width != 2 * height {
            warnings.push(format!("environment: {width} x {height} is not twice as wide as high; it is stretched"));
        }
        while map.radiance.len() as u64 * 12 > limits.image_bytes && map.width > 1 && map.height > 1 {
            map = map.halved();
        }
        if map.width < width {
            warnings.push(format!("environment: reduced from {width} x {height} to {} x {}", map.width, map.height));
        }
        Ok((map, warnings))
    }

    /// The same radiance from everywhere.
    pub fn constant(radiance: [f32; 3]) -> Self {
        Self { width: 2, height: 1, radiance: vec![radiance; 2] }
    }

    /// A clear sky with a low warm sun, blurred to a few degrees so that it lights softly, over brown ground.
    /// Made up to look pleasant, not measured. Mean radiance is near one.
    pub fn default_sky() -> Self {
        let (width, height) = (128, 64);
        let center = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (center(x, width), center(y, height))));
        let radiance = texels.map(|(u, v)| sky(Self::direction(u, v).into())).collect();
        Self { width, height, radiance }
    }

    /// The unit direction that texture coordinates (u, v) in [0, 1] stand for.
    pub fn direction(u: f32, v: f32) -> [f32; 3] {
        let ((sin_p, cos_p), (sin_t, cos_t)) = ((TAU * (u - 0.5)).sin_cos(), (PI * v).sin_cos());
        [sin_t * sin_p, cos_t, -sin_t * cos_p]
    }

    /// Brings values into range; the number of texels that needed it.
    fn clamp(&mut self) -> u64 {
        let mut clamped = 0;
        for texel in &mut self.radiance {
            let valid = texel.map(|x| if x == f32::INFINITY { BRIGHTEST_HALF } else { x.max(0.0) });
            // NaN differs from itself, and max() has replaced it.
            clamped += u64::from(valid != *texel);
            *texel = valid;
        }
        clamped
    }

    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let texel = |x: u32, y: u32| Vec3::from(self.radiance[y as usize * self.width as usize + x as usize]) * 0.25;
        let block = |x, y| texel(x, y) + texel(x + 1, y) + texel(x, y + 1) + texel(x + 1, y + 1);
        let blocks = (0..height).flat_map(|y| (0..width).map(move |x| (2 * x, 2 * y)));
        Self { width, height, radiance: blocks.map(|(x, y)| block(x, y).into()).collect() }
    }
}

fn sky(direction: Vec3) -> [f32; 3] {
    const ZENITH: Vec3 = Vec3::new(0.18, 0.36, 0.75);
    const HORIZON: Vec3 = Vec3::new(0.85, 0.92, 1.0);
    const GROUND: Vec3 = Vec3::new(0.22, 0.19, 0.16);
    const SUN: Vec3 = Vec3::new(1.0, 0.82, 0.6);
    let haze = (1.0 - direction.y.abs()).powi(4);
    if direction.y < 0.0 {
        return GROUND.lerp(HORIZON, 0.6 * haze * haze).into();
    }
    let cosine = direction.dot(Vec3::new(0.55, 0.6, 0.58).normalize());
    // A lobe of about four degrees, and a wide glow around it.
    let sun = 60.0 * (200.0 * (cosine - 1.0)).exp() + 1.0 * (8.0 * (cosine - 1.0)).exp();
    (ZENITH.lerp(HORIZON, haze) + SUN * sun).into()
}

const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Checks a size before anything of that size is allocated.
fn check_size(width: usize, height: usize, limits: &Limits) -> std::result::Result<(), String> {
    let side = limits.image_side as usize;
    if width == 0 || height == 0 || width > side || height > side {
        return Err(format!("{width} x {height} texels are out of bounds"));
    }
    let bytes = width as u64 * height as u64 * 12;
    if bytes > limits.image_decode_bytes { Err(format!("{bytes} bytes of texels are out of bounds")) } else { Ok(()) }
}

fn decode_exr(bytes: &[u8], limits: &Limits) -> std::result::Result<Environment, String> {
    let cause = |e: exr::error::Error| format!("damaged or unsupported OpenEXR: {e}");
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(cause)?;
    for header in &meta.headers {
        check_size(header.layer_size.width(), header.layer_size.height(), limits)?;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size: exr::math::Vec2<usize>, _: &_| (size.width(), vec![[0f32; 3]; size.area()]),
            |(width, texels): &mut (usize, Vec<[f32; 3]>), at, (r, g, b): (f32, f32, f32)| {
                if let Some(texel) = texels.get_mut(at.y() * *width + at.x()) {
                    *texel = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(cause)?;
    let size = image.layer_data.size;
    let (_, radiance) = image.layer_data.channel_data.pixels;
    check_size(size.width(), size.height(), limits)?;
    Ok(Environment { width: size.width() as u32, height: size.height() as u32, radiance })
}

fn decode_hdr(bytes: &[u8], limits: &Limits) -> std::result::Result<Environment, String> {
    let open = || {
        let mut reader = image::ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Hdr);
        let mut bounds = image::Limits::default();
        bounds.max_image_width = Some(limits.image_side);
        bounds.max_image_height = Some(limits.image_side);
        bounds.max_alloc = Some(limits.image_decode_bytes);
        reader.limits(bounds);
        reader
    };
    let cause = |e: image::ImageError| format!("damaged Radiance HDR: {e}");
    let (width, height) = open().into_dimensions().map_err(cause)?;
    check_size(width as usize, height as usize, limits)?;
    let pixels = open().decode().map_err(cause)?.into_rgb32f();
    Ok(Environment { width, height, radiance: pixels.pixels().map(|p| p.0).collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map");
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    /// A flat (not run-length coded) 2 x 1 map: mantissas over 256 times 2^(exponent - 128).
    const HDR: &[u8] = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x40\x20\x81\x00\x00\x00\x00";

    fn exr(texels: [[f32; 3]; 2]) -> Vec<u8> {
        use exr::prelude::WritableImage;
        let mut bytes = Cursor::new(Vec::new());
        let channels = exr::prelude::SpecificChannels::rgb(|at: exr::math::Vec2<usize>| {
            let [r, g, b] = texels[at.x()];
            (r, g, b)
        });
        exr::prelude::Image::from_channels((2, 1), channels).write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn hdr_values() {
        let (_folder, path) = file(HDR);
        let (map, warnings) = Environment::load(&path, &Limits::default()).unwrap();
        assert_eq!((map.width, map.height), (2, 1));
        assert!(warnings.is_empty());
        assert!((map.radiance[0][0] / map.radiance[0][1] - 2.0).abs() < 0.02 && map.radiance[1] == [0.0; 3]);
    }

    #[test]
    fn exr_values_are_clamped_and_counted() {
        let (_folder, path) = file(&exr([[1.5, 2.0, 0.25], [f32::NAN, -1.0, f32::INFINITY]]));
        let (map, warnings) = Environment::load(&path, &Limits::default()).unwrap();
        assert_eq!(map.radiance, [[1.5, 2.0, 0.25], [0.0, 0.0, BRIGHTEST_HALF]]);
        assert!(warnings.len() == 1 && warnings[0].contains(" 1 negative"), "{warnings:?}");
        let strict = Limits { strict: true, ..Limits::default() };
        assert!(Environment::load(&path, &strict).is_err());
    }

    #[test]
    fn cut_and_foreign_files_are_errors() {
        let whole = exr([[1.0; 3]; 2]);
        let limits = Limits::default();
        assert!((0..whole.len()).all(|n| Environment::decode(&whole[..n], &limits).is_err()));
        assert!((0..HDR.len()).all(|n| Environment::decode(&HDR[..n], &limits).is_err()));
        assert!(Environment::decode(b"P6 1 1 255 abc", &limits).is_err());
        let small = Limits { image_side: 1, ..limits };
        assert!(Environment::decode(&whole, &small).is_err() && Environment::decode(HDR, &small).is_err());
    }

    #[test]
    fn large_maps_are_halved_keeping_the_mean() {
        let limits = Limits { image_bytes: 12, ..Limits::default() };
        let map = Environment { width: 4, height: 2, radiance: (0..8).map(|i| [i as f32; 3]).collect() };
        let half = map.halved();
        assert_eq!(half.radiance, [[2.5; 3], [4.5; 3]]);
        let (_, warnings) = Environment::decode(HDR, &limits).unwrap();
        assert!(warnings.is_empty(), "one row cannot be halved");
    }

    #[test]
    fn directions_follow_the_convention() {
        let close = |a: [f32; 3], b: [f32; 3]| assert!(Vec3::from(a).distance(b.into()) < 1e-6, "{a:?} {b:?}");
        close(Environment::direction(0.3, 0.0), [0.0, 1.0, 0.0]);
        close(Environment::direction(0.5, 0.5), [0.0, 0.0, -1.0]);
        close(Environment::direction(0.75, 0.5), [1.0, 0.0, 0.0]);
        close(Environment::direction(0.0, 0.5), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn the_sky_is_finite_positive_and_brightest_at_the_sun() {
        let sky = Environment::default_sky();
        assert_eq!(sky.radiance.len(), 128 * 64);
        assert!(sky.radiance.iter().flatten().all(|x| x.is_finite() && *x > 0.0));
        let brightest = (0..sky.radiance.len()).max_by(|&a, &b| sky.radiance[a][0].total_cmp(&sky.radiance[b][0]));
        let (x, y) = (brightest.unwrap() % 128, brightest.unwrap() / 128);
        let direction = Environment::direction((x as f32 + 0.5) / 128.0, (y as f32 + 0.5) / 64.0);
        assert!(Vec3::from(direction).dot(Vec3::new(0.55, 0.6, 0.58).normalize()) > 0.998);
    }
}
