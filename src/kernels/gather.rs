//! Density estimation at the eye hits from the photon BVH.

use super::eye::EyeHits;
use super::generated::{GatherBvh, GatherBvhBindings};
use super::photon::PhotonMap;
use super::scene_data::Variant;
use crate::graph::{Buf, Graph, Grid};

/// How to gather.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Epanechnikov kernel if true, constant otherwise.
    pub epanechnikov: bool,
    /// Leaves the number of photons tested in the fourth component of the caustic light, and of those that counted in
    /// that of the other light: for measurements. Otherwise both are 0.
    pub count_pairs: bool,
}

/// Gathered radiance per slot: caustic, then other light.
pub fn bvh(
    g: &mut Graph,
    v: Variant,
    options: Options,
    eye: &EyeHits,
    photons: &PhotonMap,
    gathered: &mut Buf<[f32; 4]>,
) {
    let Options { epanechnikov, count_pairs } = options;
    let kernel = GatherBvh { glossy: v.gathers_glossy, smooth_normals: v.gathers_smooth, epanechnikov, count_pairs };
    let bind = GatherBvhBindings {
        list: &eye.list,
        count: &eye.count,
        eye_hits: &eye.hits,
        photon_nodes: &photons.tree.nodes,
        photons: &photons.photons,
        gathered,
    };
    g.dispatch(kernel, Grid::Indirect(&eye.args), (), bind);
}
