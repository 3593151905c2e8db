//! `nephroid bench`: the speed of each kernel beside its floor.

use clap::Args;

use super::flags::DeviceArgs;
use crate::error::{Error, Result};

const EXAMPLES: &str = "\
Example:
  nephroid bench --device cpu";

/// Flags of `nephroid bench`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BenchArgs {
    /// Where to measure.
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Measures scan, sort, tree build, rays, photons and gathering, and prints a table.
///
/// # Errors
/// Those of the device.
pub fn run(args: &BenchArgs) -> Result<()> {
    let device = args.device.device.as_deref().unwrap_or("the default device");
    Err(Error::Usage(format!("this build cannot measure {device} yet")))
}
