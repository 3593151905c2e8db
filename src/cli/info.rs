//! `nephroid info`: what a scene holds and what rendering it needs.

use std::path::PathBuf;

use clap::Args;

use crate::error::{Error, Result};

const EXAMPLES: &str = "\
Example:
  nephroid info cup.glb";

/// Flags of `nephroid info`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct InfoArgs {
    /// glTF 2.0 scene (.gltf or .glb)
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// Environment map to assume (.exr or .hdr)
    #[arg(long, value_name = "FILE")]
    pub environment: Option<PathBuf>,
}

/// Prints triangles, lights, materials and bytes, and which parts of the renderer the scene leaves out.
///
/// # Errors
/// Those of loading the scene.
pub fn run(args: &InfoArgs) -> Result<()> {
    super::check_readable(&args.scene)?;
    args.environment.iter().try_for_each(|path| super::check_readable(path))?;
    Err(Error::Usage("this build cannot load scenes yet".into()))
}
