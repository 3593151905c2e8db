//! The scene in device memory.

mod casters;
mod lights;
pub mod memory;
mod shading;
pub mod upload;
