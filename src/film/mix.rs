//! Films whose passes are of two methods: one that has little noise and may have a bias that it does not know of, and
//! one that has more noise and none. Each has sums of its own; the picture takes from both what serves it best.
//!
//! Let p be the mean of the first at a pixel, t that of the second, with variances v_p and v_t, and b the bias of p.
//! The sum p + w (t - p) has the least mean square error (1 - w)^2 (v_p + b^2) + w^2 v_t for
//! w = (v_p + b^2) / (v_p + b^2 + v_t). Nobody knows b, but (t - p)^2 has the expectation b^2 + v_p + v_t: what it is
//! above the variances, over a window of some pixels, is the bias. This shrinks an unbiased estimate towards a biased
//! one as James and Stein (1961) shrink towards a point; Green and Strawderman (1991, "A James-Stein type estimator for
//! combining unbiased and possibly biased estimators") give the positive part that is used here. As passes are added,
//! v_t vanishes, w becomes 1 wherever there is a bias, and the picture is right.

use super::accumulate::{Film, LAYER_SUMS, PassSet, SUMS};
use super::exact::ExactSum;
use crate::constants::FILM_SQUARES;

/// A number of passes of either method that follow each other: spread evenly, the first of all of the method that has
/// more, or one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Round {
    /// Of the first method.
    pub first: u32,
    /// Of the second method.
    pub second: u32,
}

impl Round {
    /// Passes of both methods.
    pub const fn passes(self) -> u64 {
        self.first as u64 + self.second as u64
    }

    /// Of the first `index` passes of a single round, of which those of the first method come first, how many are of
    /// either method.
    fn below_in_order(self, index: u64) -> [u64; 2] {
        let firsts = index.min(u64::from(self.first));
        [firsts, index - firsts]
    }

    /// Of the first `index` passes of a sequence of such rounds, how many are of either method.
    fn below(self, index: u64) -> [u64; 2] {
        let [first, second] = [self.first, self.second].map(u64::from);
        let (round, place) = (index / self.passes(), index % self.passes());
        let firsts = (place * first + (self.passes() - 1) / 2) / self.passes();
        [round * first + firsts, round * second + place - firsts]
    }
}

/// Whose turn a pass is, by its global index. The passes of the opening tell which method serves the picture how well,
/// and so what follows ([`super::shares`]); those up to [`Turns::SECOND_LOOK`] tell more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Turns {
    /// The first passes: those of the first method, then those of the second.
    pub opening: Round,
    /// Work of the first pass of either method, in any unit; 0 before there is one.
    #[serde(default)]
    pub work: [u32; 2],
    /// What is repeated after the opening; `None` before this is known, and then there are no further passes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub then: Option<Round>,
    /// What is repeated after the second look; as above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_last: Option<Round>,
}

impl Turns {
    /// Passes before what is repeated from then on is chosen.
    pub const SECOND_LOOK: u64 = 24;
    /// Most passes of a round.
    const LONGEST_ROUND: u64 = 1 << 20;

    /// Turns of which no more than the opening is known, which is shorter than [`Turns::SECOND_LOOK`].
    pub const fn new(opening: Round) -> Self {
        Self { opening, work: [0; 2], then: None, at_last: None }
    }

    /// Turns that are known from the beginning to the end.
    pub const fn always(round: Round) -> Self {
        Self { opening: round, work: [1; 2], then: Some(round), at_last: Some(round) }
    }

    /// Passes of which it is known whose turn they are.
    pub fn known(self) -> u64 {
        match (self.then, self.at_last) {
            (None, _) => self.opening.passes(),
            (Some(_), None) => Self::SECOND_LOOK,
            (Some(_), Some(_)) => u64::MAX,
        }
    }

    /// Whether the pass is of the second method, and its index among those of its method.
    ///
    /// # Panics
    /// Beyond what is known.
    pub fn of(self, index: u64) -> (bool, u64) {
        let [firsts, seconds] = self.below(index);
        let is_second = self.below(index + 1)[1] > seconds;
        (is_second, if is_second { seconds } else { firsts })
    }

    /// Of the passes below an index, how many are of either method.
    fn below(self, index: u64) -> [u64; 2] {
        let ends = [self.opening.passes(), Self::SECOND_LOOK.max(self.opening.passes()), u64::MAX];
        let (mut sums, mut begin) = ([0, 0], 0);
        for (end, round) in ends.into_iter().zip([Some(self.opening), self.then, self.at_last]) {
            if index > begin {
                let (round, index) = (round.expect("the turn is known"), index.min(end) - begin);
                let counts = if begin == 0 { round.below_in_order(index) } else { round.below(index) };
                sums = [sums[0] + counts[0], sums[1] + counts[1]];
            }
            begin = end;
        }
        sums
    }

    /// Passes of either method, by their indices among those of their method.
    pub fn split(self, passes: &PassSet) -> [PassSet; 2] {
        let mut split = [PassSet::default(), PassSet::default()];
        for range in passes.ranges() {
            let (starts, ends) = (self.below(range.start), self.below(range.end));
            for (set, (start, end)) in split.iter_mut().zip(starts.into_iter().zip(ends)) {
                set.unite(&PassSet::of(start..end));
            }
        }
        split
    }

    /// Whether there are passes of either method in the opening, none without a method, and none beyond what is known.
    pub fn fit(self, passes: &PassSet) -> bool {
        let end = passes.ranges().last().map_or(0, |range| range.end);
        let rounds = [Some(self.opening), self.then, self.at_last];
        let possible = rounds.iter().flatten().all(|round| (1..=Self::LONGEST_ROUND).contains(&round.passes()));
        let in_order = self.then.is_some() || self.at_last.is_none();
        possible && in_order && end <= self.known() && self.opening.first > 0 && self.opening.second > 0
    }

    /// What both say of one render; `None` where they contradict each other.
    pub fn agreed(self, other: Self) -> Option<Self> {
        let (less, more) = if self.known() <= other.known() { (self, other) } else { (other, self) };
        let same = less.then.is_none_or(|then| more.then == Some(then));
        let same = same && less.at_last.is_none_or(|at_last| more.at_last == Some(at_last));
        let both = less.work.into_iter().zip(more.work);
        let alike = both.clone().all(|(ours, theirs)| ours == theirs || ours == 0 || theirs == 0);
        let mut work = both.map(|(ours, theirs)| ours.max(theirs));
        let work = std::array::from_fn(|_| work.next().unwrap_or(0));
        (less.opening == more.opening && same && alike).then_some(Self { work, ..more })
    }
}

/// The sums of the second method.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mix {
    /// Which passes they are of.
    pub turns: Turns,
    /// As [`Film::sums`].
    pub sums: Vec<[ExactSum; SUMS]>,
    /// As [`Film::layers`].
    pub layers: Vec<[ExactSum; LAYER_SUMS]>,
}

/// Pixels from the middle of a window to its side.
const REACH: usize = 5;

/// Standard deviation of the weights of a window, in pixels.
const SPREAD: f64 = 2.5;

/// By how much the squared difference of both means has to be above its expectation without bias, as a part of it: in a
/// window of some thirty independent pixels it is that by chance in one of thirty.
const MARGIN: f64 = 0.5;

/// Mean and variance of the mean: three channels.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Estimate {
    /// The mean of the passes.
    mean: [f64; 3],
    /// Its variance, from the spread of the passes; infinite for fewer than two.
    variance: [f64; 3],
}

impl Estimate {
    fn of(sums: &[ExactSum; SUMS], unit: f64, passes: u64) -> Self {
        let n = passes as f64;
        if passes == 0 {
            return Self { mean: [0.0; 3], variance: [f64::INFINITY; 3] };
        }
        let sum = [0, 1, 2].map(|k| sums[k].to_f64() * unit);
        let square = [0, 1, 2].map(|k| sums[FILM_SQUARES as usize + k].to_f64() * unit * unit);
        let variance = |k: usize| {
            let total = square[k] - sum[k] * sum[k] / n;
            // Squares beyond the range of the sums are cut, as if one pass had brought everything; else it is rounding.
            let cut = total < -sum[k] * sum[k] / n / f64::from(1u32 << 20);
            if cut { (sum[k] / n).powi(2) } else { total.max(0.0) / (n - 1.0) / n }
        };
        let variance = [0, 1, 2].map(|k| if passes < 2 { f64::INFINITY } else { variance(k) });
        Self { mean: sum.map(|x| x / n), variance }
    }
}

/// What the film of two methods says of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixed {
    /// Weight of the second method, 0 to 1.
    pub weight: f64,
    /// Squared bias of the first method, per channel: the mean over a window.
    pub squared_bias: f64,
}

/// What both methods show of a pixel; sums over channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Compared {
    /// Variances of the means of both; infinite for fewer than two passes, but see [`compared`].
    pub variances: [f64; 2],
    /// The mean of the second less that of the first, per channel.
    pub apart: [f64; 3],
    /// Means of both over the root of 3: the root of the sum of squares for grey.
    pub means: [f64; 2],
}

impl Compared {
    /// What both show, in equal parts.
    pub fn mean(&self) -> f64 {
        0.5 * (self.means[0] + self.means[1])
    }

    /// Squared difference of both means.
    pub fn difference(&self) -> f64 {
        self.apart.iter().map(|x| x * x).sum()
    }

    /// Variances of both, squared difference and mean of the second, relative to a squared value.
    fn over(&self, square: f64) -> [f64; 4] {
        let [p, t] = self.variances;
        [p / square, t / square, self.difference() / square, self.means[1] / square.sqrt()]
    }
}

/// For each pixel what both methods show; `None` for films of one method, and for those with no passes of one of them.
/// The variances of a single pass of the second method are told by neighbours, if the first has two passes or more.
pub(super) fn compared(film: &Film) -> Option<Vec<Compared>> {
    let mix = film.mix.as_ref()?;
    let unit = 2f64.powi(film.exponents[0]);
    let [first, second] = film.split_passes().map(|passes| passes.count());
    if first == 0 || second == 0 {
        return None;
    }
    let of = |(p, t): (&[ExactSum; SUMS], &[ExactSum; SUMS])| {
        let (p, t) = (Estimate::of(p, unit, first), Estimate::of(t, unit, second));
        let sum = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>();
        Compared {
            variances: [sum(&|k| p.variance[k]), sum(&|k| t.variance[k])],
            apart: [0, 1, 2].map(|k| t.mean[k] - p.mean[k]),
            means: [&p, &t].map(|estimate| estimate.mean.iter().sum::<f64>() / 3f64.sqrt()),
        }
    };
    let mut pixels: Vec<Compared> = film.sums.iter().zip(&mix.sums).map(of).collect();
    if first > 1 && second == 1 {
        from_neighbours(&mut pixels, film.width as usize);
    }
    Some(pixels)
}

/// The variances of a single pass of the second method: from how far what is between both methods differs from pixel to
/// pixel. The first has little noise, and most of that in common with its neighbours; what is seen is the same in both.
fn from_neighbours(pixels: &mut [Compared], width: usize) {
    let apart: Vec<[f64; 3]> = pixels.iter().map(|pixel| pixel.apart).collect();
    let half_square = |i: usize, k: usize| (0..3).map(|c| (apart[i][c] - apart[k][c]).powi(2)).sum::<f64>() / 2.0;
    let count = apart.len();
    for (i, pixel) in pixels.iter_mut().enumerate() {
        let aside = [(i % width > 0).then(|| i - 1), (i % width + 1 < width).then_some(i + 1)];
        let above = [i.checked_sub(width), Some(i + width).filter(|k| *k < count)];
        let near: Vec<f64> = aside.into_iter().chain(above).flatten().map(|k| half_square(i, k)).collect();
        // A picture of one pixel tells nothing.
        if !near.is_empty() {
            pixel.variances[1] = near.iter().sum::<f64>() / near.len() as f64;
        }
    }
}

/// What counts against the value of a pixel, as a part of the squared mean of the picture: differences between dark
/// pixels do not.
const FLOOR: f64 = 0.3;

/// Independent pixels of a window.
const WINDOW: f64 = 30.0;

/// Events that the second method must have seen in a window before its spread counts.
const FEW_EVENTS: f64 = 16.0;

/// The spread of n passes of the second method is mostly smaller than it should be, as its bright samples are rare: it
/// counts as 1 + this / n^2 times as large. Of laws with 1 / n and 1 / n^2 and factors from 4 to 128 this one had the
/// least error over nineteen scenes.
const FEW_PASSES: f64 = 32.0;

/// For each pixel, what of the second method goes into the picture; nothing for films of one method.
pub fn mixed(film: &Film) -> Vec<Mixed> {
    if film.mix.is_none() {
        return vec![];
    }
    let Some(pixels) = compared(film) else {
        let [_, second] = film.split_passes().map(|passes| passes.count());
        let weight = if second > 0 { 1.0 } else { 0.0 };
        return vec![Mixed { weight, squared_bias: 0.0 }; film.sums.len()];
    };
    let [first, second] = film.split_passes().map(|passes| passes.count());
    if first > 1 && second == 1 {
        // Where a single pass has found nothing, it would seem to be sure of that.
        return vec![Mixed { weight: 0.0, squared_bias: 0.0 }; film.sums.len()];
    }
    let few = few_passes(film);
    let (windows, scales) = windows(&pixels, film.width as usize);
    let best = windows.into_iter().map(|[p, t, difference, mean]| best([p, t * few, difference, mean]));
    best.zip(scales).map(|(at, scale)| Mixed { squared_bias: at.squared_bias * scale, ..at }).collect()
}

/// By how much the variance of the second method counts more than its passes tell.
fn few_passes(film: &Film) -> f64 {
    1.0 + FEW_PASSES / (film.split_passes()[1].count() as f64).powi(2)
}

/// Around each pixel, over a window: variances of both methods, squared difference, mean of the second, relative to
/// what is there; and what they are relative to.
fn windows(pixels: &[Compared], width: usize) -> (Vec<[f64; 4]>, Vec<f64>) {
    // Relative to what is there, or a window would tell of its brightest pixel and of nothing else; to the lesser of
    // both, so that a rare bright sample does not hide behind itself.
    let mean = pixels.iter().map(Compared::mean).sum::<f64>() / pixels.len() as f64;
    let scale = |pixel: &Compared| {
        let [p, t] = pixel.means;
        (p.min(t).max(0.0).powi(2) + FLOOR * mean * mean).max(f64::MIN_POSITIVE)
    };
    let scales: Vec<f64> = pixels.iter().map(scale).collect();
    let mut relative: Vec<[f64; 4]> = pixels.iter().zip(&scales).map(|(pixel, scale)| pixel.over(*scale)).collect();
    temper(&mut relative, width);
    (blurred(&relative, width), scales)
}

/// What a pixel's variance by the first method may be above the square of the mean of roots around it.
const OUTLIER: f64 = 4.0;

/// Lessens what single pixels say where the first method has far more noise than around them: the edge of a lamp would
/// speak for the wall beside it. The second method is not asked, as rare bright samples are what its noise is made of.
///
/// Twice, as a pixel of a million times the noise of others is a part of its own surroundings.
fn temper(relative: &mut [[f64; 4]], width: usize) {
    for _ in 0..2 {
        let roots: Vec<[f64; 1]> = relative.iter().map(|[p, ..]| [p.sqrt()]).collect();
        for (pixel, [root]) in relative.iter_mut().zip(blurred(&roots, width)) {
            let most = OUTLIER * root * root;
            if pixel[0].is_finite() && pixel[0] > most {
                let part = most / pixel[0];
                (0..3).for_each(|k| pixel[k] *= part);
            }
        }
    }
}

/// Around each pixel, over a window: variances of the means of both methods and squared bias of the first, relative to
/// what is there, as relative errors are defined in `crate::compare::metrics`, without the pixels of most noise. `None`
/// as of [`compared`], for a black picture, or where a variance is not known.
pub(super) fn local(film: &Film) -> Option<Vec<[f64; 3]>> {
    let pixels = compared(film)?;
    let width = film.width as usize;
    let mut relative = relative_to_means(&pixels, width)?;
    let mut noises: Vec<f64> = relative.iter().map(|[p, t, ..]| p + t).collect();
    if noises.iter().any(|noise| !noise.is_finite()) {
        return None;
    }
    noises.sort_unstable_by(f64::total_cmp);
    let most = noises[noises.len() - 1 - (noises.len() as f64 * LEFT_OUT) as usize];
    for pixel in relative.iter_mut().filter(|[p, t, ..]| p + t > most) {
        *pixel = [0.0; 4];
    }
    temper(&mut relative, width);
    let few = few_passes(film);
    let bias = |[p, t, difference, mean]: [f64; 4]| [p, t, 3.0 * best([p, t * few, difference, mean]).squared_bias];
    Some(blurred(&relative, width).into_iter().map(bias).collect())
}

/// Part of the pixels that is left out, as of the errors of pictures: those with the most noise.
pub(super) const LEFT_OUT: f64 = 1e-3;

/// For each pixel the variances of both methods, the squared difference and the mean of the second, relative to the
/// mean of a window: its square has next to no noise, which a mean of squares has. `None` for a black picture.
pub(super) fn relative_to_means(pixels: &[Compared], width: usize) -> Option<Vec<[f64; 4]>> {
    let own: Vec<[f64; 1]> = pixels.iter().map(|pixel| [pixel.mean()]).collect();
    let means = blurred(&own, width);
    let mean = own.iter().map(|[mean]| mean).sum::<f64>() / own.len() as f64;
    if mean.is_nan() || mean <= 0.0 {
        return None;
    }
    let relative = |(pixel, [at]): (&Compared, &[f64; 1])| pixel.over(at * at + 0.01 * mean * mean);
    Some(pixels.iter().zip(&means).map(relative).collect())
}

/// The best weight for these variances, this squared difference, and this mean of the second method. Where a single
/// pass has no variance, what the difference is above that of the other one has to serve; and so where the second
/// method has seen few events, as its variance is then mostly too small: light that it has not found yet is no bias of
/// the first.
fn best([p, t, difference, mean]: [f64; 4]) -> Mixed {
    let weighed = |p: f64, t: f64, bias: f64| {
        let sum = p + bias + t;
        Mixed { weight: if sum > 0.0 { (p + bias) / sum } else { 0.5 }, squared_bias: bias / 3.0 }
    };
    let knows = WINDOW * mean * mean >= FEW_EVENTS * t;
    match (p.is_finite(), t.is_finite()) {
        (true, true) if knows && mean > 0.0 => weighed(p, t, (difference - (p + t) * (1.0 + MARGIN)).max(0.0)),
        (true, true) => weighed(p, t.max(difference - p), 0.0),
        (false, true) => weighed(0.0, t, (difference - t).max(0.0)),
        (true, false) => weighed(p, (difference - p).max(0.0), 0.0),
        (false, false) => weighed(1.0, 1.0, 0.0),
    }
}

/// Means over windows with the weights of a bell curve.
pub(super) fn blurred<const N: usize>(numbers: &[[f64; N]], width: usize) -> Vec<[f64; N]> {
    let height = numbers.len() / width.max(1);
    let weight = |d: usize| (-0.5 * (d as f64 / SPREAD).powi(2)).exp();
    let pass = |source: &[[f64; N]], length: usize, place: &dyn Fn(usize, usize) -> usize, lines: usize| {
        let mut result = vec![[0.0; N]; source.len()];
        for line in 0..lines {
            for at in 0..length {
                let (mut sum, mut total) = ([0.0; N], 0.0);
                for near in at.saturating_sub(REACH)..(at + REACH + 1).min(length) {
                    let g = weight(near.abs_diff(at));
                    let value = source[place(line, near)];
                    sum = std::array::from_fn(|k| sum[k] + g * value[k]);
                    total += g;
                }
                result[place(line, at)] = sum.map(|x| x / total);
            }
        }
        result
    };
    let rows = pass(numbers, width, &|line, at| line * width + at, height);
    pass(&rows, height, &|line, at| at * width + line, width)
}

#[cfg(test)]
mod tests;
#[cfg(test)]
use crate::random::Random;
