//! The scene's buffers in a graph, and the variant of the kernels that the scene needs.

use super::generated::{BvhNode, BvhTriangle, Caster, Globals, Light, Material, Pass, TextureUse};
use crate::graph::ReadBuf;

/// What every transport kernel may read; the layouts are those of glsl/shared.
#[derive(Debug)]
pub struct SceneBuffers {
    /// Tree over the triangles.
    pub nodes: ReadBuf<BvhNode>,
    /// Triangles in leaf order.
    pub triangles: ReadBuf<BvhTriangle>,
    /// Vertex attributes per triangle, laid out by [`Variant`].
    pub shading_data: ReadBuf<[f32; 4]>,
    /// Materials.
    pub materials: ReadBuf<Material>,
    /// Textures as materials use them.
    pub texture_uses: ReadBuf<TextureUse>,
    /// RGBA8 texels of all textures.
    pub texels: ReadBuf<u32>,
    /// Lights with their cumulative probabilities.
    pub lights: ReadBuf<Light>,
    /// One entry.
    pub globals: ReadBuf<Globals>,
    /// Radiance of the environment.
    pub environment: ReadBuf<[f32; 4]>,
    /// Cumulative rows, then the cumulative column.
    pub environment_cdf: ReadBuf<f32>,
    /// Spheres around specular surfaces.
    pub casters: ReadBuf<Caster>,
    /// One entry, changed by the host before each pass.
    pub pass: ReadBuf<Pass>,
}

/// Specialisation of the transport kernels: what a scene does not need is compiled out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Variant {
    pub textures: bool,
    pub normal_maps: bool,
    pub alpha_mask: bool,
    pub glass: bool,
    pub absorption: bool,
    /// Anything but pure Lambert.
    pub glossy: bool,
    pub environment: bool,
    pub area_lights: bool,
    pub delta_lights: bool,
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
