//! What a device can do beyond Vulkan 1.2's minimum, and the pNext chains that ask for it.

use ash::vk;

macro_rules! features {
    ($($field:ident $variant:ident $text:literal)*) => {
        /// Optional abilities of a device, as reported by the driver; [`super::Device::open`] enables all that are
        /// there.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct Features { $(#[doc = $text] pub $field: bool,)* }

        /// One field of [`Features`], to be named as a requirement.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Feature { $(#[doc = $text] $variant,)* }

        impl Features {
            /// Whether `feature` is present.
            pub fn has(&self, feature: Feature) -> bool {
                match feature { $(Feature::$variant => self.$field,)* }
            }
        }

        impl Feature {
            /// Every feature, in a fixed order.
            pub const ALL: &'static [Feature] = &[$(Feature::$variant,)*];

            /// What it is, in words.
            pub fn describe(self) -> &'static str {
                match self { $(Feature::$variant => $text,)* }
            }
        }
    };
}

features! {
    synchronization2 Synchronization2 "synchronization2 (barriers and submission)"
    timeline Timeline "timeline semaphores (waiting for a submission)"
    scalar_layout ScalarLayout "scalar block layout (host and kernel structs agree)"
    memory_model MemoryModel "the Vulkan memory model"
    memory_model_device_scope MemoryModelDeviceScope "the Vulkan memory model at device scope"
    int64 Int64 "64-bit integers in kernels"
    int64_atomics Int64Atomics "64-bit atomics on buffers"
    float64 Float64 "64-bit floats in kernels"
    int16 Int16 "16-bit integers in kernels"
    int8 Int8 "8-bit integers in kernels"
    float16 Float16 "16-bit floats in kernels"
    storage16 Storage16 "16-bit values in buffers"
    storage8 Storage8 "8-bit values in buffers"
    float_atomic_add FloatAtomicAdd "32-bit float addition as an atomic on buffers"
    subgroup_basic SubgroupBasic "subgroups in compute kernels"
    subgroup_vote SubgroupVote "subgroup votes"
    subgroup_arithmetic SubgroupArithmetic "subgroup reductions and scans"
    subgroup_ballot SubgroupBallot "subgroup ballots"
    subgroup_shuffle SubgroupShuffle "subgroup shuffles"
    subgroup_shuffle_relative SubgroupShuffleRelative "relative subgroup shuffles"
    subgroup_clustered SubgroupClustered "clustered subgroup operations"
    subgroup_size_control SubgroupSizeControl "a fixed subgroup size per kernel"
    timestamps Timestamps "timestamps on the compute queue (timings are left out)"
    raster Raster "graphics passes (a graphics queue, dynamic rendering, blending of 32-bit floats)"
    geometry_shader GeometryShader "geometry kernels in graphics passes"
    depth_clamp DepthClamp "depth clamping in graphics passes (bounds across the near plane)"
}

/// Without these a device is not used at all.
pub(super) const REQUIRED: &[Feature] = &[Feature::Synchronization2, Feature::Timeline, Feature::ScalarLayout];

/// Device extensions that matter here, as far as present.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extensions {
    pub synchronization2: bool,
    pub subgroup_size_control: bool,
    pub float_atomics: bool,
    pub dynamic_rendering: bool,
    pub portability_subset: bool,
}

/// Storage for every feature structure that is chained; the only place where feature chains are built.
#[derive(Default)]
pub(super) struct FeatureChain {
    core: vk::PhysicalDeviceFeatures,
    v11: vk::PhysicalDeviceVulkan11Features<'static>,
    v12: vk::PhysicalDeviceVulkan12Features<'static>,
    sync2: vk::PhysicalDeviceSynchronization2Features<'static>,
    subgroup_size: vk::PhysicalDeviceSubgroupSizeControlFeatures<'static>,
    float_atomics: vk::PhysicalDeviceShaderAtomicFloatFeaturesEXT<'static>,
    rendering: vk::PhysicalDeviceDynamicRenderingFeatures<'static>,
}

impl FeatureChain {
    /// The chain's head. Structures of absent extensions are left out; with 1.3 the promoted ones are always known.
    pub fn link(&mut self, version: u32, extensions: &Extensions) -> vk::PhysicalDeviceFeatures2<'_> {
        let is_13 = version >= vk::API_VERSION_1_3;
        let mut head = vk::PhysicalDeviceFeatures2::default().features(self.core);
        head = head.push_next(&mut self.v11).push_next(&mut self.v12);
        if is_13 || extensions.synchronization2 {
            head = head.push_next(&mut self.sync2);
        }
        if is_13 || extensions.subgroup_size_control {
            head = head.push_next(&mut self.subgroup_size);
        }
        if is_13 || extensions.dynamic_rendering {
            head = head.push_next(&mut self.rendering);
        }
        if extensions.float_atomics {
            head = head.push_next(&mut self.float_atomics);
        }
        head
    }

    /// A chain that enables exactly `wanted`, for vkCreateDevice.
    pub fn enabling(wanted: &Features) -> Self {
        let mut chain = Self::default();
        chain.core = chain.core.shader_int64(wanted.int64).shader_float64(wanted.float64).shader_int16(wanted.int16);
        chain.core = chain.core.geometry_shader(wanted.geometry_shader).depth_clamp(wanted.depth_clamp);
        chain.rendering = chain.rendering.dynamic_rendering(wanted.raster);
        chain.v11 = chain.v11.storage_buffer16_bit_access(wanted.storage16);
        chain.v12 = chain
            .v12
            .timeline_semaphore(wanted.timeline)
            .scalar_block_layout(wanted.scalar_layout)
            .vulkan_memory_model(wanted.memory_model)
            .vulkan_memory_model_device_scope(wanted.memory_model_device_scope)
            .shader_buffer_int64_atomics(wanted.int64_atomics)
            .shader_int8(wanted.int8)
            .shader_float16(wanted.float16)
            .storage_buffer8_bit_access(wanted.storage8);
        chain.sync2 = chain.sync2.synchronization2(wanted.synchronization2);
        chain.subgroup_size = chain.subgroup_size.subgroup_size_control(wanted.subgroup_size_control);
        chain.float_atomics = chain.float_atomics.shader_buffer_float32_atomic_add(wanted.float_atomic_add);
        chain
    }

    /// What a chain filled by vkGetPhysicalDeviceFeatures2 says; `core` is its head's features.
    pub fn features(&self, core: &vk::PhysicalDeviceFeatures) -> Features {
        let yes = |value: vk::Bool32| value == vk::TRUE;
        Features {
            synchronization2: yes(self.sync2.synchronization2),
            timeline: yes(self.v12.timeline_semaphore),
            scalar_layout: yes(self.v12.scalar_block_layout),
            memory_model: yes(self.v12.vulkan_memory_model),
            memory_model_device_scope: yes(self.v12.vulkan_memory_model_device_scope),
            int64: yes(core.shader_int64),
            int64_atomics: yes(self.v12.shader_buffer_int64_atomics),
            float64: yes(core.shader_float64),
            int16: yes(core.shader_int16),
            int8: yes(self.v12.shader_int8),
            float16: yes(self.v12.shader_float16),
            storage16: yes(self.v11.storage_buffer16_bit_access),
            storage8: yes(self.v12.storage_buffer8_bit_access),
            float_atomic_add: yes(self.float_atomics.shader_buffer_float32_atomic_add),
            subgroup_size_control: yes(self.subgroup_size.subgroup_size_control),
            raster: yes(self.rendering.dynamic_rendering),
            geometry_shader: yes(core.geometry_shader),
            depth_clamp: yes(core.depth_clamp),
            ..Features::default()
        }
    }
}

impl Features {
    /// Adds what the subgroup properties say about compute kernels.
    pub(super) fn add_subgroups(&mut self, stages: vk::ShaderStageFlags, ops: vk::SubgroupFeatureFlags) {
        if !stages.contains(vk::ShaderStageFlags::COMPUTE) {
            return;
        }
        self.subgroup_basic = ops.contains(vk::SubgroupFeatureFlags::BASIC);
        self.subgroup_vote = ops.contains(vk::SubgroupFeatureFlags::VOTE);
        self.subgroup_arithmetic = ops.contains(vk::SubgroupFeatureFlags::ARITHMETIC);
        self.subgroup_ballot = ops.contains(vk::SubgroupFeatureFlags::BALLOT);
        self.subgroup_shuffle = ops.contains(vk::SubgroupFeatureFlags::SHUFFLE);
        self.subgroup_shuffle_relative = ops.contains(vk::SubgroupFeatureFlags::SHUFFLE_RELATIVE);
        self.subgroup_clustered = ops.contains(vk::SubgroupFeatureFlags::CLUSTERED);
    }

    /// Leaves out what is of graphics where its other half is missing.
    pub(super) fn without_graphics(&mut self) {
        (self.raster, self.geometry_shader, self.depth_clamp) = (false, false, false);
    }

    /// What of `needed` is missing, in words.
    pub(super) fn missing(&self, needed: &[Feature]) -> Vec<String> {
        needed.iter().filter(|&&feature| !self.has(feature)).map(|feature| feature.describe().to_owned()).collect()
    }
}
