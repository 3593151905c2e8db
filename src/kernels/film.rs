//! Adding a pass to the film. The specification of the sums is [`crate::film::exact`], which the kernel mirrors.

use super::generated::{Camera, FilmAdd, FilmAddBindings, FilmAddParams, Pass};
pub use crate::constants::{FILM_SUMS, LAYER_SUMS};
use crate::graph::{Buf, Graph, Grid};

/// The film's buffers.
pub struct FilmBuffers {
    /// [`FILM_SUMS`] per pixel.
    pub film: Buf<[u32; 4]>,
    /// [`LAYER_SUMS`] per pixel, or one without layers.
    pub layers: Buf<[u32; 4]>,
    /// One word: pixels of passes that were not finite or beyond the range of the sums.
    pub rejected: Buf<u32>,
}

/// What one pass brings.
pub struct PassResult<'a> {
    /// Emission and direct light per slot.
    pub radiance: &'a Buf<[f32; 4]>,
    /// Caustic and other light per slot.
    pub gathered: &'a Buf<[f32; 4]>,
    /// First-hit layers per pixel.
    pub aov_first: &'a Buf<f32>,
    /// Photons that did not fit; if any, the pass is not added.
    pub overflow: &'a Buf<u32>,
}

/// How a pass is added.
#[derive(Debug, Clone, Copy)]
pub struct Adding {
    /// Pixels of the band.
    pub pixels: u32,
    /// Whether layers are added, too.
    pub aov: bool,
    /// Exponents of the powers of two that radiance and depth are counted in.
    pub exponents: [i32; 2],
}

/// Adds a pass.
pub fn add(
    g: &mut Graph,
    (camera, pass): (&Buf<Camera>, &Buf<Pass>),
    adding: Adding,
    result: PassResult<'_>,
    film: &mut FilmBuffers,
) {
    let bind = FilmAddBindings {
        camera,
        pass,
        radiance: result.radiance,
        gathered: result.gathered,
        aov_first: result.aov_first,
        film: &mut film.film,
        film_layers: &mut film.layers,
        rejected: &mut film.rejected,
        overflow: result.overflow,
    };
    let [unit, depth_unit] = adding.exponents.map(|exponent| 2f32.powi(-exponent));
    g.dispatch(FilmAdd { aov: adding.aov }, Grid::Threads(adding.pixels), FilmAddParams { unit, depth_unit }, bind);
}
