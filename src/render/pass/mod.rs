//! One pass: what it declares, how it is recorded, and its parts.

pub mod estimator;
pub mod host_map;
pub mod leaf_size;
pub mod light;
pub mod path;
pub mod plan;
pub mod recording;
pub mod sampling;
