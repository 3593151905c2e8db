//! Physical devices: what they are called, what they can do, how much of it.

use super::call::failed;
use super::features::{Extensions, Feature, FeatureChain, Features, REQUIRED};
use super::image_kind::formats_fit;
use super::instance::Instance;
use crate::error::Result;
use ash::vk;
use std::ffi::CStr;

/// What kind of hardware a device is, in the order of preference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A GPU with memory of its own.
    Discrete,
    /// A GPU that shares the host's memory.
    Integrated,
    /// A GPU of a virtual machine, or of a kind the driver does not tell.
    Virtual,
    /// A renderer on the CPU, such as lavapipe.
    Software,
}

impl std::fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Software => "software",
        })
    }
}

/// Sizes that bound what one dispatch, buffer or binding may be. Bytes unless named otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Longest range of one storage-buffer binding.
    pub storage_range: u64,
    /// Largest buffer: the smaller of `maxMemoryAllocationSize` and, where reported, `maxBufferSize`.
    pub allocation: u64,
    /// Size of the largest device-local heap.
    pub heap: u64,
    /// Workgroups per dispatch and axis.
    pub groups: [u32; 3],
    /// Shared memory of a workgroup.
    pub shared_bytes: u32,
    /// Invocations of a workgroup.
    pub invocations: u32,
    /// Invocations of a workgroup, per axis.
    pub group_size: [u32; 3],
    /// Push constants; this crate uses at most [`Limits::PUSH_BYTES`].
    pub push_bytes: u32,
    /// Invocations of a subgroup, as kernels see it.
    pub subgroup_size: u32,
    /// The least subgroup size that the driver may choose.
    pub subgroup_size_min: u32,
    /// The greatest subgroup size that the driver may choose.
    pub subgroup_size_max: u32,
    /// Storage buffers that one kernel can bind.
    pub storage_buffers: u32,
    /// Alignment of the start of a storage-buffer binding.
    pub storage_alignment: u64,
    /// Width and height of the picture of a graphics pass, at most.
    pub image_side: u32,
    /// Nanoseconds of one timestamp tick.
    pub timestamp_period_ns: f32,
    /// Valid bits of a timestamp; 0 where the queue has none.
    pub timestamp_bits: u32,
}

impl Limits {
    /// Push constants that every device has (the least value of `maxPushConstantsSize`).
    pub const PUSH_BYTES: u32 = 128;
}

/// A physical device.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    /// Position in the loader's list, from 0.
    pub index: usize,
    /// The driver's name for the device.
    pub name: String,
    /// What it is.
    pub kind: DeviceKind,
    /// Name and version of the driver.
    pub driver: String,
    /// Vulkan version as used: the lower of device and loader.
    pub api_version: (u32, u32, u32),
    /// Sizes.
    pub limits: Limits,
    /// Abilities.
    pub features: Features,
    /// What this crate needs or would use and the device lacks, in words; what makes it unusable comes first.
    pub lacks: Vec<String>,
    /// How many entries of [`DeviceInfo::lacks`] make the device unusable.
    pub blocking: usize,
}

impl DeviceInfo {
    /// What keeps the device from running any kernel of this crate; nothing if it is usable.
    pub fn obstacles(&self) -> &[String] {
        &self.lacks[..self.blocking]
    }

    /// Order of preference: usable before unusable, then by kind; the least is chosen, the first of equals.
    pub fn rank(&self) -> (bool, DeviceKind) {
        (self.blocking > 0, self.kind)
    }
}

/// A device with what is needed to open it.
pub(super) struct Candidate {
    pub raw: vk::PhysicalDevice,
    pub info: DeviceInfo,
    pub version: u32,
    pub extensions: Extensions,
    /// The queue family to use; none if the device cannot compute.
    pub queue_family: Option<u32>,
    pub identity: Identity,
}

/// What a pipeline cache file must have been made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Identity {
    pub vendor: u32,
    pub device: u32,
    pub driver_version: u32,
    pub uuid: [u8; vk::UUID_SIZE],
}

/// Every physical device, in the loader's order.
pub(super) fn candidates(instance: &Instance) -> Result<Vec<Candidate>> {
    // SAFETY: the instance is valid; vkEnumeratePhysicalDevices has no further preconditions.
    let devices = unsafe { instance.raw.enumerate_physical_devices() }
        .map_err(failed("vkEnumeratePhysicalDevices", "instance"))?;
    devices.iter().enumerate().map(|(index, &raw)| candidate(instance, raw, index)).collect()
}

fn candidate(instance: &Instance, raw: vk::PhysicalDevice, index: usize) -> Result<Candidate> {
    // SAFETY: `raw` comes from this instance.
    let basic = unsafe { instance.raw.get_physical_device_properties(raw) };
    let version = basic.api_version.min(instance.version);
    let name = text(&basic.device_name);
    let extensions = extensions(instance, raw, &name)?;
    // SAFETY: `raw` comes from this instance.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(raw) };
    let queue_family = compute_family(&families);
    let is_12 = version >= vk::API_VERSION_1_2;
    let (mut limits, driver, subgroups) = if is_12 {
        properties(instance, raw, version, &extensions)
    } else {
        (basic_limits(&basic.limits), format!("version {:#x}", basic.driver_version), Subgroups::default())
    };
    // SAFETY: `raw` comes from this instance.
    let memory = unsafe { instance.raw.get_physical_device_memory_properties(raw) };
    limits.heap = largest_heap(&memory);
    limits.timestamp_bits = queue_family.map_or(0, |family| families[family as usize].timestamp_valid_bits);
    let mut features = Features::default();
    if is_12 {
        let mut chain = FeatureChain::default();
        let mut head = chain.link(version, &extensions);
        // SAFETY: every structure in the chain belongs to the device's version or to an extension it reports
        // (VUID-VkPhysicalDeviceFeatures2-pNext-pNext); the chain outlives the call.
        unsafe { instance.raw.get_physical_device_features2(raw, &mut head) };
        let core = head.features;
        features = chain.features(&core);
        features.add_subgroups(subgroups.stages, subgroups.operations);
        features.subgroup_size_control &= subgroups.sized_stages.contains(vk::ShaderStageFlags::COMPUTE);
    }
    features.timestamps = limits.timestamp_bits > 0;
    let draws = queue_family.is_some_and(|at| families[at as usize].queue_flags.contains(vk::QueueFlags::GRAPHICS));
    if !(features.raster && draws && formats_fit(instance, raw)) {
        features.without_graphics();
    }
    let (lacks, blocking) = lacks(&features, &limits, version, queue_family.is_some());
    let info = DeviceInfo {
        index,
        name,
        kind: kind(basic.device_type),
        driver,
        api_version: split(version, basic.api_version),
        limits,
        features,
        lacks,
        blocking,
    };
    let identity = Identity {
        vendor: basic.vendor_id,
        device: basic.device_id,
        driver_version: basic.driver_version,
        uuid: basic.pipeline_cache_uuid,
    };
    Ok(Candidate { raw, info, version, extensions, queue_family, identity })
}

/// Invocations of the smallest subgroups that kernels work with: four lanes load a node of a tree together.
const LEAST_SUBGROUP: u32 = 4;

/// In words, what is missing: first what is required, and how much of it; then what would be used.
fn lacks(features: &Features, limits: &Limits, version: u32, computes: bool) -> (Vec<String>, usize) {
    let mut list = Vec::new();
    if version < vk::API_VERSION_1_2 {
        list.push("Vulkan 1.2".to_owned());
    }
    if !computes {
        list.push("a compute queue".to_owned());
    }
    list.extend(features.missing(REQUIRED));
    if limits.subgroup_size_min < LEAST_SUBGROUP {
        list.push(format!("subgroups of {LEAST_SUBGROUP} invocations or more"));
    }
    let blocking = list.len();
    let optional: Vec<Feature> = Feature::ALL.iter().copied().filter(|feature| !REQUIRED.contains(feature)).collect();
    list.extend(features.missing(&optional));
    (list, blocking)
}

/// A family that also does graphics is the main queue of every known GPU; pure compute families may be a slice of it.
fn compute_family(families: &[vk::QueueFamilyProperties]) -> Option<u32> {
    let find = |flags| families.iter().position(|family| family.queue_flags.contains(flags));
    let main = find(vk::QueueFlags::COMPUTE | vk::QueueFlags::GRAPHICS);
    main.or_else(|| find(vk::QueueFlags::COMPUTE)).map(|index| index as u32)
}

fn extensions(instance: &Instance, raw: vk::PhysicalDevice, name: &str) -> Result<Extensions> {
    // SAFETY: `raw` comes from this instance.
    let list = unsafe { instance.raw.enumerate_device_extension_properties(raw) }
        .map_err(failed("vkEnumerateDeviceExtensionProperties", name))?;
    let has = |wanted: &CStr| list.iter().any(|extension| extension.extension_name_as_c_str() == Ok(wanted));
    Ok(Extensions {
        synchronization2: has(ash::khr::synchronization2::NAME),
        subgroup_size_control: has(ash::ext::subgroup_size_control::NAME),
        float_atomics: has(ash::ext::shader_atomic_float::NAME),
        dynamic_rendering: has(ash::khr::dynamic_rendering::NAME),
        portability_subset: has(ash::khr::portability_subset::NAME),
    })
}

/// What subgroups can do.
#[derive(Default)]
struct Subgroups {
    stages: vk::ShaderStageFlags,
    operations: vk::SubgroupFeatureFlags,
    /// Stages for which a size can be demanded.
    sized_stages: vk::ShaderStageFlags,
}

/// Limits, driver text and subgroup operations of a 1.2 device; the only place where property chains are built.
fn properties(
    instance: &Instance,
    raw: vk::PhysicalDevice,
    version: u32,
    extensions: &Extensions,
) -> (Limits, String, Subgroups) {
    let is_13 = version >= vk::API_VERSION_1_3;
    let has_size_control = is_13 || extensions.subgroup_size_control;
    let mut v11 = vk::PhysicalDeviceVulkan11Properties::default();
    let mut v12 = vk::PhysicalDeviceVulkan12Properties::default();
    let mut sizes = vk::PhysicalDeviceSubgroupSizeControlProperties::default();
    let mut maintenance4 = vk::PhysicalDeviceMaintenance4Properties::default();
    let mut head = vk::PhysicalDeviceProperties2::default().push_next(&mut v11).push_next(&mut v12);
    if has_size_control {
        head = head.push_next(&mut sizes);
    }
    if is_13 {
        head = head.push_next(&mut maintenance4);
    }
    // SAFETY: every structure in the chain belongs to the device's version or to an extension it reports; the chain
    // outlives the call.
    unsafe { instance.raw.get_physical_device_properties2(raw, &mut head) };
    let mut limits = basic_limits(&head.properties.limits);
    limits.allocation = v11.max_memory_allocation_size;
    if is_13 {
        limits.allocation = limits.allocation.min(maintenance4.max_buffer_size);
    }
    limits.subgroup_size = v11.subgroup_size;
    limits.subgroup_size_min = if has_size_control { sizes.min_subgroup_size } else { v11.subgroup_size };
    limits.subgroup_size_max = if has_size_control { sizes.max_subgroup_size } else { v11.subgroup_size };
    let driver = format!("{} {}", text(&v12.driver_name), text(&v12.driver_info)).trim().to_owned();
    let subgroups = Subgroups {
        stages: v11.subgroup_supported_stages,
        operations: v11.subgroup_supported_operations,
        sized_stages: sizes.required_subgroup_size_stages,
    };
    (limits, driver, subgroups)
}

fn basic_limits(limits: &vk::PhysicalDeviceLimits) -> Limits {
    Limits {
        storage_range: limits.max_storage_buffer_range.into(),
        allocation: 0,
        heap: 0,
        groups: limits.max_compute_work_group_count,
        shared_bytes: limits.max_compute_shared_memory_size,
        invocations: limits.max_compute_work_group_invocations,
        group_size: limits.max_compute_work_group_size,
        push_bytes: limits.max_push_constants_size,
        subgroup_size: 1,
        subgroup_size_min: 1,
        subgroup_size_max: 1,
        storage_buffers: limits
            .max_per_stage_descriptor_storage_buffers
            .min(limits.max_descriptor_set_storage_buffers)
            .min(limits.max_per_stage_resources),
        storage_alignment: limits.min_storage_buffer_offset_alignment,
        image_side: limits
            .max_image_dimension2_d
            .min(limits.max_framebuffer_width)
            .min(limits.max_framebuffer_height)
            .min(limits.max_viewport_dimensions[0])
            .min(limits.max_viewport_dimensions[1]),
        timestamp_period_ns: limits.timestamp_period,
        timestamp_bits: 0,
    }
}

fn largest_heap(memory: &vk::PhysicalDeviceMemoryProperties) -> u64 {
    let heaps = memory.memory_heaps_as_slice();
    let local = heaps.iter().filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    local.map(|heap| heap.size).max().unwrap_or(0)
}

fn kind(kind: vk::PhysicalDeviceType) -> DeviceKind {
    match kind {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::CPU => DeviceKind::Software,
        _ => DeviceKind::Virtual,
    }
}

/// The version in use, with the device's own patch number where the minor version is the device's.
fn split(used: u32, device: u32) -> (u32, u32, u32) {
    let (major, minor) = (vk::api_version_major(used), vk::api_version_minor(used));
    let same = vk::api_version_major(device) == major && vk::api_version_minor(device) == minor;
    (major, minor, if same { vk::api_version_patch(device) } else { 0 })
}

/// A fixed-size C string of the driver; bytes after the first NUL, or a missing NUL, do no harm.
fn text(chars: &[std::ffi::c_char]) -> String {
    let bytes: Vec<u8> = chars.iter().map(|&c| c as u8).take_while(|&c| c != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
impl Limits {
    /// Those of lavapipe, about.
    pub(crate) fn of_a_processor() -> Self {
        Self {
            storage_range: 1 << 27,
            allocation: 1 << 31,
            heap: 1 << 31,
            groups: [65535; 3],
            shared_bytes: 32768,
            invocations: 1024,
            group_size: [1024; 3],
            push_bytes: 128,
            subgroup_size: 8,
            subgroup_size_min: 8,
            subgroup_size_max: 8,
            storage_buffers: 32,
            storage_alignment: 64,
            image_side: 16_384,
            timestamp_period_ns: 1.0,
            timestamp_bits: 64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subgroups_that_are_too_small_make_a_device_unusable() {
        let blocking = |subgroup_size_min| {
            let limits = Limits { subgroup_size_min, ..Limits::of_a_processor() };
            lacks(&Features::default(), &limits, vk::API_VERSION_1_3, true).1
        };
        assert_eq!(blocking(LEAST_SUBGROUP), blocking(8));
        assert_eq!(blocking(LEAST_SUBGROUP - 1), blocking(8) + 1);
    }
}
