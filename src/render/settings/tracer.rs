//! What photons are traced in.

use crate::kernels::maps::{MAP_CANDIDATES, Search, Shape};

/// What photons are traced in. Eye paths and shadow rays go through the tree in any case.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Tracer {
    /// The tree over the triangles: exact.
    #[default]
    Tree,
    /// Environment maps taken from several centres (Yao, Wang, Chan, Yong and Paul 2010). What no map sees gets no
    /// photons, and photons are lost where no map knows what they meet: the picture stays wrong there, however many
    /// passes there are. It needs a device that rasterises.
    Maps(MapSettings),
}

/// Environment maps that photons are traced in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSettings {
    /// Centres, 1 to 32. The paper has 8 to 15.
    pub centres: u32,
    /// Random places that the centres are chosen from, 1 to 64. The paper has 30 to 50.
    pub candidates: u32,
    /// Texels along a side of a map's face, 8 to 1024.
    pub resolution: u32,
    /// Surfaces behind each other that a map holds, 1 to 4; the paper has one.
    pub layers: u32,
    /// Whether rays are searched by steps first, instead of from the paper's first guess.
    pub steps: bool,
}

impl MapSettings {
    /// Texels along a side of a face of a candidate's map: those of the paper.
    pub const CANDIDATE_RESOLUTION: u32 = 32;

    /// The shape of the maps that photons are traced in.
    pub fn shape(self) -> Shape {
        Shape { centres: self.centres, resolution: self.resolution, layers: self.layers }
    }

    /// The shape of the maps of the candidates.
    pub fn candidate_shape(self) -> Shape {
        let centres = self.candidates.clamp(self.centres, MAP_CANDIDATES);
        Shape { centres, resolution: Self::CANDIDATE_RESOLUTION, layers: 1 }
    }

    /// How rays are searched for.
    pub fn search(self) -> Search {
        if self.steps { Search::STEPS } else { Search::PAPER }
    }
}

impl Default for MapSettings {
    fn default() -> Self {
        Self { centres: 12, candidates: 48, resolution: 128, layers: 1, steps: false }
    }
}
