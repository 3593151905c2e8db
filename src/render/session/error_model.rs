//! What a session knows about the errors of its film.

use std::f64::consts::PI;

use crate::film::error_estimate::{Bias, Model};
use crate::kernels::photon::Emission;
use crate::kernels::photon::Footprint;
use crate::render::pass::budget::PhotonBudget;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::{Estimator, Method, Sampling, Scale, Settings};

/// Of a render with these settings, which estimates light by `estimator`.
pub fn of(settings: &Settings, estimator: Estimator, device: &DeviceScene, budget: &PhotonBudget) -> Model {
    let discs = budget.emissions.iter().map(|e| per_watt(e, f64::from(device.radius)));
    let discs = discs.fold(0.0, f64::max);
    Model { bias: bias(settings, estimator, budget), event: device.light_power.map(|power| power * discs / PI) }
}

fn bias(settings: &Settings, estimator: Estimator, budget: &PhotonBudget) -> Bias {
    let whole = matches!(settings.sampling, Sampling::Full)
        || matches!(settings.sampling, Sampling::Stochastic { scale: Scale::Unbiased, .. });
    if settings.method != Method::Photons || budget.emissions.is_empty() {
        Bias::None
    } else if estimator == Estimator::Knn || matches!(settings.footprint, Footprint::Fixed(_)) || !whole {
        Bias::Unknown
    } else {
        Bias::Estimated
    }
}

/// Limits of a footprint's semiaxes in scene radii, as in `glsl/lib/footprint.glsl`.
const MAX_RADIUS: f64 = 0.03;

/// Irradiance within the footprint of one photon of the first pass, if the lights have one watt together: that of a photon that
/// went half the scene's radius `r`. Shorter ways give brighter ones, but end in few places.
fn per_watt(emission: &Emission, r: f64) -> f64 {
    let n = f64::from(emission.count);
    let disc = |radius: f64| 1.0 / (n * PI * radius * radius);
    match emission.footprint {
        Footprint::Fixed(radius) => disc(radius.into()),
        Footprint::Density { max, .. } => disc(max.into()),
        // The spacing of n isotropic photons at distance d is d sqrt(4 pi / n) (Fabianowski and Dingliana 2009, equation 9).
        Footprint::Differential => {
            let spacing = 0.5 * r * (4.0 * PI / n).sqrt();
            disc((f64::from(emission.smoothing) * spacing).min(MAX_RADIUS * r))
        }
    }
}
