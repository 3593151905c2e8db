//! The group of flags about when a scene that moves is shown.

use clap::Args;

use crate::render::Shutter;
use crate::scene::Scene;

/// When the scene is shown.
#[derive(Debug, Clone, Copy, Default, Args)]
#[command(next_help_heading = "Scene")]
pub struct MomentArgs {
    /// Show the scene as its animation has it at this time, in seconds; before its first key and after its last one
    /// nothing moves [default: at rest, as if it had no animation]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    pub at: Option<f64>,

    /// Leave the shutter open for so many seconds from then on: what moves is blurred
    #[arg(long, value_name = "SECONDS", value_parser = seconds, requires = "at", allow_negative_numbers = true)]
    pub shutter_seconds: Option<f64>,
}

impl MomentArgs {
    /// Brings the scene to the moment; returns when the shutter is open, and what the user should know.
    pub fn apply(&self, scene: &mut Scene) -> (Option<Shutter>, Option<String>) {
        let moves = scene.motion.as_ref().is_some_and(|motion| !motion.is_still());
        let Some(at) = self.at else {
            let told = moves.then(|| "the scene moves: it is shown at rest (--at SECONDS shows another moment)".into());
            return (None, told);
        };
        scene.move_to(at);
        let told = (!moves).then(|| "nothing moves in the scene: it is the same at any time".into());
        let shutter = self.shutter_seconds.filter(|_| moves);
        (shutter.map(|seconds| Shutter { open: at, close: at + seconds.max(0.0) }), told)
    }
}

/// Parses seconds, with or without the unit.
pub fn seconds(text: &str) -> std::result::Result<f64, String> {
    /// Some thirty years; frames a thousandth of a second apart are still told from each other.
    const MOST: f64 = 1e9;
    let number = text.strip_suffix('s').unwrap_or(text).trim_end();
    let seconds = number.parse::<f64>().ok().filter(|seconds| seconds.abs() <= MOST);
    seconds.ok_or_else(|| format!("expected seconds between -{MOST:e} and {MOST:e}, for example 1.5"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_finite() {
        assert_eq!((seconds("1.5"), seconds("-2s"), seconds("0.25 s")), (Ok(1.5), Ok(-2.0), Ok(0.25)));
        assert!(["", "s", "nan", "inf", "1e10", "1m"].iter().all(|text| seconds(text).is_err()));
    }

    #[test]
    fn a_scene_without_motion_has_no_shutter() {
        let moment = MomentArgs { at: Some(1.0), shutter_seconds: Some(0.5) };
        let (shutter, told) = moment.apply(&mut Scene::default());
        assert!(shutter.is_none() && told.is_some_and(|told| told.starts_with("nothing moves")));
        assert_eq!(MomentArgs::default().apply(&mut Scene::default()), (None, None));
    }
}
