//! Values of settings that are chosen by a name, on the command line and in the file of a study.

use super::{Estimator, Method, PhotonBuild, Record, TreeBuild};
use crate::kernels::gather::{Amplification, Weight};

/// A type whose values have names.
pub trait Named: Copy + 'static {
    /// All values, in the order in which help lists them.
    const VALUES: &'static [Self];

    /// The name: lower-case letters, digits and hyphens, different for each value.
    fn name(self) -> &'static str;

    /// What it is, as a line of help.
    fn help(self) -> &'static str;
}

/// The value of this name.
///
/// # Errors
/// A sentence with the names there are.
pub fn by_name<T: Named>(text: &str) -> Result<T, String> {
    T::VALUES.iter().copied().find(|value| value.name() == text).ok_or_else(|| {
        let names: Vec<&str> = T::VALUES.iter().map(|value| value.name()).collect();
        format!("expected one of {}", names.join(", "))
    })
}

impl Named for Estimator {
    const VALUES: &'static [Self] = &Self::ALL;

    fn name(self) -> &'static str {
        Self::name(self)
    }

    fn help(self) -> &'static str {
        Self::help(self)
    }
}

impl Named for Method {
    const VALUES: &'static [Self] = &[Self::Auto, Self::Photons, Self::Hybrid, Self::Path, Self::Light];

    fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Photons => "photons",
            Self::Hybrid => "hybrid",
            Self::Path => "path",
            Self::Light => "light",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Auto => {
                "Photons and hybrid in turns, each where it is better; the first passes tell how much of either"
            }
            Self::Photons => "Photon mapping: sees everything, with a bias that shrinks",
            Self::Hybrid => "Path tracing, with photons for caustics: sees everything",
            Self::Path => "Path tracing: no caustics of lights without extent",
            Self::Light => "Light tracing: nothing in mirrors and glass",
        }
    }
}

impl Named for PhotonBuild {
    const VALUES: &'static [Self] = &[Self::Linear, Self::Vvh];

    fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Vvh => "vvh",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Linear => "Morton order, on the device: built quickly",
            Self::Vvh => "Voxel volume heuristic, on the host: for comparisons",
        }
    }
}

impl Named for TreeBuild {
    const VALUES: &'static [Self] = &[Self::Sah, Self::Lbvh, Self::Hploc, Self::Auto];

    fn name(self) -> &'static str {
        match self {
            Self::Sah => "sah",
            Self::Lbvh => "lbvh",
            Self::Hploc => "hploc",
            Self::Auto => "auto",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Sah => "Surface-area heuristic, on the host: the best for rays",
            Self::Lbvh => "Morton order, on the device: built quickly",
            Self::Hploc => "Locally-ordered clustering, on the device",
            Self::Auto => "As sah, and on the device where triangles move",
        }
    }
}

impl Named for Weight {
    const VALUES: &'static [Self] = &[Self::Constant, Self::Cone, Self::Epanechnikov];

    fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Cone => "cone",
            Self::Epanechnikov => "epanechnikov",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Constant => "Equal weight within the footprint: sharper, noisier",
            Self::Cone => "Equal weight with a soft rim",
            Self::Epanechnikov => "Weight falls towards the rim: smoother",
        }
    }
}

impl Named for Record {
    const VALUES: &'static [Self] = &[Self::Full, Self::Packed20, Self::Packed12];

    fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Packed20 => "20",
            Self::Packed12 => "12",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Full => "64 bytes: ellipses, in full precision",
            Self::Packed20 => "Discs",
            Self::Packed12 => "Discs, positions relative to a cell or tile",
        }
    }
}

impl Named for Amplification {
    const VALUES: &'static [Self] = &[Self::Vertex, Self::Geometry];

    fn name(self) -> &'static str {
        match self {
            Self::Vertex => "vertex",
            Self::Geometry => "geometry",
        }
    }

    fn help(self) -> &'static str {
        match self {
            Self::Vertex => "The vertex kernel: an instance for each photon",
            Self::Geometry => "The geometry kernel, where the device has one",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each name leads back to its value.
    fn check<T: Named + PartialEq + std::fmt::Debug>() {
        for value in T::VALUES {
            assert_eq!(by_name::<T>(value.name()), Ok(*value));
            assert!(!value.help().is_empty());
        }
        assert!(by_name::<T>("gauss").is_err_and(|text| text.contains(T::VALUES[0].name())));
    }

    #[test]
    fn names_lead_back_to_their_values() {
        check::<Estimator>();
        check::<Method>();
        check::<PhotonBuild>();
        check::<TreeBuild>();
        check::<Weight>();
        check::<Record>();
        check::<Amplification>();
    }
}
