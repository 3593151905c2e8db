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
/// Its passes.
const PASSES: u64 = 6;

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
    let mut films = vec![];
    let mut work = [0.0; 2];
    for (method, work) in [Method::Hybrid, Method::Path].into_iter().zip(&mut work) {
        let mut session = Session::over(runtime, (scene.clone(), device.clone()), small(settings, method))?;
        (0..PASSES).try_for_each(|index| session.run_pass(index))?;
        *work = session.work_of_last_pass();
        films.push(session.film()?);
    }
    let film = both(films).expect("two films");
    Ok(if shares::is_second_better(&film, work) { Method::Path } else { Method::Hybrid })
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
    Settings { method, width, height, seed, photons, layers: false, count_work: true, ..settings.clone() }
}

/// One film of both, each of as many passes.
fn both(mut films: Vec<Film>) -> Option<Film> {
    let (second, first) = (films.pop()?, films.pop()?);
    let mix = Mix { turns: Turns::always(Round { first: 1, second: 1 }), sums: second.sums, layers: second.layers };
    Some(Film { passes: PassSet::of(0..2 * PASSES), mix: Some(mix), ..first })
}
