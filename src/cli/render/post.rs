//! What is done to a picture after its last pass.

use super::flags_post::DepthOfField;
use super::request::Request;
use crate::error::Result;
use crate::picture::exr::{Metadata, Value};
use crate::picture::post::defocus::Defocus;
use crate::picture::post::{Post, View};
use crate::picture::tonemap::ToneMap;
use crate::render::{Lens, Settings};
use crate::scene::{Camera, Projection};

/// What is done to the finished film.
pub(in crate::cli) struct After {
    pub post: Post,
    pub view: View,
    /// The lens in the eye paths.
    lens: Option<Lens>,
}

impl After {
    pub fn of(request: &Request, camera: &Camera, settings: &Settings) -> Result<Self> {
        let defocus = match request.lens.depth_of_field {
            DepthOfField::Lens => None,
            DepthOfField::Screen => request.lens.lens(camera)?.map(|Lens { radius, focus }| Defocus { radius, focus }),
        };
        let orthographic = matches!(camera.projection, Projection::Orthographic { .. });
        let half = camera.projection.half_size(settings.width as f32 / settings.height as f32);
        let post = Post { ssao: request.post.occlusion(), defocus, bloom: request.post.glow() };
        let view = View { axes: [camera.right, camera.up, camera.forward], half, orthographic };
        Ok(Self { post, view, lens: settings.lens })
    }

    /// For the metadata of an EXR: keys `lens` and `post`, where there is something to say.
    pub fn notes(&self) -> Metadata {
        let lens = self.lens.map(|Lens { radius, focus }| format!("aperture radius {radius} focus {focus}"));
        let passes = self.post.describe();
        let post = (!passes.is_empty()).then(|| passes.join("; "));
        let notes = [("lens", lens), ("post", post)];
        notes.into_iter().filter_map(|(key, text)| Some((key.to_owned(), Value::Text(text?)))).collect()
    }

    /// For the report.
    pub fn report(&self, request: &Request) -> serde_json::Value {
        serde_json::json!({
            "lens": self.lens.map(|lens| serde_json::json!({ "radius": lens.radius, "focus": lens.focus })),
            "linear": self.post.describe(),
            "png": request.post.display(ToneMap::default()).describe(),
        })
    }
}
