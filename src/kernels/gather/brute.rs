//! Density estimation with every photon at every hit: the specification of all other estimators, and what finishes the
//! hits at which they gave up.

use super::{Points, Program};
use crate::graph::{Buf, Graph, Grid};
use crate::kernels::Items;
use crate::kernels::eye::SlotList;
use crate::kernels::generated::{
    GatherBrute, GatherBruteBindings, GatherBruteParams, GatherUnfinished, GatherUnfinishedBindings, Photon,
};

/// Photons of one dispatch. Well below the shortest loop limit known (65,535), and short enough for any watchdog.
const PHOTONS: u32 = 1 << 14;

/// Writes the gathered radiance of the listed slots (caustic, then other light) from the first `photons.1[0]` photons.
pub fn brute(
    g: &mut Graph,
    program: Program,
    points: Points<'_>,
    photons: (&Buf<Photon>, &Buf<u32>),
    gathered: &mut Buf<[f32; 4]>,
) {
    let kernel = || GatherBrute {
        glossy: program.glossy,
        smooth_normals: program.smooth_normals,
        blinn_phong: program.blinn_phong,
        weight: program.weight.code(),
        count_pairs: program.count_pairs,
        walk_stride: program.walk.stride,
        walk_ratio: program.walk.ratio,
    };
    for first in (0..photons.0.len().max(1)).step_by(PHOTONS as usize) {
        let bind = GatherBruteBindings {
            pass: points.pass,
            list: points.list,
            count: points.count,
            eye_hits: points.hits,
            lobes: points.lobes,
            photon_count: photons.1,
            photons: photons.0,
            gathered: &mut *gathered,
        };
        g.dispatch(kernel(), Grid::Indirect(points.args), GatherBruteParams { first, most: PHOTONS }, bind);
    }
}

/// Estimates again, with every photon, where an estimator gave up (UNFINISHED): only drivers that end loops need it. A
/// hit at which this happens has tens of thousands of photons around it, so that going through all of them is no waste.
pub(super) fn finish(
    g: &mut Graph,
    program: Program,
    points: Points<'_>,
    photons: (&Buf<Photon>, &Buf<u32>),
    gathered: &mut Buf<[f32; 4]>,
) {
    if program.loop_limit.is_none() {
        return;
    }
    g.scope("finish", |g| {
        let rest = unfinished(g, points, gathered);
        brute(g, program, points.part(&rest), photons, gathered);
    });
}

/// The points at which an estimator gave up (UNFINISHED).
pub(super) fn unfinished(g: &mut Graph, points: Points<'_>, gathered: &Buf<[f32; 4]>) -> SlotList {
    let mut flags = g.buffer("unfinished", points.list.len());
    let bind = GatherUnfinishedBindings { list: points.list, count: points.count, gathered, flags: &mut flags };
    g.dispatch(GatherUnfinished, Grid::Indirect(points.args), (), bind);
    SlotList::select(g, Items::Counted(points.count), &flags, points.list, points.list.len())
}
