//! What holds for the repository as a whole, without a device: layers of the sources, tools, scenes.

#[path = "../support/mod.rs"]
mod support;

mod assets;
mod features;
mod glsl;
mod layers;
mod lengths;
mod tools;
