//! Recording graphics passes: pipelines, draws, and the copies of their pictures to buffers.

use std::sync::Arc;

use super::memory::Memory;
use super::runtime::Runtime;
use crate::error::Result;
use crate::graph::draw::{DrawCount, DrawSpec, RasterSpec, Stage, StageSpec};
use crate::graph::plan::Plan;
use crate::vk::{Pipeline, RasterDesc, Recorder, StageDesc};

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
        for (image, &output) in memory.images.colours(spec).iter().zip(&spec.outputs) {
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
