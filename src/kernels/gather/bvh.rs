//! Density estimation from the photon BVH (Fabianowski and Dingliana 2009, section 6).

use super::brute::finish;
use super::{Points, Program};
use crate::graph::{Buf, Graph, Grid};
use crate::kernels::deposits::Deposits;
use crate::kernels::generated::{GatherBvh, GatherBvhBindings, RadiusRange};
use crate::kernels::photon::PhotonMap;
use crate::kernels::records::Record;

/// Writes the gathered radiance of the listed slots: caustic, then other light.
pub fn bvh(
    g: &mut Graph,
    program: Program,
    points: Points<'_>,
    (map, deposits): (&PhotonMap, &Deposits),
    gathered: &mut Buf<[f32; 4]>,
) {
    let (no_records, no_range) = (g.upload("no_records", &[0u32]), g.upload("no_range", &[RadiusRange::default()]));
    let (records, ranges) = map.records.as_ref().map_or((&*no_records, &*no_range), |r| (&r.records, &r.range));
    let kernel = GatherBvh {
        glossy: program.glossy,
        smooth_normals: program.smooth_normals,
        blinn_phong: program.blinn_phong,
        weight: program.weight.code(),
        count_pairs: program.count_pairs,
        walk_stride: program.walk.stride,
        walk_ratio: program.walk.ratio,
        step_limit: step_limit(&program),
        record: map.records.as_ref().map_or(Record::Full, |r| r.record).code(),
    };
    let bind = GatherBvhBindings {
        pass: points.pass,
        list: points.list,
        count: points.count,
        eye_hits: points.hits,
        lobes: points.lobes,
        photon_nodes: &map.tree.nodes,
        photons: &map.photons,
        records,
        ranges,
        gathered,
    };
    g.dispatch(kernel, Grid::Indirect(points.args), (), bind);
    // Three steps at most for each photon: two nodes, and itself.
    if deposits.photons.len() > step_limit(&program) / 3 {
        finish(g, program, points, (&deposits.photons, &deposits.count), gathered);
    }
}

/// Steps of a walk: all its loops together, which test, choose and evaluate, run three times for each.
fn step_limit(program: &Program) -> u32 {
    program.step_limit() / 2
}
