//! What a render needs to know besides the scene.

pub mod names;

use crate::graph::DeviceClass;
use crate::kernels::gather::{Amplification, Weight};
use crate::kernels::photon::Footprint;
pub use crate::kernels::records::Record;
use crate::render::pass::estimator::Estimator;
use crate::render::pass::sampling::Sampling;

/// A thin lens: what lies in the plane at `focus` is sharp, a point at distance z is spread over a disc of radius
/// `radius * |1 / focus - 1 / z|`, as a tangent of the angle of view (Potmesil and Chakravarty 1981).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Radius of the aperture in scene units, greater than 0.
    pub radius: f32,
    /// Distance of the sharp plane from the camera along the view axis in scene units, greater than 0.
    pub focus: f32,
}

/// Half the height of a full-frame sensor, 24 mm, in metres, glTF's unit of length.
const HALF_SENSOR: f32 = 0.012;

impl Lens {
    /// The lens that a photographer calls f/`number`, focused at `focus`, behind which a full-frame sensor (24 mm high)
    /// sees the vertical field of view `yfov`, in radians. Lengths are in metres.
    pub fn from_f_number(number: f32, focus: f32, yfov: f32) -> Self {
        let image_distance = HALF_SENSOR / (0.5 * yfov).tan();
        // The lens equation, 1 / f = 1 / image + 1 / object.
        let focal_length = image_distance * focus / (image_distance + focus);
        Self { radius: focal_length / (2.0 * number), focus }
    }
}

/// Settings of a session. The defaults suit every scene: none has to be tuned.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Index of the camera.
    pub camera: usize,
    /// Thin lens of a perspective camera; `None` is a pinhole, which is sharp everywhere.
    pub lens: Option<Lens>,
    /// Seed of all random numbers.
    pub seed: u32,
    /// How light is transported.
    pub method: Method,
    /// Photons emitted per pass over both classes; `None` chooses by the image size.
    pub photons: Option<u32>,
    /// How the light of the photons is estimated; `None` chooses by the device ([`Estimator::default_for`]).
    pub estimator: Option<Estimator>,
    /// Photons of each class that [`Estimator::Knn`] seeks, 1 to 512; others are taken as the nearest of these.
    pub knn_photons: u32,
    /// What part of the work of density estimation a pass does.
    pub sampling: Sampling,
    /// Kernel of the density estimate.
    pub weight: Weight,
    /// How large footprints are.
    pub footprint: Footprint,
    /// Largest semiaxis of a footprint by photon differentials, in scene radii at the first pass.
    pub largest_footprint: f32,
    /// Whether footprints end at walls that stand on their surface, their light reflected back; packed records have no room for
    /// it.
    pub fold: bool,
    /// How photons are stored for the gather.
    pub record: Record,
    /// Gathered glossy lobes after Blinn and Phong instead of GGX (Mara, Luebke and McGuire 2013, equation 6).
    pub blinn_phong: bool,
    /// Whether layers (albedo, normal, depth, direct, indirect, caustic) are kept.
    pub layers: bool,
    /// Surfaces that an eye path may meet after its first; [`Method::Path`] takes the larger of this and `photon_bounces`, at
    /// most 254.
    pub eye_depth: u32,
    /// Surfaces that a photon may meet.
    pub photon_bounces: u32,
    /// Smoothing factor s of caustic photons (Fabianowski and Dingliana 2009, end of section 4).
    pub caustic_smoothing: f32,
    /// Smoothing factor of all other photons.
    pub global_smoothing: f32,
    /// Exponent of the radius schedule (Knaus and Zwicker 2011): r^2 shrinks by (i + a) / (i + 1) in pass i.
    pub alpha: f64,
    /// Who builds the photon map of [`Estimator::Bvh`].
    pub photon_build: PhotonBuild,
    /// Photons in a leaf of the photon map at most, 1 to 16; `None` chooses by the overlap of footprints.
    pub leaf_photons: Option<u32>,
    /// Corners of the polygon that [`Estimator::Bounds25d`] draws around a photon, 6 to 18: more fit tighter and cost more.
    pub bound_vertices: u32,
    /// Which kernel draws the bounds of [`Estimator::Bounds25d`] and [`Estimator::Bounds3d`].
    pub amplification: Amplification,
    /// Keeps every feature in the kernels, whether the scene needs it or not: to prove that leaving out changes nothing.
    pub full_program: bool,
    /// Gathers with the kernels of a scene that has nothing but Lambert's law and flat triangles, whatever the scene has: to
    /// measure what the full reflection costs. Photons and eye paths stay as they are; at every hit the reflectance counts
    /// that is stored there, which is wrong where the surface is glossy.
    pub lambert_estimate: bool,
    /// Counts the photons that the gather tests and accepts ([`crate::render::Statistics`]): for measurements, slower.
    pub count_pairs: bool,
    /// Brings the photons of each pass to the host ([`crate::render::Session::photons`]), packed ones as the discs that they stand for: for
    /// measurements, slower.
    pub read_photons: bool,
}

/// Methods of light transport. The last two are references for the first: unbiased in what they see, and slow.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Method {
    /// Photon mapping.
    #[default]
    Photons,
    /// Paths from the eye with next-event estimation and multiple importance sampling: cannot see caustics of lights without
    /// extent, and those of small ones hardly.
    Path,
    /// Paths from the lights, connected to the camera: photons of the same classes, numbers and bounces as with
    /// [`Self::Photons`], but no footprints, so no bias. What is seen by way of mirrors or glass has its emission and its direct
    /// light only: light tracing cannot connect there. Needs a pinhole or a parallel camera.
    Light,
}

/// Builders of the photon BVH (Fabianowski and Dingliana 2009, section 5). Both give the same picture up to the order of
/// summation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PhotonBuild {
    /// Morton order, on the device: built quickly.
    #[default]
    Linear,
    /// Voxel volume heuristic, on the host: fewer nodes and photons are looked at, but photons go to the host and back.
    Vvh,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 640,
            height: 480,
            camera: 0,
            lens: None,
            seed: 0,
            method: Method::default(),
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
            leaf_photons: None,
            bound_vertices: 6,
            amplification: Amplification::default(),
            full_program: false,
            lambert_estimate: false,
            count_pairs: false,
            read_photons: false,
        }
    }
}

impl Settings {
    /// Pixels of the image.
    pub fn pixels(&self) -> u32 {
        self.width * self.height
    }

    /// The estimator to use on a kind of device.
    pub fn estimator_on(&self, class: DeviceClass) -> Estimator {
        self.estimator.unwrap_or(Estimator::default_for(class))
    }

    /// Photons emitted per pass over both classes: two per pixel within bounds, if not set.
    pub fn photon_count(&self) -> u32 {
        self.photons.unwrap_or_else(|| (self.pixels() * 2).clamp(1 << 16, 1 << 19))
    }

    /// Footprint scale of pass `index` relative to pass 0: the square root of the product of (k + a) / (k + 1) for k = 1
    /// to `index`, in closed form by the gamma function, so that any pass can be computed on its own.
    pub fn radius_scale(&self, index: u64) -> f32 {
        // prod_{k=1}^{i} (k + a)/(k + 1) = Gamma(i + 1 + a) / Gamma(1 + a) * Gamma(2) / Gamma(i + 2)
        let i = index as f64;
        let log_ratio = ln_gamma(i + 1.0 + self.alpha) - ln_gamma(1.0 + self.alpha) - ln_gamma(i + 2.0);
        (0.5 * log_ratio).exp() as f32
    }
}

/// Natural logarithm of the gamma function for x >= 1: Stirling's series after moving the argument beyond 16.
fn ln_gamma(x: f64) -> f64 {
    let mut shift = 0.0;
    let mut x = x;
    while x < 16.0 {
        shift += x.ln();
        x += 1.0;
    }
    let (inverse, square) = (1.0 / x, 1.0 / (x * x));
    let series = inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0 - square / 1680.0)));
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * std::f64::consts::PI).ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f_numbers_are_those_of_a_full_frame_camera() {
        // 50 mm focused far away: half the height of 12 mm at 50 mm; f/2 is then 25 mm wide.
        let yfov = 2.0 * (0.012f32 / 0.05).atan();
        let far = Lens::from_f_number(2.0, 1e6, yfov);
        assert!((far.radius - 0.0125).abs() < 1e-6, "{far:?}");
        // At 0.1 m (twice the focal length of 33.3 mm, the image at 50 mm) 1 / f = 20 + 10.
        let near = Lens::from_f_number(2.0, 0.1, yfov);
        assert!((near.radius - 0.1 / 3.0 / 4.0).abs() < 1e-6, "{near:?}");
    }

    /// Case 25 of the extreme cases: the closed form equals the product in double precision.
    #[test]
    fn radius_schedule_equals_the_product() {
        let settings = Settings::default();
        let mut squared = 1.0f64;
        for index in 0..1_000_001u64 {
            if index > 0 {
                squared *= (index as f64 + settings.alpha) / (index as f64 + 1.0);
            }
            if index < 100 || index % 99_991 == 0 || index == 1_000_000 {
                let relative = f64::from(settings.radius_scale(index)) / squared.sqrt() - 1.0;
                assert!(relative.abs() < 1e-6, "pass {index}: off by {relative}");
            }
        }
        assert!((f64::from(settings.radius_scale(10)) - squared.sqrt()).abs() > 1e-3, "the check can fail");
    }
}
