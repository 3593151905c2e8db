//! The camera as the kernels read it.

use crate::kernels::generated::Camera;
use crate::render::settings::Settings;
use crate::scene::{Projection, Scene};

/// The camera as the kernels read it.
pub fn device_camera(scene: &Scene, settings: &Settings, slots: u32) -> Camera {
    let camera = &scene.cameras[settings.camera];
    let (width, height) = (settings.width as f32, settings.height as f32);
    let [half_width, half_height] = camera.projection.half_size(width / height);
    let orthographic = u32::from(matches!(camera.projection, Projection::Orthographic { .. }));
    Camera {
        position: camera.position,
        width: settings.width,
        right: camera.right.map(|x| x * half_width),
        height: settings.height,
        up: camera.up.map(|x| x * half_height),
        orthographic,
        forward: camera.forward,
        slots,
        first_pixel: 0,
        pixels: 0,
        lens_radius: settings.lens.map_or(0.0, |lens| lens.radius),
        inverse_focus: settings.lens.map_or(0.0, |lens| 1.0 / lens.focus),
    }
}
