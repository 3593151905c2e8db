//! From values to places on an axis, and where its ticks stand.

use super::Axis;

/// A tick; only those with a label are drawn at full strength.
pub(super) struct Tick {
    /// Where it is.
    pub value: f64,
    /// What stands there.
    pub label: Option<String>,
}

impl Tick {
    /// Width of its line.
    pub fn width(&self) -> f64 {
        if self.label.is_some() { 1.0 } else { 0.4 }
    }
}

/// From values to user units.
pub(super) struct Scale {
    logarithmic: bool,
    /// Logarithms of them if it is logarithmic.
    range: [f64; 2],
    /// The ends of the axis in the picture.
    pub pixels: [f64; 2],
    /// Ascending.
    pub ticks: Vec<Tick>,
}

impl Scale {
    pub fn new(axis: &Axis, values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
        let of = |v: f64| if axis.logarithmic { v.log10() } else { v };
        let (low, high) = values.map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        // Without points, or with one value only, there is still a range.
        let (low, high) = match (low.is_finite(), high > low) {
            (false, _) => (0.0, 1.0),
            (true, false) if axis.logarithmic => (low - 0.5, low + 0.5),
            (true, false) => (low - 0.5 * low.abs().max(1.0), low + 0.5 * low.abs().max(1.0)),
            (true, true) => (low - 0.04 * (high - low), high + 0.04 * (high - low)),
        };
        let ticks = if axis.logarithmic { decades(low, high) } else { steps(low, high) };
        Self { logarithmic: axis.logarithmic, range: [low, high], pixels, ticks }
    }

    pub fn at(&self, value: f64) -> f64 {
        let value = if self.logarithmic { value.log10() } else { value };
        let [low, high] = self.range;
        let [from, to] = self.pixels;
        from + (value - low) / (high - low) * (to - from)
    }
}

/// Powers of ten with labels, their multiples without; where there are few powers, 2 and 5 have labels too.
fn decades(low: f64, high: f64) -> Vec<Tick> {
    let (first, last) = (low.floor() as i32, high.ceil() as i32);
    // A label every so many decades, so that they do not meet.
    let every = (last - first) / 10 + 1;
    let mut ticks = Vec::new();
    for decade in first..=last {
        for digit in 1..=9 {
            let value = f64::from(digit) * 10f64.powi(decade);
            let named = match digit {
                1 => decade % every == 0,
                2 | 5 => high - low < 1.7,
                _ => false,
            };
            if (low..=high).contains(&value.log10()) && (digit == 1 || every == 1) {
                ticks.push(Tick { value, label: named.then(|| number(value)) });
            }
        }
    }
    ticks
}

/// About six round values.
fn steps(low: f64, high: f64) -> Vec<Tick> {
    let rough = (high - low) / 6.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].iter().map(|k| k * power).find(|s| *s >= rough).unwrap_or(rough);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last)
        .map(|k| {
            let value = k as f64 * step;
            Tick { value, label: Some(number(value)) }
        })
        .collect()
}

/// A tick's value without the noise of binary fractions.
fn number(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e5).contains(&value.abs()) {
        return format!("{value:.0e}");
    }
    let digits = format!("{value:.6}");
    digits.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        let labels = |ticks: Vec<Tick>| ticks.into_iter().filter_map(|t| t.label).collect::<Vec<_>>();
        assert_eq!(labels(decades(2.9, 6.1)), ["1000", "10000", "1e5", "1e6"]);
        assert_eq!(labels(decades(0.0, 1.0)), ["1", "2", "5", "10"]);
        assert_eq!(labels(steps(0.0, 0.55)), ["0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(labels(steps(-20.0, 30.0)), ["-20", "-10", "0", "10", "20", "30"]);
        assert!(labels(decades(-300.0, 300.0)).len() < 15);
    }
}
