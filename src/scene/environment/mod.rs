//! Light from infinity: equirectangular maps from .exr and .hdr files, and a procedural sky.

mod canvas;
mod color;
mod exr;
mod hdr;
mod read;
mod turn;

use std::f32::consts::{PI, TAU};
use std::path::{Path, PathBuf};

use glam::Vec3;

use self::read::Reading;
use super::Environment;
use super::load::Limits;
use crate::error::{Error, Result};
use crate::input;

/// An environment map as the user asks for it.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentFile {
    /// OpenEXR or Radiance HDR.
    pub path: PathBuf,
    /// Angle in degrees by which it is turned about +Y, counter-clockwise seen from above.
    pub rotation: f32,
    /// Factor of its radiance, at least 0.
    pub scale: f32,
}

impl EnvironmentFile {
    /// The map in this file as it is.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), rotation: 0.0, scale: 1.0 }
    }

    /// Reads the map, turns and scales it; with warnings.
    ///
    /// # Errors
    /// Those of [`Environment::load`].
    pub fn load(&self, limits: &Limits) -> Result<(Environment, Vec<String>)> {
        let (mut map, warnings) = Environment::load(&self.path, limits)?;
        map.turn(self.rotation);
        map.scale(self.scale);
        Ok((map, warnings))
    }
}

impl Environment {
    /// Reads an equirectangular map from an OpenEXR or Radiance HDR file (told apart by their first bytes), with
    /// warnings. Colours become linear Rec. 709. NaN and negative values become 0, infinite ones 65504; maps larger
    /// than [`Limits::image_bytes`], or than a file of this length can account for, are halved until they fit.
    ///
    /// Of an OpenEXR file the display window is read, black where it has no pixels. Of several layers it is the one
    /// without a name, or one that is called so as the whole picture is, or the first; a luminance Y is grey.
    ///
    /// # Errors
    /// [`Error::Io`] if the file cannot be read, [`Error::Scene`] if it is damaged, of another kind, or too large;
    /// with [`Limits::strict`] also if something was clamped or ignored.
    pub fn load(path: &Path, limits: &Limits) -> Result<(Self, Vec<String>)> {
        let bytes = input::read(path, limits.file_bytes)?;
        Self::decode(&bytes, limits).map_err(|cause| Error::scene(path, cause))
    }

    fn decode(bytes: &[u8], limits: &Limits) -> read::Outcome<(Self, Vec<String>)> {
        let mut reading = Reading::new(bytes.len() as u64, limits);
        let canvas = if exr::is_ours(bytes) {
            exr::decode(bytes, &mut reading)?
        } else if hdr::is_ours(bytes) {
            hdr::decode(bytes, &mut reading)?
        } else {
            return Err("neither OpenEXR nor Radiance HDR".into());
        };
        let clamped = canvas.clamped;
        let (map, notes) = canvas.finish();
        Ok((map, reading.finish(clamped, notes)?))
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

#[cfg(test)]
mod tests;
