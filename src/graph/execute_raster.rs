//! Running graphics passes: pictures, pipelines, recording.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::declare::Operation;
use super::draw::{DrawCount, DrawSpec, RasterSpec, Stage, StageSpec};
use super::execute::{Memory, Runtime, check_range};
use super::plan::Plan;
use crate::error::Result;
use crate::vk::{Device, Feature, Image, ImageKind, Picture, Pipeline, RasterDesc, Recorder, StageDesc};

/// Pictures of a plan. Passes of the same extent share them: what one pass leaves in a picture no other looks at.
#[derive(Default)]
pub(super) struct Images(BTreeMap<[u32; 2], Shared>);

/// The pictures of one extent: as many as the pass with the most needs.
struct Shared {
    colours: Vec<Image>,
    depth: Option<Image>,
}

/// The graphics passes of a plan.
fn passes(plan: &Plan) -> impl Iterator<Item = &RasterSpec> {
    plan.passes.iter().filter_map(|pass| match &pass.operation {
        Operation::Raster(spec) => Some(spec),
        _ => None,
    })
}

/// Refuses a plan whose draws the device cannot do, or that need more of a buffer than one binding shows.
pub(super) fn check(device: &Device, plan: &Plan) -> Result<()> {
    let longest = device.info().limits.storage_range;
    for spec in passes(plan) {
        device.require(&[Feature::Raster])?;
        for draw in &spec.draws {
            if draw.stage(Stage::Geometry).is_some() {
                device.require(&[Feature::GeometryShader])?;
            }
            if draw.state.depth_clamp {
                device.require(&[Feature::DepthClamp])?;
            }
            for (_, buffer) in draw.bindings() {
                check_range(plan, buffer, draw.name(), longest)?;
            }
        }
    }
    Ok(())
}

impl Images {
    /// Makes the pictures of all graphics passes.
    pub fn new(device: &Device, plan: &Plan) -> Result<Self> {
        let mut images = Self::default();
        for spec in passes(plan) {
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
    fn within<R>(&self, recorder: &mut Recorder, spec: &RasterSpec, draw: impl FnOnce(&mut Recorder) -> R) -> R {
        let shared = &self.0[&spec.extent];
        let colours: Vec<_> = shared.colours[..spec.outputs.len()].iter().collect();
        let depth = spec.depth.and_then(|value| shared.depth.as_ref().map(|image| (image, value)));
        let picture = Picture { colours: &colours, depth };
        recorder.begin_picture(&picture);
        let result = draw(recorder);
        recorder.end_picture(&picture);
        result
    }
}

impl Runtime {
    pub(super) fn record_raster(
        &self,
        recorder: &mut Recorder,
        plan: &Plan,
        memory: &Memory,
        spec: &RasterSpec,
    ) -> Result<()> {
        memory.images.within(recorder, spec, |recorder| -> Result<()> {
            for draw in &spec.draws {
                self.bind_draw(recorder, plan, memory, (spec, draw))?;
                match draw.count {
                    DrawCount::Direct { vertices, instances } => recorder.draw(vertices, instances),
                    DrawCount::Indirect(buffer) => {
                        let args = memory.slice(plan, buffer);
                        recorder.draw_indirect(args.buffer, args.offset);
                    }
                }
            }
            Ok(())
        })?;
        for (image, &output) in memory.images.0[&spec.extent].colours.iter().zip(&spec.outputs) {
            let to = memory.slice(plan, output);
            recorder.copy_image(image, to.buffer, to.offset);
        }
        Ok(())
    }

    fn bind_draw(
        &self,
        recorder: &mut Recorder,
        plan: &Plan,
        memory: &Memory,
        (spec, draw): (&RasterSpec, &DrawSpec),
    ) -> Result<()> {
        let slices: Vec<_> =
            draw.bindings().into_iter().map(|(binding, buffer)| (binding, memory.slice(plan, buffer))).collect();
        recorder.bind(&self.draw_pipeline(spec, draw)?, &slices, draw.params())
    }

    fn draw_pipeline(&self, spec: &RasterSpec, draw: &DrawSpec) -> Result<Arc<Pipeline>> {
        let bindings: Vec<u32> = draw.bindings().into_iter().map(|(binding, _)| binding).collect();
        self.device.raster_pipeline(&RasterDesc {
            name: draw.name(),
            vertex: stage_desc(&draw.stages[0]),
            geometry: draw.stage(Stage::Geometry).map(stage_desc),
            fragment: draw.stage(Stage::Fragment).map(stage_desc),
            bindings: &bindings,
            push_bytes: draw.params().len() as u32,
            state: draw.state,
            colours: spec.outputs.len() as u32,
            writes_colour: draw.writes_colour(),
            depth: spec.depth.is_some(),
        })
    }
}

fn stage_desc(stage: &StageSpec) -> StageDesc<'_> {
    StageDesc { spirv: bytemuck::cast_slice(stage.shader.spirv.0), constants: &stage.constants }
}
