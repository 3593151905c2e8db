//! What attachments hold, and in which formats of Vulkan.

use super::instance::Instance;
use ash::vk;

/// What an [`super::Image`] holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// Four 32-bit floats a pixel.
    Colour,
    /// One 32-bit float a pixel.
    Depth,
}

impl ImageKind {
    pub(super) fn format(self) -> vk::Format {
        match self {
            Self::Colour => vk::Format::R32G32B32A32_SFLOAT,
            Self::Depth => vk::Format::D32_SFLOAT,
        }
    }

    pub(super) fn usage(self) -> vk::ImageUsageFlags {
        match self {
            Self::Colour => vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC,
            Self::Depth => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        }
    }

    pub(super) fn aspect(self) -> vk::ImageAspectFlags {
        match self {
            Self::Colour => vk::ImageAspectFlags::COLOR,
            Self::Depth => vk::ImageAspectFlags::DEPTH,
        }
    }

    /// Bytes of a pixel.
    pub fn pixel_bytes(self) -> u64 {
        match self {
            Self::Colour => 16,
            Self::Depth => 4,
        }
    }
}

/// Whether colours can be blended and copied, and depths tested, in the formats used here.
pub(super) fn formats_fit(instance: &Instance, raw: vk::PhysicalDevice) -> bool {
    let has = |kind: ImageKind, wanted: vk::FormatFeatureFlags| {
        // SAFETY: `raw` comes from this instance.
        let found = unsafe { instance.raw.get_physical_device_format_properties(raw, kind.format()) };
        found.optimal_tiling_features.contains(wanted)
    };
    has(ImageKind::Colour, vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND | vk::FormatFeatureFlags::TRANSFER_SRC)
        && has(ImageKind::Depth, vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT)
}
