//! An estimate of the error of a film, from the film alone. Noise follows from the spread of the passes. The bias of
//! finite footprints follows from the trend of the passes with the size of the footprints.
//!
//! **Noise.** The standard error of a mean of N independent passes is the root of their variance over N. Samples are
//! stratified over passes, so for direct light and edges the true error is often smaller; it is not greater.
//!
//! **Bias.** A kernel estimate of radius r is off by a multiple of r^2 to leading order (Silverman 1986, section 4.3;
//! for photons Hachisuka, Jarosz and Jensen 2010, equation 12; for radii that follow the pass alone Knaus and Zwicker
//! 2011, section 4). Pass i then has the expectation L + B x_i, where x_i is its squared footprint scale, and every
//! pass is one observation of that line: B is the slope of the regression of the passes on x_i, and B mean(x) the bias
//! of their mean. This needs one more sum per pixel, sum x_i v_i, but neither Laplacians nor a second radius, and it
//! uses all passes. The noise of photons grows as 1 / x. The slope depends mostly on the early passes, whose x is large
//! and whose noise is therefore small. Where the noise is the same in all passes (most of the light is direct), part of
//! it is taken for bias, and the estimate is too great by up to a factor of 2. Where the bias falls more slowly than
//! r^2, it is underestimated: at edges it falls with r, and at a step of the light it stays until the footprint no
//! longer reaches the step.
//!
//! **Light not seen yet.** A pixel that no photon has reached has no spread, but it may have an error. An event with
//! probability p per pass is missed by N passes with probability (1 - p)^N. So with confidence c its expected number in
//! N passes is less than ln(1 / (1 - c)) (for 95 % the rule of three; Hanley and Lippman-Hand 1983). This number, times
//! the brightness of one event, is added to the bound of every pixel. The brightness is variance over mean where events
//! are rare (Fano 1947); where they are common, this is small against the noise. A pixel with few events uses those of
//! its neighbours as well. Where there are none, [`Model::event`] is used: the light of one photon.

use super::accumulate::{Film, PassSet, SUMS};
use super::exact::ExactSum;
use super::mix::{Mixed, mixed};
use crate::compare::metrics::TRIM;
use crate::compare::quantiles;
use crate::constants::{FILM_SCALED, FILM_SQUARES};

/// What is known about the bias of a film.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bias {
    /// Proportional to the squared footprint scale: estimated.
    Estimated,
    /// The method has none.
    None,
    /// There is bias that the passes do not show, because footprints do not follow the schedule or light is filtered
    /// over the picture. The estimate holds the noise alone.
    Unknown,
}

impl Bias {
    /// For reports: `estimated`, `none`, `unknown`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Estimated => "estimated",
            Self::None => "none",
            Self::Unknown => "unknown",
        }
    }
}

/// What has to be known about a render besides its film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// How the bias behaves.
    pub bias: Bias,
    /// Radiance that one photon adds to a pixel within its footprint at scale 1, on a white surface: red, green, blue.
    pub event: [f64; 3],
}

/// Sums over the squared footprint scales of the passes of a film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule {
    count: f64,
    /// Mean of x.
    mean: f64,
    /// Sum of (x - mean)^2.
    spread: f64,
    /// Sum of (x - mean)^2 / x over the mean of 1 / x, in units of `spread`. If the noise grows as 1 / x, as that of
    /// photons does, the variance of the slope is this part of what it is if all passes have the same noise.
    leverage: f64,
}

impl Schedule {
    /// `scale` is the footprint scale of a pass by its global index, at most 1, greater than 0.
    pub fn of(passes: &PassSet, scale: impl Fn(u64) -> f32) -> Self {
        let (mut n, mut sum, mut squares, mut inverse) = (0.0, 0.0, 0.0, 0.0);
        for index in passes.ranges().iter().cloned().flatten() {
            let r = scale(index);
            // Rounded as the film's kernel does it.
            let x = f64::from(r * r);
            n += 1.0;
            sum += x;
            squares += x * x;
            inverse += 1.0 / x;
        }
        let mean = if n > 0.0 { sum / n } else { 0.0 };
        let spread: f64 = squares - sum * mean;
        // Passes of one size say nothing about a trend.
        let spread = if spread > 1e-9 * squares { spread } else { 0.0 };
        let weighted = sum - 2.0 * n * mean + mean * mean * inverse;
        let leverage = if spread > 0.0 { weighted * n / (inverse * spread) } else { 0.0 };
        Self { count: n, mean, spread, leverage }
    }
}

/// One channel of one pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Number {
    mean: f32,
    /// Standard error of the mean.
    noise: f32,
    /// Of the mean.
    bias: f32,
    /// Standard error of the bias.
    bias_noise: f32,
}

impl Number {
    /// The picture's number, made of that of the first method and that of the second. Its bias is what remains of that
    /// of the first, which both together show. Where the noise of the first is not known (fewer than two passes), it is
    /// in the picture because it seems no worse than the second.
    fn mixed_with(self, second: Self, at: Mixed, is_first_known: bool) -> Self {
        let (w, rest) = (at.weight, 1.0 - at.weight);
        let bias = if is_first_known { at.squared_bias.sqrt().max(f64::from(self.bias.abs())) } else { 0.0 };
        let noise = if is_first_known { self.noise } else { second.noise };
        Self {
            mean: (rest * f64::from(self.mean) + w * f64::from(second.mean)) as f32,
            noise: (rest * f64::from(noise)).hypot(w * f64::from(second.noise)) as f32,
            bias: (bias * rest) as f32,
            bias_noise: (rest * f64::from(self.bias_noise)) as f32,
        }
    }

    /// Variance over mean: brightness of one event where events are rare.
    fn event(&self, passes: f64) -> f64 {
        if self.mean > 0.0 { f64::from(self.noise).powi(2) * passes / f64::from(self.mean) } else { 0.0 }
    }

    /// Number of equal rare events that would have this mean and this noise; infinite without noise.
    fn events(&self) -> f64 {
        if self.noise > 0.0 { (f64::from(self.mean) / f64::from(self.noise)).powi(2) } else { f64::INFINITY }
    }
}

/// The error of a film.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorEstimate {
    /// What of the bias is in it.
    pub bias: Bias,
    /// Estimated root of the mean over pixels of the squared relative error, like the root of
    /// [`crate::compare::metrics::Metrics::relmse_trimmed`] for pictures of mean luminance one: a pixel's error counts
    /// against its value and a tenth of the picture's mean luminance, whichever is more, and the worst 0.1 % of the
    /// pixels are left out. It is the mean and not the median, because the median is small even if a tenth of the
    /// pixels, such as caustics, is still noisy. Light that no pass has seen is not included.
    ///
    /// `None` where it is unknown: for fewer than two passes, and for a picture that is black so far.
    pub relative: Option<f64>,
    width: usize,
    /// Passes, of the method that has more of them.
    count: f64,
    schedule: Schedule,
    model: Model,
    numbers: Vec<[Number; 3]>,
}

/// Fewer events than this in a pixel say little about how bright one is.
const FEW_EVENTS: f64 = 16.0;

impl ErrorEstimate {
    /// The error of a film of a render with this model; `schedule` is that of the film's passes.
    pub fn of(film: &Film, schedule: Schedule, model: Model) -> Self {
        let unit = 2f64.powi(film.exponents[0]);
        let number = |sums: &[ExactSum; SUMS], k: usize| {
            let [sum, squares, products] =
                [k, FILM_SQUARES as usize + k, FILM_SCALED as usize + k].map(|i| sums[i].to_f64() * unit);
            number([sum, squares * unit, products], schedule, model.bias)
        };
        let mut numbers: Vec<[Number; 3]> = film.sums.iter().map(|sums| [0, 1, 2].map(|k| number(sums, k))).collect();
        let second = film.split_passes()[1].count() as f64;
        if let Some(mix) = &film.mix {
            let of_second = |sums: &[ExactSum; SUMS], k: usize| {
                let [sum, squares] = [k, FILM_SQUARES as usize + k].map(|i| sums[i].to_f64() * unit);
                let schedule = Schedule { count: second, mean: 0.0, spread: 0.0, leverage: 0.0 };
                self::number([sum, squares * unit, 0.0], schedule, Bias::None)
            };
            let is_first_known = schedule.count >= 2.0;
            for ((ours, theirs), at) in numbers.iter_mut().zip(&mix.sums).zip(mixed(film)) {
                *ours = std::array::from_fn(|k| ours[k].mixed_with(of_second(theirs, k), at, is_first_known));
            }
        }
        let most = schedule.count.max(second);
        // Footprints spread what is rare; of two methods in turns the estimate became far too great behind glass.
        let has_rare_paths = model.bias == Bias::None && film.mix.is_none();
        let relative = if most < 2.0 { None } else { relative(&numbers, film.width as usize, has_rare_paths) };
        Self { bias: model.bias, relative, width: film.width as usize, count: most, schedule, model, numbers }
    }

    /// Passes in the film; of two methods, those of the one that has more.
    pub fn passes(&self) -> u64 {
        self.count as u64
    }

    /// Standard error of the mean, from the spread of the passes: per pixel, row by row, red, green and blue; infinite
    /// for fewer than two passes.
    pub fn standard_error(&self) -> Vec<f32> {
        let known = self.count >= 2.0;
        self.numbers.as_flattened().iter().map(|n| if known { n.noise } else { f32::INFINITY }).collect()
    }

    /// Estimated difference between the expectation of the mean and the limit of infinitely small footprints: per
    /// pixel, row by row, red, green and blue; zero unless [`Bias::Estimated`] and for fewer than three passes.
    pub fn bias_of_mean(&self) -> Vec<f32> {
        self.numbers.as_flattened().iter().map(|n| n.bias).collect()
    }

    /// What the error of the picture stays below with probability `confidence` (0 ... 1, exclusive) at each pixel: row
    /// by row, red, green and blue; infinite for fewer than two passes. Errors of neighbours are not independent.
    pub fn bound(&self, confidence: f64) -> Vec<f32> {
        if self.count < 2.0 {
            return vec![f32::INFINITY; 3 * self.numbers.len()];
        }
        let fitted = if self.has_trend() { 2 } else { 1 };
        let t = quantiles::student(0.5 + 0.5 * confidence, self.passes() - fitted);
        let unseen = -(1.0 - confidence).ln() / self.count;
        let at = |(pixel, channel): (usize, usize)| {
            let noise = f64::from(self.numbers[pixel][channel].noise);
            let seen = t * (noise * noise + self.squared_bias(pixel, channel)).sqrt();
            (seen + unseen * self.event(pixel, channel)) as f32
        };
        (0..self.numbers.len()).flat_map(|pixel| [0, 1, 2].map(|k| (pixel, k))).map(at).collect()
    }

    fn has_trend(&self) -> bool {
        fits_trend(self.schedule, self.bias)
    }

    /// Mean over the pixel and its neighbours, because one slope alone may be near zero by chance. A squared slope is
    /// on average too great by its own variance; only half of that is taken off, because neighbours that share photons
    /// err alike.
    fn squared_bias(&self, pixel: usize, channel: usize) -> f64 {
        let excess = |n: Number| f64::from(n.bias).powi(2) - 0.5 * f64::from(n.bias_noise).powi(2);
        let (count, sum) =
            self.around(pixel).fold((0.0, 0.0), |(n, sum), at| (n + 1.0, sum + excess(self.numbers[at][channel])));
        (sum / count).max(0.0)
    }

    /// Brightness that one more event at this pixel may have.
    fn event(&self, pixel: usize, channel: usize) -> f64 {
        let n = self.numbers[pixel][channel];
        let events = n.events();
        if n.noise > 0.0 && events >= FEW_EVENTS {
            return n.event(self.count);
        }
        let around = self.around(pixel).map(|at| self.numbers[at][channel].event(self.count));
        let seen = around.fold(0.0, f64::max);
        // Scales shrink, so most of what was missed would have come early and been as bright as its pass made it.
        let unseen = if self.schedule.mean > 0.0 { self.model.event[channel] / self.schedule.mean } else { 0.0 };
        if n.noise > 0.0 { seen } else { seen.max(unseen) }
    }

    fn around(&self, pixel: usize) -> impl Iterator<Item = usize> {
        around(pixel, self.numbers.len(), self.width)
    }
}

fn fits_trend(schedule: Schedule, bias: Bias) -> bool {
    bias == Bias::Estimated && schedule.count >= 3.0 && schedule.spread > 0.0
}

/// Sum, sum of squares and sum of products with x of one channel of one pixel.
fn number([sum, squares, products]: [f64; 3], schedule: Schedule, bias: Bias) -> Number {
    let n = schedule.count;
    if n < 2.0 {
        return Number { mean: if n > 0.0 { sum as f32 } else { 0.0 }, ..Number::default() };
    }
    let mean = sum / n;
    let total = squares - sum * mean;
    // Squares are rounded to 24 bits before they are summed.
    let resolution = sum * mean / f64::from(1u32 << 22);
    if total < -resolution {
        // The squares were beyond the range of the sums, and cut: all that is known is that values are not negative.
        return Number { mean: mean as f32, noise: (mean / n.sqrt()) as f32, ..Number::default() };
    }
    if total <= resolution {
        return Number { mean: mean as f32, ..Number::default() };
    }
    if !fits_trend(schedule, bias) {
        return Number { mean: mean as f32, noise: (total / (n - 1.0) / n).sqrt() as f32, ..Number::default() };
    }
    let Schedule { mean: x, spread, leverage, .. } = schedule;
    let slope = (products - sum * x) / spread;
    let variance = (total - slope * slope * spread).max(0.0) / (n - 2.0);
    Number {
        mean: mean as f32,
        noise: (variance / n).sqrt() as f32,
        bias: (slope * x) as f32,
        bias_noise: (x * (variance * leverage / spread).sqrt()) as f32,
    }
}

/// The pixel and the up to eight around it, of so many pixels in rows of `width`.
fn around(pixel: usize, pixels: usize, width: usize) -> impl Iterator<Item = usize> {
    let (height, x, y) = (pixels / width, pixel % width, pixel / width);
    let rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.flat_map(move |row| (x.saturating_sub(1)..(x + 2).min(width)).map(move |column| row * width + column))
}

/// Square of what a channel of a pixel should be, to measure its error by. That of its mean is too great where light of
/// a rare path has met the pixel, and then its error, which is that light, would look small beside it. The neighbours
/// tell, within what the noise of the pixel leaves open: the second brightest of them, as edges and lines that are
/// bright have two such neighbours everywhere.
fn square_of_truth(numbers: &[[Number; 3]], width: usize, (pixel, channel): (usize, usize)) -> f64 {
    let n = numbers[pixel][channel];
    let (mean, noise) = (f64::from(n.mean), f64::from(n.noise));
    let mut brightest = [f64::NEG_INFINITY; 2];
    for at in around(pixel, numbers.len(), width).filter(|at| *at != pixel) {
        let other = f64::from(numbers[at][channel].mean);
        brightest = if other > brightest[0] { [other, brightest[0]] } else { [brightest[0], brightest[1].max(other)] };
    }
    let known = (mean + noise).is_finite() && brightest[1].is_finite();
    if known { brightest[1].clamp((mean - noise).max(0.0), mean.max(0.0)).powi(2) } else { mean * mean }
}

/// Root of the trimmed mean of the squared relative error; see [`ErrorEstimate::relative`]. Where paths may be rare, a
/// pixel that met one is told by its neighbours.
fn relative(numbers: &[[Number; 3]], width: usize, has_rare_paths: bool) -> Option<f64> {
    let luminance =
        |p: &[Number; 3]| p.iter().zip([0.2126, 0.7152, 0.0722]).map(|(n, w)| w * f64::from(n.mean)).sum::<f64>();
    let mean = numbers.iter().map(luminance).sum::<f64>() / numbers.len() as f64;
    if !(mean > 0.0 && mean.is_finite()) {
        return None;
    }
    let floor = (0.1 * mean).powi(2);
    let part = |pixel: usize, channel: usize| {
        let n = numbers[pixel][channel];
        let [noise, bias, bias_noise] = [n.noise, n.bias, n.bias_noise].map(|x| f64::from(x) * f64::from(x));
        let own = f64::from(n.mean).powi(2);
        let square = if has_rare_paths { square_of_truth(numbers, width, (pixel, channel)) } else { own };
        let weight = 1.0 / (square + floor) / 3.0;
        // The squared slope is on average too great by its own variance; a single difference may be negative.
        [noise * weight, (bias - bias_noise) * weight]
    };
    let add = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
    let of_pixel = |pixel: usize| (0..3).map(|channel| part(pixel, channel)).fold([0.0; 2], add);
    let mut pixels: Vec<[f64; 2]> = (0..numbers.len()).map(of_pixel).collect();
    let kept = pixels.len() - (pixels.len() as f64 * TRIM) as usize;
    pixels.select_nth_unstable_by(kept - 1, |a, b| f64::total_cmp(&(a[0] + a[1]), &(b[0] + b[1])));
    let [noise, bias] = pixels[..kept].iter().copied().fold([0.0; 2], add);
    // Where the bias is lost in the noise the sum may be negative by chance; the noise is there all the same.
    Some(((noise + bias.max(0.0)) / kept as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Footprint scale with squares that fall as they do for alpha = 2/3.
    fn scale(index: u64) -> f32 {
        (1.0 + index as f32).powf(-1.0 / 6.0)
    }

    /// A film of rows of 50 pixels, or of one shorter row, with the passes 0 .. `passes` of the grey values
    /// `value(pixel, pass, x)`.
    fn film(pixels: u32, passes: u64, mut value: impl FnMut(u32, u64, f32) -> f32) -> Film {
        let width = pixels.min(50);
        let mut film = Film::new(width, pixels.checked_div(width).unwrap_or(0), [3, 0], false);
        film.passes = PassSet::of(0..passes);
        for (pixel, sums) in film.sums.iter_mut().enumerate() {
            for pass in 0..passes {
                let x = scale(pass) * scale(pass);
                let v = value(pixel as u32, pass, x) / 8.0;
                for k in 0..3 {
                    sums[k] = sums[k].plus(v);
                    sums[3 + k] = sums[3 + k].plus((v * v).min(super::super::exact::LARGEST));
                    sums[6 + k] = sums[6 + k].plus(v * x);
                }
            }
        }
        film
    }

    const EVENT: f64 = 0.5;

    fn estimate(film: &Film, bias: Bias) -> ErrorEstimate {
        ErrorEstimate::of(film, Schedule::of(&film.passes, scale), Model { bias, event: [EVENT; 3] })
    }

    /// Part of the pixels whose value is within `factor` of the bound, and the median of bound over error.
    fn coverage(film: &Film, estimate: &ErrorEstimate, truth: f32, factor: f32) -> (f64, f64) {
        let (picture, bound) = (film.picture(), estimate.bound(0.9));
        let errors = picture.layers[0].data.iter().step_by(3).map(|x| (x - truth).abs());
        let mut ratios: Vec<f64> =
            errors.zip(bound.iter().step_by(3)).map(|(e, b)| f64::from(factor * b) / f64::from(e).max(1e-30)).collect();
        ratios.sort_by(f64::total_cmp);
        let held = ratios.iter().filter(|r| **r >= 1.0).count() as f64 / ratios.len() as f64;
        println!("coverage {held:.3}, median bound over error {:.2}", ratios[ratios.len() / 2]);
        (held, ratios[ratios.len() / 2])
    }

    /// Root mean square of the error over the pixels, relative to a true value of 1 and the tenth of it that black
    /// counts.
    fn true_relative(film: &Film) -> f64 {
        let picture = film.picture();
        let squares = picture.layers[0].data.iter().map(|x| f64::from(x - 1.0).powi(2) / 1.01);
        (squares.sum::<f64>() / picture.layers[0].data.len() as f64).sqrt()
    }

    #[test]
    fn noise_and_bias_are_found() {
        // Exactly on the line: no noise, and the bias to the last digits.
        let line = film(4, 64, |_, _, x| 1.0 + 0.25 * x);
        let found = estimate(&line, Bias::Estimated);
        let mean_x = (0..64).map(|i| f64::from(scale(i)).powi(2)).sum::<f64>() / 64.0;
        let bias = f64::from(found.bias_of_mean()[0]);
        assert!((bias - 0.25 * mean_x).abs() < 1e-5, "{bias}");
        assert!(found.standard_error()[0] < 1e-4, "{}", found.standard_error()[0]);
        let relative = found.relative.expect("known");
        assert!((relative / true_relative(&line) - 1.0).abs() < 0.15, "{relative}, not {}", true_relative(&line));
        assert!((relative - bias / (1.0 + bias).hypot(0.1 * (1.0 + bias))).abs() < 1e-4);
        // The same spread is noise where there is no bias.
        let found = estimate(&line, Bias::None);
        assert_eq!(found.bias_of_mean()[0], 0.0);
        assert!(found.standard_error()[0] > 1e-3);
    }

    #[test]
    fn the_picture_s_error_is_the_true_one() {
        // Noise of photons, whose variance grows as 1 / x, with no, some and much bias.
        for (name, bias) in [("no", 0.0), ("some", 0.1), ("much", 0.5)] {
            let mut random = Random(1);
            let film = film(2000, 100, |_, _, x| 1.0 + bias * x + 0.3 * random.normal() / x.sqrt());
            let (found, truth) = (estimate(&film, Bias::Estimated).relative.expect("known"), true_relative(&film));
            println!("{name} bias: {found:.4}, true {truth:.4}");
            assert!((found / truth - 1.0).abs() < 0.15, "{name} bias: {found}, true {truth}");
            let blind = estimate(&film, Bias::Unknown).relative.expect("known");
            assert!(bias < 0.2 || blind < 0.7 * truth, "without the bias the estimate must be too small: {blind}");
        }
        // Even noise: the bias cannot be told from it as well as is assumed, so the estimate is too great, by about 2.
        let mut random = Random(2);
        let film = film(2000, 100, |_, _, _| 1.0 + 0.3 * random.normal());
        let (found, truth) = (estimate(&film, Bias::Estimated).relative.expect("known"), true_relative(&film));
        assert!((1.0..2.2).contains(&(found / truth)), "{found}, true {truth}");
    }

    /// Paths met once in 2000 bring 100: where it is met it is most of the pixel's mean and all of its error.
    #[test]
    fn light_of_rare_paths_counts_against_what_is_around_it() {
        let mut random = Random(4);
        let film = film(2000, 100, |_, _, _| if random.unit() < 5e-4 { 100.95 } else { 0.95 });
        let (found, truth) = (estimate(&film, Bias::None).relative.expect("known"), true_relative(&film));
        assert!((0.8..1.2).contains(&(found / truth)), "{found}, true {truth}");
    }

    #[test]
    fn the_estimate_does_not_depend_on_the_exposure() {
        let mut errors = [1.0f32, 1024.0, 1.0 / 1024.0].map(|exposure| {
            let mut random = Random(3);
            let film = film(50, 20, |pixel, _, x| exposure * (pixel as f32 * 0.1 + x + random.unit()));
            estimate(&film, Bias::Estimated).relative.expect("known")
        });
        errors.sort_by(f64::total_cmp);
        assert!(errors[2] / errors[0] - 1.0 < 1e-4, "{errors:?}");
    }

    #[test]
    fn bounds_hold_as_often_as_they_say() {
        for passes in [4, 10, 100] {
            for bias in [0.0, 0.1, 0.4] {
                let mut random = Random(passes);
                let film = film(4000, passes, |_, _, x| 1.0 + bias * x + 0.3 * random.normal() / x.sqrt());
                let estimate = estimate(&film, Bias::Estimated);
                println!("{passes} passes, bias {bias}:");
                let (held, width) = coverage(&film, &estimate, 1.0, 1.0);
                assert!(held >= 0.88, "{passes} passes, bias {bias}: {held}");
                // A normal error's bound is 2.4 times its median; few passes and unknown bias make it wider.
                assert!(width < if passes == 4 { 20.0 } else { 8.0 }, "{passes} passes, bias {bias}: {width}");
                let half = coverage(&film, &estimate, 1.0, 0.5).0;
                assert!(passes < 100 || half < 0.88, "{passes} passes, bias {bias}: half of the bound holds {half}");
            }
        }
    }

    #[test]
    fn rare_events_are_covered() {
        // Photons that come once in a hundred pixels and passes or more seldom, and are worth EVENT x 1.5 (within the
        // footprint from 0 to twice the mean).
        for probability in [1e-4f32, 1e-3, 3e-3, 1e-2, 3e-2] {
            let mut random = Random(7);
            let mut held = Vec::new();
            let mut tight = Vec::new();
            for _ in 0..40 {
                let film = film(100, 100, |_, _, x| {
                    let hit = random.unit() < probability * x;
                    if hit { EVENT as f32 * 2.0 * random.unit() / x } else { 0.0 }
                });
                let found = estimate(&film, Bias::Estimated);
                held.push(coverage(&film, &found, probability * EVENT as f32, 1.0).0);
                let blind = ErrorEstimate { model: Model { event: [0.0; 3], ..found.model }, ..found };
                tight.push(coverage(&film, &blind, probability * EVENT as f32, 1.0).0);
            }
            let mean = |shares: &[f64]| shares.iter().sum::<f64>() / shares.len() as f64;
            let (held, blind) = (mean(&held), mean(&tight));
            println!("probability {probability}: {held:.3}, without unseen light {blind:.3}");
            assert!(held >= 0.9, "probability {probability}: {held}");
            assert!(probability > 1e-3 || blind < 0.7, "unseen light must be needed: {blind}");
        }
    }

    #[test]
    fn what_is_not_known_is_said() {
        let one = film(2, 1, |_, _, _| 1.0);
        let found = estimate(&one, Bias::Estimated);
        assert_eq!((found.relative, found.passes()), (None, 1));
        assert!(found.bound(0.9).iter().chain(&found.standard_error()).all(|x| *x == f32::INFINITY));
        let black = film(2, 10, |_, _, _| 0.0);
        let found = estimate(&black, Bias::Estimated);
        assert_eq!(found.relative, None);
        assert!(found.bound(0.9).iter().all(|x| *x > 0.0 && x.is_finite()));
        let two = estimate(&film(2, 2, |_, pass, _| 1.0 + pass as f32), Bias::Estimated);
        assert!(two.relative.is_some() && two.bound(0.9).iter().all(|x| x.is_finite()) && two.bias_of_mean()[0] == 0.0);
        let none = estimate(&Film::new(3, 1, [0, 0], false), Bias::None);
        assert_eq!((none.relative, none.bound(0.9).len()), (None, 9));
        let empty = estimate(&Film::new(0, 0, [0, 0], false), Bias::None);
        assert_eq!((empty.relative, empty.bound(0.9).len()), (None, 0));
    }

    #[test]
    fn squares_beyond_the_range_are_no_certainty() {
        let glaring = film(1, 10, |_, pass, _| 4e8 + 1e7 * pass as f32);
        let found = estimate(&glaring, Bias::Estimated);
        assert!(found.standard_error()[0] > 1e7, "{}", found.standard_error()[0]);
        let constant = estimate(&film(1, 10, |_, _, _| 1.1), Bias::Estimated);
        assert_eq!(constant.standard_error()[0], 0.0, "rounding is no noise");
    }
}
