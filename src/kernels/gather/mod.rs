//! Density estimation at the eye hits. One file per estimator; all of them weigh a photon by glsl/lib/estimate.glsl, so
//! with the same photons they give the same radiance, and differ in which photons they look at to find those that
//! count.

mod bounds;
mod brute;
mod bvh;
pub mod hash;
pub mod hash_reference;
mod knn;
pub mod reference;
pub mod reference_knn;
mod sampling;
mod split;
pub mod tiled;

pub use bounds::{Amplification, Bounds, POLYGON_CORNERS, Shape, bounds};
pub use brute::brute;
pub use bvh::bvh;
pub use hash::{HashGrid, hash, hash_grid};
pub use knn::{KnnMap, MAX_NEIGHBOURS, knn, knn_by_digits, knn_map};
pub use sampling::{Walk, filter, regular};
pub use split::{Listed, split};
pub use tiled::tiled;

use super::eye::{EyeHits, SlotList};
use super::scene_data::{SceneBuffers, Variant};
use crate::constants::{WEIGHT_CONE, WEIGHT_CONSTANT, WEIGHT_EPANECHNIKOV};
use crate::graph::{Buf, DispatchArgs};
use crate::kernels::generated::{Camera, EyeHit, Pass};

/// Weight of a photon within its footprint: the kernel of density estimation, called so to tell it from programs. Each
/// integrates to one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Weight {
    /// Equal everywhere: sharper, noisier.
    Constant,
    /// `min(c, 1 - s / r)` with c = 1/5: flat with a soft rim (Mara, Luebke and McGuire 2013, equation 3).
    Cone,
    /// `1 - (s / r)^2`: smooth.
    #[default]
    Epanechnikov,
}

impl Weight {
    /// WEIGHT_* of glsl/lib/estimate.glsl.
    pub(crate) fn code(self) -> u32 {
        match self {
            Self::Constant => WEIGHT_CONSTANT,
            Self::Cone => WEIGHT_CONE,
            Self::Epanechnikov => WEIGHT_EPANECHNIKOV,
        }
    }
}

/// What every estimator's kernels are specialised for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Program {
    /// Whether a gathering surface reflects other than by Lambert's law.
    pub glossy: bool,
    /// Whether a gathering surface has shading normals of its own.
    pub smooth_normals: bool,
    /// Glossy lobes after Blinn and Phong instead of GGX.
    pub blinn_phong: bool,
    /// Weight of a photon within its footprint.
    pub weight: Weight,
    /// Leaves the number of photons tested in the fourth component of the caustic light, and of those that counted in
    /// that of the other light: for measurements. Otherwise both are 0.
    pub count_pairs: bool,
    /// How lists of photons are gone through.
    pub walk: Walk,
    /// Loop iterations that the driver runs in an invocation, if it ends loops ([`crate::vk::Device::loop_limit`]).
    pub loop_limit: Option<u32>,
}

impl Program {
    /// The program that a scene needs.
    pub fn of(v: Variant, weight: Weight) -> Self {
        Self {
            glossy: v.gathers_glossy,
            smooth_normals: v.gathers_smooth,
            blinn_phong: v.blinn_phong && v.gathers_glossy,
            weight,
            count_pairs: false,
            walk: Walk::FULL,
            loop_limit: None,
        }
    }

    /// Iterations after which an estimator gives a hit up; 0: never. Half of what the driver runs, for loops around the
    /// counted one.
    fn step_limit(&self) -> u32 {
        self.loop_limit.map_or(0, |limit| limit / 2)
    }
}

/// Eye hits to estimate at: some or all of a band's.
#[derive(Clone, Copy)]
pub struct Points<'a> {
    /// Hits by path slot.
    pub hits: &'a Buf<EyeHit>,
    /// Slots that have one.
    pub list: &'a Buf<u32>,
    /// How many are listed.
    pub count: &'a Buf<u32>,
    /// Groups of 64 for one invocation per listed slot.
    pub args: &'a Buf<DispatchArgs>,
    /// The pass, for random numbers.
    pub pass: &'a Buf<Pass>,
    /// What rough lobes reflect ([`crate::kernels::lobes::table`]); programs without glossy lobes do not look.
    pub lobes: &'a Buf<u32>,
}

impl<'a> Points<'a> {
    /// All hits of a band.
    pub fn new(eye: &'a EyeHits, scene: &'a SceneBuffers) -> Self {
        let (pass, lobes) = (&*scene.pass, &*scene.lobes);
        Self { hits: &eye.hits, list: &eye.list, count: &eye.count, args: &eye.args, pass, lobes }
    }

    /// The hits of a list of slots.
    pub(in crate::kernels) fn listed(hits: &'a Buf<EyeHit>, slots: &'a SlotList, scene: &'a SceneBuffers) -> Self {
        let (pass, lobes) = (&*scene.pass, &*scene.lobes);
        Self { hits, list: &slots.list, count: &slots.count, args: &slots.args, pass, lobes }
    }

    /// Those in a list of slots.
    pub(super) fn part<'b>(self, slots: &'b SlotList) -> Points<'b>
    where
        'a: 'b,
    {
        Points { list: &slots.list, count: &slots.count, args: &slots.args, ..self }
    }
}

/// The part of the image that points belong to, for estimators that work in the image.
#[derive(Clone, Copy)]
pub struct Band<'a> {
    /// The camera with this band of pixels.
    pub camera: &'a Buf<Camera>,
    /// Size of the whole image.
    pub size: [u32; 2],
    /// First pixel of the band, in the order of glsl/lib/pixels.glsl.
    pub first_pixel: u32,
    /// Pixels in the band.
    pub pixels: u32,
}
