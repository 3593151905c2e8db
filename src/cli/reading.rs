//! The group of flags about how a scene is read.

use std::path::Path;

use clap::Args;

use super::environment::EnvironmentArgs;
use crate::error::Result;
use crate::scene::{self, Choices, Limits, Scene};

/// How a scene is read.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Scene")]
pub struct ReadingArgs {
    /// Variant of the materials, by name or by index from 0 (KHR_materials_variants); without it the materials are
    /// those that the file shows by default
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,

    /// Animation, by name or by index from 0; without it every animation is played that moves nothing which an earlier
    /// one of the file moves: of several gaits of one figure the first
    #[arg(long, value_name = "NAME")]
    pub animation: Option<String>,

    /// Refuse a scene in which something is wrong, instead of a warning and a picture without it
    #[arg(long)]
    pub strict: bool,
}

impl ReadingArgs {
    /// Loads a scene with its environment.
    ///
    /// # Errors
    /// Those of [`scene::load_with`].
    pub fn load(&self, scene: &Path, environment: &EnvironmentArgs) -> Result<Scene> {
        let (variant, animation) = (self.variant.clone(), self.animation.clone());
        let choices = Choices { environment: environment.file(), variant, animation };
        scene::load_with(scene, &choices, &Limits { strict: self.strict, ..Limits::default() })
    }
}
