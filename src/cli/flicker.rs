//! `nephroid flicker`: how much the frames of a sequence flicker where nothing moves.

use std::path::PathBuf;

use clap::Args;

use super::console::print;
use super::numbers::percent;
use crate::compare::flicker::Flicker;
use crate::error::{Error, Result};
use crate::picture::exr;

const EXAMPLES: &str = "\
Examples:
  nephroid flicker fox_*.exr
  nephroid animate fox.glb -o fox_####.exr --aov depth,normal,albedo && nephroid flicker fox_*.exr";

/// Flags of `nephroid flicker`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct FlickerArgs {
    /// Frames in their order, three at least (.exr). Pixels that move are left out by the layers depth, normal, albedo
    /// and error, those that are there
    #[arg(value_name = "FRAME", num_args = 3.., required = true)]
    frames: Vec<PathBuf>,

    /// Print JSON instead of text
    #[arg(long)]
    json: bool,
}

/// Reads the frames and prints their flicker index.
///
/// # Errors
/// Those of [`exr::read`], and [`Error::Usage`] for frames that differ in size.
pub fn run(args: &FlickerArgs) -> Result<()> {
    let mut flicker = Flicker::default();
    let mut last = Vec::new();
    for path in &args.frames {
        last.push(exr::read(path)?.0);
        if let [a, b, c] = last.as_slice() {
            let added = flicker.add([a, b, c]);
            added.map_err(|error| Error::Usage(format!("{}: {error}", path.display())))?;
            last.remove(0);
        }
    }
    let (index, share, triples) = (flicker.index(), flicker.still_share(), flicker.triples());
    if args.json {
        let json = serde_json::json!({ "flicker": index, "still_share": share, "triples": triples });
        return print(&format!("{json:#}"));
    }
    let index = index.map_or("none: nothing stays and shines".into(), |index| format!("{index:.6}"));
    print(&format!("flicker index {index}, over {} of the pixels of {triples} triples", percent(share)))
}
