//! The device as the rest of the crate sees it.

use super::buffer::{Buffer, MemoryUse, Place};
use super::cache::{CacheFile, default_cache_dir};
use super::core::Core;
use super::features::Feature;
use super::instance::{Instance, ValidationLog};
use super::limits::{DeviceInfo, candidates};
use super::pipeline::{Pipeline, PipelineDesc, PipelineStore};
use super::record::Recorder;
use super::select::DeviceSelect;
use super::{lock, probe};
use crate::error::{Error, Result};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// How to open a device.
#[derive(Clone, Debug)]
pub struct DeviceOptions {
    /// Which one.
    pub select: DeviceSelect,
    /// Load the validation layers with synchronisation validation. `NEPHROID_VALIDATE=1` in the environment does too.
    pub validate: bool,
    /// Folder of the pipeline cache; none keeps it in memory only.
    pub cache: Option<PathBuf>,
    /// Write a crash marker after every scope, so that a lost device names the last finished one. Always on with
    /// validation; without markers the timestamps are asked, which not every driver answers after a loss.
    pub markers: bool,
    /// How long one wait may last before the device counts as lost.
    pub wait_limit: Duration,
}

impl Default for DeviceOptions {
    fn default() -> Self {
        Self {
            select: DeviceSelect::Auto,
            validate: false,
            cache: default_cache_dir(),
            markers: false,
            wait_limit: Duration::from_secs(600),
        }
    }
}

/// An open device with one compute queue. Buffers, pipelines and commands keep the underlying device alive by
/// themselves, so they may outlive this value.
pub struct Device {
    pub(super) core: Arc<Core>,
    pipelines: PipelineStore,
    loop_limit: OnceLock<Option<u32>>,
}

/// All physical devices, in the order of `--device` numbers, usable or not.
///
/// # Errors
/// [`Error::NoDevice`] without a Vulkan loader or driver; [`Error::Vulkan`] if enumeration fails. The list may be empty.
pub fn devices() -> Result<Vec<DeviceInfo>> {
    let instance = Instance::new(false)?;
    Ok(candidates(&instance)?.into_iter().map(|candidate| candidate.info).collect())
}

impl Device {
    /// Opens a device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if nothing fits `options.select` or the validation layers are missing,
    /// [`Error::MissingFeature`] if what was chosen cannot run any kernel of this crate, [`Error::Vulkan`] otherwise.
    pub fn open(options: &DeviceOptions) -> Result<Arc<Self>> {
        let forced = std::env::var_os("NEPHROID_VALIDATE").is_some_and(|value| value == "1");
        let validate = options.validate || forced;
        let instance = Instance::new(validate)?;
        let candidate = options.select.choose(candidates(&instance)?)?;
        let core = Arc::new(Core::new(instance, candidate, options.wait_limit, options.markers || validate)?);
        let file = options.cache.as_ref().map(|folder| CacheFile::new(folder, core.identity));
        let pipelines = PipelineStore::new(Arc::clone(&core), file)?;
        Ok(Arc::new(Self { core, pipelines, loop_limit: OnceLock::new() }))
    }

    /// What it is and can do.
    pub fn info(&self) -> &DeviceInfo {
        &self.core.info
    }

    /// Checks that the device has all of `needed`.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] naming every one that is missing.
    pub fn require(&self, needed: &[Feature]) -> Result<()> {
        let missing = self.core.info.features.missing(needed);
        if missing.is_empty() {
            return Ok(());
        }
        Err(Error::MissingFeature { device: self.core.info.name.clone(), feature: missing.join(", ") })
    }

    /// Whether the validation layers are loaded.
    pub fn is_validating(&self) -> bool {
        self.core.instance.validating
    }

    /// The validation messages, to be read also after the device is gone.
    pub fn validation_log(&self) -> ValidationLog {
        self.core.instance.log.clone()
    }

    /// All validation messages so far.
    pub fn validation_messages(&self) -> Vec<String> {
        self.core.instance.log.messages()
    }

    /// Fails if there was any validation message.
    ///
    /// # Errors
    /// [`Error::Validation`] with all of them.
    pub fn check_validation(&self) -> Result<()> {
        self.core.instance.log.check()
    }

    /// Bytes in buffers of this device.
    pub fn memory(&self) -> MemoryUse {
        *lock(&self.core.memory)
    }

    /// A new buffer of `bytes` bytes (0 is allowed) with undefined content.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if the device cannot hold it, [`Error::Vulkan`] if the driver fails.
    pub fn buffer(&self, name: &str, bytes: u64, place: Place) -> Result<Buffer> {
        Buffer::new(&self.core, name, bytes, place)
    }

    /// The pipeline for `desc`, made at the first request and shared afterwards.
    ///
    /// # Errors
    /// [`Error::Vulkan`] if the driver refuses the kernel, [`Error::MissingFeature`] if it binds more buffers than the
    /// device allows.
    ///
    /// # Panics
    /// If the description is impossible on every device: see [`PipelineDesc`].
    pub fn pipeline(&self, desc: &PipelineDesc<'_>) -> Result<Arc<Pipeline>> {
        self.pipelines.get(desc)
    }

    /// Starts recording commands; `name` shows in debuggers and errors.
    ///
    /// # Errors
    /// [`Error::Vulkan`] if the driver cannot make a command buffer.
    pub fn recorder(&self, name: &str) -> Result<Recorder> {
        Recorder::new(&self.core, name)
    }

    /// After how many iterations this driver silently ends the loops of an invocation, if it does (Mesa's lavapipe
    /// before 23: 65535 over all loops together). Found by running a loop of [`probe::WANTED`] iterations, once.
    /// Where the probe itself fails, the known limit is assumed.
    pub fn loop_limit(&self) -> Option<u32> {
        *self.loop_limit.get_or_init(|| probe::loop_limit(self).unwrap_or(Some(probe::ASSUMED)))
    }

    /// Waits until everything submitted so far has finished.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] if it does not within [`DeviceOptions::wait_limit`].
    pub fn wait_idle(&self) -> Result<()> {
        if self.core.wait_idle() {
            return Ok(());
        }
        Err(Error::DeviceLost { last_finished_scope: "unknown (while waiting for the whole queue)".to_owned() })
    }
}
