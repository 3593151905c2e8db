//! The camera as an input of a recorded pass: another view needs no other plan.

use super::content::Content;
use crate::graph::{Executable, Graph, Input, ReadBuf};
use crate::kernels::generated::Camera;
use crate::render::scene::camera::device_camera;

/// A camera for a range of pixels, written by the host.
#[derive(Clone, Copy)]
pub struct CameraInput {
    input: Input<Camera>,
    first_pixel: u32,
    pixels: u32,
    /// Path slots per pixel.
    slots: u32,
}

impl CameraInput {
    /// Declares the input, which holds the camera of `content`, for `pixels` pixels from `first_pixel` on.
    pub fn declare(
        g: &mut Graph,
        name: &'static str,
        content: Content<'_>,
        (first_pixel, pixels): (u32, u32),
        slots: u32,
    ) -> (ReadBuf<Camera>, Self) {
        let camera = camera(content, (first_pixel, pixels), slots);
        let (buffer, input) = g.input(name, &[camera]);
        (buffer, Self { input, first_pixel, pixels, slots })
    }

    /// Sets the camera of `content` for the runs that follow.
    pub fn write(&self, executable: &mut Executable, content: Content<'_>) {
        executable.write(&self.input, &[camera(content, (self.first_pixel, self.pixels), self.slots)]);
    }
}

fn camera(content: Content<'_>, (first_pixel, pixels): (u32, u32), slots: u32) -> Camera {
    Camera { first_pixel, pixels, ..device_camera(content.scene, content.settings, slots) }
}
