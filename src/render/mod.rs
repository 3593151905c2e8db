//! Rendering: settings, the scene on the device, the list of what a pass does, and the session that runs passes.

mod pass;
mod scene;
mod session;
mod settings;

pub use crate::kernels::gather::{Amplification, Weight};
pub use crate::kernels::photon::Footprint;
pub use pass::leaf_size::{automatic as automatic_leaf, coverage};
pub use scene::maps::{SceneMaps, Surfaces, candidates as map_candidates};
pub use scene::upload::DeviceScene;
pub use session::changes::{Change, Changes, Step, Steps};
pub use session::estimator_bytes::EstimatorBytes;
pub use session::identity::identity;
pub use session::outline::{KernelUse, Outline, Saving, Savings, savings};
pub use session::{CLASSES, Choice, Session, Statistics, Updated};
pub use settings::{
    Estimator, Lens, MapSettings, Method, Named, PhotonBuild, Record, Sampling, Scale, Settings, Shutter, Tracer,
    TreeBuild, by_name,
};
pub use settings::{names, ranges};
