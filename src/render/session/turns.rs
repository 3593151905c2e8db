//! Methods that take turns: whose turn a pass is, and the settings of the passes of the other method.

use crate::film::mix::Turns;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::{Estimator, Method, PhotonBuild, Sampling, Settings};

/// Turns that give both methods about half of the time: where paths gather photons, too, a pass of theirs takes as long
/// as one of photons, elsewhere a third of it.
pub(super) fn turns(device: &DeviceScene) -> Turns {
    Turns { first: 1, second: if device.caster_count > 0 { 1 } else { 3 } }
}

/// The settings of the passes of paths, for a render with these.
pub(super) fn settings_of_paths(settings: &Settings) -> Settings {
    // What works in the picture does not serve paths that gather anywhere.
    let anywhere = [Estimator::Bvh, Estimator::Hash, Estimator::Knn, Estimator::Brute];
    Settings {
        method: Method::Hybrid,
        estimator: settings.estimator.filter(|estimator| anywhere.contains(estimator)),
        sampling: Sampling::Full,
        photon_build: PhotonBuild::Linear,
        ..settings.clone()
    }
}
