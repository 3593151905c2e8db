//! Rendering: the scene on the device, the pass list of a frame, and the session that runs passes.

mod casters;
mod frame;
mod lights;
mod pixels;
mod session;
mod settings;
mod shading;
mod upload;

pub use session::{Outcome, Session, Statistics};
pub use settings::Settings;
pub use upload::DeviceScene;
