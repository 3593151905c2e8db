//! The film of a session: out to the host, in from another session, and what it tells of its error.

use super::{Session, Statistics, error_model, pixels};
use crate::error::Result;
use crate::film::accumulate::{Film, LAYER_SUMS, SUMS};
use crate::film::error_estimate::{ErrorEstimate, Model, Schedule};
use crate::film::exact::ExactSum;
use crate::film::film_file::Totals;
use crate::film::mix::Mix;
use crate::picture::image::Picture;
use crate::render::settings::Settings;

impl Session {
    /// The film of all passes so far: with it a render can be shown, resumed and merged.
    pub fn film(&self) -> Result<Film> {
        let mut film = self.own_film()?;
        film.passes = self.passes.clone();
        film.rejected = self.rejected()?;
        if let Some(other) = &self.other {
            let theirs = other.session.film()?;
            film.mix = Some(Mix { turns: other.turns, sums: theirs.sums, layers: theirs.layers });
        }
        Ok(film)
    }

    /// The sums on the device: those of this session's passes, without those of another method.
    pub(super) fn own_film(&self) -> Result<Film> {
        let Settings { width, height, layers, .. } = self.settings;
        let mut film = Film::new(width, height, self.device_scene.exponents, layers);
        if self.stale_film {
            return Ok(film);
        }
        for band in &self.state.bands {
            let places = (band.first_pixel..band.first_pixel + band.pixels).map(|index| self.place(index));
            let layers = if layers { self.runtime.download(&band.layers)? } else { vec![] };
            let mut layers = layers.chunks_exact(LAYER_SUMS);
            for (place, sums) in places.zip(self.runtime.download(&band.film)?.chunks_exact(SUMS)) {
                film.sums[place] = std::array::from_fn(|k| ExactSum::from_words(sums[k]));
                if let Some(sums) = layers.next() {
                    film.layers[place] = std::array::from_fn(|k| ExactSum::from_words(sums[k]));
                }
            }
        }
        Ok(film)
    }

    /// The mean of all passes: beauty, and the layers if the settings ask for them. Black before the first pass.
    pub fn picture(&self) -> Result<Picture> {
        Ok(self.film()?.picture())
    }

    /// Per pixel (row by row) and channel: sum, sum of squares, and sum of values times squared footprint scale, in
    /// double precision.
    pub fn moments(&self) -> Result<Vec<[f64; SUMS]>> {
        Ok(self.film()?.moments())
    }

    /// Puts a film of the same render in place of this one's: passes that follow are added to it, bit for bit as if the
    /// render had never been stopped.
    ///
    /// # Errors
    /// [`Error::Usage`](crate::error::Error::Usage) if size, layers or units differ.
    pub fn restore(&mut self, film: &Film) -> Result<()> {
        let Settings { width, height, layers, .. } = self.settings;
        let turns = self.other.as_ref().map(|other| other.turns);
        Film::new(width, height, self.device_scene.exponents, layers).with_turns(turns).merge(film)?;
        self.restore_own(film)?;
        if let (Some(other), Some(mix)) = (&mut self.other, &film.mix) {
            let mut theirs = Film::new(width, height, film.exponents, false);
            theirs.passes = film.split_passes()[1].clone();
            (theirs.sums, theirs.layers) = (mix.sums.clone(), mix.layers.clone());
            other.session.restore(&theirs)?;
            // The film may know what follows the opening, and this session not yet.
            other.turns = mix.turns.agreed(other.turns).unwrap_or(mix.turns);
        }
        self.stale_film = false;
        self.rejected_before = film.rejected;
        self.passes = film.passes.clone();
        Ok(())
    }

    /// Puts sums in place of those on the device, without those of another method.
    pub(super) fn restore_own(&self, film: &Film) -> Result<()> {
        let layers = self.settings.layers;
        for band in &self.state.bands {
            let places = (band.first_pixel..band.first_pixel + band.pixels).map(|index| self.place(index));
            let sums: Vec<[u32; 4]> = places.clone().flat_map(|place| film.sums[place].map(ExactSum::words)).collect();
            self.runtime.overwrite(&band.film, &sums)?;
            if layers {
                let sums: Vec<[u32; 4]> = places.flat_map(|place| film.layers[place].map(ExactSum::words)).collect();
                self.runtime.overwrite(&band.layers, &sums)?;
            }
        }
        self.runtime.overwrite(&self.state.rejected, &[0])
    }

    /// [`Self::restore`] with the counts of the film's passes, so that [`Self::statistics`] are those of all passes,
    /// too.
    ///
    /// # Errors
    /// Those of [`Self::restore`].
    pub fn resume(&mut self, film: &Film, totals: &Totals) -> Result<()> {
        self.restore(film)?;
        self.statistics = Statistics::restored(totals, film.passes.count());
        Ok(())
    }

    /// The error of the film so far: downloads the film.
    ///
    /// # Errors
    /// Those of the device.
    pub fn error_estimate(&self) -> Result<ErrorEstimate> {
        Ok(self.error_of(&self.film()?))
    }

    /// The error of a film of this render or of a part of it.
    pub fn error_of(&self, film: &Film) -> ErrorEstimate {
        let schedule = Schedule::of(&film.split_passes()[0], |index| self.settings.radius_scale(index));
        ErrorEstimate::of(film, schedule, self.error_model())
    }

    /// What has to be known of this render, besides its film, to estimate its error.
    pub fn error_model(&self) -> Model {
        error_model::of(&self.settings, self.estimator(), &self.device_scene, &self.budget)
    }

    /// Values in the film's passes that were not finite and count as black.
    pub(super) fn rejected(&self) -> Result<u64> {
        let theirs = self.other.as_ref().map_or(Ok(0), |other| other.session.rejected())?;
        Ok(theirs + self.own_rejected()?)
    }

    /// Those in passes of this session, without those of another method.
    pub(super) fn own_rejected(&self) -> Result<u64> {
        let counted = if self.stale_film { 0 } else { self.runtime.download(&self.state.rejected)?[0] };
        Ok(self.rejected_before + u64::from(counted))
    }

    /// Row-major index of the pixel with this index on the device.
    fn place(&self, index: u32) -> usize {
        let (x, y) = pixels::position(index, self.settings.width, self.settings.height);
        (y * self.settings.width + x) as usize
    }
}
