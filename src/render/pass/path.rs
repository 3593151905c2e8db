//! The methods beside photon mapping: what each puts into a band of the film.

use super::content::Content;
use super::light;
use crate::error::{Error, Result};
use crate::graph::Graph;
use crate::kernels::eye::View;
use crate::kernels::path::{PathLight, PathSettings, trace};
use crate::render::settings::{Method, Settings};

/// Checks that a method can render with these settings.
///
/// # Errors
/// [`Error::Usage`] if it has no such model.
pub fn check(settings: &Settings) -> Result<()> {
    match settings.method {
        Method::Photons => Ok(()),
        Method::Path if settings.blinn_phong => {
            Err(Error::Usage("method path scatters by GGX: it has no Blinn-Phong model".into()))
        }
        Method::Path => Ok(()),
        Method::Light => light::check(settings),
    }
}

/// Paths of a band of pixels. They may meet as many surfaces as photons may or eye paths may, whichever is more: mirrors
/// and glass count like the others. One light sample at each surface: the lobes' own sample is the other strategy.
pub fn path(g: &mut Graph, content: Content<'_>, view: View<'_>, pixels: u32) -> PathLight {
    let Content { device, settings, .. } = content;
    let path_settings = PathSettings {
        pixels,
        max_depth: settings.photon_bounces.max(settings.eye_depth),
        light_samples: if device.light_count > 0 { 1 } else { 0 },
        aov: settings.layers,
    };
    trace(g, view, device.variant, path_settings)
}
