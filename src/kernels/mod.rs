//! One file per algorithm: graph functions over the generated kernels, with their CPU references and tests.

#[allow(clippy::all)]
pub mod generated;
