//! The methods of light transport.

/// Methods of light transport. The last two are references for the first: unbiased in what they see, and slow.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Method {
    /// Photon mapping.
    #[default]
    Photons,
    /// Paths from the eye with next-event estimation and multiple importance sampling. They cannot find caustics of
    /// lights without extent, and seldom find those of small lights.
    Path,
    /// Paths from the lights, connected to the camera: photons of the same classes, numbers and bounces as with
    /// [`Self::Photons`], but no footprints, so no bias. What is seen by way of mirrors or glass has its emission and
    /// its direct light only, because light tracing cannot connect there. It needs a pinhole or a parallel camera.
    Light,
}

/// What a method does and can do: settings, budgets and reports ask for these, not for the method itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Traits {
    /// Photons leave the lights.
    pub emits_photons: bool,
    /// Light is estimated from the density of photons, so there is an estimator, and pictures have a bias that shrinks.
    pub estimates_density: bool,
    /// Eye paths may split at their surfaces.
    pub splits_eye_paths: bool,
    /// The camera may have a lens.
    pub takes_lens: bool,
    /// Rough glossy lobes may follow the model of Blinn and Phong.
    pub takes_blinn_phong: bool,
}

impl Method {
    /// What this method does and can do.
    pub const fn traits(self) -> Traits {
        let photons = Traits {
            emits_photons: true,
            estimates_density: true,
            splits_eye_paths: true,
            takes_lens: true,
            takes_blinn_phong: true,
        };
        match self {
            Self::Photons => photons,
            Self::Path => Traits {
                emits_photons: false,
                estimates_density: false,
                splits_eye_paths: false,
                takes_blinn_phong: false,
                ..photons
            },
            Self::Light => Traits { estimates_density: false, takes_lens: false, ..photons },
        }
    }
}
