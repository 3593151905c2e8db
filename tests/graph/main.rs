//! The command graph and the shader compiler: plans without a device, replay and graphics passes on one.

#[allow(dead_code, unused_imports)] // each test uses a part
#[path = "../../src/shader/mod.rs"]
mod shader;
#[path = "../support/mod.rs"]
mod support;

mod compiled;
mod plan_properties;
mod plans;
mod raster;
mod run;
mod shaders;
