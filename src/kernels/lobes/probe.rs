//! Lobes as the kernels evaluate and sample them, one by one.

use crate::graph::{Buf, Graph, Grid};
use crate::kernels::generated::{LobeProbe, LobeProbeBindings, LobeProbeParams, ProbedLobe};

/// Evaluates and samples lobes with the functions that light transport uses: three vectors of `results` for each, as
/// `glsl/kernels/surface/lobe_probe.comp` describes. `lobes` begins with [`super::table::reflection_words`].
pub fn probe(g: &mut Graph, probes: &Buf<ProbedLobe>, lobes: &Buf<u32>, results: &mut Buf<[f32; 4]>) {
    let count = probes.len();
    let bind = LobeProbeBindings { lobes, probes, results };
    g.dispatch(LobeProbe::default(), Grid::Threads(count), LobeProbeParams { count }, bind);
}
