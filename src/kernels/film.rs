//! Adding a pass to the film. The specification of the sums is [`crate::film`]'s host film, which the kernel mirrors.

use super::generated::{Camera, FilmAdd, FilmAddBindings};
use crate::graph::{Buf, Graph, Grid};

/// Floats per pixel of the film: sum high, sum low, squares high, squares low, three channels each.
pub const FILM_FLOATS: u32 = 12;

/// Vectors per pixel of the layers: albedo, normal, depth and coverage, direct, indirect, caustic; high and low parts.
pub const LAYER_VECTORS: u32 = 12;

/// The film's buffers.
pub struct FilmBuffers {
    /// [`FILM_FLOATS`] per pixel.
    pub film: Buf<f32>,
    /// [`LAYER_VECTORS`] per pixel, or one without layers.
    pub layers: Buf<[f32; 4]>,
    /// One word: pixels of passes that were not finite.
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

/// Adds a pass; `aov` also adds the layers.
pub fn add(g: &mut Graph, camera: &Buf<Camera>, pixels: u32, aov: bool, pass: PassResult<'_>, film: &mut FilmBuffers) {
    let bind = FilmAddBindings {
        camera,
        radiance: pass.radiance,
        gathered: pass.gathered,
        aov_first: pass.aov_first,
        film: &mut film.film,
        film_layers: &mut film.layers,
        rejected: &mut film.rejected,
        overflow: pass.overflow,
    };
    g.dispatch(FilmAdd { aov }, Grid::Threads(pixels), (), bind);
}
