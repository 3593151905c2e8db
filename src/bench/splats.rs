//! Additive blending of floats, which bounds what estimators can do that scatter photons as squares of the picture.

use super::{Effort, Floor, MEASURED, Rate, time};
use crate::draw_state::{DrawState, Topology};
use crate::error::Result;
use crate::graph::{Draw, Instances, RasterPass, Runtime};
use crate::kernels::generated::{
    BenchSplatFrag, BenchSplatFragBindings, BenchSplatFragParams, BenchSplatVert, BenchSplatVertBindings,
    BenchSplatVertParams, Splat,
};
use crate::vk::Feature;

/// Pixels of the picture along a side.
const SIDE: u32 = 512;
/// Half a square's side in pixels: about a photon's footprint at the default settings.
const HALF_SIDE: u32 = 8;
/// Fragments of a square.
const FRAGMENTS: u32 = 4 * HALF_SIDE * HALF_SIDE;

/// Fragments a second, each added to two pictures; nothing where the device does not draw.
pub(super) fn splats(runtime: &Runtime, effort: Effort) -> Result<Option<Rate>> {
    if runtime.device().require(&[Feature::Raster]).is_err() {
        return Ok(None);
    }
    let count = (effort.items / FRAGMENTS).max(1);
    let (data, white) = ((0..count).map(splat).collect::<Vec<_>>(), vec![[1.0f32; 4]; count as usize]);
    let (data, white) = (runtime.persistent_from("splats", &data)?, runtime.persistent_from("colours", &white)?);
    let seconds = time(runtime, effort.repeats, |g| {
        let (splats, colours) = (g.import_read(&data), g.import_read(&white));
        let (mut sum, mut place) = (g.buffer("sum", SIDE * SIDE), g.buffer("place", SIDE * SIDE));
        let extent = [SIDE as f32; 2];
        let instances = Instances::Direct { vertices: 4, instances: count };
        let bind = BenchSplatVertBindings { splats: &splats };
        let draw = Draw::new(BenchSplatVert, instances, BenchSplatVertParams { extent }, bind)
            .fragment(
                BenchSplatFrag { scale: 1.0 },
                BenchSplatFragParams { extent, factor: 1.0 },
                BenchSplatFragBindings { splats: &splats, colours: &colours },
            )
            .state(DrawState { topology: Topology::TriangleStrip, ..DrawState::default() });
        let pass = RasterPass { name: "splats", extent: [SIDE; 2], depth: None };
        g.scope(MEASURED, |g| g.raster(pass, vec![draw], [&mut sum, &mut place]));
        g.keep(&sum);
    })?;
    let items = u64::from(count) * u64::from(FRAGMENTS);
    let note = "each to two pictures".to_owned();
    Ok(Some(Rate { name: "additive blending", items, unit: "fragments", seconds, floor: Floor::Unknown, note }))
}

/// Squares all over the picture, none of them cut.
fn splat(index: u32) -> Splat {
    let place = |step: u32| (HALF_SIDE + index.wrapping_mul(step) % (SIDE - 2 * HALF_SIDE)) as f32;
    Splat { centre: [place(7919), place(104_729)], half_side: HALF_SIDE as f32, depth: 0.5 }
}
