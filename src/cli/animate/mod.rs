//! `nephroid animate`: a scene that moves in, frames out.

mod flags;
mod frame;
mod movie;
mod pattern;
mod sequence;

use std::ops::Range;

use self::frame::Frames;
use self::movie::Movie;
use self::pattern::{Part, Pattern};
use self::sequence::{Done, Sequence};
use super::console::{complain, print};
use super::interrupt;
use super::numbers::clock;
use super::render::request::Request;
use crate::error::{Error, Result};
use crate::scene::Scene;

pub use self::flags::AnimateArgs;

/// Most frames that are looked at without --frames: an animation of a day.
const MOST_FRAMES: f64 = 1e7;

/// Renders all frames that are not there yet, and the film of them.
///
/// # Errors
/// [`Error::Io`] and [`Error::Usage`] if a file cannot be read or written, those of the renderer, and
/// [`Error::Interrupted`] after Ctrl-C, when the frame in work is in its checkpoint.
pub fn run(args: &AnimateArgs) -> Result<()> {
    let stop = interrupt::install()?;
    let of_a_frame = args.of_a_frame();
    let request = Request::new(&of_a_frame)?;
    let (patterns, movie) = outputs(args)?;
    let scene = request.reading.load(&request.scene, &request.light.environment)?;
    let frames = range(args, &scene)?;
    let part = args.frames.part.unwrap_or(Part::WHOLE);
    let files = Frames::of(patterns, (args, &of_a_frame, frames.clone()))?;
    let done = Sequence::new((args, request), files, stop).render(
        scene,
        part.of(frames.clone()),
        part.count(count(&frames)),
    )?;
    if done.is_interrupted {
        return Err(Error::Interrupted);
    }
    let file = match &movie {
        Some(movie) if done.claimed == 0 => {
            movie.write((frames.start, count(&frames)), args.frames.fps)?;
            movie.path()
        }
        Some(movie) => {
            complain(&format!("{} is written once all frames are there: run this again then", movie.path().display()));
            movie.frames.path()
        }
        None => &args.frames.output[0],
    };
    print(&last_line(&done, &file.display().to_string()))
}

fn count(frames: &Range<u64>) -> u64 {
    frames.end - frames.start
}

/// The files of frames, and the film of them.
fn outputs(args: &AnimateArgs) -> Result<(Vec<Pattern>, Option<Movie>)> {
    let (films, pictures): (Vec<_>, Vec<_>) = args.frames.output.iter().partition(|path| Movie::is_named(path));
    let mut patterns = pictures.into_iter().map(|path| Pattern::of(path)).collect::<Result<Vec<_>>>()?;
    let movie = match films.as_slice() {
        [] => None,
        [path] if args.frames.part.is_none() => Some(Movie::of(path)?),
        [path] => return Err(Error::Usage(format!("'{}' needs all frames, not --part of them", path.display()))),
        _ => return Err(Error::Usage("one film at a time".into())),
    };
    patterns.extend(movie.iter().map(|movie| movie.frames.clone()));
    Ok((patterns, movie))
}

/// The frames that are wanted, or those of the whole animation.
fn range(args: &AnimateArgs, scene: &Scene) -> Result<Range<u64>> {
    if let Some(frames) = &args.frames.frames {
        return Ok(frames.clone());
    }
    let motion = scene.motion.as_ref().filter(|motion| !motion.is_still());
    let motion =
        motion.ok_or_else(|| Error::Usage("nothing moves in the scene: --frames says how many to render".into()))?;
    let last = (motion.span()[1] * args.frames.fps).ceil().max(0.0);
    if last > MOST_FRAMES {
        return Err(Error::Usage(format!("{last:.0} frames: --frames says which of them to render")));
    }
    Ok(0..last as u64 + 1)
}

fn last_line(done: &Done, file: &str) -> String {
    let plural = |count: u64| if count == 1 { "" } else { "s" };
    let mut line = format!("{} frame{} in {}", done.rendered, plural(done.rendered), clock(done.seconds));
    if done.found > 0 {
        line += &format!(", {} that were there", done.found);
    }
    if done.claimed > 0 {
        line += &format!(", {} that another process renders", done.claimed);
    }
    format!("{line}: {file}")
}
