//! How much of the density estimation is done in a pass: what the modes of Mara, Luebke and McGuire 2013 do to a
//! gather.

use crate::graph::{Buf, Graph};
use crate::kernels::gather::{self, Band, Points, Walk};
use crate::render::settings::{Sampling, Scale};

impl Sampling {
    /// How lists of photons are gone through.
    pub(in crate::render) fn walk(self) -> Walk {
        match self {
            Self::Full | Self::Regular(_) => Walk::FULL,
            Self::Stochastic { k, scale, .. } => Walk { stride: k * k, ratio: scale == Scale::Ratio },
        }
    }

    /// Gathers by `gather` as far as needed and completes the rest. `gathered` must be filled with 0.
    pub(in crate::render) fn apply(
        self,
        g: &mut Graph,
        place: (Points<'_>, Band<'_>),
        mut gathered: Buf<[f32; 4]>,
        mut gather: impl FnMut(&mut Graph, Points<'_>, &mut Buf<[f32; 4]>),
    ) -> Buf<[f32; 4]> {
        match self {
            Self::Regular(k) => gather::regular(g, k, place, &mut gathered, gather),
            Self::Full | Self::Stochastic { .. } => gather(g, place.0, &mut gathered),
        }
        match self {
            Self::Stochastic { k, filter: true, .. } => g.scope("filter", |g| gather::filter(g, k, place, &gathered)),
            _ => gathered,
        }
    }
}
