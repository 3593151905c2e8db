//! Flags of a render, one struct for each group.

use std::path::PathBuf;

use clap::Args;

use super::flags_film::FilmArgs;
use super::flags_post::{LensArgs, PostArgs};
use crate::cli::device::DeviceArgs;
use crate::cli::environment::EnvironmentArgs;
use crate::cli::moment::MomentArgs;
use crate::cli::reading::ReadingArgs;
use crate::cli::values::{self, Aov, Bsdf, Size};
use crate::picture::tonemap::Curve;
use crate::render::{
    Amplification, Estimator, Method, PhotonBuild, Record, Sampling, Settings, Tracer, TreeBuild, Weight,
};

const EXAMPLES: &str = "\
Examples:
  nephroid render cup.glb -o cup.png                     an error of 1 % or 30 s, 640x480
  nephroid render cup.glb -o cup.exr --target-error 0.5% --time 1h
  nephroid render cup.glb -o cup.exr -o cup.png --size 1920x1080 --time 10m
  nephroid render ring.gltf -o ring.exr --passes 256 --aov caustic,depth --seed 7
  nephroid render car.gltf -o car.png --environment sky.exr --exposure -1
  nephroid render chess.glb -o chess.png --aperture f/2.8 --focus 0.4 --bloom 0.05
  nephroid render hall.glb -o hall.exr --time 8h --checkpoint hall.film.exr --resume hall.film.exr
  nephroid render hall.glb -o part-1.exr --pass-range 64..128     a part, for `nephroid merge`

Ctrl-C ends a render early and writes what is finished; another one, a second or more later, writes nothing.";

/// Flags of `nephroid render`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct RenderArgs {
    /// glTF 2.0 scene (.gltf or .glb)
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// How the scene is read.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// When it is shown.
    #[command(flatten)]
    pub moment: MomentArgs,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArgs,
    /// What is seen.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Through which lens.
    #[command(flatten)]
    pub lens: LensArgs,
    /// How much is computed.
    #[command(flatten)]
    pub effort: EffortArgs,
    /// What is kept to go on with.
    #[command(flatten)]
    pub film: FilmArgs,
    /// Light and how it is estimated.
    #[command(flatten)]
    pub light: LightArgs,
    /// Where it is computed.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// What is done to the picture after it.
    #[command(flatten)]
    pub post: PostArgs,
}

/// Where results go.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Output")]
pub struct OutputArgs {
    /// Picture to write, repeatable: .exr (linear floats, with the layers of --aov) or .png (8-bit sRGB, tone-mapped)
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,

    /// Tone curve of a PNG
    #[arg(long, value_name = "CURVE", value_enum, default_value_t)]
    pub tonemap: Curve,

    /// Exposure of a PNG in stops: +1 doubles, -1 halves
    #[arg(long, value_name = "STOPS", default_value = "0", value_parser = values::stops, allow_negative_numbers = true)]
    pub exposure: f32,

    /// Write counts, times, memory and warnings of the render as JSON
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,

    /// Write the device's timeline as Chrome trace JSON (open in a trace viewer)
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,

    /// Show no progress and no warnings, only the last line and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// What is seen.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Picture")]
pub struct ViewArgs {
    /// Size in pixels; the camera keeps its vertical field of view
    #[arg(long, value_name = "WxH", default_value = "640x480", value_parser = values::size)]
    pub size: Size,

    /// Camera of the scene, by name or by index from 0; a scene without cameras gets one that sees all of it
    #[arg(long, value_name = "CAMERA", default_value = "0")]
    pub camera: String,

    /// Additional layers of an EXR, separated by commas; a PNG has none. The layer `error` is always there
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',')]
    pub aov: Vec<Aov>,
}

/// How much is computed.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Effort")]
pub struct EffortArgs {
    /// End when the estimated error of the picture is this: 2% or 0.02, the root of the mean over pixels of the squared
    /// relative error, noise and bias together. --time and --passes are caps; without them a target alone renders until
    /// it is reached (Ctrl-C writes what is finished) [default: 1% without --passes and --time, otherwise none]
    #[arg(long, value_name = "ERROR", value_parser = values::relative_error, allow_negative_numbers = true)]
    pub target_error: Option<f64>,

    /// Passes to render; each refines the whole picture. With --time, what comes first ends the render
    /// [default: as many as the time allows]
    #[arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true)]
    pub passes: Option<u64>,

    /// Rendering time, such as 30s, 2m, 1h30m; loading is not included. The render ends between two passes, as near to
    /// this time as it can and at most a tenth later, but not before the first one
    /// [default: 30s without --passes and --target-error]
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_negative_numbers = true)]
    pub time: Option<f64>,

    /// Photons emitted per pass, such as 250000, 250k, 1M; where something can focus light, half of them are aimed at
    /// it [default: two per pixel, at least 65536, at most 524288]
    #[arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true)]
    pub photons: Option<u64>,

    /// Seed: the same one gives the same picture, bit for bit, after the same passes on the same device
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

/// Light and how it is estimated.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Light")]
pub struct LightArgs {
    /// The environment map.
    #[command(flatten)]
    pub environment: EnvironmentArgs,

    /// How light is transported. `auto` is `photons` where a flag asks for what only these have: --sampling,
    /// --footprint, --bsdf, --tracer
    #[arg(long, value_name = "METHOD", value_enum, default_value_t)]
    pub method: Method,

    /// What photons are traced in: `tree`, the triangles, which is exact; or `maps`, environment maps from several
    /// centres (Yao et al. 2010), for comparisons: what no map sees gets no photons. Options of maps:
    /// maps:centres=12:candidates=48:resolution=128:layers=1 are the defaults, :steps looks for hits by steps along the
    /// ray instead of from the paper's first guess
    #[arg(long, value_name = "TRACER", default_value = "tree", value_parser = values::tracer, hide_short_help = true)]
    pub tracer: Tracer,

    /// How the light of the photons is estimated at the eye hits; the picture is the same [default: what is fastest on
    /// the device]
    #[arg(long, value_name = "NAME", value_enum)]
    pub estimator: Option<Estimator>,

    /// Who builds the photon map of the estimator `bvh`; the picture is the same up to rounding
    #[arg(long, value_name = "BUILDER", value_enum, default_value_t, hide_short_help = true)]
    pub photon_build: PhotonBuild,

    /// Who builds the tree over the triangles; all but `sah` give the same picture
    #[arg(long, value_name = "BUILDER", value_enum, default_value_t, hide_short_help = true)]
    pub tree: TreeBuild,

    /// Photons of each class (caustic, other) that `--estimator knn` seeks, 1 to 512: more is smoother
    #[arg(long, value_name = "K", default_value_t = 64, value_parser = values::knn_photons, hide_short_help = true)]
    pub knn_photons: u32,

    /// What part of the density estimation a pass does: `full`; `regular:K`, one pixel in each K x K, the others filled
    /// from similar ones around them (edges of light stay blurred over K pixels); `stochastic:K`, one photon in K^2 by
    /// chance at every pixel (more noise, no blur), with `:ratio` scaled by photons listed over photons visited (less
    /// noise, loses light), with `:filter` smoothed among similar pixels. K is 2 ... 16
    #[arg(long, value_name = "MODE", default_value = "full", value_parser = values::sampling)]
    pub sampling: Sampling,

    /// Size of footprints: `differential` (ellipses by photon differentials), `density` or `density:MIN:MAX` (discs by
    /// the density of the photon's path, radii in scene units at the first pass), `fixed:RADIUS` (discs of one radius
    /// in scene units that never shrink: blurred for ever)
    #[arg(long, value_name = "RULE", default_value = "differential", value_parser = values::footprint)]
    pub footprint: values::FootprintRule,

    /// Corners of the polygon that `bounds25d` draws around a photon: more fit tighter and cost more
    #[arg(long, value_name = "N", default_value_t = Settings::default().bound_vertices, hide_short_help = true,
          value_parser = values::bound_vertices)]
    pub bounds_vertices: u32,

    /// Which kernel draws the bounds of `bounds25d` and `bounds3d`
    #[arg(long, value_name = "STAGE", value_enum, default_value_t, hide_short_help = true)]
    pub bounds_stage: Amplification,

    /// Weight of photons within their footprint
    #[arg(long = "kernel", value_name = "KERNEL", value_enum, default_value_t)]
    pub weight: Weight,

    /// How photons are stored for the gather: in full precision, or packed to 20 or 12 bytes as discs of the same area
    /// with 8-bit flux; 12 needs the cells of `hash` or the tiles of `tiled`
    #[arg(long, value_name = "BYTES", value_enum, default_value_t, hide_short_help = true)]
    pub photon_record: Record,

    /// Model of rough glossy surfaces where light is gathered
    #[arg(long, value_name = "MODEL", value_enum, default_value = "ggx", hide_short_help = true)]
    pub bsdf: Bsdf,

    /// Footprint size of caustic photons, in photon spacings of the first pass: larger is smoother [default: 2.1]
    #[arg(
        long,
        value_name = "S",
        hide_short_help = true,
        value_parser = values::smoothing,
        allow_negative_numbers = true
    )]
    pub caustic_smoothing: Option<f32>,

    /// Largest semiaxis of a footprint, in radii of the scene at the first pass [default: 0.042]
    #[arg(
        long,
        value_name = "R",
        hide_short_help = true,
        value_parser = values::largest_footprint,
        allow_negative_numbers = true
    )]
    pub largest_footprint: Option<f32>,

    /// Let footprints reach beyond walls and edges: dark outlines, and light that leaks through walls
    #[arg(long, hide_short_help = true)]
    pub no_fold: bool,

    /// Footprint size of all other photons, in photon spacings of the first pass: larger is smoother [default: 2.8]
    #[arg(
        long,
        value_name = "S",
        hide_short_help = true,
        value_parser = values::smoothing,
        allow_negative_numbers = true
    )]
    pub global_smoothing: Option<f32>,
}
