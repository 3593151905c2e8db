//! The photon map's tables: speed by leaf size and builder, and the sizes of footprints.
//!
//! They repeat tables 1 and 3 of Fabianowski and Dingliana 2009 on any scene.

use super::median;
use crate::error::Result;
use crate::graph::Runtime;
use crate::kernels::generated::Photon;
use crate::render::{Session, Settings};
use crate::scene::Scene;

/// Leaf sizes that are compared.
pub const LEAF_SIZES: [u32; 5] = [1, 2, 4, 8, 16];

/// Pixels, photons, and runs of each measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PhotonMapEffort {
    /// Size of the picture.
    pub size: [u32; 2],
    /// Photons of a pass; `None` for the renderer's choice.
    pub photons: Option<u32>,
    /// Runs of each measurement that count, at least 1.
    pub repeats: u32,
}

/// A pass with one kind of map.
#[derive(Debug, Clone, PartialEq)]
pub struct LeafTime {
    /// Photons in a leaf at most.
    pub leaf: u32,
    /// Least seconds of building.
    pub build: f64,
    /// Least seconds of gathering.
    pub gather: f64,
    /// Least seconds of building and gathering in one pass.
    pub total: f64,
    /// Median of the same over the least: 1 without noise.
    pub noise: f64,
}

/// What was measured on a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotonMapReport {
    /// Its file, or what it is.
    pub name: String,
    /// Photons stored.
    pub photons: u64,
    /// Sum of the footprints' areas over the area of all surfaces.
    pub coverage: f64,
    /// Time by leaf size.
    pub leaves: Vec<LeafTime>,
}

/// Area of a photon's footprint, in square scene units.
pub fn footprint_area(photon: &Photon) -> f64 {
    1.0 / f64::from(f32::from_bits(photon.d[3]).abs())
}

/// Measures on `scene`. `begin` hears what comes next.
///
/// # Errors
/// Those of the device.
pub fn photon_map(
    runtime: &Runtime,
    scene: &Scene,
    effort: PhotonMapEffort,
    begin: &mut dyn FnMut(&str),
) -> Result<PhotonMapReport> {
    let settings =
        Settings { width: effort.size[0], height: effort.size[1], photons: effort.photons, ..Settings::default() };
    begin("footprints");
    let mut session = Session::new(runtime, scene.clone(), Settings { read_photons: true, ..settings.clone() })?;
    session.run_pass(0)?;
    let photons = session.photons();
    drop(session);
    let area: f64 = photons.iter().map(footprint_area).sum();
    let mut sessions = Vec::new();
    for leaf in LEAF_SIZES {
        begin(&format!("preparing leaves of {leaf}"));
        let settings = Settings { leaf_photons: Some(leaf), ..settings.clone() };
        let mut session = Session::new(runtime, scene.clone(), settings)?;
        session.run_pass(0)?;
        sessions.push((leaf, session, vec![]));
    }
    // In turn, so that a disturbance from outside meets all of them.
    for run in 0..effort.repeats.max(1) {
        begin(&format!("run {run}"));
        for (_, session, times) in &mut sessions {
            session.run_pass(0)?;
            times.push(map_seconds(session));
        }
    }
    Ok(PhotonMapReport {
        name: scene.path.display().to_string(),
        photons: photons.len() as u64,
        coverage: area / surface_area(scene),
        leaves: sessions.into_iter().map(|(leaf, _, times)| leaf_time(leaf, &times)).collect(),
    })
}

fn leaf_time(leaf: u32, times: &[[f64; 2]]) -> LeafTime {
    let least = |of: fn(&[f64; 2]) -> f64| times.iter().map(of).fold(f64::INFINITY, f64::min);
    let total = least(|[build, gather]| build + gather);
    let middle = median(times.iter().map(|[build, gather]| build + gather).collect());
    LeafTime { leaf, build: least(|t| t[0]), gather: least(|t| t[1]), total, noise: middle / total }
}

/// Seconds of building and of gathering in the last pass.
fn map_seconds(session: &Session) -> [f64; 2] {
    let timings = session.timings();
    ["photon map", "gather"].map(|name| {
        let scopes = timings.iter().filter(|t| t.depth == 0 && t.name == name);
        scopes.map(|t| (t.end_ns - t.start_ns) as f64 * 1e-9).sum()
    })
}

/// Area of all triangles, in square scene units.
fn surface_area(scene: &Scene) -> f64 {
    let geometry = &scene.geometry;
    let area = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|i| glam::Vec3::from(geometry.positions[i as usize]).as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    };
    geometry.triangles.iter().map(area).filter(|area| area.is_finite()).sum()
}
