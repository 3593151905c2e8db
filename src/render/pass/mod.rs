//! One pass: what it declares, how it is recorded, and its parts.

pub mod budget;
mod camera_input;
pub mod content;
mod emission;
pub mod estimator;
pub mod eye;
pub mod film_state;
mod host_map;
pub mod leaf_size;
mod light;
mod methods;
mod path;
mod photons;
pub mod plan;
pub mod recording;
mod reports;
mod sampling;
mod transport;
