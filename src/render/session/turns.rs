//! Photons and paths in turns ([`Method::Auto`]): whose turn a pass is, and how that is found out.
//!
//! The opening has passes of either method. What they show, and how many rays and photons they took, says which method
//! is to have what part of the time from then on; after [`Turns::SECOND_LOOK`] passes this is said again, for good
//! ([`crate::film::shares`]). So it depends on the scene, the settings and the seed alone. A part of a render that does
//! not have these passes renders them to find out, and forgets them.

use super::Session;
use super::changes::{Change, Changes};
use crate::error::Result;
use crate::film::accumulate::PassSet;
use crate::film::mix::{Round, Turns};
use crate::film::shares;
use crate::kernels::eye::{EYE_RAYS, SHADOW_RAYS};
use crate::kernels::photon::PHOTON_RAYS;
use crate::render::pass::eye;
use crate::render::settings::{Estimator, Method, PhotonBuild, Sampling, Settings};

/// The first passes: as few as tell something of the noise of either method. Where photons serve a picture, they are
/// all that it is for a while; and where paths serve it, their passes are short, so little is lost.
const OPENING: Round = Round { first: 2, second: 1 };
/// The same where paths find by themselves what focuses light: they are likely to serve the rest of the scene, too.
const OPENING_OF_PATHS: Round = Round { first: 2, second: 6 };

/// Time of a shadow ray, and of a photon in whose footprint an eye hit lies with all that are tested for it, in that of
/// a ray of an eye path: from passes of twenty scenes on two cores, lavapipe 25.0.7, to a factor of 1.5.
const WORK_OF_SHADOW: f64 = 0.5;
const WORK_OF_PAIR: f64 = 0.1;

/// What the seed of the passes of paths differs by.
const OTHER_SEED: u32 = 0x5bd1_e995;

/// The passes that are not the session's own.
pub(super) struct Other {
    pub turns: Turns,
    pub session: Session,
    /// The last pass was one of them.
    pub was_last: bool,
}

/// What [`Method::Auto`] has chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice {
    /// The method of the passes that are not of photons: [`Method::Hybrid`] or [`Method::Path`].
    pub paths: Method,
    /// How the passes follow each other; those of photons are of the first method.
    pub turns: Turns,
}

impl Other {
    pub fn new(session: Session) -> Self {
        Self { turns: Turns::new(opening(&session)), session, was_last: false }
    }

    /// Forgets all passes and what they have shown.
    pub fn reset(&mut self) {
        self.turns = Turns::new(opening(&self.session));
        self.session.reset();
    }
}

/// The opening, where these are the passes of paths.
fn opening(paths: &Session) -> Round {
    if paths.settings.method == Method::Path { OPENING_OF_PATHS } else { OPENING }
}

/// The settings of the passes of paths, for a render with these.
pub(super) fn settings_of_paths(settings: &Settings) -> Settings {
    // What works in the picture does not serve paths that gather anywhere.
    let anywhere = [Estimator::Bvh, Estimator::Hash, Estimator::Knn, Estimator::Brute];
    Settings {
        method: Method::Hybrid,
        // With the same random numbers both methods would err alike: at edges, and by the same caustic photons.
        seed: settings.seed ^ OTHER_SEED,
        estimator: settings.estimator.filter(|estimator| anywhere.contains(estimator)),
        sampling: Sampling::Full,
        photon_build: PhotonBuild::Linear,
        ..settings.clone()
    }
}

/// What changes mean for the passes of paths.
pub(super) fn changes_of_paths(changes: &Changes) -> Changes {
    let theirs = |change: &Change| match change {
        Change::Seed(seed) => Change::Seed(seed ^ OTHER_SEED),
        other => other.clone(),
    };
    Changes(changes.0.iter().map(theirs).collect())
}

impl Session {
    /// Whether passes of this session emit photons; those of the other method do not count.
    fn has_photons(&self) -> bool {
        !self.budget.emissions.is_empty()
    }

    /// Whether the pass is of the other method, and its index among those of its method. Beyond the opening this finds
    /// out what follows, if it is not known yet.
    pub(super) fn turn_of(&mut self, index: u64) -> Result<(bool, u64)> {
        let Some(other) = &self.other else { return Ok((false, index)) };
        if index >= other.turns.known() {
            self.choose_turns(index)?;
        }
        Ok(self.other.as_ref().map_or((false, index), |other| other.turns.of(index)))
    }

    /// Keeps in mind that a pass was rendered, with its index among those of its method.
    pub(super) fn note_turn(&mut self, own: u64, is_other: bool) {
        let ours = if own == 0 && !is_other { self.work_of_last_pass() } else { 0.0 };
        let Some(other) = &mut self.other else { return };
        other.was_last = is_other;
        if own == 0 {
            let work = if is_other { other.session.work_of_last_pass() } else { ours };
            other.turns.work[usize::from(is_other)] = work.round().clamp(1.0, f64::from(u32::MAX)) as u32;
        }
    }

    /// What [`Method::Auto`] has chosen; `None` for other methods.
    pub fn choice(&self) -> Option<Choice> {
        let other = self.other.as_ref()?;
        Some(Choice { paths: other.session.settings.method, turns: other.turns })
    }

    /// Seconds that the pass with this index will take, by the last one of its method; `None` where no pass was
    /// rendered yet.
    pub fn expected_seconds(&self, index: u64) -> Option<f64> {
        /// A pass of photons by one of paths without any: about so many times as long. One of paths that gather photons
        /// is as long.
        const PHOTONS_BY_PATHS: f64 = 4.0;
        let Some(other) = &self.other else { return self.last_seconds };
        let ratio = if other.session.has_photons() { 1.0 } else { PHOTONS_BY_PATHS };
        let turns = other.turns;
        // What is not known yet is as long as the longest pass so far.
        let is_other = (index < turns.known()).then(|| turns.of(index).0);
        let theirs = other.session.last_seconds;
        match is_other {
            Some(true) => theirs.or(self.last_seconds),
            Some(false) => self.last_seconds.or(theirs.map(|seconds| ratio * seconds)),
            None => self.last_seconds.into_iter().chain(theirs).reduce(f64::max),
        }
    }

    /// Finds out whose turn the pass is, from those before it that tell.
    fn choose_turns(&mut self, index: u64) -> Result<()> {
        while let Some(other) = &self.other
            && index >= other.turns.known()
        {
            let known = other.turns.known();
            if self.passes == PassSet::of(0..known) {
                self.add_turns()?;
            } else {
                self.rehearse_turns(if index < Turns::SECOND_LOOK { known } else { Turns::SECOND_LOOK })?;
            }
        }
        Ok(())
    }

    /// What follows the passes of this session, which are all that are known.
    fn add_turns(&mut self) -> Result<()> {
        let film = self.film()?;
        if let Some(other) = &mut self.other {
            // Also photons that look good in few passes may not have shown how rare their bright discs are.
            let least = if other.session.settings.method == Method::Path { 0.5 } else { 0.0 };
            other.turns = shares::next(&film, other.turns, other.session.has_photons(), least);
        }
        Ok(())
    }

    /// Renders these first passes of the render to find out what follows, and forgets them. The film and the counts are
    /// what they were, also where a pass fails.
    fn rehearse_turns(&mut self, passes: u64) -> Result<()> {
        let (film, before) = (self.film()?, self.statistics.clone());
        let theirs = self.other.as_ref().map(|other| other.session.statistics.clone());
        self.reset();
        let outcome = (0..passes).try_for_each(|index| self.run_pass(index)).and_then(|()| self.add_turns());
        let turns = self.other.as_ref().map(|other| other.turns).filter(|_| outcome.is_ok());
        self.reset();
        let restored = self.restore(&film);
        self.statistics = before;
        if let (Some(other), Some(theirs)) = (&mut self.other, theirs) {
            other.session.statistics = theirs;
            other.turns = turns.unwrap_or(other.turns);
        }
        outcome.and(restored)
    }

    /// Work of this session's last pass, by counts, in the time of a ray of an eye path on a processor; 0 where nothing
    /// is counted. That of the other method is another session's.
    pub(super) fn work_of_last_pass(&self) -> f64 {
        let count = |kind| {
            let counts = self.recording.work().filter(|(known, _)| *known == kind);
            counts.map(|(_, count)| count as f64).sum::<f64>()
        };
        let shadow_rays = count(SHADOW_RAYS);
        // Hits that gather: those that look for lights, by as many rays.
        let samples =
            if self.settings.method.traits().traces_paths { 1 } else { eye::light_samples(&self.device_scene) };
        let pairs = shadow_rays / f64::from(samples.max(1)) * self.coverage.filter(|c| c.is_finite()).unwrap_or(0.0);
        count(EYE_RAYS) + count(PHOTON_RAYS) + WORK_OF_SHADOW * shadow_rays + WORK_OF_PAIR * pairs
    }
}
