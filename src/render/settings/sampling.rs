//! What part of the work of density estimation a pass does.

/// Scale of estimates from a part of the photons.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scale {
    /// k^2: right in the mean.
    #[default]
    Unbiased,
    /// Length of the lists over photons visited, as in the paper: steadier, but short lists lose light.
    Ratio,
}

/// What part of the work of density estimation a pass does.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sampling {
    /// All photons at all eye hits.
    #[default]
    Full,
    /// All photons at one pixel in each block of k x k, in turn from pass to pass; bilateral upsampling elsewhere.
    /// Edges of light are blurred over k pixels, however many passes there are.
    Regular(u32),
    /// One photon in k^2, by chance, at all eye hits.
    Stochastic {
        /// Square root of the part.
        k: u32,
        /// Scale of the sums.
        scale: Scale,
        /// Whether a bilateral filter follows, with a window that shrinks like the footprints.
        filter: bool,
    },
}
