//! The device as the rest of the crate sees it.

use super::buffer::Buffer;
use super::cache::{CacheFile, default_cache_dir};
use super::call::lock;
use super::core::Core;
use super::features::{Feature, Features};
use super::image::Image;
use super::image_kind::ImageKind;
use super::instance::{Instance, NEWEST, ValidationLog};
use super::limits::{DeviceInfo, candidates};
use super::memory::{MemoryUse, Place};
use super::pipeline::{Pipeline, PipelineDesc};
use super::pipeline_store::PipelineStore;
use super::probe;
use super::raster_pipeline::RasterDesc;
use super::record::Recorder;
use super::select::DeviceSelect;
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

/// All physical devices, in the order of their numbers, usable or not.
///
/// # Errors
/// [`Error::NoDevice`] without a Vulkan loader or driver; [`Error::Vulkan`] if enumeration fails. The list may be
/// empty.
pub fn devices() -> Result<Vec<DeviceInfo>> {
    let instance = Instance::new(false, NEWEST)?;
    Ok(candidates(&instance)?.into_iter().map(|candidate| candidate.info).collect())
}

impl Device {
    /// Opens a device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if nothing fits `options.select` or the validation layers are missing,
    /// [`Error::MissingFeature`] if what was chosen cannot run any kernel of this crate, [`Error::Vulkan`] otherwise.
    pub fn open(options: &DeviceOptions) -> Result<Arc<Self>> {
        Self::open_version(options, NEWEST)
    }

    /// Opens a device as if the loader knew nothing beyond Vulkan `newest`.
    fn open_version(options: &DeviceOptions, newest: u32) -> Result<Arc<Self>> {
        Self::open_changed(options, newest, |_| ())
    }

    /// The same with what `change` makes of the device's abilities.
    fn open_changed(options: &DeviceOptions, newest: u32, change: impl FnOnce(&mut Features)) -> Result<Arc<Self>> {
        let forced = std::env::var_os("NEPHROID_VALIDATE").is_some_and(|value| value == "1");
        let validate = options.validate || forced;
        let instance = Instance::new(validate, newest)?;
        let mut candidate = options.select.choose(candidates(&instance)?)?;
        change(&mut candidate.info.features);
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
        let (device, feature) = (self.core.info.name.clone(), missing.join(", "));
        Err(Error::MissingFeature { device, feature, settings: &[] })
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
        lock(&self.core.memory).all
    }

    /// Begins the peak of [`Self::memory`] anew with what is in use now: to measure one render of many.
    pub fn restart_memory_peak(&self) {
        let all = &mut lock(&self.core.memory).all;
        all.peak = all.current;
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

    /// The pipeline for the draws of `desc`, made at the first request and shared afterwards.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] if the device has no graphics passes, or no geometry kernels or depth clamping where
    /// `desc` asks for them, or binds too few buffers; [`Error::Vulkan`] if the driver refuses the kernels.
    ///
    /// # Panics
    /// If the description is impossible on every device: see [`PipelineDesc`].
    pub fn raster_pipeline(&self, desc: &RasterDesc<'_>) -> Result<Arc<Pipeline>> {
        self.require(&desc.needs())?;
        self.pipelines.get_raster(desc)
    }

    /// A new attachment of graphics passes with undefined content.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] without graphics passes or beyond [`super::Limits::image_side`],
    /// [`Error::OutOfMemory`] if the device cannot hold it, [`Error::Vulkan`] if the driver fails.
    ///
    /// # Panics
    /// If a side is 0.
    pub fn image(&self, name: &str, extent: [u32; 2], kind: ImageKind) -> Result<Image> {
        self.require(&[Feature::Raster])?;
        Image::new(&self.core, name, extent, kind)
    }

    /// Starts recording commands; `name` shows in debuggers and errors.
    ///
    /// # Errors
    /// [`Error::Vulkan`] if the driver cannot make a command buffer.
    pub fn recorder(&self, name: &str) -> Result<Recorder> {
        Recorder::new(&self.core, name)
    }

    /// After how many iterations this driver silently ends the loops of an invocation, if it does (Mesa's lavapipe
    /// before 23: 65535 over all loops together). Found by running a loop of 2^20 iterations, once.
    /// Where the probe itself fails, the known limit is assumed.
    pub fn loop_limit(&self) -> Option<u32> {
        let measure = || probe::loop_limit(&self.core, &self.pipelines).unwrap_or(Some(probe::ASSUMED));
        *self.loop_limit.get_or_init(measure)
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

#[cfg(test)]
mod tests {
    use super::*;

    fn options() -> DeviceOptions {
        DeviceOptions { validate: true, cache: None, ..DeviceOptions::default() }
    }

    /// Timestamps, barriers, submission and subgroup features come from extensions then.
    #[test]
    fn vulkan_1_2_with_extensions_does_the_same() {
        let device = Device::open_version(&options(), ash::vk::API_VERSION_1_2).unwrap();
        assert_eq!(device.info().api_version.1, 2);
        assert!(matches!(device.core.sync2, crate::vk::core::Sync2::Extension(_)));
        let newest = Device::open(&options()).unwrap();
        assert_eq!(device.info().features, newest.info().features);
        assert_eq!(device.loop_limit(), newest.loop_limit());
        let target = device.buffer("target", 64, Place::Readback).unwrap();
        let mut recorder = device.recorder("old").unwrap();
        recorder.begin_scope("fill");
        recorder.fill(&target, 0, 64, 0x0102_0304);
        recorder.end_scope();
        if device.info().features.raster {
            let image = device.image("image", [2, 1], ImageKind::Colour).unwrap();
            let picture = crate::vk::Picture { colours: &[&image], depth: None };
            recorder.begin_picture(&picture);
            recorder.end_picture(&picture);
            recorder.barrier();
            recorder.copy_image(&image, &target, 32);
        }
        let commands = recorder.finish().unwrap();
        commands.submit().unwrap().wait().unwrap();
        let mut bytes = [0; 64];
        target.read(0, &mut bytes);
        assert_eq!(bytes[..32], [4, 3, 2, 1].repeat(8)[..]);
        let second = if device.info().features.raster { [0; 4] } else { [4, 3, 2, 1] };
        assert_eq!(bytes[32..], second.repeat(8)[..]);
        assert_eq!(commands.timings().len(), usize::from(device.info().features.timestamps));
        device.check_validation().unwrap();
    }

    /// Barriers name no stages of graphics then, and nothing is enabled for it.
    #[test]
    fn a_device_without_graphics_does_all_but_draw() {
        let device = Device::open_changed(&options(), NEWEST, Features::without_graphics).unwrap();
        let newest = Device::open(&options()).unwrap();
        assert_eq!(device.loop_limit(), newest.loop_limit(), "a kernel runs");
        let refused = device.image("image", [2, 2], ImageKind::Colour).err().expect("there are no pictures");
        assert!(matches!(&refused, Error::MissingFeature { feature, .. } if feature.contains("graphics passes")));
        assert_eq!(refused.exit_code(), 3);
        let runtime = crate::graph::Runtime::new(device);
        let mut g = crate::graph::Graph::new();
        let mut target = g.buffer("target", 4);
        let pass = crate::graph::RasterPass { name: "empty", extent: [2, 2], depth: None };
        g.raster(pass, vec![], [&mut target]);
        g.keep(&target);
        let refused = runtime.prepare(&g.plan().unwrap()).err().expect("a plan that draws");
        assert!(refused.to_string().contains("graphics passes"), "{refused}");
        runtime.device().check_validation().unwrap();
    }

    #[test]
    fn a_device_that_does_not_answer_in_time_is_lost() {
        let options = DeviceOptions { wait_limit: Duration::ZERO, ..options() };
        let device = Device::open(&options).unwrap();
        let buffer = device.buffer("busy", 1 << 26, Place::Device).unwrap();
        let mut recorder = device.recorder("busy").unwrap();
        for index in 0..200 {
            recorder.begin_scope(&format!("fill {index}"));
            recorder.fill(&buffer, 0, buffer.bytes(), index);
            recorder.end_scope();
            recorder.barrier();
        }
        let commands = recorder.finish().unwrap();
        let run = commands.submit().unwrap();
        let lost = run.wait().expect_err("200 fills of 64 MiB take longer than no time");
        let Error::DeviceLost { last_finished_scope: scope } = lost else { panic!("{lost:?}") };
        assert!(scope.ends_with("of 'busy'") && !scope.contains("fill 199"), "{scope}");
        assert!(commands.submit().is_err(), "nothing more is given to a device that hangs");
        // It was only slow: the process must not end while a driver's thread is at work.
        while !run.is_done().unwrap() {
            std::thread::sleep(Duration::from_millis(5));
        }
        run.wait().unwrap();
        assert_eq!(commands.state.last_finished(), "'fill 199' of 'busy'");
    }

    #[test]
    fn timestamps_stand_in_for_markers() {
        let device = Device::open(&DeviceOptions { cache: None, ..DeviceOptions::default() }).unwrap();
        if device.is_validating() || !device.info().features.timestamps {
            return;
        }
        let mut recorder = device.recorder("plain").unwrap();
        recorder.begin_scope("only");
        recorder.end_scope();
        let commands = recorder.finish().unwrap();
        assert!(commands.state.markers.is_none());
        commands.submit().unwrap().wait().unwrap();
        assert_eq!(commands.state.last_finished(), "'only' of 'plain'");
    }

    #[test]
    fn handles_may_cross_threads() {
        fn shared<T: Send + Sync>() {}
        shared::<Device>();
        shared::<crate::vk::Buffer>();
        shared::<crate::vk::Pipeline>();
        shared::<crate::vk::Commands>();
        shared::<crate::vk::Submission>();
        shared::<Recorder>();
        let device = Device::open(&options()).unwrap();
        std::thread::scope(|scope| {
            for thread in 0..4u32 {
                let device = &device;
                scope.spawn(move || {
                    for round in 0..20 {
                        let target = device.buffer("target", 64, Place::Readback).unwrap();
                        let mut recorder = device.recorder("thread").unwrap();
                        recorder.fill(&target, 0, 64, thread * 1000 + round);
                        recorder.finish().unwrap().submit().unwrap().wait().unwrap();
                        let mut word = [0; 4];
                        target.read(60, &mut word);
                        assert_eq!(u32::from_ne_bytes(word), thread * 1000 + round);
                    }
                });
            }
        });
        device.check_validation().unwrap();
    }
}
