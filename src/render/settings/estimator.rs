//! The names of the density estimators, and of who builds the photon map.

use crate::graph::DeviceClass;

/// How the light of the photons is estimated at the eye hits. All but [`Estimator::Knn`] give the same
/// picture; they differ in time and memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// A bounding-volume hierarchy over the photons' footprints (Fabianowski and Dingliana 2009).
    Bvh,
    /// A grid of cells in a hash table, one for each size of footprint (after Mara, Luebke and McGuire 2013).
    Hash,
    /// Lists of photons per tile of the image (Mara, Luebke and McGuire 2013); a hierarchy behind mirrors and glass.
    Tiled,
    /// A polygon drawn around each photon's outline in the picture (Mara, Luebke and McGuire 2013).
    Bounds25d,
    /// An icosahedron drawn around each photon (same).
    Bounds3d,
    /// The k nearest photons at every eye hit (Jensen 2001), another estimate: radii follow the density of photons
    /// wherever more than k footprints overlap.
    Knn,
    /// Every photon at every eye hit: slow, and the reference for the others.
    Brute,
}

impl Estimator {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Bvh, Self::Tiled, Self::Hash, Self::Bounds25d, Self::Bounds3d, Self::Knn, Self::Brute];

    /// Its name in settings that are written as text.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Hash => "hash",
            Self::Knn => "knn",
            Self::Tiled => "tiled",
            Self::Bounds25d => "bounds25d",
            Self::Bounds3d => "bounds3d",
            Self::Brute => "brute",
        }
    }

    /// What it is, in a line of help.
    pub fn help(self) -> &'static str {
        match self {
            Self::Bvh => "Bounding-volume hierarchy over the footprints",
            Self::Hash => "Hash grid, a level of cells for each size of footprint",
            Self::Knn => "The k nearest photons of each class, radii cut to the farthest: another, smaller blur",
            Self::Tiled => "Lists of photons per tile of the image; hits behind mirrors and glass by bvh",
            Self::Bounds25d => {
                "A polygon drawn around each photon, for a device that rasterises; what mirrors and glass show is \
                 gathered as by `bvh`"
            }
            Self::Bounds3d => "An icosahedron drawn around each photon, otherwise as `bounds25d`",
            Self::Brute => "Every photon at every hit: for small scenes, the answer that the others must give",
        }
    }

    /// Whether it goes through lists of photons, of which a part can be skipped
    /// ([`Sampling::Stochastic`](super::Sampling)).
    pub fn walks(self) -> bool {
        match self {
            Self::Bvh | Self::Hash | Self::Tiled | Self::Brute => true,
            Self::Knn | Self::Bounds25d | Self::Bounds3d => false,
        }
    }

    /// The fastest of them on a device of this class, as measured (ARCHITECTURE.md).
    pub fn default_for(_class: DeviceClass) -> Self {
        Self::Bvh
    }
}

/// Builders of the photon BVH (Fabianowski and Dingliana 2009, section 5). Both give the same picture up to the order
/// of summation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PhotonBuild {
    /// Morton order, on the device: built quickly.
    #[default]
    Linear,
    /// Voxel volume heuristic, on the host: a gather visits fewer nodes and photons, but photons go to the host and
    /// back.
    Vvh,
}

/// Builders of the tree over the triangles of a scene. Hits do not depend on the tree, so the picture does not either,
/// but for the order of lights: with [`TreeBuild::Sah`] triangles that shine are listed as the leaves of its tree have
/// them, with all others in the order of the scene. These give the same bits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum TreeBuild {
    /// Surface-area heuristic, on the host, after every change: the best for rays.
    #[default]
    Sah,
    /// Morton order, on the device; refitted where triangles move.
    Lbvh,
    /// Locally-ordered clustering, on the device; refitted where triangles move.
    Hploc,
    /// [`TreeBuild::Sah`] at first; refitted on the device where triangles move. When the refitted tree has become
    /// much worse, a new one is built: by a graphics card with [`TreeBuild::Hploc`], else by the host. Small scenes
    /// stay with the host.
    Auto,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        let names: std::collections::BTreeSet<_> = Estimator::ALL.iter().map(|estimator| estimator.name()).collect();
        assert_eq!(names.len(), Estimator::ALL.len());
    }
}
