//! The pictures that graphics passes draw on.

use std::collections::BTreeMap;

use crate::error::Result;
use crate::graph::declare::Operation;
use crate::graph::draw::RasterSpec;
use crate::graph::plan::Plan;
use crate::vk::{Device, Image, ImageKind, Picture, Recorder};

/// Pictures of a plan. Passes of the same extent share them: what one pass leaves in a picture no other looks at.
#[derive(Default)]
pub(super) struct Images(BTreeMap<[u32; 2], Shared>);

/// The pictures of one extent: as many as the pass with the most needs.
struct Shared {
    colours: Vec<Image>,
    depth: Option<Image>,
}

/// The graphics passes of a plan.
pub(super) fn raster_passes(plan: &Plan) -> impl Iterator<Item = &RasterSpec> {
    plan.passes.iter().filter_map(|pass| match &pass.operation {
        Operation::Raster(spec) => Some(spec),
        _ => None,
    })
}

impl Images {
    /// Makes the pictures of all graphics passes.
    pub fn new(device: &Device, plan: &Plan) -> Result<Self> {
        let mut images = Self::default();
        for spec in raster_passes(plan) {
            let shared = images.0.entry(spec.extent).or_insert_with(|| Shared { colours: vec![], depth: None });
            while shared.colours.len() < spec.outputs.len() {
                shared.colours.push(device.image("picture", spec.extent, ImageKind::Colour)?);
            }
            if spec.depth.is_some() && shared.depth.is_none() {
                shared.depth = Some(device.image("picture_depth", spec.extent, ImageKind::Depth)?);
            }
        }
        Ok(images)
    }

    /// Bytes of all pictures.
    pub fn bytes(&self) -> u64 {
        self.0.values().flat_map(|shared| shared.colours.iter().chain(&shared.depth)).map(Image::bytes).sum()
    }

    /// Runs `draw` with the picture of a pass begun.
    pub fn within<R>(&self, recorder: &mut Recorder, spec: &RasterSpec, draw: impl FnOnce(&mut Recorder) -> R) -> R {
        let shared = &self.0[&spec.extent];
        let colours: Vec<_> = shared.colours[..spec.outputs.len()].iter().collect();
        let depth = spec.depth.and_then(|value| shared.depth.as_ref().map(|image| (image, value)));
        let picture = Picture { colours: &colours, depth };
        recorder.begin_picture(&picture);
        let result = draw(recorder);
        recorder.end_picture(&picture);
        result
    }

    /// The colours of a pass, in the order of its outputs.
    pub fn colours(&self, spec: &RasterSpec) -> &[Image] {
        &self.0[&spec.extent].colours[..spec.outputs.len()]
    }
}
