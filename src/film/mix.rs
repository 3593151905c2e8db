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
    /// Variance of a single pass of the second method, per channel: the mean over a window. 0 with more passes, which
    /// tell theirs by themselves.
    pub single: f64,
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
        return vec![Mixed { weight, squared_bias: 0.0, single: 0.0 }; film.sums.len()];
    };
    let few = few_passes(film);
    let (windows, scales) = windows(&pixels, film.width as usize);
    let is_single = film.split_passes()[1].count() == 1;
    let of = |([p, t, difference, mean], scale): ([f64; 4], f64)| {
        let at = best([p, t * few, difference, mean]);
        let single = if is_single && t.is_finite() { t * scale / 3.0 } else { 0.0 };
        Mixed { squared_bias: at.squared_bias * scale, single, ..at }
    };
    windows.into_iter().zip(scales).map(of).collect()
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
    let relative = |(pixel, scale): (&Compared, &f64)| {
        let Compared { variances: [p, t], means: [_, second], .. } = *pixel;
        [p / scale, t / scale, pixel.difference() / scale, second / scale.sqrt()]
    };
    let mut relative: Vec<[f64; 4]> = pixels.iter().zip(&scales).map(relative).collect();
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
    let relative = |(pixel, [at]): (&Compared, &[f64; 1])| {
        let scale = at * at + 0.01 * mean * mean;
        let [p, t] = pixel.variances;
        [p / scale, t / scale, pixel.difference() / scale, pixel.means[1] / scale.sqrt()]
    };
    Some(pixels.iter().zip(&means).map(relative).collect())
}

/// The best weight for these variances, this squared difference, and this mean of the second method. Where a single
/// pass has no variance, what the difference is above that of the other one has to serve; and so where the second
/// method has seen few events, as its variance is then mostly too small: light that it has not found yet is no bias of
/// the first.
fn best([p, t, difference, mean]: [f64; 4]) -> Mixed {
    let weighed = |p: f64, t: f64, bias: f64| {
        let sum = p + bias + t;
        Mixed { weight: if sum > 0.0 { (p + bias) / sum } else { 0.5 }, squared_bias: bias / 3.0, single: 0.0 }
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
mod tests {
    use super::*;
    use crate::random::Random;

    const TURNS: Turns = Turns::always(Round { first: 2, second: 3 });

    #[test]
    fn every_pass_is_of_one_method() {
        let of = |index| TURNS.of(index);
        // An opening in order, then rounds that are spread.
        assert_eq!([0, 1, 2, 3, 4].map(of), [(false, 0), (false, 1), (true, 0), (true, 1), (true, 2)]);
        assert_eq!([5, 6, 7, 8, 9].map(of), [(true, 3), (false, 2), (true, 4), (false, 3), (true, 5)]);
        let rounds = |then, at_last| Turns { then: Some(then), at_last: Some(at_last), ..TURNS };
        let [photons, paths] = [Round { first: 1, second: 0 }, Round { first: 0, second: 1 }];
        for turns in [TURNS, rounds(photons, paths), rounds(paths, Round { first: 16, second: 1 })] {
            for range in [0..0, 0..5, 1..3, 7..60, 39..41, (1 << 32) - 7..1 << 32] {
                let mut expected = [PassSet::default(), PassSet::default()];
                for index in range.clone() {
                    let (second, own) = turns.of(index);
                    assert!(expected[usize::from(second)].insert(own), "pass {index} twice");
                }
                assert_eq!(turns.split(&PassSet::of(range.clone())), expected, "{range:?}");
            }
        }
        // Ranges apart from each other stay apart or grow together, whichever their passes do.
        let apart: PassSet = "0..2,5..7".parse().expect("a set");
        assert_eq!(TURNS.split(&apart).map(|passes| passes.to_string()), ["0..3", "3..4"]);
        assert_eq!(TURNS.split(&PassSet::of(1..6)).map(|passes| passes.to_string()), ["1..2", "0..4"]);
    }

    #[test]
    fn turns_are_known_as_far_as_they_were_chosen() {
        let opening = Turns::new(TURNS.opening);
        let looked = Turns { work: [30, 10], then: Some(Round { first: 1, second: 1 }), ..opening };
        let whole = Turns { at_last: Some(Round { first: 0, second: 1 }), ..looked };
        assert_eq!([opening, looked, whole].map(Turns::known), [5, Turns::SECOND_LOOK, u64::MAX]);
        assert!(whole.of(u64::MAX - 1).0);
        for (one, other) in [(opening, looked), (looked, whole), (opening, whole), (whole, whole)] {
            assert_eq!((one.agreed(other), other.agreed(one)), (Some(other), Some(other)));
        }
        let otherwise = Turns { then: Some(Round { first: 1, second: 2 }), ..looked };
        assert_eq!((otherwise.agreed(whole), whole.agreed(otherwise)), (None, None));
        assert_eq!(Turns { work: [31, 10], ..looked }.agreed(whole), None);
        // The passes that tell the work of either method may be in two films.
        let [one, other] = [[30, 0], [0, 10]].map(|work| Turns { work, ..opening });
        assert_eq!(one.agreed(other), Some(Turns { work: [30, 10], ..opening }));
        assert_eq!(Turns::new(Round { first: 3, second: 2 }).agreed(whole), None);
        // What a film may say of itself.
        let passes = |text: &str| text.parse::<PassSet>().expect("a set");
        assert!(opening.fit(&passes("0..5")) && !opening.fit(&passes("5..6")) && looked.fit(&passes("5..24")));
        assert!(!looked.fit(&passes("24..25")) && whole.fit(&passes("7..1000")));
        for damaged in [
            Turns { then: Some(Round { first: 0, second: 0 }), ..looked },
            Turns { then: None, ..whole },
            Turns::new(Round { first: 0, second: 2 }),
            Turns::new(Round { first: u32::MAX, second: 2 }),
        ] {
            assert!(!damaged.fit(&passes("")), "{damaged:?}");
        }
    }

    /// A film of 40 x 30 pixels: the first method has noise of 0.02 about 1 plus a bias that grows from left to right,
    /// the second noise of 0.2 about 1.
    fn film(passes: u64, bias: f64) -> Film {
        let mut film = Film::new(40, 30, [3, 0], false).with_turns(Some(TURNS));
        film.passes = PassSet::of(0..passes);
        let mut random = Random(7);
        let mut mix = film.mix.take().expect("a second method");
        for index in 0..passes {
            let (second, _) = TURNS.of(index);
            let (target, noise) = if second { (&mut mix.sums, 0.2) } else { (&mut film.sums, 0.02) };
            for (pixel, sums) in target.iter_mut().enumerate() {
                let offset = if second { 0.0 } else { bias * (pixel % 40) as f64 / 39.0 };
                for k in 0..3 {
                    let value = ((1.0 + offset + noise * f64::from(random.normal())) / 8.0) as f32;
                    sums[k] = sums[k].plus(value);
                    sums[3 + k] = sums[3 + k].plus(value * value);
                }
            }
        }
        film.mix = Some(mix);
        film
    }

    fn mean_square_error(film: &Film, columns: std::ops::Range<usize>) -> f64 {
        let picture = film.picture();
        let wanted = |(i, _): &(usize, &f32)| columns.contains(&(i / 3 % 40));
        let errors: Vec<f64> =
            picture.layers[0].data.iter().enumerate().filter(wanted).map(|(_, x)| f64::from(x - 1.0).powi(2)).collect();
        errors.iter().sum::<f64>() / errors.len() as f64
    }

    #[test]
    fn a_bias_that_the_second_method_shows_goes_and_the_rest_stays() {
        let passes = 500;
        let film = film(passes, 0.3);
        let (first, second) = (0.02f64.powi(2) / 200.0, 0.2f64.powi(2) / 300.0);
        // On the right the first method alone would be off by 0.3, on the left it has a sixtieth of the noise.
        let (left, right) = (mean_square_error(&film, 0..1), mean_square_error(&film, 36..40));
        println!("left {left:.2e} of {second:.2e}, right {right:.2e}");
        assert!((0.8 * second..1.2 * second).contains(&right), "{right} for {second}");
        let unbiased = mean_square_error(&super::tests::film(passes, 0.0), 0..40);
        println!("without bias {unbiased:.2e} of {first:.2e}");
        assert!(unbiased < 4.0 * first, "{unbiased} for {first} of the first method alone and {second} of the second");
        let weights = mixed(&film);
        assert!(weights[20 * 40 + 38].weight > 0.98 && weights.iter().all(|w| (0.0..=1.0).contains(&w.weight)));
        let bias = weights[20 * 40 + 38].squared_bias.sqrt();
        assert!((bias / 0.29 - 1.0).abs() < 0.1, "{bias}");
    }

    #[test]
    fn few_passes_make_a_picture() {
        let all = |film: &Film, weight: f64| mixed(film).iter().all(|w| w.weight == weight);
        assert!((0..3).all(|passes| all(&film(passes, 0.3), 0.0)), "passes of the first");
        let only_second = Film { passes: PassSet::of(3..4), ..film(5, 0.3) };
        assert!(all(&only_second, 1.0), "one pass of the second");
        let mean = |film: &Film, columns: std::ops::Range<usize>| {
            let weights = mixed(film);
            let wanted = weights.iter().enumerate().filter(|(i, _)| columns.contains(&(i % 40)));
            wanted.map(|(_, w)| w.weight).sum::<f64>() / (30 * columns.len()) as f64
        };
        // A single pass of the second tells its noise by neighbours, and no bias.
        let three = film(3, 0.9);
        assert!(mean(&three, 0..40) < 0.05 && mean_square_error(&three, 0..5) < 0.1 * 0.04);
        let told = compared(&three).expect("both");
        let variance = told.iter().map(|pixel| pixel.variances[1]).sum::<f64>() / told.len() as f64;
        assert!((variance / (3.0 * 0.2f64.powi(2)) - 1.0).abs() < 0.1, "{variance}");
        // Three of them do: where the first has no bias, it has less noise, and is taken.
        let five = film(5, 0.9);
        println!("{:.2} {:.2}", mean(&five, 0..5), mean(&five, 30..40));
        assert!(mean(&five, 0..5) < 0.3 && mean(&five, 30..40) > 0.6);
        assert!(mean_square_error(&five, 0..5) < 0.5 * 0.04 / 3.0, "half of the noise of the second");
        // A part of a render may have one pass of the first, and no more.
        assert!(best([f64::INFINITY, 0.01, 1.0, 1.0]).weight > 0.9);
        assert!(best([f64::INFINITY, 0.01, 0.01, 1.0]).weight < 0.1);
        assert_eq!(best([f64::INFINITY; 4]).weight, 0.5);
        assert_eq!(mixed(&Film::new(2, 2, [0; 2], false)), []);
    }

    /// The edge of a lamp, where the first method has much noise, does not make the wall beside it take the second.
    #[test]
    fn a_pixel_of_much_noise_speaks_for_itself() {
        let weights = |edge: f64| {
            let mut relative = vec![[1e-4, 1e-2, 1.2e-2, 1.0]; 40 * 30];
            relative[15 * 40 + 20] = [edge, edge, 2.0 * edge, 1.0];
            temper(&mut relative, 40);
            blurred(&relative, 40).into_iter().map(best).map(|at| at.weight).collect::<Vec<_>>()
        };
        let (even, with) = (weights(1e-4), weights(100.0));
        assert!(even[15 * 40 + 22] < 0.02 && with[15 * 40 + 22] < 0.05, "{}", with[15 * 40 + 22]);
        let mut untempered = vec![[1e-4, 1e-2, 1.2e-2, 1.0]; 40 * 30];
        untempered[15 * 40 + 20] = [100.0, 100.0, 200.0, 1.0];
        assert!(best(blurred(&untempered, 40)[15 * 40 + 22]).weight > 0.4, "it would");
        // What the second shows in one pixel of many is its noise, and stays.
        let mut rare = vec![[1e-4, 0.0, 1e-4, 1.0]; 40 * 30];
        rare[15 * 40 + 20] = [1e-4, 1.0, 1.0, 1.0];
        let before = rare.clone();
        temper(&mut rare, 40);
        assert_eq!(rare, before);
    }

    #[test]
    fn what_the_second_method_has_not_found_stays() {
        // The first shows light everywhere, the second none, or in one pixel of a hundred: no bias of the first.
        let (first, few, many) = (0.01, 0.3, 4e-4);
        for (t, mean) in [(0.0, 0.0), (few, 0.1)] {
            let at = best([first, t, 1.0, mean]);
            assert!(at.weight < 0.02 && at.squared_bias == 0.0, "{at:?}");
        }
        // A second that has seen enough is believed.
        let at = best([first, many, 0.09, 0.7]);
        assert!(at.weight > 0.98 && at.squared_bias > 0.02, "{at:?}");
    }

    #[test]
    fn parts_add_up() {
        let whole = film(20, 0.1);
        let mut sum = Film { passes: PassSet::of(0..0), ..Film::new(40, 30, [3, 0], false).with_turns(Some(TURNS)) };
        sum.merge(&whole).expect("the same turns");
        assert_eq!(sum, whole);
        let other = Film::new(40, 30, [3, 0], false).with_turns(Some(Turns::always(Round { first: 1, second: 3 })));
        assert!(sum.merge(&other).is_err() && sum.merge(&Film::new(40, 30, [3, 0], false)).is_err());
    }
}
