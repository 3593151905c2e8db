//! Renders with the checks that hold for every render, and comparators.

use std::ops::{Deref, DerefMut};

use nephroid::low_level::check;
pub use nephroid::low_level::check::scenes::{from_above, parallel};
pub use nephroid::low_level::check::settings;
use nephroid::low_level::render::Settings;
use nephroid::low_level::scene::{self, Limits, Scene};

use super::device::runtime;
use super::{proof, repository};

/// A finished render that is as every render should be.
pub struct Shot(check::Shot);

impl Deref for Shot {
    type Target = check::Shot;
    fn deref(&self) -> &check::Shot {
        &self.0
    }
}

impl DerefMut for Shot {
    fn deref_mut(&mut self) -> &mut check::Shot {
        &mut self.0
    }
}

impl Shot {
    /// Renders the passes `first .. end`.
    pub fn take(scene: &Scene, settings: &Settings, passes: std::ops::Range<u64>) -> Self {
        // Validation messages end a pass with an error.
        let shot = check::Shot::take(runtime().device(), scene, settings, passes).expect("passes without a message");
        proof::ran(&shot.plan);
        assert_eq!(shot.not_finite(), 0, "numbers that are not finite, pixels rejected, photons refused");
        let energies = &shot.statistics.energies;
        assert!(shot.imbalance() < 1e-6, "light that is not accounted for: {energies:?}");
        let fired: Vec<_> = shot.statistics.counters.iter().filter(|(_, count)| *count > 0).collect();
        let s = &shot.statistics;
        println!(
            "{} passes, {} photons, {} deposits, {:.2} s; guards: {fired:?}; truncated: {} photons, {} eye paths",
            s.passes, s.photons, s.deposits, s.seconds, s.photons_truncated, s.eye_paths_truncated
        );
        Self(shot)
    }
}

/// Whether `found` is within `tolerance` (relative) of `expected`, with a message for the log.
pub fn close(found: f64, expected: f64, tolerance: f64) -> Result<(), String> {
    let relative = found / expected - 1.0;
    let message = format!("{found:.6}, expected {expected:.6}: off by {:+.4} %", relative * 100.0);
    println!("{message}");
    if relative.abs() <= tolerance { Ok(()) } else { Err(message) }
}

/// Fails unless `found` is within `tolerance` (relative) of `expected`.
pub fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    close(found, expected, tolerance).unwrap_or_else(|message| panic!("{what}: {message}"));
}

/// The first place where two renders differ, over all layers.
pub fn difference(a: &[u32], b: &[u32]) -> Option<usize> {
    if a.len() != b.len() { Some(a.len().min(b.len())) } else { (0..a.len()).find(|&i| a[i] != b[i]) }
}

/// Fails at the first place where two renders differ.
pub fn assert_same(found: &[u32], expected: &[u32], what: &str) {
    if let Some(at) = difference(found, expected) {
        let count = found.iter().zip(expected).filter(|(a, b)| a != b).count();
        let (a, b) = (f32::from_bits(found[at]), f32::from_bits(expected[at]));
        panic!("{what}: {count} of {} numbers differ, first number {at}: {a:e}, not {b:e}", found.len());
    }
}

/// The scene `assets/NAME.glb`.
pub fn asset(name: &str) -> Scene {
    scene::load(&repository(&format!("assets/{name}.glb")), &Limits::default()).expect("an asset")
}
