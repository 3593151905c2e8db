//! One pass, top to bottom: photons, their map, and for each band of pixels eye paths, direct light, gather, film.

use super::estimator::{self, Estimator};
use super::memory::Memory;
use super::settings::Settings;
use super::upload::{DeviceScene, device_camera};
use crate::error::Result;
use crate::graph::{Executable, Graph, Input, Persistent, Plan, Readback, Runtime};
use crate::kernels::eye::{self, EyeSettings};
use crate::kernels::film::{self, FILM_FLOATS, FilmBuffers, LAYER_VECTORS, PassResult};
use crate::kernels::gather::{Band, Points, Program};
use crate::kernels::generated::Pass;
use crate::kernels::photon::{self, Deposits, Emission};
use crate::scene::Scene;

/// Path slots of one band: bounds the memory of eye paths whatever the image size, and keeps every buffer far below
/// the smallest binding limit.
const BAND_SLOTS: u32 = 1 << 19;

/// Shadow rays per eye hit and pass, where there is more than one direction to choose.
const SHADOW_RAYS: u32 = 4;

/// Film of one band of pixels.
pub(super) struct BandFilm {
    pub first_pixel: u32,
    pub pixels: u32,
    pub film: Persistent<f32>,
    pub layers: Persistent<[f32; 4]>,
}

/// Memory that outlives passes.
pub(super) struct FilmState {
    pub bands: Vec<BandFilm>,
    pub rejected: Persistent<u32>,
}

impl FilmState {
    pub fn new(memory: Memory<'_>, settings: &Settings, slots: u32) -> Result<Self> {
        let per_band = (BAND_SLOTS / slots).max(1);
        let mut bands = Vec::new();
        let mut first_pixel = 0;
        while first_pixel < settings.pixels() {
            let pixels = per_band.min(settings.pixels() - first_pixel);
            bands.push(BandFilm {
                first_pixel,
                pixels,
                film: memory.zeroed("film", pixels * FILM_FLOATS)?,
                layers: memory.zeroed("film_layers", if settings.layers { pixels * LAYER_VECTORS } else { 1 })?,
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

/// Which photons a pass emits.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PhotonBudget {
    pub emissions: Vec<Emission>,
    /// Deposits that the map has room for.
    pub capacity: u32,
}

/// A recorded pass.
pub(super) struct Frame {
    pub executable: Executable,
    pub pass: Input<Pass>,
    pub reports: Reports,
    pub dump: String,
    pub dispatches: usize,
}

/// Numbers that a pass brings to the host.
pub(super) struct Reports {
    pub deposits: Option<Readback<u32>>,
    pub overflow: Option<Readback<u32>>,
    pub counters: Option<Readback<u32>>,
    pub truncated: Vec<Readback<u32>>,
    pub eye_truncated: Vec<Readback<u32>>,
    /// What the estimator built, by name; equal names are added up.
    pub structure: Vec<(&'static str, Readback<u32>)>,
    /// What was gathered, where pairs are counted.
    pub gathered: Vec<Readback<[f32; 4]>>,
}

/// Path slots per pixel: splitting needs them only where paths can go on after their first surface.
pub(super) fn slots_per_pixel(device: &DeviceScene) -> u32 {
    if device.variant.glossy { 4 } else { 1 }
}

/// Declares and plans one pass.
pub(super) fn plan(
    scene: &Scene,
    device: &DeviceScene,
    settings: &Settings,
    budget: &PhotonBudget,
    state: &FilmState,
) -> (Plan, Input<Pass>, Reports) {
    let mut g = Graph::new().with_lanes(device.lanes);
    let (buffers, pass) = device.import(&mut g, Pass::default());
    let slots = slots_per_pixel(device);
    let mut deposits = None;
    let chosen = settings.estimator.unwrap_or(Estimator::default_for(device.lanes));
    let mut structure = None;
    if !budget.emissions.is_empty() {
        let mut store = Deposits::new(&mut g, budget.capacity);
        for emission in &budget.emissions {
            let name = if emission.caustic { "caustic photons" } else { "global photons" };
            g.scope(name, |g| photon::trace(g, &buffers, device.variant, *emission, &mut store));
        }
        structure = Some(g.scope("photon map", |g| estimator::build(g, chosen, device, settings, &store)));
        deposits = Some(store);
    }
    let mut rejected = g.import(&state.rejected);
    let (mut eye_truncated, mut gathers) = (Vec::new(), Vec::new());
    for band in &state.bands {
        let mut camera = device_camera(scene, settings, slots);
        camera.first_pixel = band.first_pixel;
        camera.pixels = band.pixels;
        let camera = g.upload("camera", &[camera]);
        let view = (&buffers, &*camera);
        let eye_settings =
            EyeSettings { pixels: band.pixels, slots, max_depth: settings.eye_depth, aov: settings.layers };
        let mut hits = g.scope("eye paths", |g| eye::trace(g, view, device.variant, eye_settings));
        if device.light_count > 0 {
            // A single light without extent has nothing to choose; otherwise a few shadow rays cost little of a pass.
            let samples = if device.light_count == 1 && !device.has_wide_lights { 1 } else { SHADOW_RAYS };
            g.scope("direct light", |g| eye::direct(g, view, device.variant, samples, &mut hits));
        }
        let mut gathered = g.buffer("gathered", 2 * band.pixels * slots);
        g.fill(&mut gathered, 0);
        if let (Some(structure), Some(store)) = (&mut structure, &deposits) {
            let program = Program {
                count_pairs: settings.count_pairs,
                loop_limit: device.loop_limit,
                ..Program::of(device.variant, settings.weight)
            };
            let place = Band {
                camera: &camera,
                size: [settings.width, settings.height],
                first_pixel: band.first_pixel,
                pixels: band.pixels,
                bends: device.variant.glossy,
            };
            let points = (Points::from(&hits), place);
            g.scope("gather", |g| estimator::gather(g, program, (structure, store), points, &mut gathered));
            if settings.count_pairs {
                gathers.push(g.readback(&gathered));
            }
        }
        let no_overflow = g.upload("no_overflow", &[0u32]);
        let overflow = deposits.as_ref().map_or(&*no_overflow, |d| &d.overflow);
        let mut film = FilmBuffers { film: g.import(&band.film), layers: g.import(&band.layers), rejected };
        let result = PassResult { radiance: &hits.radiance, gathered: &gathered, aov_first: &hits.aov_first, overflow };
        g.scope("film", |g| film::add(g, &camera, band.pixels, settings.layers, result, &mut film));
        g.keep(&film.film);
        g.keep(&film.layers);
        rejected = film.rejected;
        eye_truncated.push(g.readback(&hits.truncated));
    }
    g.keep(&rejected);
    let counts = structure.as_ref().map_or(vec![], |structure| estimator::counts(&mut g, structure));
    let reports = Reports {
        deposits: deposits.as_ref().map(|d| g.readback(&d.count)),
        overflow: deposits.as_ref().map(|d| g.readback(&d.overflow)),
        counters: deposits.as_ref().map(|d| g.readback(&d.counters)),
        truncated: deposits.iter().flat_map(|d| &d.truncated).map(|count| g.readback(count)).collect(),
        eye_truncated,
        structure: counts.iter().map(|(name, count)| (*name, g.readback(count))).collect(),
        gathered: gathers,
    };
    let plan = g.plan().unwrap_or_else(|error| panic!("the frame is declared wrong: {error}"));
    (plan, pass, reports)
}

impl Frame {
    /// Plans, allocates and records one pass.
    pub fn new(
        runtime: &Runtime,
        (scene, device): (&Scene, &DeviceScene),
        settings: &Settings,
        budget: &PhotonBudget,
        state: &FilmState,
    ) -> Result<Self> {
        let (plan, pass, reports) = plan(scene, device, settings, budget, state);
        let executable = runtime.prepare(&plan)?;
        Ok(Self { executable, pass, reports, dump: plan.dump(), dispatches: plan.passes.len() })
    }
}
