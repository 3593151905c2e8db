//! Photons traced in environment maps instead of a tree: Yao, Wang, Chan, Yong and Paul 2010, "Multi-Image Based Photon
//! Tracing for Interactive Global Illumination of Dynamic Scenes".
//!
//! A map is what is seen from a centre, on the six faces of a cube; its texels name triangles and places on them
//! (glsl/shared/maps.glsl). The rasteriser draws it, so nothing is precomputed when geometry moves. [`draw`] makes
//! the maps of some centres, [`seen`] tells what each adds to the others, for [`Seen::choose`], and `trace` finds the
//! hits of photons, as the tree does. The CPU references are in [`super::maps_reference`].

use super::eye::SlotList;
use super::generated::{
    BvhTriangle, MapTexel, MapsDrawFrag, MapsDrawFragBindings, MapsDrawFragParams, MapsDrawVert, MapsDrawVertBindings,
    MapsDrawVertParams, MapsJudge, MapsJudgeBindings, MapsJudgeParams, MapsPack, MapsPackBindings, MapsPackParams,
    MapsSeen, MapsSeenBindings, MapsSeenParams, MapsTrace, MapsTraceBindings, Ray, RayHit,
};
use super::trace::Tree;
pub use crate::constants::{MAP_CANDIDATES, MAP_COUNTS, MAP_FACES};
use crate::draw_state::{Blend, DepthTest, DrawState};
use crate::graph::{Buf, Draw, Graph, Grid, Instances, RasterPass};

/// Names of the counts of [`judge`].
pub const COUNTS: [&str; MAP_COUNTS as usize] =
    ["none", "beside", "later", "right", "early", "all_right", "all_wrong", "all_lost", "all_escaped", "all_phantom"];

/// Parts of the scene's radius that are closer to a centre than what is drawn.
pub const NEAR: f32 = 1e-4;

/// The shape of a set of maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Centres, at least 1.
    pub centres: u32,
    /// Texels along a side of a face, 1 to 2048.
    pub resolution: u32,
    /// Surfaces behind each other that a map holds, at least 1.
    pub layers: u32,
}

impl Shape {
    /// Texels of one layer of one map.
    pub fn texels_of_map(self) -> u32 {
        MAP_FACES * self.resolution * self.resolution
    }

    /// Texels of all maps.
    pub fn texels(self) -> u32 {
        self.texels_of_map() * self.centres * self.layers
    }
}

/// How a ray is searched for in a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Steps along the ray before the search, for half a turn as seen from the centre; 0: the paper's first guess, and
    /// the middle of a texel as the hit.
    pub steps: u32,
    /// Most steps of false position; the paper has 3 to 5.
    pub iterations: u32,
    /// Largest error of a point's direction that is accepted: one less its cosine; the paper has 0.001.
    pub tolerance: f32,
}

impl Search {
    /// The search of the paper.
    pub const PAPER: Self = Self { steps: 0, iterations: 5, tolerance: 0.001 };
    /// Steps first, and hits where the ray meets the triangle that was found.
    pub const STEPS: Self = Self { steps: 24, iterations: 4, tolerance: 0.001 };
}

/// Maps on the device.
#[derive(Clone, Copy)]
pub struct Maps<'a> {
    /// Their shape.
    pub shape: Shape,
    /// Centres; w is unused.
    pub centres: &'a Buf<[f32; 4]>,
    /// Texels: layer after layer, in each map after map.
    pub texels: &'a Buf<MapTexel>,
}

/// Draws the maps of all centres over the first `count` triangles, in leaf order; `radius` is that of the scene.
///
/// Needs a device that rasterises.
pub fn draw(
    g: &mut Graph,
    (triangles, count): (&Buf<BvhTriangle>, u32),
    (shape, radius): (Shape, f32),
    centres: &Buf<[f32; 4]>,
    texels: &mut Buf<MapTexel>,
) {
    assert_eq!(texels.len(), shape.texels(), "room for the maps");
    let nothing = g.upload("no_map", &[MapTexel::default()]);
    let (resolution, near) = (shape.resolution, NEAR * radius);
    let strip = shape.texels_of_map();
    for layer in 0..shape.layers {
        for centre in 0..shape.centres {
            let map = layer * shape.centres + centre;
            let before = if layer > 0 { &*texels } else { &*nothing };
            let mut drawn = g.buffer("map_drawn", strip);
            let instances = Instances::Direct { vertices: 3 * count, instances: MAP_FACES };
            let kernel = MapsDrawVert;
            let params = MapsDrawVertParams { centre, near };
            let draw = Draw::new(kernel, instances, params, MapsDrawVertBindings { triangles, centres });
            let former = strip * map.saturating_sub(shape.centres);
            let fragment = MapsDrawFrag { map_resolution: resolution, peel: layer > 0 };
            let params = MapsDrawFragParams { centre, near, before: former };
            let draw = draw.fragment(fragment, params, MapsDrawFragBindings { triangles, centres, before });
            let state = DrawState {
                blend: Blend::Replace,
                depth_test: DepthTest::Greater,
                depth_write: true,
                ..DrawState::default()
            };
            let extent = [MAP_FACES * resolution, resolution];
            g.raster(RasterPass { name: "map", extent, depth: Some(0.0) }, vec![draw.state(state)], [&mut drawn]);
            let params = MapsPackParams { centre, first: strip * map };
            let bind = MapsPackBindings { triangles, centres, drawn: &drawn, texels };
            g.dispatch(MapsPack { map_resolution: resolution }, Grid::Threads(strip), params, bind);
        }
    }
}

/// For each texel of the maps of candidates, which have one layer: the area of the surface that it stands for (equation
/// 1), and a bit for each candidate that sees its place.
pub fn seen(g: &mut Graph, triangles: &Buf<BvhTriangle>, maps: Maps<'_>) -> (Buf<f32>, Buf<[u32; 2]>) {
    let Maps { shape, centres, texels } = maps;
    assert!(shape.layers == 1 && shape.centres <= MAP_CANDIDATES, "candidates' maps");
    let (mut areas, mut seen_by) = (g.buffer("map_areas", shape.texels()), g.buffer("map_seen_by", shape.texels()));
    let bind = MapsSeenBindings { triangles, centres, texels, areas: &mut areas, seen_by: &mut seen_by };
    let kernel = MapsSeen { map_resolution: shape.resolution };
    g.dispatch(kernel, Grid::Threads(shape.texels()), MapsSeenParams { candidates: shape.centres }, bind);
    (areas, seen_by)
}

/// Hits of the listed photons by the maps.
pub(super) fn trace(
    g: &mut Graph,
    triangles: &Buf<BvhTriangle>,
    (maps, search): (Maps<'_>, Search),
    SlotList { list, count, args }: &SlotList,
    (rays, hits, states): (&Buf<[f32; 4]>, &mut Buf<[u32; 4]>, &mut Buf<u32>),
) {
    let Maps { shape, centres, texels } = maps;
    let kernel = MapsTrace {
        map_resolution: shape.resolution,
        map_count: shape.centres,
        map_layers: shape.layers,
        map_steps: search.steps,
        map_iterations: search.iterations,
        map_tolerance: search.tolerance,
    };
    let bind = MapsTraceBindings { triangles, list, count, rays, hits, states, centres, texels };
    g.dispatch(kernel, Grid::Indirect(args), (), bind);
}

/// Hits of rays of unit direction by the maps, and beside the tree's [`COUNTS`] of what each map and all of them say.
pub fn judge(
    g: &mut Graph,
    tree: Tree<'_>,
    (maps, search): (Maps<'_>, Search),
    rays: &Buf<Ray>,
) -> (Buf<RayHit>, Buf<u32>) {
    let Maps { shape, centres, texels } = maps;
    let (mut hits, mut counts) = (g.buffer("map_hits", rays.len()), g.buffer("map_counts", MAP_COUNTS));
    g.fill(&mut counts, 0);
    let kernel = MapsJudge {
        map_resolution: shape.resolution,
        map_count: shape.centres,
        map_layers: shape.layers,
        map_steps: search.steps,
        map_iterations: search.iterations,
        map_tolerance: search.tolerance,
    };
    let Tree { nodes, triangles } = tree;
    let bind = MapsJudgeBindings { nodes, triangles, rays, hits: &mut hits, counts: &mut counts, centres, texels };
    g.dispatch(kernel, Grid::Threads(rays.len()), MapsJudgeParams { count: rays.len() }, bind);
    (hits, counts)
}

/// What the maps of the candidates show: an area and who sees it, texel by texel, map after map.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// Candidates.
    pub candidates: u32,
    /// Areas [squared scene units].
    pub areas: &'a [f32],
    /// A bit for each candidate.
    pub seen_by: &'a [[u32; 2]],
}

/// Centres that were chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Indices of candidates, in the order in which they were chosen.
    pub chosen: Vec<u32>,
    /// What each has added when it was chosen first [squared scene units].
    pub added: Vec<f64>,
    /// Exchanges after the first choice, until nothing changed.
    pub exchanges: u32,
}

impl Seen<'_> {
    /// What the maps of `centres` hold of what the map of a candidate shows, as one mask for each candidate.
    fn mask(chosen: &[u32]) -> u64 {
        chosen.iter().fold(0, |mask, candidate| mask | 1 << candidate)
    }

    /// The area that a candidate sees and none of these does: A(v|C).
    pub fn new_area(&self, candidate: u32, chosen: &[u32]) -> f64 {
        let mask = Self::mask(chosen);
        let of_map = self.areas.len() / self.candidates.max(1) as usize;
        let first = candidate as usize * of_map;
        let texels = self.areas[first..first + of_map].iter().zip(&self.seen_by[first..first + of_map]);
        let by = |words: &[u32; 2]| u64::from(words[0]) | u64::from(words[1]) << 32;
        texels.filter(|(_, words)| by(words) & mask == 0).map(|(area, _)| f64::from(*area)).sum()
    }

    /// The candidate that adds most to these, and how much; the first of equals. `None` if all are chosen.
    fn best(&self, chosen: &[u32]) -> Option<(u32, f64)> {
        let rest = (0..self.candidates).filter(|candidate| !chosen.contains(candidate));
        rest.map(|candidate| (candidate, self.new_area(candidate, chosen)))
            .reduce(|best, next| if next.1 > best.1 { next } else { best })
    }

    /// Part of the area that `all` see that the chosen ones see. Each place counts once, in the map of its first
    /// observer.
    pub fn covered(&self, chosen: &[u32], all: &[u32]) -> f64 {
        let (mut seen, mut total) = (0.0, 0.0);
        for (place, candidate) in all.iter().enumerate() {
            let former = &all[..place];
            let new = self.new_area(*candidate, former);
            let missed = self.new_area(*candidate, &[former, chosen].concat());
            total += new;
            seen += new - missed;
        }
        if total > 0.0 { seen / total } else { 0.0 }
    }

    /// One exchange: the best of the others comes in, the least useful goes out. `false` if they are the same.
    pub fn exchange(&self, chosen: &mut Vec<u32>) -> bool {
        let Some((incoming, _)) = self.best(chosen) else { return false };
        chosen.push(incoming);
        let use_of = |place: usize| {
            let others: Vec<u32> = chosen.iter().enumerate().filter(|(k, _)| *k != place).map(|(_, c)| *c).collect();
            self.new_area(chosen[place], &others)
        };
        // Of equals the newest goes, so that an exchange that gains nothing changes nothing.
        let least = (0..chosen.len()).rev().map(|place| (place, use_of(place)));
        let least = least.reduce(|least, next| if next.1 < least.1 { next } else { least });
        let place = least.map_or(chosen.len() - 1, |(place, _)| place);
        let gone = chosen.remove(place);
        gone != incoming
    }

    /// Chooses `count` centres: each time the candidate that adds most, then exchanges until nothing changes (Yao et
    /// al. 2010, section 4.1; an exchange never loses area, and there are at most as many as candidates).
    pub fn choose(&self, count: u32) -> Choice {
        let mut choice = Choice { chosen: vec![], added: vec![], exchanges: 0 };
        while choice.chosen.len() < count as usize {
            let Some((candidate, area)) = self.best(&choice.chosen) else { break };
            choice.chosen.push(candidate);
            choice.added.push(area);
        }
        while choice.exchanges < self.candidates && self.exchange(&mut choice.chosen) {
            choice.exchanges += 1;
        }
        choice
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Candidates on a line, each of which sees the cells within a reach of its own.
    fn line(reaches: &[(i32, i32)], cells: usize) -> (Vec<f32>, Vec<[u32; 2]>) {
        let sees = |(at, reach): (i32, i32), cell: usize| (cell as i32 - at).abs() <= reach;
        let mask = |cell: usize| {
            let all = reaches.iter().enumerate().filter(|(_, r)| sees(**r, cell));
            all.fold(0u64, |mask, (candidate, _)| mask | 1 << candidate)
        };
        let texels = reaches.iter().flat_map(|r| (0..cells).map(move |cell| (*r, cell)));
        texels
            .map(|(r, cell)| {
                let mask = mask(cell);
                (if sees(r, cell) { 1.0 } else { 0.0 }, [mask as u32, (mask >> 32) as u32])
            })
            .unzip()
    }

    #[test]
    fn greedy_choice_takes_what_is_new() {
        let (areas, seen_by) = line(&[(5, 5), (6, 5), (20, 4), (14, 1)], 30);
        let seen = Seen { candidates: 4, areas: &areas, seen_by: &seen_by };
        let choice = seen.choose(3);
        assert_eq!((&choice.chosen[..], &choice.added[..]), (&[0, 2, 3][..], &[11.0, 9.0, 3.0][..]));
        assert_eq!(seen.new_area(1, &[0]), 1.0);
        assert_eq!(seen.choose(9).chosen.len(), 4, "no more than there are");
    }

    /// The first centre was best alone and is of no use once its neighbours are there.
    #[test]
    fn an_exchange_drops_what_has_become_useless() {
        let (areas, seen_by) = line(&[(10, 5), (6, 4), (14, 4), (30, 1)], 40);
        let seen = Seen { candidates: 4, areas: &areas, seen_by: &seen_by };
        let choice = seen.choose(3);
        let total = |chosen: &[u32]| {
            (0..4).map(|c| seen.new_area(c, &[])).sum::<f64>() - (0..4).map(|c| seen.new_area(c, chosen)).sum::<f64>()
        };
        assert!(choice.exchanges >= 1 && !choice.chosen.contains(&0), "{choice:?}");
        assert!(total(&choice.chosen) >= total(&[0, 1, 3]), "an exchange loses nothing");
        let mut again = choice.chosen.clone();
        assert!(!seen.exchange(&mut again) && again == choice.chosen, "and then nothing changes");
    }
}
