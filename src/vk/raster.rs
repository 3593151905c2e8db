//! Recording graphics passes: images are drawn on between [`Recorder::begin_picture`] and [`Recorder::end_picture`],
//! and copied to buffers afterwards. Their barriers are all here; buffers follow the rules of every other pass.

use super::buffer::Buffer;
use super::core::Rendering;
use super::image::Image;
use super::image_kind::ImageKind;
use super::record::{Recorder, TRANSFER};
use ash::vk;
use ash::vk::Handle;
use std::sync::Arc;

const COLOUR: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT;
const COLOUR_ACCESS: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::COLOR_ATTACHMENT_READ.as_raw() | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw(),
);
const DEPTH: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::EARLY_FRAGMENT_TESTS.as_raw() | vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS.as_raw(),
);
const DEPTH_ACCESS: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_READ.as_raw()
        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw(),
);

/// What a graphics pass draws on.
#[derive(Clone, Copy)]
pub struct Picture<'a> {
    /// Colours, cleared to 0; all of one extent.
    pub colours: &'a [&'a Image],
    /// Depths of the same extent, and what they are cleared to.
    pub depth: Option<(&'a Image, f32)>,
}

/// Where an image was last used, and where it is used next.
struct Step {
    before: (vk::PipelineStageFlags2, vk::AccessFlags2),
    after: (vk::PipelineStageFlags2, vk::AccessFlags2),
    layouts: (vk::ImageLayout, vk::ImageLayout),
}

impl Step {
    fn barrier(self, image: &Image) -> vk::ImageMemoryBarrier2<'static> {
        vk::ImageMemoryBarrier2::default()
            .src_stage_mask(self.before.0)
            .src_access_mask(self.before.1)
            .dst_stage_mask(self.after.0)
            .dst_access_mask(self.after.1)
            .old_layout(self.layouts.0)
            .new_layout(self.layouts.1)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image.inner.raw)
            .subresource_range(image.inner.range())
    }
}

impl Recorder {
    /// Clears the images of `picture` and draws on them from here on; what they held is lost. Images may be used again
    /// by later pictures: they wait for what was done with them before.
    ///
    /// # Panics
    /// Inside of another picture, without colours, or if kinds or extents of the images do not fit.
    pub fn begin_picture(&mut self, picture: &Picture<'_>) {
        assert!(self.drawing.is_none(), "a picture inside of a picture");
        let extent = picture.colours.first().expect("a picture has a colour").extent();
        let fits = |image: &Image, kind| image.kind() == kind && image.extent() == extent;
        assert!(picture.colours.iter().all(|image| fits(image, ImageKind::Colour)), "colours of one extent");
        assert!(picture.depth.is_none_or(|(image, _)| fits(image, ImageKind::Depth)), "depths of the same extent");
        let mut barriers: Vec<_> = picture.colours.iter().map(|image| before_drawing(image)).collect();
        barriers.extend(picture.depth.map(|(image, _)| before_drawing(image)));
        self.depend(&vk::DependencyInfo::default().image_memory_barriers(&barriers));
        self.begin_rendering(picture, extent);
    }

    fn begin_rendering(&mut self, picture: &Picture<'_>, extent: [u32; 2]) {
        for image in picture.colours.iter().copied().chain(picture.depth.map(|(image, _)| image)) {
            self.state.images.entry(image.inner.raw.as_raw()).or_insert_with(|| Arc::clone(&image.inner));
        }
        let colours: Vec<_> = picture.colours.iter().map(|image| colour_attachment(image)).collect();
        let depth = picture.depth.map(|(image, value)| depth_attachment(image, value));
        let area = vk::Rect2D::default().extent(vk::Extent2D { width: extent[0], height: extent[1] });
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colours);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        let (core, commands) = (&self.state.core, self.state.commands);
        let viewport = vk::Viewport::default().width(extent[0] as f32).height(extent[1] as f32).max_depth(1.0);
        // SAFETY: recording, outside of rendering; the attachments are views of images of this device in the layouts
        // stated, which the barrier before gave them, and the area is theirs (VUID-VkRenderingInfo-pNext-06079,
        // -06080); the device has dynamic rendering, for it has made images (`Device::image`).
        unsafe {
            match &core.rendering {
                Rendering::Promoted => core.raw.cmd_begin_rendering(commands, &info),
                Rendering::Extension(fns) => fns.cmd_begin_rendering(commands, &info),
                Rendering::Absent => unreachable!("images without graphics passes"),
            }
            core.raw.cmd_set_viewport(commands, 0, &[viewport]);
            core.raw.cmd_set_scissor(commands, 0, &[area]);
        }
        self.drawing = Some(extent);
    }

    /// Draws `vertices` vertices of each of `instances` instances with the bound kernels.
    ///
    /// # Panics
    /// Outside of a picture or without bound graphics kernels.
    pub fn draw(&mut self, vertices: u32, instances: u32) {
        self.assert_draws();
        // SAFETY: inside of rendering, with a graphics pipeline, its set, its push constants and its dynamic state
        // (VUID-vkCmdDraw-None-08600, -08601, -renderpass); that its formats are the picture's is the caller's promise
        // in `RasterDesc` (VUID-vkCmdDraw-dynamicRenderingUnusedAttachments-08910).
        unsafe { self.state.core.raw.cmd_draw(self.state.commands, vertices, instances, 0, 0) };
    }

    /// Draws as many vertices and instances as the first two of four u32 at byte `offset` of `arguments` say when it
    /// starts; the other two (first vertex, first instance) have to be 0.
    ///
    /// # Panics
    /// As [`Recorder::draw`], or if the arguments leave the buffer or are not 4-byte aligned.
    pub fn draw_indirect(&mut self, arguments: &Buffer, offset: u64) {
        self.assert_draws();
        let fits = offset.is_multiple_of(4) && offset.checked_add(16).is_some_and(|end| end <= arguments.bytes());
        assert!(fits, "arguments of a draw at {offset} of '{}'", arguments.name());
        self.state.keep(arguments);
        let (commands, buffer) = (self.state.commands, arguments.inner.raw);
        // SAFETY: as in `draw`; the buffer has INDIRECT usage (VUID-vkCmdDrawIndirect-buffer-02709) and holds the four
        // words. What they say is the writing kernel's duty (VkDrawIndirectCommand).
        unsafe { self.state.core.raw.cmd_draw_indirect(commands, buffer, offset, 1, 16) };
    }

    fn assert_draws(&self) {
        assert!(self.drawing.is_some(), "draw outside of a picture");
        let pipeline = self.bound.as_ref().expect("draw without bind");
        assert!(pipeline.draws(), "'{}' is a compute kernel", pipeline.name());
    }

    /// Ends the picture begun last; its colours can be copied from here on.
    ///
    /// # Panics
    /// If `picture` has other extents than what was begun.
    pub fn end_picture(&mut self, picture: &Picture<'_>) {
        let extent = self.drawing.expect("end_picture without begin_picture");
        assert!(picture.colours.iter().all(|image| image.extent() == extent), "the picture that was begun");
        self.end_rendering();
        let barriers: Vec<_> = picture.colours.iter().map(|image| before_copy(image)).collect();
        self.depend(&vk::DependencyInfo::default().image_memory_barriers(&barriers));
    }

    fn end_rendering(&mut self) {
        self.drawing = None;
        let (core, commands) = (&self.state.core, self.state.commands);
        // SAFETY: inside of rendering that this recorder began (VUID-vkCmdEndRendering-None-06161).
        unsafe {
            match &core.rendering {
                Rendering::Promoted => core.raw.cmd_end_rendering(commands),
                Rendering::Extension(fns) => fns.cmd_end_rendering(commands),
                Rendering::Absent => unreachable!("images without graphics passes"),
            }
        }
    }

    /// Copies the colours of an ended picture, row by row without gaps, to byte `offset` of a buffer.
    ///
    /// # Panics
    /// Inside of a picture, for depths, if the pixels leave the buffer, or if `offset` is no multiple of a pixel's 16
    /// bytes.
    pub fn copy_image(&mut self, image: &Image, buffer: &Buffer, offset: u64) {
        assert!(self.drawing.is_none() && image.kind() == ImageKind::Colour, "colours are copied after the drawing");
        let fits = offset.checked_add(image.bytes()).is_some_and(|end| end <= buffer.bytes());
        let name = &image.inner.name;
        assert!(fits && offset.is_multiple_of(16), "copy of '{name}' to {offset} of '{}'", buffer.name());
        self.state.keep(buffer);
        let [width, height] = image.extent();
        let layer = vk::ImageSubresourceLayers::default().aspect_mask(image.kind().aspect()).layer_count(1);
        let region = [vk::BufferImageCopy::default()
            .buffer_offset(offset)
            .image_subresource(layer)
            .image_extent(vk::Extent3D { width, height, depth: 1 })];
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        let (commands, from, to) = (self.state.commands, image.inner.raw, buffer.inner.raw);
        // SAFETY: recording, outside of rendering; usages are set on image and buffer, the region is all of the image
        // and lies in the buffer (VUID-vkCmdCopyImageToBuffer-pRegions-00183); `end_picture` left the layout.
        unsafe { self.state.core.raw.cmd_copy_image_to_buffer(commands, from, layout, to, &region) };
    }
}

/// After an earlier picture's copy (colours) or draws (depths), before the clear. What was there is dropped.
fn before_drawing(image: &Image) -> vk::ImageMemoryBarrier2<'static> {
    let undefined = vk::ImageLayout::UNDEFINED;
    let step = match image.kind() {
        ImageKind::Colour => Step {
            before: (COLOUR | TRANSFER, vk::AccessFlags2::COLOR_ATTACHMENT_WRITE),
            after: (COLOUR, COLOUR_ACCESS),
            layouts: (undefined, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL),
        },
        ImageKind::Depth => Step {
            before: (DEPTH, vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE),
            after: (DEPTH, DEPTH_ACCESS),
            layouts: (undefined, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL),
        },
    };
    step.barrier(image)
}

/// Between the last draw and the copy.
fn before_copy(image: &Image) -> vk::ImageMemoryBarrier2<'static> {
    let step = Step {
        before: (COLOUR, vk::AccessFlags2::COLOR_ATTACHMENT_WRITE),
        after: (TRANSFER, vk::AccessFlags2::TRANSFER_READ),
        layouts: (vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL),
    };
    step.barrier(image)
}

fn colour_attachment(image: &Image) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(image.inner.view)
        .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue { color: vk::ClearColorValue { float32: [0.0; 4] } })
}

/// Depths live as long as the picture: nobody reads them afterwards.
fn depth_attachment(image: &Image, value: f32) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(image.inner.view)
        .image_layout(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::DONT_CARE)
        .clear_value(vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: value, stencil: 0 } })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::{Device, DeviceOptions, Place};

    /// Clears a picture and copies it, with or without the barriers around its drawing; then once more, so that the
    /// second picture meets what the first left. Messages of the validation layers.
    fn messages(before: bool, after: bool) -> Vec<String> {
        let options = DeviceOptions { validate: true, cache: None, ..DeviceOptions::default() };
        let device = Device::open(&options).unwrap();
        let image = device.image("image", [5, 3], ImageKind::Colour).unwrap();
        let depth = device.image("depth", [5, 3], ImageKind::Depth).unwrap();
        let target = device.buffer("target", 480, Place::Readback).unwrap();
        target.write(0, &[0xab; 480]);
        let mut recorder = device.recorder("pictures").unwrap();
        let picture = Picture { colours: &[&image], depth: Some((&depth, 0.5)) };
        for index in 0..2 {
            if before {
                recorder.begin_picture(&picture);
            } else {
                recorder.begin_rendering(&picture, [5, 3]);
            }
            if after {
                recorder.end_picture(&picture);
            } else {
                recorder.end_rendering();
            }
            recorder.copy_image(&image, &target, 240 * index);
        }
        recorder.finish().unwrap().submit().unwrap().wait().unwrap();
        let mut bytes = [1; 480];
        target.read(0, &mut bytes);
        assert_eq!(bytes, [0; 480], "cleared to 0");
        device.validation_messages()
    }

    #[test]
    fn missing_barriers_of_images_are_caught() {
        assert_eq!(messages(true, true), Vec::<String>::new());
        assert!(!messages(false, true).is_empty());
        assert!(!messages(true, false).is_empty());
    }

    #[test]
    #[should_panic(expected = "outside of a picture")]
    fn draws_need_a_picture() {
        let device = Device::open(&DeviceOptions { cache: None, ..DeviceOptions::default() }).unwrap();
        device.recorder("stray").unwrap().draw(3, 1);
    }
}
