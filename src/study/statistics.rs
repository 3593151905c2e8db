//! Statistics over seeds: quantiles, slopes with confidence intervals, curves compared at equal time and at equal
//! error.

use crate::compare::quantiles;
use crate::fit::fit;

/// Confidence of every interval in a report.
pub const CONFIDENCE: f64 = 0.95;
/// The band of a plot, as quantiles.
pub const BAND: [f64; 2] = [0.1, 0.9];

/// Median and band of some values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Quantile at the lower end of [`BAND`].
    pub low: f64,
    /// Median.
    pub median: f64,
    /// Quantile at the upper end of [`BAND`].
    pub high: f64,
    /// How many values there were.
    pub count: usize,
}

/// Median and band; `None` of nothing. What is not a number counts as infinite: a picture that is not a number is as
/// wrong as one can be, and must not vanish from the statistics.
pub fn spread(values: impl IntoIterator<Item = f64>) -> Option<Spread> {
    let mut sorted: Vec<f64> = values.into_iter().map(|v| if v.is_nan() { f64::INFINITY } else { v }).collect();
    sorted.sort_by(f64::total_cmp);
    let at = |q| quantile(&sorted, q);
    Some(Spread { low: at(BAND[0])?, median: at(0.5)?, high: at(BAND[1])?, count: sorted.len() })
}

/// Quantile of ascending values, linear between neighbours (definition 7 of Hyndman and Fan 1996). `q` is clamped to 0
/// ... 1.
pub fn quantile(sorted: &[f64], q: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let position = q.clamp(0.0, 1.0) * last as f64;
    let (below, part) = (position.floor() as usize, position.fract());
    let (a, b) = (sorted[below], sorted[(below + 1).min(last)]);
    // Between equal infinities, and at no distance from an infinity, the formula would give no number.
    Some(if part == 0.0 || a == b { a } else { a + part * (b - a) })
}

/// What the interval of a slope rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// One slope per seed, so that the points of one run, which depend on each other, count once; Student's t over this
    /// many.
    Seeds(usize),
    /// The residuals of the points of one run with these degrees of freedom: too narrow where its points depend on each
    /// other.
    Residuals(usize),
    /// Nothing: a line through two points.
    None,
}

/// An exponent: error grows like `x^value`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// The exponent: with several seeds the mean of their slopes.
    pub value: f64,
    /// Half the width of its interval at [`CONFIDENCE`].
    pub half_width: Option<f64>,
    /// What the interval rests on.
    pub basis: Basis,
}

/// Slope of log y over log x through the points of each run (one run per seed), by least squares. Points without a
/// logarithm are left out, and runs of fewer than two different x. `None` if no run is left.
pub fn slope(runs: &[Vec<(f64, f64)>]) -> Option<Slope> {
    let fits: Vec<_> = runs.iter().filter_map(|points| fit(points)).filter(|f| f.exponent.is_finite()).collect();
    let n = fits.len();
    let value = fits.iter().map(|f| f.exponent).sum::<f64>() / n as f64;
    match &fits[..] {
        [] => None,
        [one] => {
            let (half_width, basis) = match one.error {
                Some(error) => {
                    let degrees = one.points - 2;
                    (Some(student(CONFIDENCE, degrees) * error), Basis::Residuals(degrees))
                }
                None => (None, Basis::None),
            };
            Some(Slope { value, half_width, basis })
        }
        _ => {
            let variance = fits.iter().map(|f| (f.exponent - value).powi(2)).sum::<f64>() / (n - 1) as f64;
            let half_width = student(CONFIDENCE, n - 1) * (variance / n as f64).sqrt();
            Some(Slope { value, half_width: Some(half_width), basis: Basis::Seeds(n) })
        }
    }
}

/// The t with P(|T| < t) = `confidence` for Student's distribution with so many degrees of freedom.
fn student(confidence: f64, degrees: usize) -> f64 {
    quantiles::student(0.5 + 0.5 * confidence, degrees as u64)
}

/// How far outside of its points a curve still speaks, as a factor on x: a render ends with the first whole pass beyond
/// its budget, so that a curve begins a little late.
pub const REACH: f64 = 1.1;

/// A value read off a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The value.
    pub y: f64,
    /// False where `x` was outside of the points by no more than [`REACH`] and the nearest point stood in.
    pub inside: bool,
}

/// The curve through points (x, y) at `x`: straight between neighbours on logarithmic axes. Never extrapolates. Points
/// whose x has no logarithm are left out; next to a y of 0 or infinity the curve is known at the point only.
pub fn read(points: &[(f64, f64)], x: f64) -> Option<Reading> {
    let points = ascending(points);
    let (first, last) = (points.first()?, points.last()?);
    if !(x > 0.0 && x.is_finite()) {
        return None;
    }
    if let Some((_, y)) = points.iter().find(|p| p.0 == x) {
        return Some(Reading { y: *y, inside: true });
    }
    if x < first.0 || x > last.0 {
        let (end, factor) = if x < first.0 { (first, first.0 / x) } else { (last, x / last.0) };
        return (factor <= REACH).then_some(Reading { y: end.1, inside: false });
    }
    let (a, b) = points.windows(2).map(|w| (w[0], w[1])).find(|(a, b)| a.0 < x && x < b.0)?;
    let part = (x / a.0).ln() / (b.0 / a.0).ln();
    let y = a.1 * (b.1 / a.1).powf(part);
    (usable(a.1) && usable(b.1)).then_some(Reading { y, inside: true })
}

/// When a curve comes down to a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reached {
    /// At its first point already: there or before.
    Before(f64),
    /// There.
    At(f64),
    /// It does not reach the value.
    Never,
}

/// The first x at which the curve through points (x, y) is at most `y`: straight between neighbours on logarithmic
/// axes.
pub fn reach(points: &[(f64, f64)], y: f64) -> Reached {
    let points = ascending(points);
    let Some(index) = points.iter().position(|p| p.1 <= y) else { return Reached::Never };
    let b = points[index];
    let Some(a) = index.checked_sub(1).map(|before| points[before]) else { return Reached::Before(b.0) };
    if !(usable(a.1) && usable(b.1) && usable(y)) {
        return Reached::At(b.0); // the curve is known at its point only
    }
    let part = (a.1 / y).ln() / (a.1 / b.1).ln();
    Reached::At(a.0 * (b.0 / a.0).powf(part))
}

fn usable(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}

fn ascending(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut points: Vec<_> = points.iter().copied().filter(|(x, y)| usable(*x) && !y.is_nan()).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    points
}

/// `value / best` of two errors: 1 if both are 0, infinite if only the best is. `None` if the best says nothing.
pub fn ratio(value: f64, best: f64) -> Option<f64> {
    match (value, best) {
        _ if !best.is_finite() || best < 0.0 || value.is_nan() => None,
        (0.0, 0.0) => Some(1.0),
        _ => Some(value / best),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-9 * b.abs().max(1.0)
    }

    #[test]
    fn quantiles_are_those_of_known_values() {
        let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0];
        assert_eq!(spread(values.into_iter().rev()), Some(Spread { low: 2.0, median: 6.0, high: 10.0, count: 11 }));
        assert_eq!(quantile(&[1.0, 2.0], 0.25), Some(1.25));
        assert_eq!(quantile(&[3.0], 0.9), Some(3.0));
        assert_eq!((quantile(&[], 0.5), spread([])), (None, None));
    }

    #[test]
    fn broken_pictures_stay_in_the_statistics() {
        let s = spread([f64::NAN, 1.0, 2.0]).expect("three");
        assert_eq!((s.median, s.high, s.count), (2.0, f64::INFINITY, 3));
        let all = spread([f64::INFINITY; 3]).expect("three");
        assert_eq!((all.low, all.median, all.high), (f64::INFINITY, f64::INFINITY, f64::INFINITY));
        assert_eq!(spread([0.0, 0.0]).map(|s| s.median), Some(0.0));
    }

    fn power(exponent: f64, factor: f64) -> Vec<(f64, f64)> {
        [1.0f64, 3.0, 10.0, 30.0].iter().map(|&x| (x, factor * x.powf(exponent))).collect()
    }

    /// Slopes -1, -1.1, -1.2: mean -1.1, standard deviation 0.1, t of two degrees 4.30265.
    /// Two-sided 95 % and 90 % from the usual printed tables.
    #[test]
    fn seeds_count_once_each() {
        let runs = [power(-1.0, 1.0), power(-1.1, 7.0), power(-1.2, 0.1)];
        let found = slope(&runs).expect("a slope");
        assert!(near(found.value, -1.1), "{found:?}");
        assert_eq!(found.basis, Basis::Seeds(3));
        let expected = 4.302_653 * 0.1 / 3f64.sqrt();
        assert!((found.half_width.expect("an interval") - expected).abs() < 1e-6, "{found:?}");
    }

    /// Logarithms 0, 1, 2 against 0, 1, 3: slope 3/2 with the standard error sqrt(1/12), and t of one degree.
    #[test]
    fn one_seed_has_its_residuals() {
        let points = [(0.0f64, 0.0f64), (1.0, 1.0), (2.0, 3.0)].map(|(x, y)| (x.exp(), y.exp())).to_vec();
        let found = slope(&[points, vec![(1.0, 1.0)]]).expect("a slope");
        assert!(near(found.value, 1.5));
        assert_eq!(found.basis, Basis::Residuals(1));
        let expected = 12.706_205 * (1.0f64 / 12.0).sqrt();
        assert!((found.half_width.expect("an interval") - expected).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn too_little_for_a_slope() {
        assert_eq!(slope(&[]), None);
        assert_eq!(slope(&[vec![], vec![(1.0, 1.0)]]), None, "one point");
        assert_eq!(slope(&[vec![(2.0, 1.0), (2.0, 3.0)]]), None, "equal x");
        assert_eq!(slope(&[vec![(1.0, 0.0), (2.0, f64::INFINITY), (3.0, 1.0)]]), None, "one logarithm");
        let two = slope(&[vec![(1.0, 4.0), (2.0, 1.0)]]).expect("two points");
        assert!(near(two.value, -2.0));
        assert_eq!((two.half_width, two.basis), (None, Basis::None));
    }

    #[test]
    fn a_curve_is_read_between_its_points_only() {
        let points = [(10.0, 0.01), (1.0, 1.0)];
        let at = |x| read(&points, x);
        assert!(near(at(10f64.sqrt()).expect("inside").y, 0.1));
        assert_eq!(at(1.0), Some(Reading { y: 1.0, inside: true }));
        assert_eq!(at(0.95), Some(Reading { y: 1.0, inside: false }), "nearly there");
        assert_eq!(at(10.9), Some(Reading { y: 0.01, inside: false }));
        assert_eq!([at(0.9), at(11.1), at(0.0), at(f64::NAN), read(&[], 1.0)], [None; 5]);
    }

    #[test]
    fn a_curve_says_nothing_beside_zero_and_infinity() {
        let points = [(1.0, f64::INFINITY), (2.0, 1.0), (4.0, 0.0), (8.0, f64::NAN), (0.0, 1.0)];
        assert_eq!([read(&points, 1.5), read(&points, 3.0), read(&points, 8.0)], [None; 3]);
        assert_eq!(read(&points, 2.0).map(|r| r.y), Some(1.0));
        assert_eq!(read(&points, 1.0).map(|r| r.y), Some(f64::INFINITY));
        assert_eq!(reach(&points, 0.5), Reached::At(4.0));
        assert_eq!(reach(&points, 1.0), Reached::At(2.0));
    }

    #[test]
    fn an_error_is_reached_where_the_curve_crosses_it_first() {
        let points = [(1.0, 1.0), (100.0, 0.01), (200.0, 0.5), (300.0, 0.001)];
        let Reached::At(x) = reach(&points, 0.1) else { panic!("it is reached") };
        assert!(near(x, 10.0), "{x}");
        assert_eq!(reach(&points, 2.0), Reached::Before(1.0));
        assert_eq!(reach(&points, 1e-4), Reached::Never);
        assert_eq!(reach(&[], 1.0), Reached::Never);
    }

    #[test]
    fn ratios_of_zeros_and_infinities() {
        assert_eq!([ratio(3.0, 2.0), ratio(0.0, 0.0), ratio(1.0, 0.0)], [Some(1.5), Some(1.0), Some(f64::INFINITY)]);
        assert_eq!(ratio(f64::INFINITY, 1.0), Some(f64::INFINITY));
        assert_eq!([ratio(1.0, f64::INFINITY), ratio(f64::NAN, 1.0), ratio(1.0, f64::NAN)], [None; 3]);
    }
}
