//! What a session knows about the errors of its film.

use std::f64::consts::PI;

use crate::film::error_estimate::{Bias, Model};
use crate::kernels::photon::Emission;
use crate::kernels::photon::Footprint;
use crate::render::pass::budget::PhotonBudget;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::{Estimator, Sampling, Scale, Settings};

/// The model of errors of a render with these settings, which estimates light by `estimator`.
pub fn of(settings: &Settings, estimator: Estimator, device: &DeviceScene, budget: &PhotonBudget) -> Model {
    let discs = budget.emissions.iter().map(|e| per_watt(e, f64::from(device.footprint_unit)));
    let discs = discs.fold(0.0, f64::max);
    Model {
        bias: bias(settings, estimator, budget),
        event: device.light_power.map(|power| power * device.greatest_share * discs / PI),
    }
}

fn bias(settings: &Settings, estimator: Estimator, budget: &PhotonBudget) -> Bias {
    let whole = matches!(settings.sampling, Sampling::Full)
        || matches!(settings.sampling, Sampling::Stochastic { scale: Scale::Unbiased, .. });
    if !settings.method.traits().estimates_density || budget.emissions.is_empty() {
        Bias::None
    } else if estimator == Estimator::Knn || matches!(settings.footprint, Footprint::Fixed(_)) || !whole {
        Bias::Unknown
    } else {
        Bias::Estimated
    }
}

/// Irradiance [1/m^2] within the footprint of one photon of the first pass, if the lights have one watt together: that
/// of a photon that went half the scene's radius `r`. Photons that went a shorter way are brighter, but few places get
/// them.
fn per_watt(emission: &Emission, r: f64) -> f64 {
    let n = f64::from(emission.count);
    let disc = |radius: f64| 1.0 / (n * PI * radius * radius);
    match emission.footprint {
        Footprint::Fixed(radius) => disc(radius.into()),
        Footprint::Density { max, .. } => disc(max.into()),
        // n isotropic photons at distance d are d sqrt(4 pi / n) apart (Fabianowski and Dingliana 2009, equation 9).
        Footprint::Differential => {
            let spacing = 0.5 * r * (4.0 * PI / n).sqrt();
            disc((f64::from(emission.smoothing) * spacing).min(f64::from(emission.largest) * r))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance of a photon of 100 per pass, whose footprint is `largest` scene radii at most.
    fn with_limit(largest: f32) -> f64 {
        let emission = Emission {
            count: 100,
            caustic: false,
            smoothing: 2.8,
            max_bounces: 8,
            footprint: Footprint::Differential,
            largest,
        };
        per_watt(&emission, 3.0)
    }

    #[test]
    fn the_event_follows_the_largest_footprint() {
        // The spacing of 100 photons is 0.18 scene radii at half a radius: the limit binds.
        let default = Settings::default().largest_footprint;
        let expected = 1.0 / (100.0 * PI * (f64::from(default) * 3.0).powi(2));
        assert!((with_limit(default) / expected - 1.0).abs() < 1e-12);
        assert!((with_limit(default / 2.0) / with_limit(default) - 4.0).abs() < 1e-12);
        assert!((with_limit(0.004) / with_limit(0.03) - 56.25).abs() < 1e-4);
        // A limit that does not bind changes nothing.
        assert_eq!(with_limit(1.0), with_limit(2.0));
    }
}
