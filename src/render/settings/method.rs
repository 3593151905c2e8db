//! The methods of light transport.

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
