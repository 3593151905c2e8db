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
    /// caustic photons only where something can focus light.
    pub fn of(device: &DeviceScene, settings: &Settings) -> Self {
        let total = settings.photon_count();
        let none = device.light_count == 0 || device.triangle_count == 0 || total == 0;
        if none || !settings.method.traits().emits_photons {
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
        let emissions = if device.caster_count > 0 && caustic_count > 0 {
            let caustic = Emission {
                count: caustic_count,
                caustic: true,
                smoothing: settings.caustic_smoothing,
                max_bounces: settings.photon_bounces.min(settings.eye_depth),
                footprint: settings.footprint,
                largest: settings.largest_footprint,
            };
            vec![caustic, global(total - caustic_count)]
        } else {
            vec![global(total)]
        };
        let capacity = u64::from(total) * 2;
        Self { emissions, capacity: capacity.min(u64::from(device.most_deposits)) as u32 }
    }
}
