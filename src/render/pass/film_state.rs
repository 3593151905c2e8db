//! The film on the device, in bands.

use super::content::Content;
use crate::error::Result;
use crate::graph::Persistent;
use crate::kernels::film::{FILM_SUMS, LAYER_SUMS};
use crate::render::scene::memory::Memory;

/// Path slots of one band: bounds the memory of eye paths whatever the image size, and keeps every buffer far below
/// the smallest binding limit.
const BAND_SLOTS: u32 = 1 << 19;

/// Most pixels of a band: its layer sums stay below the smallest binding limit, 128 MiB.
const BAND_PIXELS: u32 = (1 << 27) / (16 * LAYER_SUMS);

/// Film of one band of pixels.
pub struct BandFilm {
    pub first_pixel: u32,
    pub pixels: u32,
    pub film: Persistent<[u32; 4]>,
    pub layers: Persistent<[u32; 4]>,
}

/// Memory that outlives passes.
pub struct FilmState {
    pub bands: Vec<BandFilm>,
    pub rejected: Persistent<u32>,
}

impl FilmState {
    pub fn new(memory: Memory<'_>, content: Content<'_>) -> Result<Self> {
        let settings = content.settings;
        let per_band = (BAND_SLOTS / content.slots()).clamp(1, BAND_PIXELS);
        let mut bands = Vec::new();
        let mut first_pixel = 0;
        while first_pixel < settings.pixels() {
            let pixels = per_band.min(settings.pixels() - first_pixel);
            bands.push(BandFilm {
                first_pixel,
                pixels,
                film: memory.zeroed("film", pixels * FILM_SUMS)?,
                layers: memory.zeroed("film_layers", if settings.layers { pixels * LAYER_SUMS } else { 1 })?,
            });
            first_pixel += pixels;
        }
        Ok(Self { bands, rejected: memory.zeroed("rejected", 1)? })
    }

    /// Size in bytes.
    pub fn bytes(&self) -> u64 {
        self.bands.iter().map(|band| band.film.bytes() + band.layers.bytes()).sum::<u64>() + self.rejected.bytes()
    }
}
