//! The shape of a method of light transport: what it prepares for a pass is asked for the light of one band of pixels
//! after the other.

use super::camera_input::CameraInput;
use super::content::Content;
use crate::graph::{Buf, Graph};
use crate::kernels::deposits::Deposits;
use crate::kernels::eye::View;
use crate::kernels::generated::Camera;
use crate::kernels::scene_data::SceneBuffers;

/// A method of light transport, prepared for a pass: its photons are traced and their map is built, if it has any.
pub trait Transport {
    /// Declares what the method does for a band of pixels and yields the light of the band.
    fn band(&mut self, g: &mut Graph, at: BandView<'_>) -> BandLight;

    /// The photons of the pass, or their light vertices, if there are any.
    fn deposits(&self) -> Option<&Deposits> {
        None
    }

    /// The camera that the method used before it was asked for bands, if it did.
    fn camera(&self) -> Option<CameraInput> {
        None
    }

    /// Numbers to report of what was built from the photons, by name; equal names are added up. Asked after all bands.
    fn counts(&self, _g: &mut Graph) -> Vec<(&'static str, Buf<u32>)> {
        vec![]
    }
}

/// A band of pixels, and what is read to see it.
#[derive(Clone, Copy)]
pub struct BandView<'a> {
    pub content: Content<'a>,
    pub buffers: &'a SceneBuffers,
    /// The camera with this band of pixels.
    pub camera: &'a Buf<Camera>,
    /// First pixel of the band, in the order of glsl/lib/pixels.glsl.
    pub first_pixel: u32,
    pub pixels: u32,
}

impl<'a> BandView<'a> {
    /// The scene and the camera, as kernels take them.
    pub fn view(&self) -> View<'a> {
        View { scene: self.buffers, camera: self.camera }
    }
}

/// What one pass brings for a band of pixels.
pub struct BandLight {
    /// Emission and direct light per path slot.
    pub radiance: Buf<[f32; 4]>,
    /// Caustic and other light per path slot.
    pub gathered: Buf<[f32; 4]>,
    /// Layers of the first hit per pixel.
    pub aov_first: Buf<f32>,
    /// Eye paths that were still alive at the depth limit.
    pub truncated: Buf<u32>,
}
