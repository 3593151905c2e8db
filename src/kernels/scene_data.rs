//! The variant of the kernels that a scene needs.

pub use super::generated::SceneBuffers;

/// Specialisation of the transport kernels: what a scene does not need is compiled out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Variant {
    pub textures: bool,
    pub normal_maps: bool,
    /// Surfaces with holes, or there in part.
    pub alpha_mask: bool,
    /// Surfaces that the camera does not see from behind.
    pub one_sided: bool,
    pub glass: bool,
    pub absorption: bool,
    /// Anything but pure Lambert.
    pub glossy: bool,
    pub environment: bool,
    pub area_lights: bool,
    pub delta_lights: bool,
    /// Photons from infinity start where they are useful.
    pub guided: bool,
    /// Samples of the environment are chosen by what gets through.
    pub guided_samples: bool,
    /// A thin lens instead of a pinhole.
    pub lens: bool,
    /// Shading normals that differ from geometric ones.
    pub smooth_normals: bool,
    /// Whether a gathering surface reflects other than by Lambert's law, or has shading normals of its own.
    pub gathers_glossy: bool,
    pub gathers_smooth: bool,
    /// Gathered glossy lobes after Blinn and Phong instead of GGX: a wish of the settings, not a need of the scene.
    pub blinn_phong: bool,
    /// Vectors of [`SceneBuffers::shading_data`] per triangle.
    pub shading_stride: u32,
    /// Where each attribute begins in a triangle's vectors; 0 if absent.
    pub uv0_at: u32,
    pub uv1_at: u32,
    pub color_at: u32,
    pub tangent_at: u32,
}

impl Variant {
    /// Whether vertex attributes lie in the same places.
    pub fn same_layout(&self, other: &Self) -> bool {
        let places = |v: &Self| [v.shading_stride, v.uv0_at, v.uv1_at, v.color_at, v.tangent_at];
        places(self) == places(other)
    }
}
