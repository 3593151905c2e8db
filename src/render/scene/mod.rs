//! The scene in device memory.

pub mod camera;
mod casters;
mod lights;
pub mod memory;
mod shading;
pub mod upload;
