//! nephroid: a progressive photon-mapping renderer on Vulkan compute.
//!
//! A [`Scene`] is loaded from a glTF file ([`Scene::load`]) or built by hand. A [`Session`] renders it on a
//! [`Device`] with [`Settings`], pass by pass: each pass is a complete picture of its own, and the [`Film`] is the sum
//! of all passes. The [`Picture`] is the mean of the film. [`Session::update`] changes camera, lights, materials and
//! geometry between passes, and does again only what the change asks for.
//!
//! ```
//! use nephroid::{Camera, Device, DeviceOptions, Light, Material, Mesh, Scene, Session, Settings};
//!
//! # fn main() -> nephroid::Result<()> {
//! // A grey floor of 4 x 4 units, and a lamp of 3 W/sr two units above it.
//! let mut scene = Scene::default();
//! let floor = Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
//! scene.add(&floor, Material::lambert([0.5; 3]));
//! scene.add_light(Light::Point { position: [0.0, 2.0, 0.0], intensity: [3.0; 3] });
//! scene.add_camera(Camera::look_at([0.0, 3.0, 3.0], [0.0; 3], [0.0, 1.0, 0.0], 0.7));
//!
//! let device = Device::open(&DeviceOptions::default())?;
//! let settings = Settings { width: 16, height: 12, photons: Some(1000), ..Settings::default() };
//! let mut session = Session::new(&device, scene, settings)?;
//! for pass in 0..2 {
//!     session.run_pass(pass)?;
//! }
//!
//! // Linear radiance, three numbers a pixel, rows from the top. Below the lamp the floor has the radiance
//! // albedo / pi * intensity / distance^2 = 0.5 / pi * 3 / 4 = 0.119.
//! let picture = session.picture()?;
//! let radiance = &picture.beauty().expect("every picture has it").data;
//! let middle = radiance[3 * (6 * 16 + 8)];
//! assert!((middle - 0.119).abs() < 0.01, "{middle}");
//! # Ok(()) }
//! ```
//!
//! The folder `examples` has more: rendering a file, a scene in memory, a camera that moves, and a kernel of one's own
//! in the command graph.
//!
//! # Conventions
//!
//! Right-handed, +Y up, lengths in scene units, angles in radians, linear Rec. 709. Radiance is in W/(sr m^2) if the
//! scene unit is a metre. The library never prints, exits or panics on input: it returns an [`Error`]. Same scene,
//! settings, seed and passes on the same driver give the same bits.
//!
//! # Features
//!
//! `cli` (default): the program `nephroid`, its studies and benchmarks. `default-features = false` leaves the library,
//! and none of the crates that only the command line needs.
//!
//! # Below the face
//!
//! [`low_level`] has the layers under these items, for programs that run kernels of their own. It may change with any
//! version.
#![deny(unsafe_code)]

#[cfg(feature = "cli")]
mod bench;
#[cfg(feature = "cli")]
mod check;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
mod compare;
mod constants;
mod draw_state;
mod error;
mod film;
#[cfg(feature = "cli")]
mod fit;
mod graph;
mod injection;
mod input;
mod kernels;
pub mod low_level;
mod picture;
#[cfg(feature = "cli")]
mod plot;
// The generator of the tests in tests/, for unit tests.
#[cfg(test)]
#[allow(dead_code)] // a part of what it offers
#[path = "../tests/support/random.rs"]
mod random;
mod render;
mod scene;
#[cfg(feature = "cli")]
mod study;
mod vk;

pub use error::{Error, MemoryCause, Result};
pub use film::accumulate::Film;
pub use picture::image::{Layer, Picture};
pub use render::{
    Change, Changes, Estimator, Lens, Method, Session, Settings, Shutter, Statistics, Step, Steps, Updated,
};
pub use scene::{
    Alpha, Camera, CameraId, Environment, Image, Instance, InstanceId, Light, LightId, Material, MaterialId, Mesh,
    MeshId, Motion, Pose, Projection, Scene, Texture, TextureRef, Transform, Vertices, Wrap,
};
pub use vk::{Device, DeviceInfo, DeviceOptions, devices};
