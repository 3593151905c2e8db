//! The content of `--report`.

use super::stop_rule::StopReason;
use crate::error::Result;
use crate::film::mix::Round;
use crate::graph::{Runtime, Timing};
use crate::kernels::energy::Ledger;
use crate::picture::exr::RenderInfo;
use crate::render::{CLASSES, Named, Session, Statistics};
use crate::scene;

/// Times of a render in seconds, why it ended, and the device's timeline.
pub(super) struct Measured {
    pub loaded: f64,
    pub prepared: f64,
    pub seconds: f64,
    pub stop: StopReason,
    pub trace: Vec<Timing>,
}

/// Counts, times, memory and warnings.
///
/// # Errors
/// Those of the device.
pub(super) fn report(
    session: &Session,
    info: &RenderInfo,
    measured: &Measured,
    runtime: &Runtime,
) -> Result<serde_json::Value> {
    let statistics = session.statistics()?;
    let (caustic, global) = session.photons_per_pass();
    let needs = scene::Needs::of(session.scene());
    let counters: serde_json::Map<_, _> =
        statistics.counters.iter().map(|(name, n)| ((*name).to_owned(), (*n).into())).collect();
    let structure: serde_json::Map<_, _> =
        statistics.structure_counts.iter().map(|(name, n)| ((*name).to_owned(), (*n).into())).collect();
    let scene_bytes: serde_json::Map<_, _> =
        session.device_scene().sizes().into_iter().map(|(name, bytes)| (name.to_owned(), bytes.into())).collect();
    let memory = runtime.device().memory();
    let scopes = scope_seconds(&session.timings());
    Ok(serde_json::json!({
        "scene": info.scene, "device": info.device, "version": env!("CARGO_PKG_VERSION"), "seed": info.seed,
        "passes": statistics.passes, "seconds": info.seconds, "choice": choice(session),
        "seconds_loading": measured.loaded, "seconds_preparing": measured.prepared,
        "photons_emitted": statistics.photons, "photons_stored": statistics.deposits,
        "photons_per_pass": { "caustic": caustic, "global": global },
        "photons_truncated": statistics.photons_truncated,
        "eye_paths_truncated": statistics.eye_paths_truncated,
        "energy": energy(&statistics), "maps": maps(session),
        "passes_repeated": statistics.repeated,
        "values_not_finite": statistics.rejected,
        "guards": counters, "estimator": estimator(session, structure.into()),
        "kept": needs.kept(), "left_out": needs.left_out(),
        "leaf_photons": session.leaf_photons(),
        "plan_passes": session.plan_passes(),
        "bytes": {
            "device_peak": memory.peak,
            "transients": session.transient_bytes(),
            "scene": scene_bytes,
        },
        "seconds_of_last_pass": scopes,
        "warnings": session.scene().warnings,
    }))
}

/// Where the light of each class of photons went: the mean over the passes [W, mean of the channels], and the part of
/// the emitted light that is not accounted for. A class without photons is left out.
fn energy(statistics: &Statistics) -> serde_json::Value {
    let passes = statistics.passes.max(1) as f64;
    let classes = CLASSES.iter().zip(&statistics.energies).filter(|(_, ledger)| ledger.emitted > 0.0);
    let class = |(name, ledger): (&&str, &Ledger)| {
        let mut entries: serde_json::Map<_, _> =
            ledger.entries().iter().map(|(name, watts)| ((*name).to_owned(), (watts / passes).into())).collect();
        entries.insert("imbalance".into(), ledger.imbalance().into());
        ((*name).to_owned(), entries.into())
    };
    classes.map(class).collect::<serde_json::Map<_, _>>().into()
}

/// The environment maps that photons are traced in; `null` without any. `covered` is the part of the area that the
/// candidates see together that the chosen centres see.
fn maps(session: &Session) -> serde_json::Value {
    session.device_scene().maps.as_ref().map_or(serde_json::Value::Null, |maps| {
        let about = &maps.about;
        serde_json::json!({
            "centres": about.centres, "covered": about.covered, "bytes": maps.bytes(),
            "exchanges": about.choice.as_ref().map(|choice| choice.exchanges),
            "seconds_choosing": about.seconds[0], "seconds_drawing": about.seconds[1],
        })
    })
}

/// What `--method auto` has chosen: passes of photons and of paths in the opening, in each round after it, and in each
/// round after the second look (`null` before that is known), and the method of the latter; `null` for other methods.
fn choice(session: &Session) -> serde_json::Value {
    let round = |round: Round| serde_json::json!({ "photons": round.first, "paths": round.second });
    session.choice().map_or(serde_json::Value::Null, |choice| {
        serde_json::json!({
            "paths": choice.paths.name(), "opening": round(choice.turns.opening), "then": choice.turns.then.map(round),
            "at_last": choice.turns.at_last.map(round),
        })
    })
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
