//! Plots as self-contained SVG: lines through points, linear or logarithmic axes, a legend.

use std::fmt::Write;

/// Size of a picture in user units.
const SIZE: [f64; 2] = [760.0, 440.0];
/// Space around the plotting area: left, right (with the legend), top, bottom.
const MARGIN: [f64; 4] = [74.0, 190.0, 44.0, 56.0];
/// Colours that people with any kind of colour vision tell apart; dashes repeat at another length than colours.
const COLOURS: [&str; 8] = ["#0060a8", "#d05000", "#008060", "#b03090", "#806000", "#4060ff", "#303030", "#c00030"];
const DASHES: [&str; 3] = ["none", "7 3", "2 3"];

/// An axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// What is plotted, with its unit.
    pub label: String,
    /// Logarithmic; points that are not greater than 0 are left out then.
    pub logarithmic: bool,
}

impl Axis {
    /// A logarithmic axis.
    pub fn logarithmic(label: impl Into<String>) -> Self {
        Self { label: label.into(), logarithmic: true }
    }

    /// A linear axis.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), logarithmic: false }
    }

    fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.logarithmic || value > 0.0)
    }
}

/// A line.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y), in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
}

/// A plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    /// Its title.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// The lines.
    pub series: Vec<Series>,
}

impl Plot {
    /// The plot as an SVG document. Each point that its axes can show is one circle of the class `point` that carries its
    /// values.
    pub fn svg(&self) -> String {
        let shown: Vec<(f64, f64)> = self.series.iter().flat_map(|s| self.shown(s)).collect();
        let [left, right, top, bottom] = MARGIN;
        let x = Scale::new(&self.x, shown.iter().map(|p| p.0), [left, SIZE[0] - right]);
        let y = Scale::new(&self.y, shown.iter().map(|p| p.1), [SIZE[1] - bottom, top]);
        let mut body = String::new();
        self.frame(&mut body, &x, &y);
        for (index, series) in self.series.iter().enumerate() {
            let style = Style::of(index);
            let points: Vec<(f64, f64)> = self.shown(series).collect();
            line(&mut body, &style, points.iter().map(|p| (x.at(p.0), y.at(p.1))));
            for (px, py) in points {
                let (cx, cy, colour) = (x.at(px), y.at(py), style.colour);
                let text = escape(&format!("{}: {px}, {py}", series.name));
                put(
                    &mut body,
                    format_args!(
                        r#"<circle class="point" cx="{cx:.2}" cy="{cy:.2}" r="3.2" fill="{colour}"><title>{text}</title></circle>"#
                    ),
                );
            }
            legend(&mut body, &style, &series.name, index);
        }
        let [w, h] = SIZE;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
             font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n{body}</svg>\n"
        )
    }

    fn shown<'a>(&'a self, series: &'a Series) -> impl Iterator<Item = (f64, f64)> + 'a {
        series.points.iter().copied().filter(|(x, y)| self.x.shows(*x) && self.y.shows(*y))
    }

    /// Title, grid, ticks, labels of the axes.
    fn frame(&self, body: &mut String, x: &Scale, y: &Scale) {
        let ([x0, x1], [y0, y1]) = (x.pixels, y.pixels);
        let (cx, cy, title) = (0.5 * (x0 + x1), 0.5 * (y0 + y1), escape(&self.title));
        put(body, format_args!(r#"<text x="{cx}" y="24" text-anchor="middle" font-size="14">{title}</text>"#));
        for tick in &x.ticks {
            let (at, width) = (x.at(tick.value), tick.width());
            put(
                body,
                format_args!(
                    r##"<line x1="{at:.2}" x2="{at:.2}" y1="{y0}" y2="{y1}" stroke="#ccc" stroke-width="{width}"/>"##
                ),
            );
            if let Some(label) = &tick.label {
                let y = y0 + 17.0;
                put(body, format_args!(r#"<text x="{at:.2}" y="{y}" text-anchor="middle">{label}</text>"#));
            }
        }
        for tick in &y.ticks {
            let (at, width) = (y.at(tick.value), tick.width());
            put(
                body,
                format_args!(
                    r##"<line x1="{x0}" x2="{x1}" y1="{at:.2}" y2="{at:.2}" stroke="#ccc" stroke-width="{width}"/>"##
                ),
            );
            if let Some(label) = &tick.label {
                let (x, y) = (x0 - 7.0, at + 4.0);
                put(body, format_args!(r#"<text x="{x}" y="{y:.2}" text-anchor="end">{label}</text>"#));
            }
        }
        let (width, height, bottom) = (x1 - x0, y0 - y1, y0 + 40.0);
        let (across, up) = (escape(&self.x.label), escape(&self.y.label));
        put(
            body,
            format_args!(
                r#"<rect x="{x0}" y="{y1}" width="{width}" height="{height}" fill="none" stroke="black"/>
<text x="{cx}" y="{bottom}" text-anchor="middle">{across}</text>
<text x="18" y="{cy}" text-anchor="middle" transform="rotate(-90 18 {cy})">{up}</text>"#
            ),
        );
    }
}

fn put(body: &mut String, line: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = writeln!(body, "{line}");
}

struct Style {
    colour: &'static str,
    dash: &'static str,
}

impl Style {
    fn of(index: usize) -> Self {
        Self { colour: COLOURS[index % COLOURS.len()], dash: DASHES[index % DASHES.len()] }
    }
}

fn line(body: &mut String, style: &Style, points: impl Iterator<Item = (f64, f64)>) {
    let points: Vec<String> = points.map(|(x, y)| format!("{x:.2},{y:.2}")).collect();
    let (points, Style { colour, dash }) = (points.join(" "), style);
    put(
        body,
        format_args!(
            r#"<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.6" stroke-dasharray="{dash}"/>"#
        ),
    );
}

fn legend(body: &mut String, style: &Style, name: &str, index: usize) {
    let x = SIZE[0] - MARGIN[1] + 12.0;
    let y = MARGIN[2] + 10.0 + 18.0 * index as f64;
    line(body, style, [(x, y), (x + 26.0, y)].into_iter());
    let (x, y, name) = (x + 32.0, y + 4.0, escape(name));
    put(body, format_args!(r#"<text class="legend" x="{x}" y="{y}">{name}</text>"#));
}

/// A tick; only those with a label are drawn at full strength.
struct Tick {
    value: f64,
    label: Option<String>,
}

impl Tick {
    fn width(&self) -> f64 {
        if self.label.is_some() { 1.0 } else { 0.4 }
    }
}

/// From values to user units.
struct Scale {
    logarithmic: bool,
    /// Logarithms of them if it is logarithmic.
    range: [f64; 2],
    pixels: [f64; 2],
    ticks: Vec<Tick>,
}

impl Scale {
    fn new(axis: &Axis, values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Self {
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

    fn at(&self, value: f64) -> f64 {
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

/// Text for element content and attribute values; what XML forbids becomes a question mark.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&apos;"),
            c if (c.is_control() && !matches!(c, '\t' | '\n' | '\r')) || matches!(c, '\u{fffe}' | '\u{ffff}') => {
                escaped.push('?');
            }
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(series: Vec<Series>) -> Plot {
        Plot { title: "t".into(), x: Axis::logarithmic("photons"), y: Axis::logarithmic("ms"), series }
    }

    fn series(name: &str, points: &[(f64, f64)]) -> Series {
        Series { name: name.into(), points: points.to_vec() }
    }

    fn attribute(element: &str, name: &str) -> f64 {
        let rest = element.split_once(&format!(" {name}=\"")).expect("the attribute").1;
        rest.split_once('"').expect("its end").0.parse().expect("a number")
    }

    #[test]
    fn every_point_is_where_its_logarithm_is() {
        let svg = plot(vec![series("bvh", &[(1e4, 1.0), (1e5, 10.0), (1e6, 1000.0)])]).svg();
        let points: Vec<[f64; 2]> = svg
            .lines()
            .filter(|line| line.contains("class=\"point\""))
            .map(|line| [attribute(line, "cx"), attribute(line, "cy")])
            .collect();
        assert_eq!(points.len(), 3);
        let [a, b, c] = points[..] else { panic!("{points:?}") };
        assert!(a[0] < b[0] && (b[0] - a[0] - (c[0] - b[0])).abs() < 0.03, "equal decades: {points:?}");
        assert!(a[1] > b[1] && (2.0 * (a[1] - b[1]) - (b[1] - c[1])).abs() < 0.05, "two decades, upwards: {points:?}");
        assert!(svg.contains(">100000<") || svg.contains(">1e5<"), "a tick has its decade: {svg}");
    }

    #[test]
    fn what_has_no_logarithm_is_left_out() {
        let odd = [(1e4, 0.0), (0.0, 1.0), (1e5, f64::NAN), (1e5, 2.0)];
        assert_eq!(plot(vec![series("a", &odd)]).svg().matches("class=\"point\"").count(), 1);
        let linear = Plot { y: Axis::linear("y"), x: Axis::linear("x"), ..plot(vec![series("a", &odd)]) };
        assert_eq!(linear.svg().matches("class=\"point\"").count(), 3);
    }

    #[test]
    fn a_plot_of_nothing_and_of_one_value_has_axes() {
        for points in [&[][..], &[(5.0, 5.0)]] {
            let svg = plot(vec![series("a", points)]).svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn ticks_are_round() {
        let labels = |ticks: Vec<Tick>| ticks.into_iter().filter_map(|t| t.label).collect::<Vec<_>>();
        assert_eq!(labels(decades(2.9, 6.1)), ["1000", "10000", "1e5", "1e6"]);
        assert_eq!(labels(decades(0.0, 1.0)), ["1", "2", "5", "10"]);
        assert_eq!(labels(steps(0.0, 0.55)), ["0", "0.1", "0.2", "0.3", "0.4", "0.5"]);
        assert_eq!(labels(steps(-20.0, 30.0)), ["-20", "-10", "0", "10", "20", "30"]);
        assert!(labels(decades(-300.0, 300.0)).len() < 15);
    }

    #[test]
    fn text_is_escaped() {
        assert_eq!(escape("a<b> & \"c'\u{1}"), "a&lt;b&gt; &amp; &quot;c&apos;?");
        let svg = plot(vec![series("<&>", &[(1.0, 1.0)])]).svg();
        assert!(svg.contains("&lt;&amp;&gt;: 1, 1</title>") && !svg.contains("<&"), "{svg}");
    }
}
