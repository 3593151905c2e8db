//! What part of the time either of two methods gets, from what their first passes show.
//!
//! The methods are those of [`super::mix`]: the first has little noise and perhaps a bias, the second has none. The
//! noise of both follows from the spread of their passes; the squared bias of the first is what the squared difference
//! of both is above their variances, summed over the picture. A window of pixels would tell more of one place and less
//! for sure: over the whole picture a bias of a hundredth of the noise is seen.
//!
//! With t times the passes, the squared error of the first method is v_p t^(-0.9) + b^2 (its footprints shrink, Knaus
//! and Zwicker 2011, and not all noise is theirs; its bias is taken to stay), that of the second v_t / t, and that of
//! the picture, which takes from both by these, the product over the sum. Variances and bias are those around each
//! pixel, as each method is the better one at some places; what of the bias only shows over the whole picture is taken
//! to be everywhere. The part of the work that makes the mean error least after eight times the opening is what the
//! second method gets, and at least a sixteenth, by which the first is checked. But light that the second has not found
//! makes it look good: where the first shows more light for sure, it keeps half of the work.

use super::accumulate::Film;
use super::mix::{self, Compared, LEFT_OUT, Round, Turns, compared};

/// By how much the work grows until the ratio of the errors counts.
const GROWTH: f64 = 8.0;

/// How well two methods serve a picture: mean squares over its pixels, relative to what is there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Variance of the mean of the passes of either method.
    pub noise: [f64; 2],
    /// Squared difference of both beyond their noise: the squared bias of one of them. It may be negative by chance.
    pub difference: f64,
    /// Standard error of the difference.
    pub uncertainty: f64,
    /// By how much the first shows more light than the second, for sure, as a part of what both show.
    pub lead: f64,
}

impl Standing {
    /// From a film with passes of both methods; `None` with fewer than two of the first or none of the second, and for
    /// a black picture.
    pub fn of(film: &Film) -> Option<Self> {
        if film.split_passes()[0].count() < 2 {
            return None;
        }
        let pixels = compared(film)?;
        let mut all = mix::relative_to_means(&pixels, film.width as usize)?;
        all.sort_unstable_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])));
        all.truncate(all.len() - (all.len() as f64 * LEFT_OUT) as usize);
        let count = all.len() as f64;
        let average = |of: &dyn Fn(&[f64; 4]) -> f64| all.iter().map(of).sum::<f64>() / count;
        let beyond = |[p, t, difference, _]: &[f64; 4]| difference - p - t;
        let difference = average(&beyond);
        let spread = average(&|pixel| (beyond(pixel) - difference).powi(2));
        let noise = [average(&|pixel| pixel[0]), average(&|pixel| pixel[1])];
        Some(Self { noise, difference, uncertainty: (spread / count).sqrt(), lead: lead(&pixels) })
    }
}

/// See [`Standing::lead`].
fn lead(pixels: &[Compared]) -> f64 {
    let count = pixels.len() as f64;
    let mean = pixels.iter().map(Compared::mean).sum::<f64>() / count;
    let difference = pixels.iter().map(|pixel| pixel.means[0] - pixel.means[1]).sum::<f64>() / count;
    let variance = pixels.iter().map(|pixel| pixel.variances[0] + pixel.variances[1]).sum::<f64>() / count / count;
    // Pixels that share photons err alike.
    (difference - 5.0 * variance.sqrt()) / mean
}

/// The noise of photons falls as the passes to this power: that of footprints of one size as 1, of those that shrink
/// as 2/3, with all that is not theirs (edges, direct light) between both.
const NOISE_EXPONENT: f64 = 0.9;

/// Parts of the work that the second method may get.
const SHARES: [f64; 8] = [1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0, 3.0 / 8.0, 1.0 / 2.0, 3.0 / 4.0, 7.0 / 8.0, 1.0];

/// Mean squared error of the picture of both, relative to what is there, after [`GROWTH`] times the work, of which the
/// second method has a part; `local` as of [`super::mix::local`] with `rest` of squared bias everywhere, and `parts` of
/// the work that either method has had.
fn error(local: &[[f64; 3]], rest: f64, parts: [f64; 2], share: f64) -> f64 {
    let fall = [(parts[0] / (GROWTH * (1.0 - share))).powf(NOISE_EXPONENT), parts[1] / (GROWTH * share)];
    let at = |[p, t, bias]: &[f64; 3]| {
        let first = if share < 1.0 { p * fall[0] + bias + rest } else { f64::INFINITY };
        let second = t * fall[1];
        if second > 0.0 && first > 0.0 { 1.0 / (1.0 / first + 1.0 / second) } else { 0.0 }
    };
    local.iter().map(at).sum::<f64>() / local.len() as f64
}

/// The part of the work with which the second method serves the picture best. Differences below a thirtieth are none:
/// then the methods get parts that are as equal as may be, as each checks the other.
fn best_share(local: &[[f64; 3]], rest: f64, parts: [f64; 2]) -> f64 {
    let errors = SHARES.map(|share| error(local, rest, parts, share));
    let least = errors.into_iter().fold(f64::INFINITY, f64::min);
    let good = SHARES.into_iter().zip(errors).filter(|(_, error)| *error <= 31.0 / 30.0 * least);
    good.map(|(share, _)| share).min_by(|a, b| (a - 0.5).abs().total_cmp(&(b - 0.5).abs())).unwrap_or(0.5)
}

/// Light that the second method misses, as a part of all, from which on the first is kept.
const LEAD: f64 = 0.02;

/// By how much the second method has to be better where it has footprints, too: the light that both find by these gains
/// less from two halves of the passes than from one whole, because footprints shrink from pass to pass.
const HANDICAP: f64 = 2.0;

/// The turns after those that are known, from a film that has these and no others; `footprints` says whether the second
/// method has footprints like the first. After the opening, which knows little of rare light, the second gets
/// `least` of the work at least.
pub fn next(film: &Film, turns: Turns, footprints: bool, least: f64) -> Turns {
    let passes = film.split_passes().map(|passes| passes.count() as f64);
    let ratio = f64::from(turns.work[0].max(1)) / f64::from(turns.work[1].max(1));
    let handicap = if footprints { HANDICAP } else { 1.0 };
    let share = Standing::of(film).map_or(0.5, |standing| {
        let Some(mut local) = mix::local(film) else { return 0.5 };
        local.iter_mut().for_each(|[_, t, _]| *t *= handicap);
        let found = local.iter().map(|[_, _, bias]| bias).sum::<f64>() / local.len() as f64;
        let rest = (standing.difference - 2.0 * standing.uncertainty - found).max(0.0);
        let whole = passes[0] * ratio + passes[1];
        let share = best_share(&local, rest, [passes[0] * ratio / whole, passes[1] / whole]);
        // Footprints lose light at edges and win next to none. A second method that shows less has not found it yet.
        if standing.lead > LEAD { share.min(0.5) } else { share }
    });
    let share = if turns.then.is_none() { share.max(least) } else { share };
    let round = Some(round_of(share, ratio));
    match turns.then {
        None => Turns { then: round, ..turns },
        Some(_) => Turns { at_last: round, ..turns },
    }
}

/// Squared error of the second method over that of the first for an equal part of the work: for methods that both have
/// no bias worth the name. What one of them has not found in these passes is the difference beyond their noise; it
/// counts for the second as the noise that it will be once that is found. Infinite where nothing is known.
pub fn loss_by_second(film: &Film, work: [f64; 2]) -> f64 {
    let Some(Standing { noise, difference, uncertainty, .. }) = Standing::of(film) else { return f64::INFINITY };
    let missed = (difference - 2.0 * uncertainty).max(0.0);
    let loss = (noise[1] + 4.0 * missed) * work[1] / (noise[0] * work[0]);
    if loss.is_nan() { 1.0 } else { loss }
}

/// The round with this part of the work for the second method, as near as few passes allow; a pass of the first takes
/// `ratio` times the work of one of the second.
fn round_of(share: f64, ratio: f64) -> Round {
    const MOST: f64 = 64.0;
    let seconds = ratio * share / (1.0 - share);
    match seconds {
        s if s >= 4.0 * MOST => Round { first: 0, second: 1 },
        s if s >= 1.0 => Round { first: 1, second: s.min(MOST).round() as u32 },
        s if s > 0.0 => Round { first: (1.0 / s).min(MOST).round() as u32, second: 1 },
        _ => Round { first: 1, second: 1 },
    }
}

#[cfg(test)]
mod tests {
    use super::super::accumulate::PassSet;
    use super::*;
    use crate::random::Random;

    const OPENING: Round = Round { first: 2, second: 6 };

    /// A film of an opening on 64 x 48 pixels about 1: noise of a pass of either method, and the bias of the first.
    fn film(noise: [f64; 2], bias: f64) -> Film {
        film_of(OPENING, noise, bias)
    }

    /// The same for another opening.
    fn film_of(opening: Round, noise: [f64; 2], bias: f64) -> Film {
        let turns = Turns { work: [300, 100], ..Turns::new(opening) };
        let mut film = Film::new(64, 48, [3, 0], false).with_turns(Some(turns));
        film.passes = PassSet::of(0..opening.passes());
        let mut mix = film.mix.take().expect("a second method");
        let mut random = Random(11);
        let both = [(&mut film.sums, opening.first, noise[0], bias), (&mut mix.sums, opening.second, noise[1], 0.0)];
        for (sums, passes, noise, bias) in both {
            for pixel in sums.iter_mut() {
                for _ in 0..passes {
                    let value = ((1.0 + bias + noise * f64::from(random.normal())) / 8.0) as f32;
                    for k in 0..3 {
                        pixel[k] = pixel[k].plus(value);
                        pixel[3 + k] = pixel[3 + k].plus(value * value);
                    }
                }
            }
        }
        film.mix = Some(mix);
        film
    }

    fn next_round(noise: [f64; 2], bias: f64) -> Round {
        let film = film(noise, bias);
        let turns = film.mix.as_ref().expect("a second method").turns;
        let next = next(&film, turns, false, 0.0);
        assert_eq!((next.opening, next.work, next.at_last), (turns.opening, turns.work, None));
        next.then.expect("known")
    }

    #[test]
    fn a_standing_is_what_the_passes_have() {
        let standing = Standing::of(&film([0.2, 0.6], 0.0)).expect("known");
        let expected = [0.2f64.powi(2) / 2.0, 0.6f64.powi(2) / 6.0].map(|x| x / 1.01);
        for (found, expected) in standing.noise.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 0.1, "{found} for {expected}");
        }
        assert!(standing.difference.abs() < 4.0 * standing.uncertainty, "{standing:?}");
        assert!(standing.uncertainty < 0.05 * standing.noise[1], "{standing:?}");
        let biased = Standing::of(&film([0.2, 0.6], 0.3)).expect("known");
        let seen = (biased.difference - standing.difference) / 0.09;
        assert!((seen - 0.8).abs() < 0.2, "of the squared bias, as the mean of both is brighter: {seen}");
        assert_eq!(Standing::of(&Film::new(4, 4, [0; 2], false)), None, "one method");
        let black = Film { sums: vec![[super::super::exact::ExactSum::default(); 9]; 64 * 48], ..film([0.1; 2], 0.0) };
        let mut black = black;
        black.mix.as_mut().expect("a second method").sums = black.sums.clone();
        assert_eq!(Standing::of(&black), None, "black");
    }

    #[test]
    fn the_better_method_gets_the_work() {
        let second = |round: Round| {
            // Passes of the first take three times the work.
            f64::from(round.second) / f64::from(3 * round.first + round.second)
        };
        assert!(second(next_round([0.02, 1.0], 0.0)) < 0.1, "photons");
        let alike = second(next_round([0.4, 0.8], 0.0));
        assert!((0.3..0.7).contains(&alike), "{alike}");
        assert_eq!(next_round([0.02, 0.5], -0.9), Round { first: 0, second: 1 }, "nearly all light is lost");
        assert!(second(next_round([0.02, 1.0], -0.3)) > 0.3, "a bias of a third");
        // What only the first shows has yet to be found by the second.
        let found_by_one = second(next_round([0.02, 0.01], 1.0));
        assert!((0.4..0.6).contains(&found_by_one), "{found_by_one}");
        assert_eq!(next_round([1.0, 0.02], 0.0), Round { first: 0, second: 1 }, "paths");
    }

    /// A single pass of the second method, whose noise its neighbours tell.
    #[test]
    fn a_single_pass_is_enough_for_a_first_look() {
        let round = |noise, least| {
            let film = film_of(Round { first: 2, second: 1 }, noise, 0.0);
            let turns = film.mix.as_ref().expect("a second method").turns;
            next(&film, turns, false, least).then.expect("known")
        };
        let second = |round: Round| f64::from(round.second) / f64::from(3 * round.first + round.second);
        assert!(second(round([0.02, 1.0], 0.0)) < 0.1, "photons");
        assert!(second(round([0.02, 1.0], 0.5)) > 0.45, "at least half");
        assert_eq!(round([1.0, 0.02], 0.0), Round { first: 0, second: 1 }, "paths");
    }

    #[test]
    fn rounds_have_the_parts_of_the_work() {
        for ratio in [0.1, 0.5, 1.0, 3.0, 10.0] {
            for share in [1.0 / 16.0, 0.25, 0.5, 7.0 / 8.0] {
                let Round { first, second } = round_of(share, ratio);
                let found = f64::from(second) / (f64::from(first) * ratio + f64::from(second));
                assert!((found - share).abs() < 0.11, "{share} at {ratio}: {found}");
                assert!(first > 0 && second > 0 && first + second <= 161, "{first} + {second}");
            }
            assert_eq!(round_of(1.0, ratio), Round { first: 0, second: 1 });
        }
        assert_eq!(round_of(0.5, f64::NAN), Round { first: 1, second: 1 });
    }

    #[test]
    fn a_method_that_misses_light_is_not_the_better_one() {
        assert!(loss_by_second(&film([0.5, 0.5], 0.0), [1.0, 0.3]) < 1.0);
        assert!(loss_by_second(&film([0.5, 0.5], 0.0), [0.3, 1.0]) > 1.0);
        assert!(loss_by_second(&film([0.5, 0.5], 0.4), [1.0, 0.3]) > 1.0);
        assert_eq!(loss_by_second(&Film::new(4, 4, [0; 2], false), [1.0; 2]), f64::INFINITY);
    }
}
