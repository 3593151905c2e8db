//! Running plans on a device: the only part of the graph that sees Vulkan.

mod check;
mod execute;
mod images;
mod memory;
mod raster;
mod runtime;

pub use execute::Executable;
pub use runtime::Runtime;
