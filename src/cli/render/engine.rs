//! From a checked order to a finished picture: device, scene, session.

use std::time::Instant;

use super::checkpoint::Checkpoints;
use super::finished::FinishedRender;
use super::flags_post::DepthOfField;
use super::monitor::Monitor;
use super::post::After;
use super::report::{Measured, report};
use super::request::Request;
use super::stop_rule::{CONFIDENCE, Outcome, StopReason, StopRule};
use crate::cli::advice;
use crate::cli::inputs::spare_inputs;
use crate::cli::progress::Status;
use crate::cli::values::{Aov, Bsdf, choose_camera};
use crate::error::Result;
use crate::film::film_file::Identity;
use crate::graph::{Runtime, chrome_trace};
use crate::picture::exr::RenderInfo;
use crate::picture::image::{Channels, Picture};
use crate::render::{Session, Settings, identity};
use crate::scene::Scene;

/// Renders until a limit is reached or the user stops.
pub(super) fn render(request: &Request, monitor: &mut Monitor) -> Result<FinishedRender> {
    let begin = Instant::now();
    let mut scene = request.reading.load(&request.scene, &request.light.environment)?;
    spare_inputs(&request.outputs.iter().collect::<Vec<_>>(), &scene.files)?;
    for warning in &scene.warnings {
        monitor.note(&advice::warning(warning));
    }
    let (shutter, told) = request.moment.apply(&mut scene);
    told.iter().for_each(|told| monitor.note(told));
    let loaded = begin.elapsed().as_secs_f64();
    let runtime = request.device.open()?;
    let settings = Settings { shutter, ..settings(request, &scene)? };
    let after = After::of(request, &scene.cameras[settings.camera], &settings)?;
    let identity = identity(&scene, &settings);
    let mut session = Session::new(runtime.device(), scene, settings)?;
    let prepared = begin.elapsed().as_secs_f64() - loaded;
    passes(request, (&mut session, &runtime), Prepared { after, identity, loaded, prepared }, monitor)
}

/// What is known before the first pass.
pub(in crate::cli) struct Prepared {
    pub after: After,
    pub identity: Identity,
    /// Seconds that loading took, and the set-up after it.
    pub loaded: f64,
    pub prepared: f64,
}

/// Renders passes into the film of a session until a limit is reached or the user stops.
pub(in crate::cli) fn passes(
    request: &Request,
    (session, runtime): (&mut Session, &Runtime),
    Prepared { after, identity, loaded, prepared }: Prepared,
    monitor: &mut Monitor,
) -> Result<FinishedRender> {
    let mut trace = Vec::new();
    let mut checkpoints = Checkpoints::begin(&request.film, identity, session, runtime, monitor)?;
    let mut rule = StopRule::new(request.limit, request.target_error, monitor.is_shown());
    let mut failure = None;
    let stop = loop {
        if monitor.is_stopped() {
            break StopReason::Interrupted;
        }
        let status = status(session, &checkpoints, &mut rule, monitor)?;
        if let Some(stop) = rule.decide(&status) {
            break stop;
        }
        let Some(index) = checkpoints.next_pass(session) else { break StopReason::Passes };
        if let Err(error) = session.run_pass(index) {
            failure = Some(error);
            break StopReason::Failed;
        }
        if request.wants_trace && trace.len() < MOST_TRACE_EVENTS {
            trace.extend(session.timings());
        }
        let seconds = checkpoints.seconds();
        checkpoints.pass_done(session, || info(request, runtime, status.passes + 1, seconds).metadata(), monitor)?;
    };
    let seconds = checkpoints.seconds();
    runtime.device().check_validation()?;
    let measured = Measured { loaded, prepared, seconds, stop, trace };
    let finished = || {
        let film = if request.film.keeps_film() { Some(checkpoints.file(session)?) } else { None };
        Ok(FinishedRender { film, ..finish((request, &after), session, runtime, measured)? })
    };
    match failure {
        None => finished(),
        // The passes before it are a picture, if the device still gives them.
        Some(failure) if session.passes().count() > 0 => match finished() {
            Ok(rendered) => Ok(FinishedRender { failure: Some(failure), ..rendered }),
            Err(_) => Err(failure),
        },
        Some(failure) => Err(failure),
    }
}

/// Where a render stands, shown to the user; with a new estimate of its error where one is due.
fn status(session: &Session, checkpoints: &Checkpoints, rule: &mut StopRule, monitor: &mut Monitor) -> Result<Status> {
    let (passes, photons) = (session.passes().count(), session.photons_emitted());
    let next = checkpoints.next_pass(session).and_then(|index| session.expected_seconds(index));
    let mut status = Status { passes, photons, seconds: checkpoints.seconds(), next, ..Status::default() };
    if rule.is_due(&status) {
        let begin = Instant::now();
        rule.add_estimate(&status, session.error_estimate()?.relative, begin.elapsed());
    }
    rule.complete(&mut status);
    if passes > 0 {
        monitor.pass_done(status);
    }
    Ok(status)
}

/// What the files say about a render.
fn info(request: &Request, runtime: &Runtime, passes: u64, seconds: f64) -> RenderInfo {
    let device = runtime.device().info().name.clone();
    RenderInfo { passes, seed: request.seed, seconds, device, scene: request.scene.display().to_string() }
}

/// Events beyond this are not kept: a trace viewer would not open them.
const MOST_TRACE_EVENTS: usize = 200_000;

pub(in crate::cli) fn settings(request: &Request, scene: &Scene) -> Result<Settings> {
    let names: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let defaults = Settings::default();
    let camera = choose_camera(&request.view.camera, &names)?;
    let in_paths = request.lens.depth_of_field == DepthOfField::Lens;
    let lens = if in_paths { request.lens.lens(&scene.cameras[camera])? } else { None };
    let needs_layers = request.post.occlusion().is_some() || (!in_paths && request.lens.aperture.is_some());
    Ok(Settings {
        width: request.view.size.width,
        height: request.view.size.height,
        camera,
        lens,
        seed: (request.seed ^ (request.seed >> 32)) as u32,
        photons: request.photons.map(|n| n.min(u64::from(u32::MAX)) as u32),
        method: request.light.method,
        tracer: request.light.tracer,
        estimator: request.light.estimator,
        photon_build: request.light.photon_build,
        tree_build: request.light.tree,
        knn_photons: request.light.knn_photons,
        sampling: request.light.sampling,
        weight: request.light.weight,
        footprint: request.light.footprint.in_scene(scene),
        bound_vertices: request.light.bounds_vertices,
        amplification: request.light.bounds_stage,
        record: request.light.photon_record,
        blinn_phong: request.light.bsdf == Bsdf::BlinnPhong,
        layers: request.view.aov.iter().any(|aov| *aov != Aov::Error) || needs_layers,
        caustic_smoothing: request.light.caustic_smoothing.unwrap_or(defaults.caustic_smoothing),
        largest_footprint: request.light.largest_footprint.unwrap_or(defaults.largest_footprint),
        fold: !request.light.no_fold,
        global_smoothing: request.light.global_smoothing.unwrap_or(defaults.global_smoothing),
        ..defaults
    })
}

fn finish(
    (request, after): (&Request, &After),
    session: &Session,
    runtime: &Runtime,
    measured: Measured,
) -> Result<FinishedRender> {
    let statistics = session.statistics()?;
    let info = info(request, runtime, statistics.passes, measured.seconds);
    let film = session.film()?;
    let estimate = session.error_of(&film);
    let outcome = Outcome { error: estimate.relative, stop: measured.stop };
    let mut picture = film.picture();
    let start = Instant::now();
    after.post.apply(&mut picture, &after.view)?;
    let seconds_after = start.elapsed().as_secs_f64();
    let mut picture = wanted_layers(picture, &request.view.aov);
    picture.push(Aov::Error.name(), Channels::Rgb, estimate.bound(CONFIDENCE));
    let mut report = report(session, &info, &measured, runtime)?;
    report["after_the_render"] = after.report(request);
    report["after_the_render"]["seconds"] = seconds_after.into();
    report["stop_reason"] = measured.stop.reason().into();
    report["error"] = outcome.report(&estimate, request.target_error);
    let trace = request.wants_trace.then(|| chrome_trace(&measured.trace));
    Ok(FinishedRender { picture, info, notes: after.notes(), outcome, film: None, report, trace, failure: None })
}

fn wanted_layers(mut picture: Picture, wanted: &[Aov]) -> Picture {
    picture.layers.retain(|layer| layer.name.is_empty() || wanted.iter().any(|aov| aov.name() == layer.name));
    picture
}
