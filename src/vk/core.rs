//! The logical device that everything else holds a share of: queue, timeline, allocator, finite waits, tear-down.

use super::call::{c_string, failed, lock};
use super::features::FeatureChain;
use super::instance::Instance;
use super::limits::{Candidate, DeviceInfo, Identity};
use super::memory::Accounts;
use crate::error::{Error, Result};
use crate::injection::{Step, fails};
use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::mem::ManuallyDrop;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Waits are cut into slices: drivers are known to hang on an infinite one.
const WAIT_SLICE: Duration = Duration::from_secs(10);

/// Block sizes of the allocator; larger buffers get memory of their own.
const DEVICE_BLOCK: u64 = 64 << 20;
const HOST_BLOCK: u64 = 16 << 20;

/// The functions of synchronization2, from Vulkan 1.3 or from the extension.
pub(super) enum Sync2 {
    /// The device's own functions.
    Promoted,
    Extension(khr::synchronization2::Device),
}

/// The functions of dynamic rendering, likewise; none where graphics passes are not possible.
pub(super) enum Rendering {
    /// The device's own functions.
    Promoted,
    Extension(khr::dynamic_rendering::Device),
    Absent,
}

/// The queue and the value that its next submission signals.
struct Queue {
    raw: vk::Queue,
    submitted: u64,
}

/// A logical device; freed when its last user is.
pub(super) struct Core {
    pub raw: ash::Device,
    pub sync2: Sync2,
    pub rendering: Rendering,
    pub info: DeviceInfo,
    pub identity: Identity,
    pub queue_family: u32,
    pub markers: bool,
    pub memory: Mutex<Accounts>,
    pub allocator: ManuallyDrop<Mutex<Allocator>>,
    pub instance: ManuallyDrop<Instance>,
    labels: Option<ext::debug_utils::Device>,
    queue: Mutex<Queue>,
    timeline: vk::Semaphore,
    wait_limit: Duration,
    lost: AtomicBool,
    /// Set once a wait ran into `wait_limit`; later waits only look.
    hung: AtomicBool,
}

impl Core {
    /// Opens `candidate`, of which everything that is present is enabled.
    pub fn new(instance: Instance, candidate: Candidate, wait_limit: Duration, markers: bool) -> Result<Self> {
        let name = candidate.info.name.clone();
        let queue_family = candidate.queue_family.ok_or_else(|| Error::NoDevice(format!("'{name}' cannot compute")))?;
        let raw = create_device(&instance, &candidate, queue_family)?;
        // SAFETY: family and index 0 are those the device was created with
        // (VUID-vkGetDeviceQueue-queueFamilyIndex-00384).
        let queue = Queue { raw: unsafe { raw.get_device_queue(queue_family, 0) }, submitted: 0 };
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: timeline semaphores are enabled (VUID-VkSemaphoreTypeCreateInfo-timelineSemaphore-03252).
        let timeline = unsafe { raw.create_semaphore(&info, None) }.map_err(|code| {
            destroy(&raw, vk::Semaphore::null());
            failed("vkCreateSemaphore", &name)(code)
        })?;
        let allocator = create_allocator(&instance, &raw, candidate.raw).inspect_err(|_| destroy(&raw, timeline))?;
        let sync2 = if candidate.version >= vk::API_VERSION_1_3 {
            Sync2::Promoted
        } else {
            Sync2::Extension(khr::synchronization2::Device::new(&instance.raw, &raw))
        };
        let rendering = match candidate.info.features.raster {
            false => Rendering::Absent,
            true if candidate.version >= vk::API_VERSION_1_3 => Rendering::Promoted,
            true => Rendering::Extension(khr::dynamic_rendering::Device::new(&instance.raw, &raw)),
        };
        let labels = instance.debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        Ok(Self {
            raw,
            sync2,
            rendering,
            info: candidate.info,
            identity: candidate.identity,
            queue_family,
            markers,
            memory: Mutex::default(),
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            instance: ManuallyDrop::new(instance),
            labels,
            queue: Mutex::new(queue),
            timeline,
            wait_limit,
            lost: AtomicBool::new(false),
            hung: AtomicBool::new(false),
        })
    }

    /// Names an object for debuggers and validation messages; without VK_EXT_debug_utils nothing happens.
    pub fn set_name<H: vk::Handle>(&self, object: H, name: &str) {
        if let Some(labels) = &self.labels {
            let name = c_string(name);
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
            // SAFETY: the object belongs to this device and is alive; callers name what they have just created and
            // not yet shared (host access must be synchronised). A failed naming has no effect on anything.
            let _ = unsafe { labels.set_debug_utils_object_name(&info) };
        }
    }

    /// Opens a label in a command buffer that is being recorded.
    pub fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        if let Some(labels) = &self.labels {
            let name = c_string(name);
            // SAFETY: callers pass a command buffer in the recording state that they own exclusively.
            unsafe {
                labels.cmd_begin_debug_utils_label(commands, &vk::DebugUtilsLabelEXT::default().label_name(&name))
            };
        }
    }

    /// Closes the label opened last.
    pub fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(labels) = &self.labels {
            // SAFETY: as in `begin_label`, and a label is open (VUID-vkCmdEndDebugUtilsLabelEXT-commandBuffer-01912).
            unsafe { labels.cmd_end_debug_utils_label(commands) };
        }
    }

    /// Submits; the returned timeline value is reached when `commands` has finished.
    pub fn submit(&self, commands: vk::CommandBuffer, name: &str) -> Result<u64> {
        if self.lost.load(Ordering::Relaxed) || self.hung.load(Ordering::Relaxed) {
            return Err(failed("vkQueueSubmit2", name)(vk::Result::ERROR_DEVICE_LOST));
        }
        let mut queue = lock(&self.queue);
        let value = queue.submitted + 1;
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.timeline)
            .value(value)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let info = vk::SubmitInfo2::default().command_buffer_infos(&buffers).signal_semaphore_infos(&signals);
        if fails(Step::Submit) {
            self.note(vk::Result::ERROR_DEVICE_LOST);
            return Err(failed("vkQueueSubmit2", name)(vk::Result::ERROR_DEVICE_LOST));
        }
        // SAFETY: the queue is externally synchronised by the lock; signal values increase strictly under that lock
        // (VUID-VkSubmitInfo2-semaphore-03882); the command buffer is executable, allows simultaneous use
        // (VUID-vkQueueSubmit2-commandBuffer-03875), and the caller keeps it and all it names until `value` is reached.
        let done = unsafe {
            match &self.sync2 {
                Sync2::Promoted => self.raw.queue_submit2(queue.raw, &[info], vk::Fence::null()),
                Sync2::Extension(fns) => fns.queue_submit2(queue.raw, &[info], vk::Fence::null()),
            }
        };
        match done {
            Ok(()) => queue.submitted = value,
            Err(code) => {
                self.note(code);
                return Err(failed("vkQueueSubmit2", name)(code));
            }
        }
        Ok(value)
    }

    /// Waits until the timeline reaches `value`; false if the device was lost or the limit of patience is reached.
    pub fn wait(&self, value: u64, name: &str) -> Result<bool> {
        let begin = Instant::now();
        let limit = if self.hung.load(Ordering::Relaxed) { Duration::ZERO } else { self.wait_limit };
        let semaphores = [self.timeline];
        let values = [value];
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        loop {
            let left = limit.saturating_sub(begin.elapsed()).min(WAIT_SLICE);
            // SAFETY: the timeline belongs to this device and is alive as long as `self`.
            match unsafe { self.raw.wait_semaphores(&info, left.as_nanos() as u64) } {
                // A fault on request comes when the work has ended: memory that is in use could not be freed.
                Ok(()) if fails(Step::Wait) => {
                    self.note(vk::Result::ERROR_DEVICE_LOST);
                    return Ok(false);
                }
                Ok(()) => return Ok(true),
                Err(vk::Result::TIMEOUT) if begin.elapsed() < limit => {}
                Err(code @ (vk::Result::TIMEOUT | vk::Result::ERROR_DEVICE_LOST)) => {
                    self.note(code);
                    return Ok(false);
                }
                Err(code) => return Err(failed("vkWaitSemaphores", name)(code)),
            }
        }
    }

    /// Whether the timeline has reached `value`.
    pub fn reached(&self, value: u64) -> Result<bool> {
        // SAFETY: the timeline belongs to this device and is alive as long as `self`.
        let now = unsafe { self.raw.get_semaphore_counter_value(self.timeline) };
        now.map(|now| now >= value).map_err(failed("vkGetSemaphoreCounterValue", &self.info.name))
    }

    /// Whether kernels get a fixed subgroup size: where the driver may choose, results that depend on the size (sums of
    /// floats) would depend on its mood.
    pub fn fixes_subgroup_size(&self) -> bool {
        let limits = &self.info.limits;
        let (least, most) = (limits.subgroup_size_min, limits.subgroup_size_max);
        self.info.features.subgroup_size_control && least < most && (least..=most).contains(&limits.subgroup_size)
    }

    /// Waits for all submissions so far; false if the device does not answer.
    pub fn wait_idle(&self) -> bool {
        let submitted = lock(&self.queue).submitted;
        matches!(self.wait(submitted, "queue"), Ok(true))
    }

    /// Whether the driver reported the device as lost; then nothing is running any more.
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    fn note(&self, code: vk::Result) {
        match code {
            vk::Result::ERROR_DEVICE_LOST => self.lost.store(true, Ordering::Relaxed),
            vk::Result::TIMEOUT => self.hung.store(true, Ordering::Relaxed),
            _ => {}
        }
    }
}

impl Drop for Core {
    fn drop(&mut self) {
        let idle = self.wait_idle();
        if !idle && !self.is_lost() {
            // The device is still busy with something that does not end: freeing what it uses is worse than leaking.
            return;
        }
        // SAFETY: no work is pending or the device is lost (VUID-vkDestroyDevice-device-05137 and the rules for lost
        // devices); all buffers, pipelines and command pools hold a share of `self`, so they are gone; the two values
        // are taken once, here, allocator before device before instance.
        unsafe {
            ManuallyDrop::drop(&mut self.allocator);
            destroy(&self.raw, self.timeline);
            ManuallyDrop::drop(&mut self.instance);
        }
    }
}

/// Destroys a device with its timeline (which may be null).
fn destroy(device: &ash::Device, timeline: vk::Semaphore) {
    // SAFETY: callers own both, and nothing that uses them is pending or alive (VUID-vkDestroyDevice-device-05137).
    unsafe {
        device.destroy_semaphore(timeline, None);
        device.destroy_device(None);
    }
}

fn create_device(instance: &Instance, candidate: &Candidate, family: u32) -> Result<ash::Device> {
    let extensions = &candidate.extensions;
    let is_13 = candidate.version >= vk::API_VERSION_1_3;
    let mut names = Vec::new();
    if !is_13 && extensions.synchronization2 {
        names.push(khr::synchronization2::NAME.as_ptr());
    }
    if !is_13 && extensions.subgroup_size_control {
        names.push(ext::subgroup_size_control::NAME.as_ptr());
    }
    if !is_13 && extensions.dynamic_rendering {
        names.push(khr::dynamic_rendering::NAME.as_ptr());
    }
    if extensions.float_atomics {
        names.push(ext::shader_atomic_float::NAME.as_ptr());
    }
    if extensions.portability_subset {
        names.push(khr::portability_subset::NAME.as_ptr());
    }
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
    let mut chain = FeatureChain::enabling(&candidate.info.features);
    let mut features = chain.link(candidate.version, extensions);
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&names)
        .push_next(&mut features);
    // SAFETY: extensions and features are reported by this device (VUID-vkCreateDevice-ppEnabledExtensionNames-01387,
    // VUID-VkDeviceCreateInfo-pNext-02830), the family exists, and all pointers outlive the call.
    unsafe { instance.raw.create_device(candidate.raw, &info, None) }
        .map_err(failed("vkCreateDevice", &candidate.info.name))
}

fn create_allocator(instance: &Instance, device: &ash::Device, physical: vk::PhysicalDevice) -> Result<Allocator> {
    // Its reports go to a logger that this crate does not have.
    let mut debug_settings = gpu_allocator::AllocatorDebugSettings::default();
    debug_settings.log_leaks_on_shutdown = false;
    let desc = AllocatorCreateDesc {
        instance: instance.raw.clone(),
        device: device.clone(),
        physical_device: physical,
        debug_settings,
        buffer_device_address: false,
        allocation_sizes: gpu_allocator::AllocationSizes::new(DEVICE_BLOCK, HOST_BLOCK),
    };
    Allocator::new(&desc).map_err(|cause| Error::NoDevice(format!("its memory cannot be managed: {cause}")))
}
