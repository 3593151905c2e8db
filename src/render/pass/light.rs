//! Light tracing (`Method::Light`): the photons of a pass, whose places are connected to the camera instead of gathered.

use super::content::Content;
use crate::error::{Error, Result};
use crate::graph::Graph;
use crate::kernels::light::{Splats, connect};
use crate::kernels::photon::Deposits;
use crate::kernels::scene_data::SceneBuffers;
use crate::render::scene::camera::device_camera;
use crate::render::settings::{Method, Sampling, Settings};

/// Refuses settings that light tracing has no meaning for.
///
/// # Errors
/// [`Error::Usage`] for a lens and for sampling of density estimates.
pub fn check(settings: &Settings) -> Result<()> {
    if settings.method != Method::Light {
        return Ok(());
    }
    if settings.lens.is_some() {
        let text = "--method light connects light to a pinhole or a parallel camera: leave --aperture out, or choose another method";
        return Err(Error::Usage(text.into()));
    }
    if settings.sampling != Sampling::Full {
        let text = "--method light estimates no density: leave --sampling out, or choose another method";
        return Err(Error::Usage(text.into()));
    }
    Ok(())
}

/// What all pixels see of the light vertices of a pass.
pub fn splats(g: &mut Graph, content: Content<'_>, buffers: &SceneBuffers, vertices: &Deposits) -> Splats {
    let Content { scene, device, settings } = content;
    let mut camera = device_camera(scene, settings, 1);
    camera.pixels = settings.pixels();
    let camera = g.upload("whole_camera", &[camera]);
    connect(g, (buffers, &camera), device.variant, settings.pixels(), vertices)
}
