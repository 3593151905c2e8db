//! The photon map's tables: speed by builder and leaf size, photons per query, sizes of footprints.
//!
//! They repeat tables 1 to 3 of Fabianowski and Dingliana 2009 on any scene, for the first pass, whose footprints are
//! the largest.

use super::median;
use crate::error::Result;
use crate::graph::Runtime;
use crate::kernels::generated::Photon;
use crate::kernels::lbvh::COUNTED_LEAF;
use crate::render::{Estimator, Method, PhotonBuild, Session, Settings, automatic_leaf, coverage};
use crate::scene::Scene;

/// Leaf sizes that are compared.
pub const LEAF_SIZES: [u32; 5] = [1, 2, 4, 8, COUNTED_LEAF];

/// Percentiles of [`Radii`].
pub const PERCENTILES: [u32; 7] = [1, 5, 25, 50, 75, 95, 99];

/// Estimators whose queries are compared: the photon BVH, and the nearest photons as the baseline.
const QUERIED: [Estimator; 2] = [Estimator::Bvh, Estimator::Knn];

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

/// A pass with one kind of map (table 1).
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

/// One builder on a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct BuilderTimes {
    /// The builder.
    pub build: PhotonBuild,
    /// By leaf size, in the order of [`LEAF_SIZES`].
    pub leaves: Vec<LeafTime>,
}

impl BuilderTimes {
    /// Least of a time over all leaf sizes.
    pub fn best(&self, of: fn(&LeafTime) -> f64) -> f64 {
        self.leaves.iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// Speed with leaves of `leaf` photons as a share of the best leaf size's; `None` for a size that was not measured.
    pub fn share_of_best(&self, leaf: u32, of: fn(&LeafTime) -> f64) -> Option<f64> {
        self.leaves.iter().find(|time| time.leaf == leaf).map(|time| self.best(of) / of(time))
    }
}

/// What an estimator looks at (table 2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Queries {
    /// The estimator.
    pub estimator: Estimator,
    /// Photons tested, per pixel.
    pub tested: f64,
    /// Photons whose footprint held the eye hit, per pixel.
    pub accepted: f64,
    /// Least seconds of building and gathering.
    pub seconds: f64,
}

/// Semiaxes of the footprints of a class of photons (table 3).
#[derive(Debug, Clone, PartialEq)]
pub struct Radii {
    /// Caustic photons, or all others.
    pub caustic: bool,
    /// Photons of the class.
    pub photons: usize,
    /// Geometric means of the two semiaxes [scene units] at [`PERCENTILES`].
    pub mean: [f64; 7],
    /// Ratios of the longer to the shorter semiaxis at [`PERCENTILES`].
    pub ratio: [f64; 7],
}

/// What was measured on a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotonMapReport {
    /// Its file, or what it is.
    pub name: String,
    /// Photons stored.
    pub photons: usize,
    /// Sum of the footprints' areas over the area of all surfaces.
    pub coverage: f64,
    /// Leaf size that follows from it, by builder.
    pub automatic: [u32; 2],
    /// Table 1.
    pub builders: Vec<BuilderTimes>,
    /// Table 2.
    pub queries: Vec<Queries>,
    /// Table 3.
    pub radii: Vec<Radii>,
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
    let [width, height] = effort.size;
    let settings = Settings {
        width,
        height,
        photons: effort.photons,
        estimator: Some(Estimator::Bvh),
        leaf_photons: Some(LEAF_SIZES[0]),
        ..Settings::of(Method::Photons)
    };
    begin("footprints");
    let photons = {
        let mut session =
            Session::new(runtime.device(), scene.clone(), Settings { read_photons: true, ..settings.clone() })?;
        session.repeat_pass(0)?;
        session.photons()
    };
    let coverage = coverage(scene, &photons);
    let builders = [PhotonBuild::Linear, PhotonBuild::Vvh].map(|build| {
        builder_times(runtime, scene, &Settings { photon_build: build, ..settings.clone() }, (effort, &mut *begin))
    });
    begin("photons per query");
    let queries = QUERIED.map(|estimator| queries(runtime, scene, &settings, (estimator, effort.repeats)));
    Ok(PhotonMapReport {
        name: scene.path.display().to_string(),
        photons: photons.len(),
        coverage,
        automatic: [PhotonBuild::Linear, PhotonBuild::Vvh].map(|build| automatic_leaf(coverage, build)),
        builders: builders.into_iter().collect::<Result<_>>()?,
        queries: queries.into_iter().collect::<Result<_>>()?,
        radii: [true, false].into_iter().filter_map(|caustic| radii(&photons, caustic)).collect(),
    })
}

/// Times of one builder; all leaf sizes in turn, so that a disturbance from outside meets all of them.
fn builder_times(
    runtime: &Runtime,
    scene: &Scene,
    settings: &Settings,
    (effort, begin): (PhotonMapEffort, &mut dyn FnMut(&str)),
) -> Result<BuilderTimes> {
    let build = settings.photon_build;
    let mut sessions = Vec::new();
    for leaf in LEAF_SIZES {
        begin(&format!("{build:?} build, leaves of {leaf}: preparing"));
        let settings = Settings { leaf_photons: Some(leaf), ..settings.clone() };
        let mut session = Session::new(runtime.device(), scene.clone(), settings)?;
        session.repeat_pass(0)?;
        sessions.push((leaf, session, vec![]));
    }
    begin(&format!("{build:?} build"));
    for _ in 0..effort.repeats.max(1) {
        for (_, session, times) in &mut sessions {
            session.repeat_pass(0)?;
            times.push(map_seconds(session));
        }
    }
    let leaves = sessions.into_iter().map(|(leaf, _, times)| leaf_time(leaf, &times)).collect();
    Ok(BuilderTimes { build, leaves })
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

fn queries(
    runtime: &Runtime,
    scene: &Scene,
    settings: &Settings,
    (estimator, repeats): (Estimator, u32),
) -> Result<Queries> {
    let settings = Settings { estimator: Some(estimator), count_pairs: true, ..settings.clone() };
    let pixels = f64::from(settings.pixels());
    let mut session = Session::new(runtime.device(), scene.clone(), settings.clone())?;
    session.repeat_pass(0)?;
    let counts = session.statistics()?;
    let per_pixel = |count: u64| count as f64 / pixels;
    let mut timed = Session::new(runtime.device(), scene.clone(), Settings { count_pairs: false, ..settings.clone() })?;
    let mut seconds = f64::INFINITY;
    for _ in 0..=repeats.max(1) {
        timed.repeat_pass(0)?;
        seconds = seconds.min(map_seconds(&timed).iter().sum());
    }
    let (tested, accepted) = (per_pixel(counts.pairs_tested), per_pixel(counts.pairs_accepted));
    Ok(Queries { estimator, tested, accepted, seconds })
}

/// Table 3 of one class; `None` where it has no photons.
fn radii(photons: &[Photon], caustic: bool) -> Option<Radii> {
    let of_class = photons.iter().filter(|photon| (f32::from_bits(photon.d[3]) < 0.0) == caustic);
    let axes: Vec<[f64; 2]> = of_class.map(semiaxes).collect();
    let percentiles = |of: fn(&[f64; 2]) -> f64| {
        let mut values: Vec<f64> = axes.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        PERCENTILES.map(|percent| values[(values.len() - 1) * percent as usize / 100])
    };
    (!axes.is_empty()).then(|| Radii {
        caustic,
        photons: axes.len(),
        mean: percentiles(|[longer, shorter]| (longer * shorter).sqrt()),
        ratio: percentiles(|[longer, shorter]| longer / shorter),
    })
}

/// Longer and shorter semiaxis of a footprint: a photon stores vectors of their reciprocal lengths.
fn semiaxes(photon: &Photon) -> [f64; 2] {
    let length = |words: [u32; 4]| {
        let squares = words[..3].iter().map(|&word| f64::from(f32::from_bits(word)).powi(2));
        1.0 / squares.sum::<f64>().sqrt()
    };
    let (c, d) = (length(photon.c), length(photon.d));
    [c.max(d), c.min(d)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photon(longer: f32, shorter: f32, caustic: bool) -> Photon {
        let words = |v: [f32; 4]| v.map(f32::to_bits);
        let density = 1.0 / (std::f32::consts::PI * longer * shorter);
        Photon {
            a: [0; 4],
            b: [0; 4],
            c: words([0.0, 1.0 / longer, 0.0, 9.0]),
            d: words([1.0 / shorter, 0.0, 0.0, if caustic { -density } else { density }]),
        }
    }

    #[test]
    fn radii_by_class() {
        let mut photons: Vec<Photon> = (1..=101).map(|i| photon(4.0 * i as f32, i as f32, false)).collect();
        photons.push(photon(3.0, 3.0, true));
        let global = radii(&photons, false).expect("photons");
        assert_eq!(global.photons, 101);
        for (percent, (mean, ratio)) in PERCENTILES.iter().zip(global.mean.iter().zip(global.ratio)) {
            assert!((mean / f64::from(2 * (percent + 1)) - 1.0).abs() < 1e-6, "{percent}: {mean}");
            assert!((ratio - 4.0).abs() < 1e-5);
        }
        assert_eq!(radii(&photons, true).map(|r| r.photons), Some(1));
        assert_eq!(radii(&photons[..5], true), None);
    }

    #[test]
    fn shares_of_the_best() {
        let time = |leaf, total| LeafTime { leaf, build: 1.0, gather: total - 1.0, total, noise: 1.0 };
        let times = BuilderTimes { build: PhotonBuild::Vvh, leaves: vec![time(4, 2.5), time(8, 2.0)] };
        assert_eq!(times.share_of_best(4, |t| t.total), Some(0.8));
        assert_eq!(times.share_of_best(8, |t| t.gather), Some(1.0));
        assert_eq!(times.share_of_best(16, |t| t.total), None);
        assert_eq!(leaf_time(2, &[[1.0, 4.0], [2.0, 2.0], [1.5, 4.0]]).total, 4.0);
    }
}
