//! What part of the work of density estimation a pass does.

use super::estimator::Estimator;
use crate::error::{Error, Result};

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
    /// All photons at one pixel in each block of k x k, in turn from pass to pass; bilateral upsampling elsewhere. Edges of light
    /// are blurred over k pixels, however many passes there are.
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

impl Sampling {
    /// Values of k: 1 would be full, and beyond 16 next to nothing is left.
    pub const K: std::ops::RangeInclusive<u32> = 2..=16;

    /// Whether this is possible with an estimator.
    ///
    /// # Errors
    /// [`Error::Usage`] if k is out of range, or photons cannot be skipped by the estimator.
    pub fn check(self, estimator: Estimator) -> Result<()> {
        let (Self::Regular(k) | Self::Stochastic { k, .. }) = self else { return Ok(()) };
        if !Self::K.contains(&k) {
            let (least, most) = (Self::K.start(), Self::K.end());
            return Err(Error::Usage(format!("sampling with k = {k}: expected {least} to {most}")));
        }
        if matches!(self, Self::Stochastic { .. }) && !estimator.walks() {
            let name = estimator.name();
            let advice = "it has no lists of photons to walk through; use --sampling regular:K, or another estimator";
            return Err(Error::Usage(format!("--sampling stochastic with --estimator {name}: {advice}")));
        }
        Ok(())
    }
}
