//! Frame after frame on one device, with one session.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::flags::AnimateArgs;
use super::frame::Frames;
use crate::cli::advice;
use crate::cli::numbers::{clock, percent};
use crate::cli::progress::Progress;
use crate::cli::render::engine::{self, Prepared};
use crate::cli::render::finished::FinishedRender;
use crate::cli::render::monitor::Monitor;
use crate::cli::render::post::After;
use crate::cli::render::request::Request;
use crate::cli::render::stop_rule::StopReason;
use crate::error::{Error, Result};
use crate::graph::Runtime;
use crate::picture::claim::Claim;
use crate::render::{Change, Changes, Session, Settings, Shutter, identity};
use crate::scene::Scene;

/// The frames of a scene.
pub(super) struct Sequence<'a> {
    args: &'a AnimateArgs,
    request: Request,
    files: Frames<'a>,
    stop: &'a AtomicBool,
    /// The device, the session and the settings of the last frame, from the first one that is rendered on.
    work: Option<(Runtime, Session, Settings)>,
    /// Frames to render in all.
    total: u64,
}

/// What was done.
#[derive(Debug, Default)]
pub(super) struct Done {
    pub rendered: u64,
    /// Frames that were there.
    pub found: u64,
    /// Frames that another process renders.
    pub claimed: u64,
    pub seconds: f64,
    pub is_interrupted: bool,
}

impl<'a> Sequence<'a> {
    pub fn new((args, request): (&'a AnimateArgs, Request), files: Frames<'a>, stop: &'a AtomicBool) -> Self {
        Self { args, request, files, stop, work: None, total: 0 }
    }

    /// Renders these frames, `total` in all, as far as they are not there.
    ///
    /// # Errors
    /// Those of files and of the renderer. Frames before the error are there, and what the one in work has is in its
    /// checkpoint.
    pub fn render(mut self, mut scene: Scene, frames: impl Iterator<Item = u64>, total: u64) -> Result<Done> {
        let begin = Instant::now();
        self.total = total;
        let monitor = self.monitor(String::new());
        scene.warnings.iter().for_each(|warning| monitor.note(&advice::warning(warning)));
        let mut done = Done::default();
        for frame in frames {
            let time = frame as f64 / self.args.frames.fps;
            scene.move_to(time);
            let settings = self.settings(frame, &scene)?;
            self.files.spare_scene(frame, &scene)?;
            let identity = identity(&scene, &settings);
            if self.files.is_there(frame, &identity)? {
                done.found += 1;
                continue;
            }
            let _claim = match Claim::of(&self.files.checkpoint(frame)?) {
                Ok(claim) => claim,
                Err(Error::Io { action: "claim", .. }) => {
                    done.claimed += 1;
                    continue;
                }
                Err(error) => return Err(error),
            };
            // Another process may have finished it meanwhile.
            if self.files.is_there(frame, &identity)? {
                done.found += 1;
                continue;
            }
            done.seconds = begin.elapsed().as_secs_f64();
            self.request.film = self.files.film(frame)?;
            let after = After::of(&self.request, &scene.cameras[settings.camera], &settings)?;
            let prepared = Prepared { after, identity: identity.clone(), loaded: 0.0, prepared: 0.0 };
            let mut rendered = self.frame((frame, time), (&scene, settings), prepared, &done)?;
            if let Some(failure) = rendered.failure.take() {
                self.files.keep(frame, &rendered)?;
                return Err(failure);
            }
            if rendered.outcome.stop == StopReason::Interrupted {
                self.files.keep(frame, &rendered)?;
                done.is_interrupted = true;
                break;
            }
            self.files.write((frame, time), &rendered, &identity)?;
            done.rendered += 1;
            done.seconds = begin.elapsed().as_secs_f64();
            self.tell(frame, &rendered, &done);
        }
        Ok(done)
    }

    /// The settings of a frame, for the scene as it is then.
    fn settings(&self, frame: u64, scene: &Scene) -> Result<Settings> {
        let flags = &self.args.frames;
        let [open, close] = [0.0, flags.shutter].map(|share| (frame as f64 + share) / flags.fps);
        let shutter = Shutter { open, close };
        let mut settings = engine::settings(&self.request, scene)?;
        settings.shutter = (flags.shutter > 0.0).then_some(shutter);
        if !flags.coherent {
            // As far from each other as seeds can be (Knuth, The Art of Computer Programming, volume 3, section 6.4).
            settings.seed ^= (frame as u32).wrapping_mul(0x9e37_79b1);
        }
        Ok(settings)
    }

    /// Renders one frame.
    fn frame(
        &mut self,
        (frame, time): (u64, f64),
        (scene, settings): (&Scene, Settings),
        prepared: Prepared,
        done: &Done,
    ) -> Result<FinishedRender> {
        let (runtime, mut session) = match self.work.take() {
            Some((runtime, mut session, former)) if alike(&former, &settings) => {
                session.show(time, settings.shutter)?;
                let changes = [Change::Seed(settings.seed), Change::Lens(settings.lens)];
                session.update(Changes(changes.to_vec()))?;
                session.reset();
                (runtime, session)
            }
            // What no change of a session reaches asks for a new one.
            former => {
                let runtime = match former {
                    Some((runtime, session, _)) => {
                        drop(session);
                        runtime
                    }
                    None => self.request.device.open()?,
                };
                let session = Session::new(runtime.device(), scene.clone(), settings.clone())?;
                (runtime, session)
            }
        };
        let mut monitor = self.monitor(format!("frame {frame} ({}), ", self.place(done)));
        let rendered = engine::passes(&self.request, (&mut session, &runtime), prepared, &mut monitor);
        monitor.progress.finish();
        self.work = Some((runtime, session, settings));
        rendered
    }

    fn monitor(&self, title: String) -> Monitor<'a> {
        let progress = Progress::new(self.request.limit, self.args.frames.quiet).titled(title);
        Monitor { stop: self.stop, progress }
    }

    /// Which frame this is, and how long all of them will take: `3 of 24, 5:07 left`.
    fn place(&self, done: &Done) -> String {
        let before = done.rendered + done.found + done.claimed;
        let left = self.total.saturating_sub(before) as f64;
        let place = format!("{} of {}", before + 1, self.total);
        match done.rendered {
            0 => place,
            rendered => format!("{place}, {} left", clock(done.seconds / rendered as f64 * left)),
        }
    }

    /// A line for each frame that is finished.
    fn tell(&self, frame: u64, rendered: &FinishedRender, done: &Done) {
        let left = self.total.saturating_sub(done.rendered + done.found + done.claimed) as f64;
        let seconds = done.seconds / done.rendered as f64 * left;
        let passes = rendered.info.passes;
        let plural = if passes == 1 { "" } else { "es" };
        let error = rendered.outcome.error.map_or(String::new(), |error| format!(", error {}", percent(error)));
        let text = format!("frame {frame}: {passes} pass{plural} in {:.1} s{error}", rendered.info.seconds);
        self.monitor(String::new()).note(&format!("{text}; {} left", clock(seconds)));
    }
}

/// Whether settings differ in nothing but what a running session can change.
fn alike(former: &Settings, next: &Settings) -> bool {
    let Settings { seed, shutter, lens, .. } = *former;
    *former == Settings { seed, shutter, lens, ..next.clone() }
}
