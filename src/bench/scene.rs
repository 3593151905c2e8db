//! Trees, rays, photons and gathering on one scene.

use std::time::Instant;

use super::rays::rays;
use super::{Effort, Floor, MEASURED, Rate, median, time};
use crate::error::Result;
use crate::graph::Runtime;
use crate::kernels::bvh_host::{HostBvh, build_sah};
use crate::kernels::generated::Aabb;
use crate::kernels::{Items, lbvh};
use crate::render::{Method, Session, Settings};
use crate::scene::{Scene, World};

/// Bytes per box of a tree built on the device, its sort included.
const BUILD_BYTES: f64 = 340.0;
/// Instructions to test one photon: Lambert, and with every lobe.
const PAIR_INSTRUCTIONS: [f64; 2] = [24.0, 80.0];

/// What was measured on a scene.
#[derive(Debug, Clone)]
pub struct SceneReport {
    /// Its file, or a description of a generated one.
    pub name: String,
    /// Triangles.
    pub triangles: usize,
    /// The measurements.
    pub rates: Vec<Rate>,
    /// Most bytes that a render held in buffers of the device, staging included.
    pub peak_bytes: u64,
}

/// Measures on `scene`, on devices opened by `open`: one for trees and rays, a fresh one for the render, so that its
/// peak of memory is its own. `begin` hears what comes next.
///
/// # Errors
/// Those of the devices.
pub fn scene(
    open: &dyn Fn() -> Result<Runtime>,
    effort: Effort,
    scene: &Scene,
    begin: &mut dyn FnMut(&str),
) -> Result<SceneReport> {
    let runtime = open()?;
    let world = World::of(scene);
    begin("tree on the host");
    let (tree, host) = build_on_host(&world, effort);
    begin("tree on the device");
    let mut rates = vec![host, build_on_device(&runtime, &world, effort)?];
    rates.extend(rays(&runtime, effort, (scene, &world), &tree, begin)?);
    drop((tree, runtime));
    let runtime = open()?;
    rates.extend(photons(&runtime, scene, effort, begin)?);
    let peak_bytes = runtime.device().memory().peak;
    begin("pairs");
    rates.extend(pairs(&runtime, scene, effort)?);
    let name = scene.path.display().to_string();
    Ok(SceneReport { name, triangles: world.triangles.len(), rates, peak_bytes })
}

fn build_on_host(world: &World, effort: Effort) -> (HostBvh, Rate) {
    let mut tree = HostBvh::default();
    let runs = (0..effort.repeats.clamp(1, 3)).map(|_| {
        let begin = Instant::now();
        tree = build_sah(&world.positions, &world.triangles);
        begin.elapsed().as_secs_f64()
    });
    let seconds = median(runs.collect());
    let note = format!("all threads of the CPU, depth {}", tree.depth);
    let items = world.triangles.len() as u64;
    let rate = Rate { name: "SAH tree, host", items, unit: "triangles", seconds, floor: Floor::Unknown, note };
    (tree, rate)
}

fn build_on_device(runtime: &Runtime, world: &World, effort: Effort) -> Result<Rate> {
    let boxes: Vec<Aabb> = world
        .triangles
        .iter()
        .map(|corners| {
            let points = corners.map(|corner| world.positions[corner as usize]);
            let extreme = |pick: fn(f32, f32) -> f32| {
                std::array::from_fn(|k| points[1..].iter().fold(points[0][k], |x, p| pick(x, p[k])))
            };
            Aabb { min: extreme(f32::min), max: extreme(f32::max) }
        })
        .collect();
    let input = runtime.persistent_from("boxes", &boxes)?;
    let options = lbvh::Options { leaf_items: 1, fences: runtime.device().loop_limit().is_none() };
    let seconds = time(runtime, effort.repeats, |g| {
        let boxes = g.import_read(&input);
        let tree = g.scope(MEASURED, |g| lbvh::build(g, Items::All, &boxes, options));
        g.keep(&tree.nodes);
    })?;
    let (items, floor) = (boxes.len() as u64, Floor::Bytes(BUILD_BYTES));
    Ok(Rate { name: "LBVH, device", items, unit: "triangles", seconds, floor, note: String::new() })
}

fn settings(effort: Effort, count_pairs: bool) -> Settings {
    Settings { width: effort.size[0], height: effort.size[1], count_pairs, ..Settings::of(Method::Photons) }
}

/// Device seconds of the scopes with one of these names in the last pass.
pub(super) fn seconds_in(session: &Session, names: &[&str]) -> f64 {
    let timings = session.timings();
    let chosen = timings.iter().filter(|t| t.depth == 0 && names.contains(&t.name.as_str()));
    chosen.map(|t| (t.end_ns - t.start_ns) as f64 * 1e-9).fold(0.0, |sum, seconds| sum + seconds)
}

/// Photons from emission to deposit, the photon map, and whole passes. None where the scene has no photons or the
/// device no timestamps.
fn photons(runtime: &Runtime, scene: &Scene, effort: Effort, begin: &mut dyn FnMut(&str)) -> Result<Vec<Rate>> {
    begin("photons: preparing");
    let mut session = Session::new(runtime.device(), scene.clone(), settings(effort, false))?;
    session.repeat_pass(0)?;
    begin("photons");
    let first = session.statistics()?;
    let (mut tracing, mut building, mut whole) = (vec![], vec![], vec![]);
    for index in 0..effort.repeats.max(1) {
        let start = Instant::now();
        session.run_pass(1 + u64::from(index))?;
        whole.push(start.elapsed().as_secs_f64());
        tracing.push(seconds_in(&session, &["caustic photons", "global photons"]));
        building.push(seconds_in(&session, &["photon map"]));
    }
    let last = session.statistics()?;
    let runs = last.passes - first.passes;
    let (emitted, stored) = ((last.photons - first.photons) / runs, (last.deposits - first.deposits) / runs);
    let rate = |name, items, unit, times: Vec<f64>, floor, note| Rate {
        name,
        items,
        unit,
        seconds: median(times),
        floor,
        note,
    };
    let pixels = u64::from(effort.size[0]) * u64::from(effort.size[1]);
    let of = format!("{}x{}, {emitted} photons", effort.size[0], effort.size[1]);
    let (passes, planning) = (session.plan_passes() as u64, vec![session.planning_seconds()]);
    let rates = vec![
        rate("plan, host", passes, "passes", planning, Floor::Unknown, "once for a session".into()),
        rate("photons traced", emitted, "photons", tracing, Floor::Unknown, format!("{stored} stored")),
        rate("photon map", stored, "photons", building, Floor::Bytes(BUILD_BYTES), String::new()),
        rate("whole pass", pixels, "pixels", whole, Floor::Unknown, of),
    ];
    Ok(rates.into_iter().filter(|rate| rate.items > 0 && rate.seconds > 0.0).collect())
}

/// Pairs of eye hit and photon: counted in one render, timed in another one that does not count.
fn pairs(runtime: &Runtime, scene: &Scene, effort: Effort) -> Result<Vec<Rate>> {
    let passes = 1..=u64::from(effort.repeats.clamp(1, 3));
    let mut counts = Vec::new();
    let mut counting = Session::new(runtime.device(), scene.clone(), settings(effort, true))?;
    let mut before = [0, 0];
    for index in passes.clone() {
        counting.run_pass(index)?;
        let s = counting.statistics()?;
        counts.push([s.pairs_tested - before[0], s.pairs_accepted - before[1]]);
        before = [s.pairs_tested, s.pairs_accepted];
    }
    drop(counting);
    let mut timed = Session::new(runtime.device(), scene.clone(), settings(effort, false))?;
    timed.repeat_pass(0)?;
    let glossy = timed.device_scene().variant.gathers_glossy;
    let mut runs = Vec::new();
    for (index, count) in passes.zip(counts) {
        timed.run_pass(index)?;
        runs.push((seconds_in(&timed, &["gather"]), count));
    }
    let speed = |(seconds, [tested, _]): &(f64, [u64; 2])| *tested as f64 / seconds;
    runs.sort_by(|a, b| speed(a).total_cmp(&speed(b)));
    let (seconds, [tested, accepted]) = runs[runs.len() / 2];
    if tested == 0 || seconds <= 0.0 {
        return Ok(vec![]);
    }
    let floor = Floor::Instructions(PAIR_INSTRUCTIONS[usize::from(glossy)]);
    let note = if glossy { "with every lobe" } else { "Lambert" };
    let rate = |name, items, floor, note: String| Rate { name, items, unit: "pairs", seconds, floor, note };
    let share = format!("{:.0} % of those tested", 100.0 * accepted as f64 / tested as f64);
    Ok(vec![rate("pairs tested", tested, floor, note.into()), rate("pairs accepted", accepted, Floor::Unknown, share)])
}
