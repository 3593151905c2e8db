//! One file per algorithm: graph functions over the generated kernels, with their CPU references and tests.

pub mod bvh_host;
#[allow(clippy::all)]
pub mod generated;
pub mod trace;
