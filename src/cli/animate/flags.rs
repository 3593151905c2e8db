//! Flags of `nephroid animate`.

use std::ops::Range;
use std::path::PathBuf;

use clap::Args;

use super::pattern::Part;
use crate::cli::device::DeviceArgs;
use crate::cli::moment::MomentArgs;
use crate::cli::reading::ReadingArgs;
use crate::cli::render::{EffortArgs, FilmArgs, LensArgs, LightArgs, OutputArgs, PostArgs, RenderArgs, ViewArgs};
use crate::cli::values;
use crate::picture::tonemap::Curve;

const EXAMPLES: &str = "\
Examples:
  nephroid animate fox.glb -o fox_####.png                         all of it, 24 frames a second
  nephroid animate fox.glb -o fox_####.exr --frames 0..48 --fps 25 --passes 64 --shutter 0.5
  nephroid animate fox.glb -o fox.mp4 --animation Run --size 640x360 --time 5s
  nephroid animate hall.glb -o hall_####.exr --frames 0..240 --part 2/4     one of four machines

The same command again goes on where the last one ended, whatever ended it: frames that are there are not rendered
again, and the one in work goes on from its checkpoint. Several may run at once in one folder: no frame is rendered
twice. Flags of effort (--passes, --time, --target-error) are for each frame.";

/// Flags of `nephroid animate`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct AnimateArgs {
    /// glTF 2.0 scene (.gltf or .glb)
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,

    /// How the scene is read.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// Which frames, and where they go.
    #[command(flatten)]
    pub frames: FrameArgs,
    /// What is seen.
    #[command(flatten)]
    pub view: ViewArgs,
    /// Through which lens.
    #[command(flatten)]
    pub lens: LensArgs,
    /// How much is computed for each frame.
    #[command(flatten)]
    pub effort: EffortArgs,
    /// Light and how it is estimated.
    #[command(flatten)]
    pub light: LightArgs,
    /// Where it is computed.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// What is done to each picture after it.
    #[command(flatten)]
    pub post: PostArgs,
}

/// Which frames, and where they go.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Frames")]
pub struct FrameArgs {
    /// Pictures to write, repeatable: #### stands for the number of the frame, as in frame_####.exr or frame_####.png;
    /// a name in .mp4 or .webm is a film of all frames, which needs the program ffmpeg
    #[arg(short, long, value_name = "FILE", required = true)]
    pub output: Vec<PathBuf>,

    /// Render frames A up to but without B; frame N shows the scene at N / FPS seconds, and beyond the last key nothing
    /// moves [default: from 0 to the last key]
    #[arg(long, value_name = "A..B", value_parser = frame_range)]
    pub frames: Option<Range<u64>>,

    /// Frames a second
    #[arg(long, value_name = "F", default_value_t = 24.0, value_parser = rate, allow_negative_numbers = true)]
    pub fps: f64,

    /// Leave the shutter open for this share of the time from one frame to the next, 0 to 1 (0.5 is 180 degrees): what
    /// moves is blurred. It opens at the time of the frame
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share, allow_negative_numbers = true)]
    pub shutter: f64,

    /// Render part K of N only: every N-th frame, from the K-th on
    #[arg(long, value_name = "K/N", value_parser = Part::parse)]
    pub part: Option<Part>,

    /// Take the same random numbers for every frame: what does not move has the same noise in all of them. With
    /// `--coherent=false` each frame has its own
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_value_t = true,
          default_missing_value = "true", action = clap::ArgAction::Set)]
    pub coherent: bool,

    /// Time between checkpoints of the frame in work
    #[arg(long, value_name = "TIME", default_value = "1m", value_parser = values::duration, hide_short_help = true)]
    pub checkpoint_interval: f64,

    /// Render frames again that are there, and leave checkpoints of other renders aside
    #[arg(long)]
    pub force: bool,

    /// Tone curve of PNGs
    #[arg(long, value_name = "CURVE", value_enum, default_value_t)]
    pub tonemap: Curve,

    /// Exposure of PNGs in stops: +1 doubles, -1 halves
    #[arg(long, value_name = "STOPS", default_value = "0", value_parser = values::stops, allow_negative_numbers = true)]
    pub exposure: f32,

    /// Show no progress and no warnings, only the last line and errors
    #[arg(short, long)]
    pub quiet: bool,
}

impl AnimateArgs {
    /// The flags of a frame, as those of a render without files.
    pub fn of_a_frame(&self) -> RenderArgs {
        let FrameArgs { tonemap, exposure, quiet, checkpoint_interval, force, .. } = self.frames;
        let film = FilmArgs { checkpoint: None, checkpoint_interval, resume: None, pass_range: None, force };
        RenderArgs {
            scene: self.scene.clone(),
            reading: self.reading.clone(),
            moment: MomentArgs::default(),
            output: OutputArgs { output: vec![], tonemap, exposure, report: None, trace: None, quiet },
            view: self.view.clone(),
            lens: self.lens.clone(),
            effort: self.effort.clone(),
            film,
            light: self.light.clone(),
            device: self.device.clone(),
            post: self.post.clone(),
        }
    }
}

/// Parses `0..48`.
fn frame_range(text: &str) -> std::result::Result<Range<u64>, String> {
    /// So that the number of a frame, and its time, is exact as a floating-point number.
    const MOST: u64 = 1 << 40;
    let ends = text.split_once("..").and_then(|(a, b)| Some(a.parse::<u64>().ok()?..b.parse::<u64>().ok()?));
    let range = ends.filter(|range| !range.is_empty() && range.end <= MOST);
    range.ok_or_else(|| format!("expected A..B with A below B, such as 0..48, and B at most {MOST}"))
}

fn rate(text: &str) -> std::result::Result<f64, String> {
    let rate = text.parse::<f64>().ok().filter(|rate| (1e-3..=1e6).contains(rate));
    rate.ok_or_else(|| "expected frames a second between 0.001 and 1000000, for example 24".into())
}

fn share(text: &str) -> std::result::Result<f64, String> {
    let share = text.parse::<f64>().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "expected a share between 0 and 1, for example 0.5".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_rates_and_shares_are_bounded() {
        assert_eq!((frame_range("0..48"), rate("29.97"), share("0.5")), (Ok(0..48), Ok(29.97), Ok(0.5)));
        for wrong in ["", "5", "5..5", "9..5", "0..1099511627777", "-1..2", "a..b"] {
            assert!(frame_range(wrong).is_err(), "{wrong}");
        }
        assert!(["0", "-24", "nan", "inf", "1e9", ""].iter().all(|text| rate(text).is_err()));
        assert!(["-0.1", "1.1", "nan", "180"].iter().all(|text| share(text).is_err()));
    }
}
