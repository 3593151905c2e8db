//! Checkpoints: the film of an earlier start is read at the beginning, and the film is written every minute.

use std::path::Path;
use std::time::Instant;

use super::flags_film::FilmOrder;
use super::monitor::Monitor;
use crate::error::{Error, Result};
use crate::film::film_file::{self, Difference, FilmFile, Identity, Packing, Totals};
use crate::graph::Runtime;
use crate::picture::exr::Metadata;
use crate::picture::image::Picture;
use crate::picture::output::Destination;
use crate::render::Session;

/// Which pass comes next, and when the film is written.
pub(super) struct Checkpoints<'a> {
    order: &'a FilmOrder,
    identity: Identity,
    devices: Vec<String>,
    /// Rendering time of earlier sessions in seconds.
    seconds_before: f64,
    start: Instant,
    /// Start of the last checkpoint.
    saved: Instant,
}

impl<'a> Checkpoints<'a> {
    /// Reads the film of `--resume`, if there is one, and starts the clock of the rendering time.
    ///
    /// # Errors
    /// Those of [`film_file::read`], and [`Error::Scene`] for a film of another render or of passes beyond
    /// `--pass-range`.
    pub fn begin(
        order: &'a FilmOrder,
        identity: Identity,
        session: &mut Session,
        runtime: &Runtime,
        monitor: &Monitor,
    ) -> Result<Self> {
        let info = runtime.device().info();
        let device = format!("{} ({})", info.name, info.driver);
        let mut devices = vec![device.clone()];
        let mut seconds_before = 0.0;
        if let Some(path) = &order.resume {
            // Before the sums, which may be many.
            check_same(path, &film_file::read_about(path)?.identity, &identity)?;
            let file = film_file::read(path)?;
            if let Some(range) = &order.range
                && let Some(beyond) =
                    file.film.passes.ranges().iter().find(|r| r.start < range.start || r.end > range.end)
            {
                let (held, wanted) = (format!("{beyond:?}"), format!("{range:?}"));
                return Err(Error::scene(path, format!("its passes {held} are not within --pass-range {wanted}")));
            }
            session.resume(&file.film, &file.totals)?;
            seconds_before = file.totals.seconds;
            let other = file.devices.iter().find(|name| **name != device);
            if let Some(other) = other {
                monitor.note(&format!(
                    "warning: {} was rendered on {other}, this is {device}: its passes are as good, but the bits of \
                     the picture will be those of neither alone",
                    path.display()
                ));
            }
            devices = file.devices;
            if !devices.contains(&device) {
                devices.push(device);
            }
        }
        let start = Instant::now();
        Ok(Self { order, identity, devices, seconds_before, start, saved: start })
    }

    /// The lowest pass that is not in the film; `None` if all that were asked for are.
    pub fn next_pass(&self, session: &Session) -> Option<u64> {
        session.passes().first_missing(self.order.range.clone().unwrap_or(0..u64::MAX))
    }

    /// Rendering time so far in seconds, that of earlier sessions included.
    pub fn seconds(&self) -> f64 {
        self.seconds_before + self.start.elapsed().as_secs_f64()
    }

    /// Writes a checkpoint if one is due. One that fails (a full disk) is no reason to lose the render: the user is
    /// told, and the next one is tried.
    ///
    /// # Errors
    /// Those of the device.
    pub fn pass_done(
        &mut self,
        session: &Session,
        metadata: impl FnOnce() -> Metadata,
        monitor: &Monitor,
    ) -> Result<()> {
        let Some(destination) = &self.order.checkpoint else { return Ok(()) };
        if self.saved.elapsed().as_secs_f64() < self.order.interval {
            return Ok(());
        }
        self.saved = Instant::now();
        let file = self.file(session)?;
        if let Err(error) = save(destination, (&file.film.picture(), &metadata()), &file, Packing::Fast) {
            monitor.note(&format!("warning: no checkpoint: {error}"));
        }
        Ok(())
    }

    /// The film as it is now.
    ///
    /// # Errors
    /// Those of the device.
    pub fn file(&self, session: &Session) -> Result<FilmFile> {
        let totals = Totals { seconds: self.seconds(), ..session.statistics()?.totals() };
        let (identity, devices) = (self.identity.clone(), self.devices.clone());
        Ok(FilmFile { film: session.film()?, identity, devices, totals })
    }
}

/// Refuses a film of another render.
fn check_same(path: &Path, file: &Identity, here: &Identity) -> Result<()> {
    let Some(Difference { name, ours, theirs }) = here.difference(file) else { return Ok(()) };
    Err(Error::scene(path, format!("a film of another render: {name} is {theirs} there and {ours} here")))
}

/// Writes a film behind its picture.
///
/// # Errors
/// Those of [`Destination::write`] and the encoder.
pub(in crate::cli) fn save(
    destination: &Destination,
    picture: (&Picture, &Metadata),
    file: &FilmFile,
    packing: Packing,
) -> Result<()> {
    destination.write(|sink| film_file::write(sink, destination.path(), picture, file, packing))
}
