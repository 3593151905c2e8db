//! One pass, top to bottom: photons, their map, and for each band of pixels eye paths, direct light, gather, film. Where the
//! host builds the map, the same in two halves.

use super::budget::PhotonBudget;
use super::content::Content;
use super::estimator::{self, Structure};
use super::film_state::{BandFilm, FilmState};
use super::host_map::HostMap;
use super::{light, path};
use crate::graph::{Buf, Graph, Input, Plan, Readback};
use crate::kernels::eye::{self, EyeSettings};
use crate::kernels::film::{self, Adding, FilmBuffers, PassResult};
use crate::kernels::gather::{Band, Points, Program};
use crate::kernels::generated::{Aabb, Pass, Photon};
use crate::kernels::photon::{self, Deposits, Emission};
use crate::kernels::scene_data::{SceneBuffers, Variant};
use crate::render::scene::camera::device_camera;
use crate::render::settings::{Method, Record};

/// Shadow rays per eye hit and pass, where there is more than one direction to choose.
const SHADOW_RAYS: u32 = 4;

/// A pass or a half of it, planned.
pub struct Planned {
    pub plan: Plan,
    pub pass: Input<Pass>,
    pub reports: Reports,
}

/// Numbers that a pass brings to the host.
#[derive(Default)]
pub struct Reports {
    pub deposits: Option<Readback<u32>>,
    pub overflow: Option<Readback<u32>>,
    pub counters: Option<Readback<u32>>,
    pub truncated: Vec<Readback<u32>>,
    pub eye_truncated: Vec<Readback<u32>>,
    /// What the estimator built, by name; equal names are added up.
    pub structure: Vec<(&'static str, Readback<u32>)>,
    /// What was gathered, where pairs are counted.
    pub gathered: Vec<Readback<[f32; 4]>>,
    /// The deposits, where they are wanted.
    pub photons: Option<Readback<Photon>>,
}

/// [`photon::trace`] or [`photon::trace_vertices`].
type TracePhotons = fn(&mut Graph, &SceneBuffers, Variant, Emission, &mut Deposits);

/// Photons of every class of the budget, or their light vertices; none of none.
fn trace_photons(
    g: &mut Graph,
    buffers: &SceneBuffers,
    Content { device, settings, .. }: Content<'_>,
    budget: &PhotonBudget,
) -> Option<Deposits> {
    if budget.emissions.is_empty() {
        return None;
    }
    let (mut store, trace) = match settings.method {
        Method::Light => (Deposits::vertices(g, budget.capacity), photon::trace_vertices as TracePhotons),
        _ => (Deposits::new(g, budget.capacity), photon::trace as TracePhotons),
    };
    for emission in &budget.emissions {
        let name = if emission.caustic { "caustic photons" } else { "global photons" };
        g.scope(name, |g| trace(g, buffers, device.variant, *emission, &mut store));
    }
    if settings.fold && settings.method == Method::Photons && settings.record == Record::Full {
        g.scope("boundaries", |g| photon::fold(g, buffers, &mut store));
    }
    Some(store)
}

/// Eye paths, direct light, gather and film, band by band.
fn bands(
    g: &mut Graph,
    content: Content<'_>,
    buffers: &SceneBuffers,
    mut stored: Option<(&mut Structure, &Deposits)>,
    state: &FilmState,
) -> Reports {
    let Content { scene, device, settings } = content;
    let slots = content.slots();
    let mut reports = Reports::default();
    let mut rejected = g.import(&state.rejected);
    for band in &state.bands {
        let mut camera = device_camera(scene, settings, slots);
        camera.first_pixel = band.first_pixel;
        camera.pixels = band.pixels;
        let camera = g.upload("camera", &[camera]);
        let view = (buffers, &*camera);
        if settings.method == Method::Path {
            let light = g.scope("paths", |g| path::path(g, content, view, band.pixels));
            let (radiance, gathered, aov_first) = (&light.radiance, &light.gathered, &light.aov_first);
            let no_overflow = g.upload("no_overflow", &[0u32]);
            let result = PassResult { radiance, gathered, aov_first, overflow: &no_overflow };
            rejected = add_to_film(g, content, (band, view), result, rejected);
            reports.eye_truncated.push(g.readback(&light.truncated));
            continue;
        }
        let eye_settings = EyeSettings {
            pixels: band.pixels,
            slots,
            max_depth: settings.eye_depth,
            aov: settings.layers,
            path: false,
        };
        let mut hits = g.scope("eye paths", |g| eye::trace(g, view, device.variant, eye_settings));
        if device.light_count > 0 {
            // A single light without extent has nothing to choose; otherwise a few shadow rays cost little of a pass.
            let samples = if device.light_count == 1 && !device.has_wide_lights { 1 } else { SHADOW_RAYS };
            g.scope("direct light", |g| eye::direct(g, view, device.variant, samples, &mut hits));
        }
        let mut gathered = g.buffer("gathered", 2 * band.pixels * slots);
        g.fill(&mut gathered, 0);
        if let Some((structure, deposits)) = &mut stored {
            let program = Program {
                count_pairs: settings.count_pairs,
                loop_limit: device.loop_limit,
                walk: settings.sampling.walk(),
                ..Program::of(device.variant, settings.weight)
            };
            let place = Band {
                camera: &camera,
                size: [settings.width, settings.height],
                first_pixel: band.first_pixel,
                pixels: band.pixels,
            };
            let points = (Points::new(&hits, &buffers.pass), place);
            gathered = g.scope("gather", |g| {
                settings.sampling.apply(g, points, gathered, |g, some, target| {
                    estimator::gather(g, program, (structure, deposits), (some, place), target);
                })
            });
            if settings.count_pairs {
                reports.gathered.push(g.readback(&gathered));
            }
        }
        let no_overflow = g.upload("no_overflow", &[0u32]);
        let overflow = stored.as_ref().map_or(&*no_overflow, |(_, deposits)| &deposits.overflow);
        let result = PassResult { radiance: &hits.radiance, gathered: &gathered, aov_first: &hits.aov_first, overflow };
        rejected = add_to_film(g, content, (band, view), result, rejected);
        reports.eye_truncated.push(g.readback(&hits.truncated));
    }
    g.keep(&rejected);
    let counts = stored.as_ref().map_or(vec![], |(structure, _)| estimator::counts(g, structure));
    reports.structure = counts.iter().map(|(name, count)| (*name, g.readback(count))).collect();
    reports
}

/// Adds what a pass brings for a band; the count of rejected values comes and goes.
fn add_to_film(
    g: &mut Graph,
    Content { device, settings, .. }: Content<'_>,
    (band, (buffers, camera)): (&BandFilm, eye::View<'_>),
    result: PassResult<'_>,
    rejected: Buf<u32>,
) -> Buf<u32> {
    let mut film = FilmBuffers { film: g.import(&band.film), layers: g.import(&band.layers), rejected };
    let adding = Adding { pixels: band.pixels, aov: settings.layers, exponents: device.exponents };
    g.scope("film", |g| film::add(g, (camera, &buffers.pass), adding, result, &mut film));
    g.keep(&film.film);
    g.keep(&film.layers);
    film.rejected
}

impl Reports {
    /// Adds what is known of the photons.
    fn with_photons(self, g: &mut Graph, deposits: &Deposits, read_photons: bool) -> Self {
        Self {
            deposits: Some(g.readback(&deposits.count)),
            overflow: Some(g.readback(&deposits.overflow)),
            counters: Some(g.readback(&deposits.counters)),
            truncated: deposits.truncated.iter().map(|count| g.readback(count)).collect(),
            photons: read_photons.then(|| g.readback(&deposits.photons)),
            ..self
        }
    }
}

fn planned(g: Graph, pass: Input<Pass>, reports: Reports) -> Planned {
    let plan = g.plan().unwrap_or_else(|error| panic!("the frame is declared wrong: {error}"));
    Planned { plan, pass, reports }
}

/// Declares and plans a pass that the device does by itself.
pub fn plan(content: Content<'_>, budget: &PhotonBudget, state: &FilmState) -> Planned {
    let Content { device, settings, .. } = content;
    let mut g = Graph::new().with_device_class(device.device_class);
    let (buffers, pass) = device.import(&mut g, Pass::default());
    let chosen = settings.estimator_on(device.device_class);
    let mut deposits = trace_photons(&mut g, &buffers, content, budget);
    let mut structure = deposits.as_mut().map(|store| match settings.method {
        Method::Light => Structure::Connections(g.scope("connections", |g| light::splats(g, content, &buffers, store))),
        _ => g.scope("photon map", |g| estimator::build(g, chosen, device, settings, store)),
    });
    let mut reports = bands(&mut g, content, &buffers, structure.as_mut().zip(deposits.as_ref()), state);
    if let Some(deposits) = &deposits {
        let read_photons = settings.read_photons && settings.method == Method::Photons;
        reports = reports.with_photons(&mut g, deposits, read_photons);
    }
    planned(g, pass, reports)
}

/// The first half of a pass whose photon map the host builds: photons, their boxes to the host. A budget without photons has
/// no halves.
pub fn plan_photons(content: Content<'_>, budget: &PhotonBudget, map: &HostMap) -> (Planned, Readback<Aabb>) {
    let Content { device, settings, .. } = content;
    let mut g = Graph::new().with_device_class(device.device_class);
    let (buffers, pass) = device.import(&mut g, Pass::default());
    let mut deposits = trace_photons(&mut g, &buffers, content, budget).expect("a photon map needs photons");
    let boxes = map.store(&mut g, &mut deposits, settings.record == Record::Packed20);
    let reports = Reports::default().with_photons(&mut g, &deposits, settings.read_photons);
    (planned(g, pass, reports), boxes)
}

/// Photons alone, brought to the host. A budget without photons has none to plan.
pub fn plan_survey(content: Content<'_>, budget: &PhotonBudget) -> (Planned, Readback<Photon>) {
    let mut g = Graph::new().with_device_class(content.device.device_class);
    let (buffers, pass) = content.device.import(&mut g, Pass::default());
    let deposits = trace_photons(&mut g, &buffers, content, budget).expect("a survey needs photons");
    let photons = g.readback(&deposits.photons);
    let reports = Reports::default().with_photons(&mut g, &deposits, false);
    (planned(g, pass, reports), photons)
}

/// The second half: everything that is seen, with the host's map.
pub fn plan_picture(content: Content<'_>, map: &HostMap, state: &FilmState) -> Planned {
    let mut g = Graph::new().with_device_class(content.device.device_class);
    let (buffers, pass) = content.device.import(&mut g, Pass::default());
    let (deposits, sorted) = g.scope("photon map", |g| map.map(g, content.settings.record == Record::Packed20));
    let reports = bands(&mut g, content, &buffers, Some((&mut Structure::Bvh(sorted), &deposits)), state);
    planned(g, pass, reports)
}
