//! The methods of light transport.

/// Methods of light transport. The last two are references for the others: unbiased in what they see, and slow.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Method {
    /// Passes of [`Self::Photons`] and of [`Self::Hybrid`] in turns, and a picture that takes from both what serves it
    /// best ([`crate::film::mix`]). The first passes tell how much time either gets ([`crate::film::shares`]). Where
    /// something focuses light and every light has an extent, a new session first renders small pictures that tell
    /// whether [`Self::Path`] does instead of [`Self::Hybrid`]: a second on a processor.
    #[default]
    Auto,
    /// Photon mapping.
    Photons,
    /// Path tracing, and photons for what it cannot find: light that reaches a surface by way of mirrors and glass
    /// alone. Where nothing can focus light, this is [`Self::Path`], and no photon is traced.
    Hybrid,
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
    /// Those that met a surface that scatters widely are of use, too.
    pub emits_global_photons: bool,
    /// Paths from the eye go on where they meet surfaces that scatter widely.
    pub traces_paths: bool,
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
            emits_global_photons: true,
            traces_paths: false,
            estimates_density: true,
            splits_eye_paths: true,
            takes_lens: true,
            takes_blinn_phong: true,
        };
        let hybrid = Traits {
            emits_global_photons: false,
            traces_paths: true,
            splits_eye_paths: false,
            takes_blinn_phong: false,
            ..photons
        };
        match self {
            Self::Auto | Self::Photons => photons,
            Self::Hybrid => hybrid,
            Self::Path => Traits { emits_photons: false, estimates_density: false, ..hybrid },
            Self::Light => Traits { estimates_density: false, takes_lens: false, ..photons },
        }
    }
}
