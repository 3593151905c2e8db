//! Renders of whole scenes: estimators, photon maps, sampling, and the methods of light transport.

#[path = "../support/mod.rs"]
mod support;

mod auto;
mod estimators;
mod faults;
mod guide;
mod light;
mod maps;
mod media;
mod moving;
mod path;
mod photon_build;
mod sampling;
mod sides;
mod transport;
mod trees;
mod update;
mod ztest;
