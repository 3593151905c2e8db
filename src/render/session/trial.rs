//! Whether the passes of paths in [`Method::Auto`] need photons for caustics.
//!
//! Where a light has no extent, they do. Where all have one, paths that look for lights by themselves find caustics,
//! too: those of a sky or a window sooner than photons do, those of a small lamp hardly ever. Small pictures by both
//! tell, which have as many photons for a pixel as the render has.

use std::sync::Arc;

use super::Session;
use crate::error::Result;
use crate::film::accumulate::{Film, PassSet};
use crate::film::mix::{Mix, Round, Turns};
use crate::film::shares;
use crate::graph::Runtime;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::{Method, Settings};
use crate::scene::Scene;

/// Pixels of a small picture.
const PIXELS: u32 = 64 * 48;
/// Its passes: no more of them than it takes to see photons far ahead.
const PASSES: u64 = 6;
/// Surfaces that its paths and photons meet: what comes later tells little, and each takes as many dispatches.
const DEPTH: u32 = 8;
/// Photons are far ahead if paths lose by more than this.
const FAR_AHEAD: f64 = 2.0;

/// [`Method::Path`] where that serves the picture at least as well as [`Method::Hybrid`]; `settings` are those of
/// passes of paths.
///
/// # Errors
/// Those of the device.
pub(super) fn method_of_paths(
    runtime: &Runtime,
    (scene, device): (&Arc<Scene>, &DeviceScene),
    settings: &Settings,
) -> Result<Method> {
    if device.caster_count == 0 || device.has_lights_without_extent {
        return Ok(Method::Hybrid);
    }
    let session = |method| Session::over(runtime, (scene.clone(), device.clone()), small(settings, method));
    let (mut hybrid, mut path) = (session(Method::Hybrid)?, session(Method::Path)?);
    let mut loss = 1.0;
    for index in 0..PASSES {
        hybrid.run_pass(index)?;
        path.run_pass(index)?;
        if index > 0 {
            let work = [hybrid.work_of_last_pass(), path.work_of_last_pass()];
            loss = shares::loss_by_second(&both(hybrid.film()?, path.film()?, index + 1), work);
            // Paths that look far ahead may not have found the caustics yet.
            if loss > FAR_AHEAD && loss.is_finite() {
                break;
            }
        }
    }
    Ok(if loss <= 1.0 { Method::Path } else { Method::Hybrid })
}

/// The settings of a small picture of the same shape.
fn small(settings: &Settings, method: Method) -> Settings {
    let pixels = f64::from(settings.pixels());
    let ratio = (f64::from(PIXELS) / pixels).min(1.0);
    let side = |length: u32| ((f64::from(length) * ratio.sqrt()) as u32).max(1);
    let photons = (f64::from(settings.photon_count()) * ratio).ceil() as u32;
    let (width, height) = (side(settings.width), side(settings.height));
    // What both have in common would otherwise hide what one of them has not found.
    let seed = if method == Method::Path { !settings.seed } else { settings.seed };
    let photons = Some(photons);
    let (eye_depth, photon_bounces) = (settings.eye_depth.min(DEPTH), settings.photon_bounces.min(DEPTH));
    let small = Settings { method, width, height, seed, photons, eye_depth, photon_bounces, ..settings.clone() };
    Settings { layers: false, count_work: true, ..small }
}

/// One film of both, each of so many passes.
fn both(first: Film, second: Film, passes: u64) -> Film {
    let mix = Mix { turns: Turns::always(Round { first: 1, second: 1 }), sums: second.sums, layers: second.layers };
    Film { passes: PassSet::of(0..2 * passes), mix: Some(mix), ..first }
}
