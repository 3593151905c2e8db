//! Attachments of graphics passes and the memory under them.

use super::buffer::refuse_oversize;
use super::call::{failed, lock};
use super::core::Core;
use super::image_kind::ImageKind;
use super::memory::{Place, allocate};
use crate::error::{Error, MemoryCause, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// A picture to be drawn on. Freed when neither this value nor any recorded [`super::Commands`] uses it.
pub struct Image {
    pub(super) inner: Arc<ImageInner>,
}

pub(super) struct ImageInner {
    core: Arc<Core>,
    pub raw: vk::Image,
    pub view: vk::ImageView,
    pub name: String,
    pub extent: [u32; 2],
    pub kind: ImageKind,
    /// Taken on drop only.
    allocation: Option<Allocation>,
}

impl Image {
    pub(super) fn new(core: &Arc<Core>, name: &str, extent: [u32; 2], kind: ImageKind) -> Result<Self> {
        let [width, height] = extent;
        assert!(width > 0 && height > 0, "the image '{name}' of {width} x {height} pixels");
        let most = core.info.limits.image_side;
        if width > most || height > most {
            let feature = format!("pictures of {width} x {height} pixels in graphics passes (it has {most} x {most})");
            return Err(Error::MissingFeature { device: core.info.name.clone(), feature, settings: &[] });
        }
        let bytes = u64::from(width) * u64::from(height) * kind.pixel_bytes();
        refuse_oversize(core, name, bytes, Place::Device)?;
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(kind.format())
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(kind.usage());
        // SAFETY: the format can be used so (`formats_fit`), the extent is neither zero nor beyond the device's limits
        // (VUID-VkImageCreateInfo-imageCreateMaxMipLevels-02251, -extent-02252, -02253).
        let raw = unsafe { core.raw.create_image(&info, None) }.map_err(failed("vkCreateImage", name))?;
        core.set_name(raw, name);
        // Null and empty until made, so that an early return frees what exists.
        let mut inner = ImageInner {
            core: Arc::clone(core),
            raw,
            view: vk::ImageView::null(),
            name: name.to_owned(),
            extent,
            kind,
            allocation: None,
        };
        inner.place()?;
        inner.create_view()?;
        Ok(Self { inner: Arc::new(inner) })
    }

    /// Width and height in pixels.
    pub fn extent(&self) -> [u32; 2] {
        self.inner.extent
    }

    /// What it holds.
    pub fn kind(&self) -> ImageKind {
        self.inner.kind
    }

    /// Length of its content in bytes.
    pub fn bytes(&self) -> u64 {
        let [width, height] = self.extent();
        u64::from(width) * u64::from(height) * self.kind().pixel_bytes()
    }
}

impl ImageInner {
    fn place(&mut self) -> Result<()> {
        // SAFETY: the image was just made by this device.
        let requirements = unsafe { self.core.raw.get_image_memory_requirements(self.raw) };
        let desc = AllocationCreateDesc {
            name: &self.name,
            requirements,
            location: MemoryLocation::GpuOnly,
            linear: false,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let allocation = allocate(&self.core, &desc).map_err(|cause| Error::OutOfMemory {
            object: self.name.clone(),
            bytes: requirements.size,
            cause: MemoryCause::ImageRefused(cause),
        })?;
        lock(&self.core.memory).add(Place::Device, allocation.size());
        let (memory, offset) = {
            let allocation = self.allocation.insert(allocation);
            // SAFETY: only read, and bound below to the image that the allocation was made for.
            (unsafe { allocation.memory() }, allocation.offset())
        };
        // SAFETY: the image is not bound yet, and the allocation was made from its own requirements, so type, size and
        // alignment fit (VUID-vkBindImageMemory-memory-01047, -None-10735); the allocation outlives the image.
        unsafe { self.core.raw.bind_image_memory(self.raw, memory, offset) }
            .map_err(failed("vkBindImageMemory", &self.name))
    }

    fn create_view(&mut self) -> Result<()> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(self.kind.format())
            .subresource_range(self.range());
        // SAFETY: the image is bound to memory (VUID-VkImageViewCreateInfo-image-01020); format and range are its own.
        self.view =
            unsafe { self.core.raw.create_image_view(&info, None) }.map_err(failed("vkCreateImageView", &self.name))?;
        Ok(())
    }

    /// All of it.
    pub fn range(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange::default().aspect_mask(self.kind.aspect()).level_count(1).layer_count(1)
    }
}

impl Drop for ImageInner {
    fn drop(&mut self) {
        // SAFETY: commands that name the image hold a share of `self` until they have finished
        // (VUID-vkDestroyImage-image-01000, VUID-vkDestroyImageView-imageView-01026); null handles are allowed.
        unsafe {
            self.core.raw.destroy_image_view(self.view, None);
            self.core.raw.destroy_image(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            lock(&self.core.memory).remove(Place::Device, allocation.size());
            // The only failure is a foreign allocation, which this is not.
            let _ = lock(&self.core.allocator).free(allocation);
        }
    }
}
