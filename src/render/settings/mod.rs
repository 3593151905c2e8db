//! What a render needs to know besides the scene.

mod estimator;
mod lens;
mod method;
mod named;
pub mod names;
mod radius_schedule;
pub mod ranges;
mod sampling;
mod shutter;
mod tracer;
mod validate;

use crate::graph::DeviceClass;
use crate::kernels::gather::{Amplification, Weight};
use crate::kernels::photon::Footprint;

pub use crate::kernels::records::Record;
pub use estimator::{Estimator, PhotonBuild, TreeBuild};
pub use lens::Lens;
pub use method::Method;
pub use named::{Named, by_name};
pub use sampling::{Sampling, Scale};
pub use shutter::Shutter;
pub use tracer::{MapSettings, Tracer};

/// Photons in a leaf of the photon map where nothing else is known. Smaller leaves were never faster: neighbouring
/// pixels walk the tree together, and a node costs them more time than a few photons.
pub const LEAST_LEAF: u32 = 8;

/// Settings of a session. The defaults suit every scene: none has to be tuned.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Image width in pixels, 1 to 65536; an image has at most 2^28 pixels.
    pub width: u32,
    /// Image height in pixels, 1 to 65536.
    pub height: u32,
    /// Index of the camera.
    pub camera: usize,
    /// Thin lens of a perspective camera; `None` is a pinhole, which is sharp everywhere.
    pub lens: Option<Lens>,
    /// When light comes in: each pass shows the scene at one moment of this time. `None` shows it as it is.
    pub shutter: Option<Shutter>,
    /// Seed of all random numbers.
    pub seed: u32,
    /// How light is transported.
    pub method: Method,
    /// What photons are traced in.
    pub tracer: Tracer,
    /// Photons emitted per pass over both classes, at most 2^30; `None` chooses by the image size.
    pub photons: Option<u32>,
    /// How the light of the photons is estimated; `None` chooses by the device ([`Estimator::default_for`]).
    pub estimator: Option<Estimator>,
    /// Photons of each class that [`Estimator::Knn`] seeks, 1 to 512.
    pub knn_photons: u32,
    /// What part of the work of density estimation a pass does.
    pub sampling: Sampling,
    /// Kernel of the density estimate.
    pub weight: Weight,
    /// How large footprints are.
    pub footprint: Footprint,
    /// Largest semiaxis of a footprint by photon differentials, 0.0001 to 1 scene radii at the first pass.
    pub largest_footprint: f32,
    /// Whether footprints end where their surface does, at walls and at edges, so that their light is reflected back.
    pub fold: bool,
    /// How photons are stored for the gather.
    pub record: Record,
    /// Gathered glossy lobes after Blinn and Phong instead of GGX (Mara, Luebke and McGuire 2013, equation 6).
    pub blinn_phong: bool,
    /// Whether layers (albedo, normal, depth, direct, indirect, caustic) are kept.
    pub layers: bool,
    /// Surfaces that an eye path may meet after its first, 0 to 254; [`Method::Path`] takes the larger of this and
    /// `photon_bounces`.
    pub eye_depth: u32,
    /// Surfaces that a photon may meet, 0 to 16384; with [`Method::Path`] 0 to 254.
    pub photon_bounces: u32,
    /// Smoothing factor s of caustic photons, 0.1 to 100 (Fabianowski and Dingliana 2009, end of section 4).
    pub caustic_smoothing: f32,
    /// Smoothing factor of all other photons, 0.1 to 100.
    pub global_smoothing: f32,
    /// Exponent a of the radius schedule, 0.000001 to 1 (Knaus and Zwicker 2011): r^2 shrinks by (i + a) / (i + 1) in
    /// pass i.
    pub alpha: f64,
    /// Who builds the photon map of [`Estimator::Bvh`].
    pub photon_build: PhotonBuild,
    /// Who builds the tree over the triangles.
    pub tree_build: TreeBuild,
    /// Photons in a leaf of the photon map at most, 1 to 16; `None` chooses by the overlap of footprints.
    pub leaf_photons: Option<u32>,
    /// Corners of the polygon that [`Estimator::Bounds25d`] draws around a photon, 6 to 18: more fit tighter and cost
    /// more.
    pub bound_vertices: u32,
    /// Which kernel draws the bounds of [`Estimator::Bounds25d`] and [`Estimator::Bounds3d`].
    pub amplification: Amplification,
    /// Keeps every feature in the kernels, whether the scene needs it or not: to prove that leaving out changes
    /// nothing.
    pub full_program: bool,
    /// Gathers with the kernels of a scene that has nothing but Lambert's law and flat triangles, whatever the scene
    /// has: to measure what the full reflection costs. Photons and eye paths stay as they are; at every hit the
    /// stored reflectance counts, which is wrong where the surface is glossy.
    pub lambert_estimate: bool,
    /// Counts rays ([`crate::render::Statistics::work`]): for measurements and for [`Method::Auto`], which counts them
    /// by itself.
    pub count_work: bool,
    /// Counts the photons that the gather tests and accepts ([`crate::render::Statistics`]): for measurements, slower.
    pub count_pairs: bool,
    /// Brings the photons of each pass to the host ([`crate::render::Session::photons`]), packed ones as the discs that
    /// they stand for: for measurements, slower.
    pub read_photons: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 640,
            height: 480,
            camera: 0,
            lens: None,
            shutter: None,
            seed: 0,
            method: Method::default(),
            tracer: Tracer::default(),
            photons: None,
            estimator: None,
            knn_photons: 64,
            sampling: Sampling::Full,
            weight: Weight::default(),
            footprint: Footprint::default(),
            largest_footprint: 0.042,
            fold: true,
            record: Record::default(),
            blinn_phong: false,
            layers: false,
            eye_depth: 24,
            photon_bounces: 48,
            caustic_smoothing: 2.1,
            global_smoothing: 2.8,
            alpha: 2.0 / 3.0,
            photon_build: PhotonBuild::default(),
            tree_build: TreeBuild::default(),
            leaf_photons: None,
            bound_vertices: 6,
            amplification: Amplification::default(),
            full_program: false,
            lambert_estimate: false,
            count_work: false,
            count_pairs: false,
            read_photons: false,
        }
    }
}

impl Settings {
    /// The defaults with this method.
    pub fn of(method: Method) -> Self {
        Self { method, ..Self::default() }
    }

    /// Pixels of the image.
    pub fn pixels(&self) -> u32 {
        self.width.saturating_mul(self.height)
    }

    /// These settings with the method that they mean: [`Method::Auto`] is [`Method::Photons`] where something is asked
    /// for that only these have (a part of the estimate, footprints by other rules, other reflection models, counts of
    /// pairs, the photons themselves, another tracer).
    pub fn resolved(self) -> Self {
        let of_photons = self.sampling != Sampling::Full
            || self.footprint != Footprint::Differential
            || self.blinn_phong
            || self.lambert_estimate
            || self.count_pairs
            || self.read_photons
            || self.tracer != Tracer::Tree;
        let method = if of_photons && self.method == Method::Auto { Method::Photons } else { self.method };
        Self { method, ..self }
    }

    /// The estimator to use on a device of this class.
    pub fn estimator_on(&self, class: DeviceClass) -> Estimator {
        self.estimator.unwrap_or(Estimator::default_for(class))
    }

    /// Photons in a leaf of the photon map at most.
    pub(in crate::render) fn leaf_size(&self) -> u32 {
        self.leaf_photons.unwrap_or(LEAST_LEAF)
    }

    /// Photons emitted per pass over both classes: two per pixel within bounds, if not set.
    pub fn photon_count(&self) -> u32 {
        self.photons.unwrap_or_else(|| self.pixels().saturating_mul(2).clamp(1 << 16, 1 << 19))
    }
}
