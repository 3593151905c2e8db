//! Pipelines and what is common to them; compute pipelines are made here, graphics pipelines in `raster_pipeline.rs`.

use super::call::{c_string, failed};
use super::core::Core;
use super::limits::Limits;
use crate::draw_state::DrawState;
use crate::error::{Error, Result};
use ash::vk;
use std::sync::Arc;

/// First word of every SPIR-V module in the host's byte order.
const SPIRV_MAGIC: u32 = 0x0723_0203;

/// A compute kernel as the device sees it. The entry point is `main`; all buffers are storage buffers in set 0.
///
/// Creating a pipeline panics if `spirv` is no SPIR-V, if `push_bytes` is no multiple of 4 or above
/// [`Limits::PUSH_BYTES`], or if a binding or constant is named twice: such a description is wrong on every device.
#[derive(Clone, Copy, Debug)]
pub struct PipelineDesc<'a> {
    /// For debuggers and errors.
    pub name: &'a str,
    /// The module, valid for Vulkan 1.2 and the features of the device.
    pub spirv: &'a [u32],
    /// Binding numbers of the storage buffers in set 0.
    pub bindings: &'a [u32],
    /// Size of the push-constant block in bytes.
    pub push_bytes: u32,
    /// Specialisation constants: identifier and the 32 bits of the value.
    pub constants: &'a [(u32, u32)],
}

/// What makes two stages the same.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct StageKey {
    flag: vk::ShaderStageFlags,
    spirv: Vec<u32>,
    constants: Vec<(u32, u32)>,
}

impl StageKey {
    pub fn new(flag: vk::ShaderStageFlags, spirv: &[u32], constants: &[(u32, u32)]) -> Self {
        Self { flag, spirv: spirv.to_vec(), constants: constants.to_vec() }
    }
}

/// What makes two descriptions the same. Holds the words themselves, so that equality is exact.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct Key {
    pub name: String,
    pub stages: Vec<StageKey>,
    pub bindings: Vec<u32>,
    pub push_bytes: u32,
    /// Of a draw: its state, whether it writes colours and how many there are, whether there is a depth.
    pub draw: Option<(DrawState, bool, u32, bool)>,
}

impl Key {
    pub fn new(desc: &PipelineDesc<'_>) -> Self {
        Self {
            name: desc.name.to_owned(),
            stages: vec![StageKey::new(vk::ShaderStageFlags::COMPUTE, desc.spirv, desc.constants)],
            bindings: desc.bindings.to_vec(),
            push_bytes: desc.push_bytes,
            draw: None,
        }
    }
}

/// A compute or graphics pipeline; freed when neither its device nor any recorded [`super::Commands`] uses it.
pub struct Pipeline {
    pub(super) core: Arc<Core>,
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) set_layout: vk::DescriptorSetLayout,
    pub(super) bindings: Vec<u32>,
    pub(super) push_bytes: u32,
    pub(super) stages: vk::ShaderStageFlags,
    name: String,
}

impl Pipeline {
    /// The kernel's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn new(core: &Arc<Core>, desc: &PipelineDesc<'_>, cache: vk::PipelineCache) -> Result<Self> {
        check_words(desc.name, desc.spirv, desc.constants);
        let mut pipeline = Self::laid_out(core, vk::ShaderStageFlags::COMPUTE, desc)?;
        pipeline.create(desc, cache)?;
        core.set_name(pipeline.raw, desc.name);
        Ok(pipeline)
    }

    /// A pipeline with layouts for `stages` and nothing else; of `desc` the name, bindings and push constants count.
    pub(super) fn laid_out(core: &Arc<Core>, stages: vk::ShaderStageFlags, desc: &PipelineDesc<'_>) -> Result<Self> {
        check(core, desc)?;
        // Null handles until made: destroying those is allowed, so an early return frees what exists.
        let mut pipeline = Self {
            core: Arc::clone(core),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            bindings: desc.bindings.to_vec(),
            push_bytes: desc.push_bytes,
            stages,
            name: desc.name.to_owned(),
        };
        pipeline.create_layouts()?;
        Ok(pipeline)
    }

    /// Whether it belongs to draws.
    pub(super) fn draws(&self) -> bool {
        self.stages != vk::ShaderStageFlags::COMPUTE
    }

    /// Where it is bound.
    pub(super) fn point(&self) -> vk::PipelineBindPoint {
        if self.draws() { vk::PipelineBindPoint::GRAPHICS } else { vk::PipelineBindPoint::COMPUTE }
    }

    fn create_layouts(&mut self) -> Result<()> {
        let bindings: Vec<_> = self.bindings.iter().map(|&binding| storage_binding(binding, self.stages)).collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: binding numbers differ (VUID-VkDescriptorSetLayoutCreateInfo-binding-00279), see `check`.
        self.set_layout = unsafe { self.core.raw.create_descriptor_set_layout(&info, None) }
            .map_err(failed("vkCreateDescriptorSetLayout", &self.name))?;
        let layouts = [self.set_layout];
        let ranges = [vk::PushConstantRange::default().stage_flags(self.stages).size(self.push_bytes)];
        let used = if self.push_bytes > 0 { &ranges[..] } else { &[] };
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts).push_constant_ranges(used);
        // SAFETY: one set within the device's storage-buffer limit and a non-empty push range of a multiple of 4
        // within 128 bytes (VUID-VkPushConstantRange-size-00296 to -00298), see `check`.
        self.layout = unsafe { self.core.raw.create_pipeline_layout(&info, None) }
            .map_err(failed("vkCreatePipelineLayout", &self.name))?;
        Ok(())
    }

    fn create(&mut self, desc: &PipelineDesc<'_>, cache: vk::PipelineCache) -> Result<()> {
        let device = &self.core.raw;
        let module = self.module(desc.spirv)?;
        let values: Vec<u8> = desc.constants.iter().flat_map(|(_, bits)| bits.to_ne_bytes()).collect();
        let entries: Vec<_> = desc.constants.iter().enumerate().map(|(i, &(id, _))| entry(i, id)).collect();
        let constants = vk::SpecializationInfo::default().map_entries(&entries).data(&values);
        let entry_point = c_string("main");
        let mut subgroup = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default()
            .required_subgroup_size(self.core.info.limits.subgroup_size);
        let mut stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(&entry_point)
            .specialization_info(&constants);
        if self.core.fixes_subgroup_size() {
            stage = stage.push_next(&mut subgroup);
        }
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(self.layout)];
        // SAFETY: module, layout and cache belong to this device; the layout declares every binding the kernel uses
        // (VUID-VkComputePipelineCreateInfo-layout-07988); `check` and the caller's reflection vouch for it.
        let made = unsafe { device.create_compute_pipelines(cache, &info, None) };
        // SAFETY: a module may be destroyed as soon as the pipelines that use it are made.
        unsafe { device.destroy_shader_module(module, None) };
        match made {
            Ok(pipelines) => self.raw = pipelines[0],
            Err((_, code)) => return Err(failed("vkCreateComputePipelines", &self.name)(code)),
        }
        Ok(())
    }
}

impl Pipeline {
    /// A module of `spirv`, which the caller destroys.
    pub(super) fn module(&self, spirv: &[u32]) -> Result<vk::ShaderModule> {
        let info = vk::ShaderModuleCreateInfo::default().code(spirv);
        // SAFETY: the words are SPIR-V valid for this device: the crate's kernels pass spirv-val at build time and
        // their features are checked by `Device::require` (VUID-VkShaderModuleCreateInfo-pCode-08737).
        unsafe { self.core.raw.create_shader_module(&info, None) }.map_err(failed("vkCreateShaderModule", &self.name))
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: commands that use the pipeline hold a share of it until they have finished
        // (VUID-vkDestroyPipeline-pipeline-00765); null handles are allowed.
        unsafe {
            self.core.raw.destroy_pipeline(self.raw, None);
            self.core.raw.destroy_pipeline_layout(self.layout, None);
            self.core.raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

fn storage_binding(binding: u32, stages: vk::ShaderStageFlags) -> vk::DescriptorSetLayoutBinding<'static> {
    vk::DescriptorSetLayoutBinding::default()
        .binding(binding)
        .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
        .descriptor_count(1)
        .stage_flags(stages)
}

pub(super) fn entry(position: usize, id: u32) -> vk::SpecializationMapEntry {
    vk::SpecializationMapEntry::default().constant_id(id).offset(4 * position as u32).size(4)
}

fn unique(mut numbers: Vec<u32>) -> bool {
    numbers.sort_unstable();
    numbers.windows(2).all(|pair| pair[0] != pair[1])
}

/// Panics if a stage's code or constants are impossible.
pub(super) fn check_words(name: &str, spirv: &[u32], constants: &[(u32, u32)]) {
    assert!(spirv.len() > 5 && spirv[0] == SPIRV_MAGIC, "the kernel '{name}' is no SPIR-V");
    assert!(unique(constants.iter().map(|&(id, _)| id).collect()), "'{name}' names a constant twice: {constants:?}");
}

fn check(core: &Core, desc: &PipelineDesc<'_>) -> Result<()> {
    let name = desc.name;
    assert!(desc.push_bytes <= Limits::PUSH_BYTES, "'{name}' has {} bytes of push constants", desc.push_bytes);
    assert!(desc.push_bytes.is_multiple_of(4), "'{name}' has {} bytes of push constants", desc.push_bytes);
    assert!(unique(desc.bindings.to_vec()), "'{name}' names a binding twice: {:?}", desc.bindings);
    let most = core.info.limits.storage_buffers as usize;
    if desc.bindings.len() > most {
        let feature = format!("{} storage buffers in one kernel ('{name}'; it has {most})", desc.bindings.len());
        return Err(Error::MissingFeature { device: core.info.name.clone(), feature, settings: &[] });
    }
    Ok(())
}
