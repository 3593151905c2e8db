//! `nephroid devices`: the Vulkan devices and what each lacks.

use clap::Args;

use crate::error::{Error, Result};

/// Flags of `nephroid devices`.
#[derive(Debug, Args)]
pub struct DevicesArgs {}

/// Lists index, name, kind and driver of every device, and what it lacks for nephroid.
///
/// # Errors
/// [`Error::NoDevice`] if there is no Vulkan loader.
pub fn run(_: &DevicesArgs) -> Result<()> {
    Err(Error::Usage("this build cannot list devices yet".into()))
}
