//! The group of flags about the environment map.

use std::path::PathBuf;

use clap::Args;

use crate::scene::EnvironmentFile;

/// The map that lights the scene from infinity.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Light")]
pub struct EnvironmentArgs {
    /// Environment map that lights the scene from infinity, equirectangular (.exr or .hdr). A scene without any light
    /// gets a plain sky
    #[arg(long, value_name = "FILE")]
    pub environment: Option<PathBuf>,

    /// Turn the environment map about +Y, counter-clockwise seen from above: 90 brings what was in front (-Z) to the
    /// left (-X)
    #[arg(long, value_name = "DEGREES", default_value = "0", value_parser = degrees, requires = "environment",
          allow_negative_numbers = true)]
    pub environment_rotation: f32,

    /// Multiply the radiance of the environment map
    #[arg(long, value_name = "X", default_value = "1", value_parser = factor, requires = "environment",
          allow_negative_numbers = true)]
    pub environment_scale: f32,
}

impl EnvironmentArgs {
    /// The map as it is wanted, if there is one.
    pub fn file(&self) -> Option<EnvironmentFile> {
        self.environment.clone().map(|path| EnvironmentFile {
            path,
            rotation: self.environment_rotation,
            scale: self.environment_scale,
        })
    }
}

fn degrees(text: &str) -> std::result::Result<f32, String> {
    let degrees = text.parse::<f32>().ok().filter(|degrees| degrees.abs() <= 36000.0);
    degrees.ok_or_else(|| "expected an angle in degrees between -36000 and 36000, for example -90".into())
}

fn factor(text: &str) -> std::result::Result<f32, String> {
    let factor = text.parse::<f32>().ok().filter(|factor| (0.0..=1e9).contains(factor));
    factor.ok_or_else(|| "expected a factor between 0 and 1e9, for example 0.5".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_factors_are_bounded() {
        assert_eq!((degrees("-90.5"), factor("2.5e-1")), (Ok(-90.5), Ok(0.25)));
        assert!(["nan", "inf", "1e6", "", "90deg"].iter().all(|text| degrees(text).is_err()));
        assert!(["nan", "inf", "-1", "1e10", ""].iter().all(|text| factor(text).is_err()));
        assert_eq!(factor("0"), Ok(0.0));
    }
}
