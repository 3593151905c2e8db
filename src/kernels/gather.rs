//! Density estimation at the eye hits from the photon BVH.

use super::eye::EyeHits;
use super::generated::{GatherBvh, GatherBvhBindings};
use super::photon::PhotonMap;
use super::scene_data::Variant;
use crate::graph::{Buf, Graph, Grid};

/// Gathered radiance per slot: caustic, then other light. `epanechnikov` chooses the kernel, constant otherwise.
pub fn bvh(
    g: &mut Graph,
    v: Variant,
    epanechnikov: bool,
    eye: &EyeHits,
    photons: &PhotonMap,
    gathered: &mut Buf<[f32; 4]>,
) {
    let kernel = GatherBvh { glossy: v.gathers_glossy, smooth_normals: v.gathers_smooth, epanechnikov };
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
