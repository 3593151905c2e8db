//! How many photons a leaf of the photon map holds: T_auto of Fabianowski and Dingliana 2009, section 5.3.

use super::budget::PhotonBudget;
use super::content::Content;
use super::plan::plan_survey;
use crate::error::Result;
use crate::graph::Runtime;
use crate::kernels::generated::{Pass, Photon};
use crate::kernels::lbvh::COUNTED_LEAF;
use crate::render::scene::host::surface_area;
use crate::render::settings::{LEAST_LEAF, PhotonBuild};
use crate::scene::{Scene, World};

/// Photons in a leaf for each photon that a point of the scene meets on average. The paper states no constant; this one
/// is fitted to the times of building and gathering (docs/estimators.md). The host's builder saves more by larger
/// leaves.
fn leaf_per_coverage(build: PhotonBuild) -> f64 {
    match build {
        PhotonBuild::Linear => 0.4,
        PhotonBuild::Vvh => 1.0,
    }
}

/// Photons of the largest class in a survey.
const SURVEY_PHOTONS: u32 = 4096;

/// The leaf size for a `coverage`, the sum of the footprints' areas over the area of all surfaces: proportional, a
/// power of two, within what serves well.
pub fn automatic(coverage: f64, build: PhotonBuild) -> u32 {
    let wanted = leaf_per_coverage(build) * coverage;
    let mut leaf = LEAST_LEAF;
    // The nearest power of two by ratio; NaN, where nothing has an area, stays at the least.
    while leaf < COUNTED_LEAF && wanted > f64::from(leaf) * std::f64::consts::SQRT_2 {
        leaf *= 2;
    }
    leaf
}

/// Sum of the areas of the photons' footprints over the area of the scene's triangles.
pub fn coverage(scene: &Scene, photons: &[Photon]) -> f64 {
    footprints(photons) / surface_area(&World::of(scene))
}

/// Sum of the areas of the photons' footprints.
fn footprints(photons: &[Photon]) -> f64 {
    photons.iter().map(|p| 1.0 / f64::from(f32::from_bits(p.d[3]).abs())).sum()
}

/// What a survey of a few photons says of a session's passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// Photons in a leaf of the map.
    pub leaf: u32,
    /// Photons that a point of the scene meets on average, in the first pass.
    pub coverage: f64,
}

/// The leaf size of a session to which nobody said any; `None` where there is no tree.
///
/// # Errors
/// Those of the device.
pub fn chosen(runtime: &Runtime, content: Content<'_>) -> Result<Option<Survey>> {
    let budget = PhotonBudget::of(content.device, content.settings);
    if !content.has_photon_tree(&budget) {
        return Ok(None);
    }
    let coverage = survey(runtime, content, &budget)?;
    Ok(Some(Survey { leaf: automatic(coverage, content.settings.photon_build), coverage }))
}

/// Coverage of the first pass, estimated by fewer photons with footprints of the same size: depends on scene and
/// settings only.
///
/// # Errors
/// Those of the device.
fn survey(runtime: &Runtime, content: Content<'_>, budget: &PhotonBudget) -> Result<f64> {
    let most = budget.emissions.iter().map(|emission| emission.count).max().unwrap_or(0);
    let ratio = (f64::from(SURVEY_PHOTONS) / f64::from(most.max(1))).min(1.0);
    let mut small = budget.clone();
    for emission in &mut small.emissions {
        emission.count = ((f64::from(emission.count) * ratio).ceil() as u32).max(1);
        // Spacings are larger by the root of what is left out.
        emission.smoothing *= ratio.sqrt() as f32;
    }
    small.capacity = small.capacity.min(8 * SURVEY_PHOTONS);
    let (planned, photons) = plan_survey(content, &small);
    let mut executable = runtime.prepare(&planned.plan)?;
    executable.write(&planned.pass, &[Pass { index: 0, seed: content.settings.seed, radius_scale: 1.0, reserved: 0 }]);
    executable.run()?;
    let read = |word| executable.read(word)[0];
    let stored = planned.reports.deposits.as_ref().map_or(0, read);
    let lost = planned.reports.overflow.as_ref().map_or(0, read);
    let mut photons = executable.read(&photons);
    photons.truncate(stored as usize);
    let share = f64::from(stored) / (f64::from(stored) + f64::from(lost)).max(1.0);
    Ok(footprints(&photons) / content.device.surface_area / (share * ratio))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_grow_with_the_overlap_and_stay_within_the_encoding() {
        let linear = |coverage| automatic(coverage, PhotonBuild::Linear);
        let sizes: Vec<u32> = (-4..20).map(|i| linear(2f64.powi(i))).collect();
        assert!(sizes.is_sorted() && sizes.iter().all(|size| size.is_power_of_two()));
        assert_eq!((sizes[0], sizes[23]), (LEAST_LEAF, COUNTED_LEAF));
        assert_eq!([11.0, 11.5].map(|leaf| linear(leaf / 0.4)), [8, 16]);
        assert_eq!([11.0, 11.5].map(|leaf| automatic(leaf, PhotonBuild::Vvh)), [8, 16]);
        for odd in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(linear(odd), LEAST_LEAF);
        }
        assert_eq!(linear(f64::INFINITY), COUNTED_LEAF);
    }
}
