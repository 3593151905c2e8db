//! Estimates from a part of the work (Mara, Luebke and McGuire 2013, section 2.3.2): a part of the photons at every
//! hit, or all photons at a part of the hits.

use super::{Band, Points};
use crate::graph::{Buf, Graph, Grid};
use crate::kernels::Items;
use crate::kernels::eye::SlotList;
use crate::kernels::generated::{
    SamplingChoose, SamplingChooseBindings, SamplingChooseParams, SamplingFill, SamplingFillBindings,
    SamplingFillParams, SamplingFilter, SamplingFilterBindings, SamplingFilterParams,
};

/// How an estimator goes through lists of photons (glsl/lib/walk.glsl): the constants of its kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Walk {
    /// One photon in so many is visited, by chance; 1: each.
    pub stride: u32,
    /// Scales by the length of the lists over the photons visited, instead of by `stride`.
    pub ratio: bool,
}

impl Walk {
    /// Every photon.
    pub const FULL: Self = Self { stride: 1, ratio: false };

    /// Expectation of the estimate from a list of `photons` over the truth: 1, or with the ratio 1 - (1 - 1/stride)^n.
    /// Given that c of n photons were visited, each set of c is as likely, so their mean is right; only where c = 0
    /// there is none.
    pub fn expectation(self, photons: u32) -> f64 {
        if self.ratio { 1.0 - (1.0 - 1.0 / f64::from(self.stride)).powf(f64::from(photons)) } else { 1.0 }
    }
}

/// Estimates by `gather` at one pixel of each block of `k` x `k` and at all hits that are not Lambert, fills the others
/// by bilateral upsampling, and estimates also where nothing similar is around. The pixel changes from pass to pass;
/// any k^2 passes from a multiple of k^2 on use each once. `gathered` must be filled with 0.
pub fn regular(
    g: &mut Graph,
    k: u32,
    (points, band): (Points<'_>, Band<'_>),
    gathered: &mut Buf<[f32; 4]>,
    mut gather: impl FnMut(&mut Graph, Points<'_>, &mut Buf<[f32; 4]>),
) {
    let (chosen, lenders) = choose(g, k, (points, band));
    let select = |g: &mut Graph, flags: &Buf<u32>| {
        SlotList::select(g, Items::Counted(points.count), flags, points.list, points.list.len())
    };
    let first = select(g, &chosen);
    gather(g, points.part(&first), gathered);
    let mut orphans = g.buffer("orphans", points.list.len());
    let bind = SamplingFillBindings {
        camera: band.camera,
        pass: points.pass,
        list: points.list,
        count: points.count,
        eye_hits: points.hits,
        chosen: &chosen,
        lenders: &lenders,
        gathered: &mut *gathered,
        orphans: &mut orphans,
    };
    g.dispatch(SamplingFill, Grid::Indirect(points.args), SamplingFillParams { k, jump: jump(k) }, bind);
    let rest = select(g, &orphans);
    g.scope("orphans", |g| gather(g, points.part(&rest), gathered));
}

/// Largest radius of the filter's window in pixels: 81 hits are read for one.
const MOST_RADIUS: u32 = 4;

/// The gathered light after a bilateral filter whose window reaches `k` pixels, at most four, at the first pass and
/// shrinks with the footprints, so that what it blurs vanishes with the passes.
pub fn filter(
    g: &mut Graph,
    k: u32,
    (points, band): (Points<'_>, Band<'_>),
    gathered: &Buf<[f32; 4]>,
) -> Buf<[f32; 4]> {
    let (_, lenders) = choose(g, 1, (points, band));
    let mut filtered = g.buffer("filtered", gathered.len());
    g.fill(&mut filtered, 0);
    let bind = SamplingFilterBindings {
        camera: band.camera,
        pass: points.pass,
        list: points.list,
        count: points.count,
        eye_hits: points.hits,
        lenders: &lenders,
        gathered,
        filtered: &mut filtered,
    };
    let params = SamplingFilterParams { radius: k.min(MOST_RADIUS) };
    g.dispatch(SamplingFilter, Grid::Indirect(points.args), params, bind);
    filtered
}

/// Flags of the listed hits that are estimated, and of the slots that lend their light.
fn choose(g: &mut Graph, k: u32, (points, band): (Points<'_>, Band<'_>)) -> (Buf<u32>, Buf<u32>) {
    let mut chosen = g.buffer("chosen", points.list.len());
    let mut lenders = g.buffer("lenders", points.hits.len());
    g.fill(&mut lenders, 0);
    let bind = SamplingChooseBindings {
        camera: band.camera,
        pass: points.pass,
        list: points.list,
        count: points.count,
        eye_hits: points.hits,
        chosen: &mut chosen,
        lenders: &mut lenders,
    };
    g.dispatch(SamplingChoose, Grid::Indirect(points.args), SamplingChooseParams { k, jump: jump(k) }, bind);
    (chosen, lenders)
}

/// The step through the k^2 places of a block: next to the golden section of k^2, without a divisor in common with it.
fn jump(k: u32) -> u32 {
    let divides_both = |n: u32| (2..=k).any(|d| k.is_multiple_of(d) && n.is_multiple_of(d));
    let golden = (f64::from(k * k) * 0.618).round() as u32;
    (golden.max(1)..).find(|&n| !divides_both(n)).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a step reaches every place.
    fn reaches_all(cells: u32, jump: u32) -> bool {
        let mut seen = vec![false; cells as usize];
        (0..cells).for_each(|i| seen[(i * jump % cells) as usize] = true);
        !seen.contains(&false)
    }

    #[test]
    fn every_place_has_its_turn() {
        assert!((1..=16).all(|k| reaches_all(k * k, jump(k))));
        assert!(!reaches_all(36, 22), "the check can fail");
    }

    #[test]
    fn the_ratio_loses_what_is_never_visited() {
        let ratio = Walk { stride: 4, ratio: true };
        assert_eq!((ratio.expectation(1), ratio.expectation(2)), (0.25, 0.4375));
        assert_eq!(Walk { ratio: false, ..ratio }.expectation(2), 1.0);
    }
}
