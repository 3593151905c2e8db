//! Graphics pipelines, for dynamic rendering: no vertex buffers, no samples, one blending for all colours.

use super::call::{c_string, failed};
use super::core::Core;
use super::features::Feature;
use super::image_kind::ImageKind;
use super::pipeline::{Key, Pipeline, PipelineDesc, StageKey, check_words, entry};
use crate::draw_state::{Blend, Cull, DepthTest, DrawState, Topology};
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// One stage of a draw. The entry point is `main`.
#[derive(Clone, Copy, Debug)]
pub struct StageDesc<'a> {
    /// The module, valid for Vulkan 1.2 and the features of the device.
    pub spirv: &'a [u32],
    /// Specialisation constants: identifier and the 32 bits of the value.
    pub constants: &'a [(u32, u32)],
}

/// The kernels of a draw as the device sees them. Buffers are storage buffers in set 0 that are only read; a binding
/// number and the push constants mean the same in all stages.
#[derive(Clone, Copy, Debug)]
pub struct RasterDesc<'a> {
    /// For debuggers and errors.
    pub name: &'a str,
    /// Places the vertices.
    pub vertex: StageDesc<'a>,
    /// Turns each primitive into others.
    pub geometry: Option<StageDesc<'a>>,
    /// Colours the fragments.
    pub fragment: Option<StageDesc<'a>>,
    /// Binding numbers of the storage buffers of all stages.
    pub bindings: &'a [u32],
    /// Size of the push-constant block in bytes.
    pub push_bytes: u32,
    /// Everything between the kernels.
    pub state: DrawState,
    /// Colour attachments of the picture; the fragment kernel writes all of them or, without `writes_colour`, none.
    pub colours: u32,
    /// Whether the draw changes the colours.
    pub writes_colour: bool,
    /// Whether the picture has a depth attachment.
    pub depth: bool,
}

impl<'a> RasterDesc<'a> {
    /// Features that the draw cannot do without.
    pub(super) fn needs(&self) -> Vec<Feature> {
        let mut needs = vec![Feature::Raster];
        needs.extend(self.geometry.map(|_| Feature::GeometryShader));
        needs.extend(self.state.depth_clamp.then_some(Feature::DepthClamp));
        needs
    }

    pub(super) fn key(&self) -> Key {
        Key {
            name: self.name.to_owned(),
            stages: self.stages().map(|(flag, stage)| StageKey::new(flag, stage.spirv, stage.constants)).collect(),
            bindings: self.bindings.to_vec(),
            push_bytes: self.push_bytes,
            draw: Some((self.state, self.writes_colour, self.colours, self.depth)),
        }
    }

    fn stages(&self) -> impl Iterator<Item = (vk::ShaderStageFlags, StageDesc<'a>)> {
        let stages = [
            (vk::ShaderStageFlags::VERTEX, Some(self.vertex)),
            (vk::ShaderStageFlags::GEOMETRY, self.geometry),
            (vk::ShaderStageFlags::FRAGMENT, self.fragment),
        ];
        stages.into_iter().filter_map(|(flag, stage)| stage.map(|stage| (flag, stage)))
    }
}

impl Pipeline {
    pub(super) fn new_raster(core: &Arc<Core>, desc: &RasterDesc<'_>, cache: vk::PipelineCache) -> Result<Self> {
        desc.stages().for_each(|(_, stage)| check_words(desc.name, stage.spirv, stage.constants));
        assert!(desc.depth || !desc.state.needs_depth(), "'{}' needs a picture with depth", desc.name);
        let flags = desc.stages().fold(vk::ShaderStageFlags::empty(), |all, (flag, _)| all | flag);
        let layout = PipelineDesc {
            name: desc.name,
            spirv: desc.vertex.spirv,
            bindings: desc.bindings,
            push_bytes: desc.push_bytes,
            constants: &[],
        };
        let mut pipeline = Self::laid_out(core, flags, &layout)?;
        let mut modules = Vec::new();
        let made = pipeline.create_raster(desc, cache, &mut modules);
        for module in modules {
            // SAFETY: a module may be destroyed as soon as the pipelines that use it are made.
            unsafe { core.raw.destroy_shader_module(module, None) };
        }
        pipeline.raw = made?;
        core.set_name(pipeline.raw, desc.name);
        Ok(pipeline)
    }

    /// The pipeline; its modules are left for the caller to destroy.
    fn create_raster(
        &self,
        desc: &RasterDesc<'_>,
        cache: vk::PipelineCache,
        modules: &mut Vec<vk::ShaderModule>,
    ) -> Result<vk::Pipeline> {
        let values: Vec<Vec<u8>> = desc.stages().map(|(_, stage)| constant_bytes(&stage)).collect();
        let entries: Vec<Vec<_>> = desc.stages().map(|(_, stage)| constant_entries(&stage)).collect();
        let specialised = values.iter().zip(&entries);
        let specialised: Vec<_> = specialised
            .map(|(data, entries)| vk::SpecializationInfo::default().map_entries(entries).data(data))
            .collect();
        let entry_point = c_string("main");
        let mut stages = Vec::new();
        for ((flag, stage), constants) in desc.stages().zip(&specialised) {
            let module = self.module(stage.spirv)?;
            modules.push(module);
            let info = vk::PipelineShaderStageCreateInfo::default().stage(flag).module(module).name(&entry_point);
            stages.push(info.specialization_info(constants));
        }
        let fixed = Fixed::new(desc);
        let (vertices, viewport, samples) = (
            vk::PipelineVertexInputStateCreateInfo::default(),
            vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1),
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1),
        );
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&fixed.blend);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default()
            .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
        let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&fixed.formats);
        if desc.depth {
            rendering = rendering.depth_attachment_format(ImageKind::Depth.format());
        }
        let info = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertices)
            .input_assembly_state(&fixed.assembly)
            .viewport_state(&viewport)
            .rasterization_state(&fixed.rasterization)
            .multisample_state(&samples)
            .depth_stencil_state(&fixed.depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering)];
        // SAFETY: modules, layout and cache belong to this device, which has dynamic rendering, geometry kernels and
        // depth clamping as far as used (`needs`); the layout declares every binding the kernels use
        // (VUID-VkGraphicsPipelineCreateInfo-layout-07988); all attachments blend alike
        // (VUID-VkPipelineColorBlendStateCreateInfo-pAttachments-00605).
        let made = unsafe { self.core.raw.create_graphics_pipelines(cache, &info, None) };
        made.map(|pipelines| pipelines[0]).map_err(|(_, code)| failed("vkCreateGraphicsPipelines", self.name())(code))
    }
}

/// A draw's state in Vulkan's words.
struct Fixed {
    assembly: vk::PipelineInputAssemblyStateCreateInfo<'static>,
    rasterization: vk::PipelineRasterizationStateCreateInfo<'static>,
    depth: vk::PipelineDepthStencilStateCreateInfo<'static>,
    blend: Vec<vk::PipelineColorBlendAttachmentState>,
    formats: Vec<vk::Format>,
}

impl Fixed {
    fn new(desc: &RasterDesc<'_>) -> Self {
        let state = &desc.state;
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(match state.topology {
            Topology::Triangles => vk::PrimitiveTopology::TRIANGLE_LIST,
            Topology::TriangleStrip => vk::PrimitiveTopology::TRIANGLE_STRIP,
            Topology::Points => vk::PrimitiveTopology::POINT_LIST,
        });
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
            .depth_clamp_enable(state.depth_clamp)
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(match state.cull {
                Cull::Nothing => vk::CullModeFlags::NONE,
                Cull::Back => vk::CullModeFlags::BACK,
                Cull::Front => vk::CullModeFlags::FRONT,
            })
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .line_width(1.0);
        // Depths are written only with the test enabled.
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(state.needs_depth())
            .depth_write_enable(state.depth_write)
            .depth_compare_op(match state.depth_test {
                DepthTest::Always => vk::CompareOp::ALWAYS,
                DepthTest::Less => vk::CompareOp::LESS,
                DepthTest::Greater => vk::CompareOp::GREATER,
            });
        let one = vk::BlendFactor::ONE;
        let blend = vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(state.blend == Blend::Add)
            .src_color_blend_factor(one)
            .dst_color_blend_factor(one)
            .color_blend_op(vk::BlendOp::ADD)
            .src_alpha_blend_factor(one)
            .dst_alpha_blend_factor(one)
            .alpha_blend_op(vk::BlendOp::ADD)
            .color_write_mask(if desc.writes_colour { vk::ColorComponentFlags::RGBA } else { Default::default() });
        let colours = desc.colours as usize;
        let formats = vec![ImageKind::Colour.format(); colours];
        Self { assembly, rasterization, depth, blend: vec![blend; colours], formats }
    }
}

fn constant_bytes(stage: &StageDesc<'_>) -> Vec<u8> {
    stage.constants.iter().flat_map(|(_, bits)| bits.to_ne_bytes()).collect()
}

fn constant_entries(stage: &StageDesc<'_>) -> Vec<vk::SpecializationMapEntry> {
    stage.constants.iter().enumerate().map(|(i, &(id, _))| entry(i, id)).collect()
}
