//! Renders with the checks that hold for every render, and comparators.

use nephroid::low_level::film::accumulate::Film;
use nephroid::low_level::film::error_estimate::Model;
use nephroid::low_level::picture::image::Picture;
use nephroid::low_level::render::{Session, Settings, Statistics};
use nephroid::low_level::scene::{self, Camera, Limits, Projection, Scene};

use super::device::runtime;
use super::{proof, repository};

/// A finished render.
pub struct Shot {
    /// Beauty and all layers.
    pub picture: Picture,
    /// Counts, guards among them.
    pub statistics: Statistics,
    /// Sums and sums of squares per pixel.
    pub moments: Vec<[f64; 9]>,
    /// The film itself.
    pub film: Film,
    /// What is known of the render besides its film.
    pub model: Model,
    /// Triangles left out of the tree.
    pub skipped: u32,
    /// Lights that photons may start from.
    pub lights: u32,
}

/// Settings of `width` x `height` pixels with all layers and `photons` photons a pass.
pub fn settings(width: u32, height: u32, photons: u32) -> Settings {
    Settings {
        width,
        height,
        photons: Some(photons),
        layers: true,
        // Wider than the defaults: these renders have few photons, and their answers are smooth.
        caustic_smoothing: 3.0,
        global_smoothing: 4.0,
        photon_bounces: 16,
        eye_depth: 12,
        ..Settings::default()
    }
}

impl Shot {
    /// Renders the passes `first .. end`.
    pub fn take(scene: &Scene, settings: &Settings, passes: std::ops::Range<u64>) -> Self {
        let runtime = runtime();
        let mut session = Session::new(runtime.device(), scene.clone(), settings.clone()).expect("a session");
        for pass in passes {
            // Validation messages end a pass with an error.
            session.run_pass(pass).expect("a pass without validation message");
        }
        proof::ran(session.plan_text());
        let shot = Self {
            picture: session.picture().expect("a picture"),
            statistics: session.statistics().expect("counts"),
            moments: session.moments().expect("sums"),
            film: session.film().expect("the film"),
            model: session.error_model(),
            skipped: session.device_scene().skipped_triangles,
            lights: session.device_scene().light_count,
        };
        shot.check();
        shot
    }

    /// What holds for every render.
    fn check(&self) {
        assert_eq!(unfinished(&self.picture), None, "a number that is not finite");
        assert!(self.moments.iter().flatten().all(|x| x.is_finite()), "a sum that is not finite");
        assert_eq!(self.statistics.rejected, 0, "pixels rejected as not finite");
        assert_eq!(self.guard("photons_not_finite"), 0, "photons that are not finite");
        let fired: Vec<_> = self.statistics.counters.iter().filter(|(_, count)| *count > 0).collect();
        let s = &self.statistics;
        println!(
            "{} passes, {} photons, {} deposits, {:.2} s; guards: {fired:?}; truncated: {} photons, {} eye paths",
            s.passes, s.photons, s.deposits, s.seconds, s.photons_truncated, s.eye_paths_truncated
        );
    }

    /// How often a guard fired.
    pub fn guard(&self, name: &str) -> u64 {
        let counter = self.statistics.counters.iter().find(|(known, _)| *known == name);
        counter.unwrap_or_else(|| panic!("no guard is called {name}")).1
    }

    /// The red channel of a layer.
    pub fn red(&self, layer: &str) -> Vec<f64> {
        let layer = self.picture.layer(layer).expect("a layer");
        layer.data.chunks(3).map(|pixel| f64::from(pixel[0])).collect()
    }

    /// Mean of the red channel of a layer.
    pub fn mean(&self, layer: &str) -> f64 {
        let red = self.red(layer);
        red.iter().sum::<f64>() / red.len() as f64
    }

    /// The bits of all layers, to compare renders exactly.
    pub fn bits(&self) -> Vec<u32> {
        self.picture.layers.iter().flat_map(|layer| layer.data.iter().map(|x| x.to_bits())).collect()
    }
}

/// The first layer and number that is not finite. A depth is infinite where nothing was seen.
pub fn unfinished(picture: &Picture) -> Option<(String, usize)> {
    picture.layers.iter().find_map(|layer| {
        let unseen = |x: f32| layer.name == "depth" && x == f32::INFINITY;
        let bad = |x: &f32| !(x.is_finite() || unseen(*x));
        layer.data.iter().position(bad).map(|at| (layer.name.clone(), at))
    })
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

/// A camera that looks along `forward` in parallel; the image shows `2 height` scene units from bottom to top.
pub fn parallel(position: [f32; 3], forward: [f32; 3], up: [f32; 3], height: f32) -> Camera {
    let target = std::array::from_fn(|k| position[k] + forward[k]);
    let camera = Camera::look_at(position, target, up, 1.0);
    Camera { position, projection: Projection::Orthographic { xmag: height, ymag: height }, ..camera }
}

/// A parallel camera that looks down at the floor; the top of the image is -z.
pub fn from_above([x, y, z]: [f32; 3], height: f32) -> Camera {
    parallel([x, y, z], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], height)
}

/// The scene `assets/NAME.glb`.
pub fn asset(name: &str) -> Scene {
    scene::load(&repository(&format!("assets/{name}.glb")), &Limits::default()).expect("an asset")
}
