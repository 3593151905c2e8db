//! What a study measures, as it is stored and reported.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One measured point: a render at the moment when it had used up a budget. The points of one render belong together:
/// same scene, variant and seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Name of the scene in the study.
    pub scene: String,
    /// Name of the method with its settings in the study, for example `photons`, `path`, `bvh s=1.5`.
    pub variant: String,
    /// Settings of the variant by name, as text: what the report explains a variant with.
    pub settings: BTreeMap<String, String>,
    /// Seed.
    pub seed: u64,
    /// What the render was allowed to use; of the ends of passes, the one nearest to it counts.
    pub budget: Budget,
    /// Passes in the picture.
    pub passes: u64,
    /// Photons emitted.
    pub photons: u64,
    /// Rendering time, without loading, set-up and measuring, in seconds.
    pub seconds: f64,
    /// The difference from the reference.
    pub error: TrueError,
    /// The renderer's own estimate of the root of the relative squared error (a part of one, not percent); `None` where
    /// it has none.
    pub estimated_error: Option<f64>,
    /// Where the time went, of the whole render so far, in seconds: `load`, `build`, `compile`, `trace`, `gather`,
    /// `write`, ...
    pub time_split: BTreeMap<String, f64>,
    /// Greatest device memory in use, in bytes.
    pub device_bytes: u64,
    /// What the scene did not need and was left out.
    pub left_out: Vec<String>,
}

/// What a render may use.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Budget {
    /// Rendering time in seconds.
    Seconds(f64),
    /// Passes.
    Passes(u64),
}

/// Measures of the difference between a picture and its reference, as in [`crate::compare::metrics::Metrics`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrueError {
    /// Mean of (x - r)^2.
    pub mse: f64,
    /// Mean of (x - r)^2 / (r^2 + 0.01).
    pub relmse: f64,
    /// The same without the worst 0.1 % of the pixels.
    pub relmse_trimmed: f64,
    /// Mean of |x - r| / (|x| + |r|).
    pub smape: f64,
    /// HDR-FLIP, if it was asked for: it takes seconds.
    pub flip: Option<f64>,
    /// Mean of x over the mean of r.
    pub mean_ratio: f64,
}

/// Bias and variance apart, from many seeds with the same number of passes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Decomposition {
    /// Name of the scene in the study.
    pub scene: String,
    /// Name of the variant in the study.
    pub variant: String,
    /// Settings of the variant.
    pub settings: BTreeMap<String, String>,
    /// Passes of each render.
    pub passes: u64,
    /// Number of seeds K.
    pub seeds: u64,
    /// Mean over the pixels of (mean over the seeds - reference)^2 / (reference^2 + 0.01), less the variance / K that
    /// the mean over K seeds still has: may be a little negative where there is none.
    pub bias_squared: f64,
    /// Mean over the pixels of the variance over the seeds (divisor K - 1) / (reference^2 + 0.01).
    pub variance: f64,
}

/// All that a study has measured so far.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Title of the study.
    pub title: String,
    /// Device and driver.
    pub device: String,
    /// Version of this crate.
    pub version: String,
    /// Measured points.
    #[serde(rename = "records")]
    pub measurements: Vec<Measurement>,
    /// Bias and variance.
    pub decompositions: Vec<Decomposition>,
    /// Curves of other renderers to lay over ours.
    pub peers: Vec<Peer>,
}

/// One run of another renderer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Peer {
    /// Name of the scene in the study.
    pub scene: String,
    /// Renderer and method, for example `pbrt sppm`.
    pub name: String,
    /// Rendering time in seconds.
    pub seconds: f64,
    /// Mean of (x - r)^2 / (r^2 + 0.01).
    pub relmse: f64,
    /// The same without the worst 0.1 % of the pixels.
    pub relmse_trimmed: f64,
}
