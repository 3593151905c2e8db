//! What a pass is made from.

use crate::render::scene::upload::DeviceScene;
use crate::render::settings::{Method, Settings};
use crate::scene::Scene;

/// A scene, on the host and on the device, and how it is rendered.
#[derive(Clone, Copy)]
pub struct Content<'a> {
    pub scene: &'a Scene,
    pub device: &'a DeviceScene,
    pub settings: &'a Settings,
}

impl Content<'_> {
    /// Path slots per pixel: splitting needs them only where paths can go on after their first surface.
    pub fn slots(&self) -> u32 {
        if self.device.variant.glossy && self.settings.method != Method::Path { 4 } else { 1 }
    }
}
