//! A checked order to the renderer.

use std::path::PathBuf;

use super::flags::{EffortArgs, LightArgs, RenderArgs, ViewArgs};
use super::flags_film::FilmOrder;
use super::flags_post::{LensArgs, PostArgs};
use super::stop_rule::DEFAULT_TARGET;
use crate::cli::device::DeviceArgs;
use crate::cli::inputs::check_readable;
use crate::cli::moment::MomentArgs;
use crate::cli::progress::Limit;
use crate::cli::reading::ReadingArgs;
use crate::cli::values::Aov;
use crate::error::Result;
use crate::picture::output::Destination;

/// Rendering time where neither passes nor time nor error are given, in seconds.
const DEFAULT_SECONDS: f64 = 30.0;

/// What is to be rendered, and when that ends.
#[derive(Debug)]
pub struct Request {
    /// Scene file; it can be opened.
    pub scene: PathBuf,
    /// How it is read.
    pub reading: ReadingArgs,
    /// When it is shown.
    pub moment: MomentArgs,
    /// Size, camera, layers.
    pub view: ViewArgs,
    /// Aperture and focus.
    pub lens: LensArgs,
    /// Passes over the finished picture.
    pub post: PostArgs,
    /// Environment, method and estimate; the environment can be opened.
    pub light: LightArgs,
    /// Photons per pass; `None` leaves the choice to the renderer.
    pub photons: Option<u64>,
    /// Seed.
    pub seed: u64,
    /// Passes or seconds at which the render ends.
    pub limit: Limit,
    /// Relative error at which the render ends.
    pub target_error: Option<f64>,
    /// What is kept to go on with; its files can be read and written.
    pub film: FilmOrder,
    /// Every file that is going to be written.
    pub outputs: Vec<Destination>,
    /// Device and validation.
    pub device: DeviceArgs,
    /// Whether a trace is wanted.
    pub wants_trace: bool,
}

impl Request {
    /// Checks the flags and the files that are read.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] and [`crate::error::Error::Scene`] for files that cannot be read or written.
    pub fn new(args: &RenderArgs) -> Result<Self> {
        check_readable(&args.scene)?;
        args.light.environment.environment.iter().try_for_each(|path| check_readable(path))?;
        let EffortArgs { target_error, passes, time, photons, seed } = args.effort;
        let film = args.film.order()?;
        let passes = film.range.as_ref().map(|range| range.end - range.start).or(passes);
        let is_open = target_error.is_none() && passes.is_none() && time.is_none();
        let seconds = time.or(is_open.then_some(DEFAULT_SECONDS));
        let target_error = target_error.or(is_open.then_some(DEFAULT_TARGET));
        let mut view = args.view.clone();
        view.aov = Aov::resolve(&view.aov);
        Ok(Self {
            scene: args.scene.clone(),
            reading: args.reading.clone(),
            moment: args.moment,
            view,
            lens: args.lens.clone(),
            post: args.post.clone(),
            light: args.light.clone(),
            photons,
            seed,
            limit: Limit { passes, seconds },
            target_error,
            outputs: film.checkpoint.iter().cloned().collect(),
            film,
            device: args.device.clone(),
            wants_trace: args.output.trace.is_some(),
        })
    }
}
