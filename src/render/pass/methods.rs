//! The methods of light transport there are: each is one file and one line here.

use super::budget::PhotonBudget;
use super::content::Content;
use super::light::LightPaths;
use super::path::EyePaths;
use super::photons::Photons;
use super::transport::Transport;
use crate::graph::Graph;
use crate::kernels::scene_data::SceneBuffers;
use crate::render::settings::Method;

/// Declares what the chosen method does before it looks at any pixel.
pub fn prepare(
    g: &mut Graph,
    content: Content<'_>,
    buffers: &SceneBuffers,
    budget: &PhotonBudget,
) -> Box<dyn Transport> {
    match content.settings.method {
        // Of its other passes another session has the plan.
        Method::Auto | Method::Photons => Box::new(Photons::prepare(g, content, buffers, budget)),
        Method::Hybrid => Box::new(EyePaths::with_caustics(g, content, buffers, budget)),
        Method::Path => Box::new(EyePaths::alone()),
        Method::Light => Box::new(LightPaths::prepare(g, content, buffers, budget)),
    }
}
