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
        let choices = Choices { environment: environment.file(), variant: self.variant.clone() };
        scene::load_with(scene, &choices, &Limits { strict: self.strict, ..Limits::default() })
    }
}
