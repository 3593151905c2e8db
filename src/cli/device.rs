//! The device that a command runs on.

use clap::Args;

use crate::error::Result;
use crate::graph::Runtime;
use crate::vk::{Device, DeviceOptions};

/// The choice of a device.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Device")]
pub struct DeviceArgs {
    /// Device to use: an index of `nephroid devices`, a part of its name, or `cpu`
    /// [default: the one that `nephroid devices` names: discrete, then integrated, then software]
    #[arg(long, value_name = "DEVICE")]
    pub device: Option<String>,

    /// Load the Vulkan validation layers and fail on their first message (slow)
    #[arg(long)]
    pub validate: bool,
}

impl DeviceArgs {
    /// Opens the device that the flags name.
    ///
    /// # Errors
    /// Those of [`Device::open`], and [`crate::error::Error::Setting`] for a name that cannot be one.
    pub fn open(&self) -> Result<Runtime> {
        let mut options = DeviceOptions { validate: self.validate, ..DeviceOptions::default() };
        if let Some(wanted) = &self.device {
            options.select = wanted.parse()?;
        }
        Ok(Runtime::new(Device::open(&options)?))
    }
}
