//! Light tracing ([`Method::Light`](crate::render::Method::Light)): where photons meet surfaces is connected to the
//! camera instead of gathered.

use super::budget::PhotonBudget;
use super::camera_input::CameraInput;
use super::content::Content;
use super::transport::{BandLight, BandView, Transport};
use super::{emission, eye};
use crate::graph::Graph;
use crate::kernels::deposits::Deposits;
use crate::kernels::eye::View;
use crate::kernels::light::{self, Splats};
use crate::kernels::scene_data::SceneBuffers;

/// Light vertices and what all pixels see of them; `None` without photons.
pub struct LightPaths(Option<Connected>);

struct Connected {
    vertices: Deposits,
    splats: Splats,
    camera: CameraInput,
}

impl LightPaths {
    /// Traces the photons of a pass and connects their vertices to the camera.
    pub fn prepare(g: &mut Graph, content: Content<'_>, buffers: &SceneBuffers, budget: &PhotonBudget) -> Self {
        let vertices = emission::vertices(g, content, buffers, budget);
        Self(vertices.map(|vertices| {
            let (splats, camera) = g.scope("connections", |g| connect(g, content, buffers, &vertices));
            Connected { vertices, splats, camera }
        }))
    }
}

/// What all pixels see of the light vertices of a pass.
fn connect(g: &mut Graph, content: Content<'_>, buffers: &SceneBuffers, vertices: &Deposits) -> (Splats, CameraInput) {
    let pixels = content.settings.pixels();
    let (camera, input) = CameraInput::declare(g, "whole_camera", content, (0, pixels), 1);
    let view = View { scene: buffers, camera: &camera };
    (light::connect(g, view, content.device.variant, pixels, vertices), input)
}

impl Transport for LightPaths {
    /// Eye paths bring emission and direct light.
    fn band(&mut self, g: &mut Graph, at: BandView<'_>) -> BandLight {
        let (hits, mut gathered) = eye::look(g, at);
        if let Some(Connected { vertices, splats, .. }) = &self.0 {
            let view = (at.camera, at.pixels);
            g.scope("gather", |g| light::sum(g, view, splats, &vertices.count, &mut gathered));
        }
        BandLight::of(hits, gathered)
    }

    fn deposits(&self) -> Option<&Deposits> {
        self.0.as_ref().map(|connected| &connected.vertices)
    }

    fn camera(&self) -> Option<CameraInput> {
        self.0.as_ref().map(|connected| connected.camera)
    }
}
