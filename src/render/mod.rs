//! Rendering: the scene on the device, the pass list of a frame, and the session that runs passes.

mod casters;
mod error_model;
mod estimator;
mod estimator_bytes;
mod frame;
mod host_map;
mod identity;
mod leaf_size;
mod light_tracing;
mod lights;
mod memory;
mod method;
pub mod names;
mod outline;
mod pixels;
mod recording;
mod sampling;
mod session;
mod settings;
mod shading;
mod upload;

pub use crate::kernels::gather::{Amplification, Weight};
pub use crate::kernels::photon::Footprint;
pub use estimator::Estimator;
pub use estimator_bytes::EstimatorBytes;
pub use identity::identity;
pub use leaf_size::{automatic as automatic_leaf, coverage};
pub use outline::{KernelUse, Outline, Saving, Savings, savings};
pub use sampling::{Sampling, Scale};
pub use session::{Session, Statistics};
pub use settings::{Lens, Method, PhotonBuild, Record, Settings};
pub use upload::DeviceScene;
