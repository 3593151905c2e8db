//! Which photons a pass emits.

use crate::kernels::photon::Emission;
use crate::render::scene::upload::DeviceScene;
use crate::render::settings::Settings;

/// Which photons a pass emits.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotonBudget {
    pub emissions: Vec<Emission>,
    /// Deposits that the map has room for.
    pub capacity: u32,
}

impl PhotonBudget {
    /// Photons of a pass. There are none if the method emits none or the scene has no lights or surfaces; there are
    /// caustic photons only where something can focus light, and others only if the method uses them.
    pub fn of(device: &DeviceScene, settings: &Settings) -> Self {
        let total = settings.photon_count();
        let none = device.light_count == 0 || device.triangle_count == 0 || total == 0;
        let traits = settings.method.traits();
        if none || !traits.emits_photons {
            return Self { emissions: vec![], capacity: 0 };
        }
        let global = |count: u32| Emission {
            count,
            caustic: false,
            smoothing: settings.global_smoothing,
            max_bounces: settings.photon_bounces,
            footprint: settings.footprint,
            largest: settings.largest_footprint,
        };
        let caustic_count = total / 2;
        let focuses = device.caster_count > 0 && caustic_count > 0;
        let caustic = focuses.then(|| Emission {
            count: caustic_count,
            caustic: true,
            smoothing: settings.caustic_smoothing,
            max_bounces: settings.photon_bounces.min(settings.eye_depth),
            footprint: settings.footprint,
            largest: settings.largest_footprint,
        });
        let others = traits.emits_global_photons.then(|| global(if focuses { total - caustic_count } else { total }));
        let emissions: Vec<Emission> = caustic.into_iter().chain(others).collect();
        if emissions.is_empty() {
            return Self { emissions, capacity: 0 };
        }
        let capacity = u64::from(total) * 2;
        Self { emissions, capacity: capacity.min(u64::from(device.most_deposits)) as u32 }
    }
}
