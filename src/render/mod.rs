//! Rendering: the scene on the device, the pass list of a frame, and the session that runs passes.

mod casters;
mod frame;
mod lights;
mod memory;
mod outline;
mod pixels;
mod session;
mod settings;
mod shading;
mod upload;

pub use outline::{KernelUse, Outline, Saving, Savings, savings};
pub use session::{Outcome, Session, Statistics};
pub use settings::{Lens, Settings};
pub use upload::DeviceScene;
