//! From a checked order to a finished picture: device, scene, session.

use std::time::Instant;

use super::flags::DeviceArgs;
use super::flags_post::{Aperture, DepthOfField, LensArgs};
use super::keep::Keeper;
use super::progress::Status;
use super::render::{Rendered, Request, Watch};
use super::stop::{CONFIDENCE, Judge, Outcome, Stop};
use super::values::{Aov, Bsdf, FootprintRule, choose_camera};
use crate::error::{Error, Result};
use crate::graph::{Runtime, Timing, chrome_trace};
use crate::picture::exr::{Metadata, RenderInfo, Value};
use crate::picture::image::{Channels, Picture};
use crate::picture::post::defocus::Defocus;
use crate::picture::post::{Post, View};
use crate::picture::tonemap::ToneMap;
use crate::render::{Footprint, Lens, Session, Settings, identity};
use crate::scene::{self, Camera, Limits, Projection, Scene};
use crate::vk::{Device, DeviceOptions};

/// Opens the device that the flags name.
pub(super) fn open(args: &DeviceArgs) -> Result<Runtime> {
    let mut options = DeviceOptions { validate: args.validate, ..DeviceOptions::default() };
    if let Some(wanted) = &args.device {
        options.select = wanted.parse()?;
    }
    Ok(Runtime::new(Device::open(&options)?))
}

/// Renders until a limit is reached or the user stops.
pub(super) fn render(request: &Request, watch: &mut Watch) -> Result<Rendered> {
    let begin = Instant::now();
    let scene = scene::load_with_environment(&request.scene, request.light.environment.as_deref(), &Limits::default())?;
    for warning in &scene.warnings {
        watch.note(warning);
    }
    let loaded = begin.elapsed().as_secs_f64();
    let runtime = open(&request.device)?;
    let settings = settings(request, &scene)?;
    let after = After::of(request, &scene.cameras[settings.camera], &settings)?;
    let identity = identity(&scene, &settings);
    let mut session = Session::new(&runtime, scene, settings)?;
    let prepared = begin.elapsed().as_secs_f64() - loaded;
    let mut trace = Vec::new();
    let mut keeper = Keeper::begin(&request.film, identity, &mut session, &runtime, watch)?;
    let mut judge = Judge::new(request.limit, request.target_error, watch.is_shown());
    let stop = loop {
        if watch.is_stopped() {
            break Stop::Interrupted;
        }
        let status = status(&session, &keeper, &mut judge, watch)?;
        if let Some(stop) = judge.decide(&status) {
            break stop;
        }
        let Some(index) = keeper.next_pass(&session) else { break Stop::Passes };
        session.run_pass(index)?;
        if request.wants_trace && trace.len() < MOST_TRACE_EVENTS {
            trace.extend(session.timings());
        }
        let seconds = keeper.seconds();
        keeper.pass_done(&session, || info(request, &runtime, status.passes + 1, seconds).metadata(), watch)?;
    };
    let seconds = keeper.seconds();
    runtime.device().check_validation()?;
    let film = if request.film.keeps_film() { Some(keeper.file(&session)?) } else { None };
    let rendered = finish((request, &after), &session, &runtime, Measured { loaded, prepared, seconds, stop, trace })?;
    Ok(Rendered { film, ..rendered })
}

/// Where a render stands, shown to the user; with a new estimate of its error where one is due.
fn status(session: &Session, keeper: &Keeper, judge: &mut Judge, watch: &mut Watch) -> Result<Status> {
    let (caustic, global) = session.photons_per_pass();
    let passes = session.passes().count();
    let photons = passes * u64::from(caustic + global);
    let mut status = Status { passes, photons, seconds: keeper.seconds(), ..Status::default() };
    if judge.is_due(&status) {
        let begin = Instant::now();
        judge.record(&status, session.error_estimate()?.relative, begin.elapsed());
    }
    judge.complete(&mut status);
    if passes > 0 {
        watch.pass_done(status);
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

struct Measured {
    loaded: f64,
    prepared: f64,
    seconds: f64,
    stop: Stop,
    trace: Vec<Timing>,
}

fn settings(request: &Request, scene: &Scene) -> Result<Settings> {
    let names: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let defaults = Settings::default();
    let camera = choose_camera(&request.view.camera, &names)?;
    let in_paths = request.lens.depth_of_field == DepthOfField::Lens;
    let lens = if in_paths { lens(&request.lens, &scene.cameras[camera])? } else { None };
    let needs_layers = request.post.occlusion().is_some() || (!in_paths && request.lens.aperture.is_some());
    Ok(Settings {
        width: request.view.size.width,
        height: request.view.size.height,
        camera,
        lens,
        seed: (request.seed ^ (request.seed >> 32)) as u32,
        photons: request.photons.map(|n| n.min(u64::from(u32::MAX)) as u32),
        method: request.light.method,
        estimator: request.light.estimator,
        photon_build: request.light.photon_build,
        knn_photons: request.light.knn_photons,
        sampling: request.light.sampling,
        weight: request.light.kernel,
        footprint: footprint(request.light.footprint, scene),
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

pub(super) fn footprint(rule: FootprintRule, scene: &Scene) -> Footprint {
    rule.in_scene(scene)
}

/// The lens that the flags ask of this camera.
fn lens(args: &LensArgs, camera: &Camera) -> Result<Option<Lens>> {
    let (Some(aperture), Some(focus)) = (args.aperture, args.focus) else { return Ok(None) };
    let Projection::Perspective { yfov, .. } = camera.projection else {
        return Err(Error::Usage(format!(
            "--aperture needs a perspective camera, and '{}' is orthographic",
            camera.name
        )));
    };
    Ok(Some(match aperture {
        Aperture::FNumber(number) => Lens::from_f_number(number, focus, yfov),
        Aperture::Radius(radius) => Lens { radius, focus },
    }))
}

/// What is done to the finished film.
struct After {
    post: Post,
    view: View,
    /// The lens in the eye paths.
    lens: Option<Lens>,
}

impl After {
    fn of(request: &Request, camera: &Camera, settings: &Settings) -> Result<Self> {
        let defocus = match request.lens.depth_of_field {
            DepthOfField::Lens => None,
            DepthOfField::Screen => {
                lens(&request.lens, camera)?.map(|Lens { radius, focus }| Defocus { radius, focus })
            }
        };
        let (half_height, orthographic) = match camera.projection {
            Projection::Perspective { yfov, .. } => ((0.5 * yfov).tan(), false),
            Projection::Orthographic { ymag, .. } => (ymag, true),
        };
        let half = [half_height * settings.width as f32 / settings.height as f32, half_height];
        let post = Post { ssao: request.post.occlusion(), defocus, bloom: request.post.glow() };
        let view = View { axes: [camera.right, camera.up, camera.forward], half, orthographic };
        Ok(Self { post, view, lens: settings.lens })
    }

    /// For the metadata of an EXR: keys `lens` and `post`, where there is something to say.
    fn notes(&self) -> Metadata {
        let lens = self.lens.map(|Lens { radius, focus }| format!("aperture radius {radius} focus {focus}"));
        let passes = self.post.describe();
        let post = (!passes.is_empty()).then(|| passes.join("; "));
        let notes = [("lens", lens), ("post", post)];
        notes.into_iter().filter_map(|(key, text)| Some((key.to_owned(), Value::Text(text?)))).collect()
    }

    /// For the report.
    fn report(&self, request: &Request) -> serde_json::Value {
        serde_json::json!({
            "lens": self.lens.map(|lens| serde_json::json!({ "radius": lens.radius, "focus": lens.focus })),
            "linear": self.post.describe(),
            "png": request.post.display(ToneMap::default()).describe(),
        })
    }
}

fn finish(
    (request, after): (&Request, &After),
    session: &Session,
    runtime: &Runtime,
    measured: Measured,
) -> Result<Rendered> {
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
    Ok(Rendered { picture, info, notes: after.notes(), outcome, film: None, report, trace })
}

fn wanted_layers(mut picture: Picture, wanted: &[Aov]) -> Picture {
    picture.layers.retain(|layer| layer.name.is_empty() || wanted.iter().any(|aov| aov.name() == layer.name));
    picture
}

fn report(session: &Session, info: &RenderInfo, measured: &Measured, runtime: &Runtime) -> Result<serde_json::Value> {
    let statistics = session.statistics()?;
    let (caustic, global) = session.photons_per_pass();
    let needs = scene::Needs::of(session.scene());
    let counters: serde_json::Map<_, _> =
        statistics.counters.iter().map(|(name, n)| ((*name).to_owned(), (*n).into())).collect();
    let structure: serde_json::Map<_, _> =
        statistics.structure_counts.iter().map(|(name, n)| ((*name).to_owned(), (*n).into())).collect();
    let memory = runtime.device().memory();
    let scopes = scope_seconds(&session.timings());
    Ok(serde_json::json!({
        "scene": info.scene, "device": info.device, "version": env!("CARGO_PKG_VERSION"), "seed": info.seed,
        "passes": statistics.passes, "seconds": info.seconds,
        "seconds_loading": measured.loaded, "seconds_preparing": measured.prepared,
        "photons_emitted": statistics.photons, "photons_stored": statistics.deposits,
        "photons_per_pass": { "caustic": caustic, "global": global },
        "photons_truncated": statistics.photons_truncated,
        "eye_paths_truncated": statistics.eye_paths_truncated,
        "passes_repeated": statistics.repeated,
        "values_not_finite": statistics.rejected,
        "guards": counters, "estimator": estimator(session, structure.into()),
        "kept": needs.kept(), "left_out": needs.left_out(),
        "leaf_photons": session.leaf_photons(),
        "plan_passes": session.plan_passes(),
        "bytes": {
            "device_peak": memory.peak,
            "transients": session.transient_bytes(),
            "scene": session.device_scene().sizes().into_iter().map(|(name, bytes)| (name.to_owned(), bytes.into())).collect::<serde_json::Map<String, serde_json::Value>>(),
        },
        "seconds_of_last_pass": scopes,
        "warnings": session.scene().warnings,
    }))
}

/// The estimator by name, what it counted, and its bytes per photon that the map has room for.
fn estimator(session: &Session, counts: serde_json::Value) -> serde_json::Value {
    let bytes = session.estimator_bytes().map(|bytes| {
        serde_json::json!({
            "kept_per_photon": bytes.kept_per_photon, "scratch_per_photon": bytes.scratch_per_photon,
            "deposits_per_photon": bytes.deposits_per_photon, "fixed": bytes.fixed,
        })
    });
    serde_json::json!({ "name": session.estimator().name(), "counts": counts, "bytes": bytes })
}

/// Seconds of the last pass by outermost scope.
fn scope_seconds(timings: &[Timing]) -> serde_json::Value {
    let mut sums: Vec<(String, f64)> = Vec::new();
    for timing in timings.iter().filter(|t| t.depth == 0) {
        let seconds = timing.end_ns.saturating_sub(timing.start_ns) as f64 * 1e-9;
        match sums.iter_mut().find(|(name, _)| *name == timing.name) {
            Some((_, sum)) => *sum += seconds,
            None => sums.push((timing.name.clone(), seconds)),
        }
    }
    sums.into_iter().map(|(name, s)| (name, s.into())).collect::<serde_json::Map<_, _>>().into()
}
