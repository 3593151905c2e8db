//! One pass, top to bottom: the method prepares its photons, then each band of pixels gets its light and adds it to the
//! film. Where the host builds the photon map, the same in two halves.

use std::time::Instant;

use super::budget::PhotonBudget;
use super::camera_input::CameraInput;
use super::content::Content;
use super::film_state::{BandFilm, FilmState};
use super::host_map::HostMap;
use super::photons::Photons;
use super::reports::Reports;
use super::transport::{BandLight, BandView, Transport};
use super::{emission, methods};
use crate::graph::{Buf, Graph, Input, Plan, Readback};
use crate::kernels::film::{self, Adding, FilmBuffers, PassResult};
use crate::kernels::generated::{Aabb, Pass, Photon};
use crate::kernels::scene_data::SceneBuffers;
use crate::render::settings::Record;

/// A pass or a half of it, planned.
pub struct Planned {
    pub plan: Plan,
    pub pass: Input<Pass>,
    pub cameras: Vec<CameraInput>,
    pub reports: Reports,
    /// Seconds that planning took.
    pub seconds: f64,
}

/// Declares and plans a pass that the device does by itself.
pub fn plan(content: Content<'_>, budget: &PhotonBudget, state: &FilmState) -> Planned {
    let (mut g, buffers, pass) = begin(content);
    let mut transport = methods::prepare(&mut g, content, &buffers, budget);
    let (mut reports, cameras) = bands(&mut g, content, &buffers, &mut *transport, state);
    if let Some(deposits) = transport.deposits() {
        reports = reports.with_photons(&mut g, deposits, content.reads_photons());
    }
    end(g, pass, reports).with_cameras(cameras)
}

/// The first half of a pass whose photon map the host builds: photons, their boxes to the host. A budget without
/// photons has no halves.
pub fn plan_photons(content: Content<'_>, budget: &PhotonBudget, map: &HostMap) -> (Planned, Readback<Aabb>) {
    let (mut g, buffers, pass) = begin(content);
    let mut deposits = emission::photons(&mut g, content, &buffers, budget).expect("a photon map needs photons");
    let boxes = map.store(&mut g, &mut deposits, content.settings.record == Record::Packed20);
    let reports = Reports::default().with_photons(&mut g, &deposits, content.reads_photons());
    (end(g, pass, reports), boxes)
}

/// The second half: everything that is seen, with the host's map.
pub fn plan_picture(content: Content<'_>, map: &HostMap, state: &FilmState) -> Planned {
    let (mut g, buffers, pass) = begin(content);
    let packed = content.settings.record == Record::Packed20;
    let mut photons = Photons::mapped(g.scope("photon map", |g| map.map(g, packed)));
    let (reports, cameras) = bands(&mut g, content, &buffers, &mut photons, state);
    end(g, pass, reports).with_cameras(cameras)
}

/// Photons alone, brought to the host. A budget without photons has no survey.
pub fn plan_survey(content: Content<'_>, budget: &PhotonBudget) -> (Planned, Readback<Photon>) {
    let (mut g, buffers, pass) = begin(content);
    let deposits = emission::photons(&mut g, content, &buffers, budget).expect("a survey needs photons");
    let photons = g.readback(&deposits.photons);
    let reports = Reports::default().with_photons(&mut g, &deposits, false);
    (end(g, pass, reports), photons)
}

fn begin(content: Content<'_>) -> (Graph, SceneBuffers, Input<Pass>) {
    let mut g = Graph::new().with_device_class(content.device.device_class);
    if content.settings.count_work {
        g = g.with_tallies();
    }
    let (buffers, pass) = content.device.import(&mut g, Pass::default());
    (g, buffers, pass)
}

fn end(mut g: Graph, pass: Input<Pass>, reports: Reports) -> Planned {
    let reports = Reports { work: g.take_tallies(), ..reports };
    let start = Instant::now();
    let plan = g.plan().unwrap_or_else(|error| panic!("the pass is declared wrong: {error}"));
    Planned { plan, pass, cameras: vec![], reports, seconds: start.elapsed().as_secs_f64() }
}

impl Planned {
    fn with_cameras(self, cameras: Vec<CameraInput>) -> Self {
        Self { cameras, ..self }
    }
}

/// The light of every band, added to the film, and the cameras that see them.
fn bands(
    g: &mut Graph,
    content: Content<'_>,
    buffers: &SceneBuffers,
    transport: &mut dyn Transport,
    state: &FilmState,
) -> (Reports, Vec<CameraInput>) {
    let mut reports = Reports::default();
    let mut cameras: Vec<CameraInput> = transport.camera().into_iter().collect();
    let mut rejected = g.import(&state.rejected);
    let counts_pairs = content.settings.count_pairs && transport.deposits().is_some();
    for band in &state.bands {
        let BandFilm { first_pixel, pixels, .. } = *band;
        let (camera, input) = CameraInput::declare(g, "camera", content, (first_pixel, pixels), content.slots());
        cameras.push(input);
        let at = BandView { content, buffers, camera: &camera, first_pixel, pixels };
        let light = transport.band(g, at);
        if counts_pairs {
            reports.gathered.push(g.readback(&light.gathered));
        }
        let no_overflow = g.upload("no_overflow", &[0u32]);
        let overflow = transport.deposits().map_or(&*no_overflow, |deposits| &deposits.overflow);
        rejected = add_to_film(g, (at, band), (&light, overflow), rejected);
        reports.eye_truncated.push(g.readback(&light.truncated));
    }
    g.keep(&rejected);
    let counts = transport.counts(g);
    reports.structure = counts.iter().map(|(name, count)| (*name, g.readback(count))).collect();
    (reports, cameras)
}

/// Adds what a pass brings for a band, unless photons did not fit; the count of rejected values comes and goes.
fn add_to_film(
    g: &mut Graph,
    (at, band): (BandView<'_>, &BandFilm),
    (light, overflow): (&BandLight, &Buf<u32>),
    rejected: Buf<u32>,
) -> Buf<u32> {
    let BandLight { radiance, gathered, aov_first, .. } = light;
    let mut film = FilmBuffers { film: g.import(&band.film), layers: g.import(&band.layers), rejected };
    let Content { device, settings, .. } = at.content;
    let adding = Adding { pixels: band.pixels, aov: settings.layers, exponents: device.exponents };
    let result = PassResult { radiance, gathered, aov_first, overflow };
    g.scope("film", |g| film::add(g, (at.camera, &at.buffers.pass), adding, result, &mut film));
    g.keep(&film.film);
    g.keep(&film.layers);
    film.rejected
}
