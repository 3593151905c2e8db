//! The scene in device memory.

pub mod camera;
mod casters;
mod device_tree;
mod guide;
pub mod host;
mod lights;
mod lobes;
pub mod maps;
pub mod memory;
mod shading;
mod sky;
pub mod upload;
mod variant;
mod view;
