//! One pass: what it declares, how it is recorded, and its parts.

pub mod budget;
pub mod content;
pub mod estimator;
pub mod film_state;
pub mod host_map;
pub mod leaf_size;
pub mod light;
pub mod path;
pub mod plan;
pub mod recording;
pub mod sampling;
