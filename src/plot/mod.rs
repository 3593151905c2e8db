//! Plots as self-contained SVG: lines through points with bands and markers, linear or logarithmic axes, a legend;
//! stacked bars.
//!
//! A plot has its own background, so that it is readable on any page. Where the reader prefers dark pages, background,
//! text and colours change.

mod bars;
mod marker;
mod scale;
pub mod text;
#[cfg(test)]
pub(crate) mod well_formed;

pub use bars::{Bar, Bars};

use std::fmt::Write;

use marker::marker;
use scale::Scale;
use text::{escape, shortened, width};

/// Size of the plotting area in user units.
const AREA: [f64; 2] = [500.0, 340.0];
/// Space left of, above and below the plotting area.
const MARGIN: [f64; 3] = [74.0, 44.0, 62.0];
/// Letters of a name in a legend; the title of its points has all of them.
const LONGEST_NAME: usize = 38;
/// Colours for light and for dark pages. A search chose them: each has enough contrast with the page, and the least
/// distance between any two is as great as possible, for normal vision and without the first or second kind of cones.
const COLOURS: [[&str; 2]; 8] = [
    ["#3461ff", "#4672ff"],
    ["#ef7f00", "#fea905"],
    ["#1db571", "#418e9c"],
    ["#784aa7", "#cb4e39"],
    ["#9f3c0a", "#b9b8ff"],
    ["#00add0", "#feff4b"],
    ["#0c0400", "#fffff2"],
    ["#4d0b63", "#d2d19f"],
];
/// Background, text, grid on light and dark pages.
const BACK: [&str; 2] = ["#ffffff", "#14171a"];
const INK: [&str; 2] = ["#202020", "#e4e4e4"];
const GRID: [&str; 2] = ["#d0d0d0", "#3c4248"];

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
    /// A second, smaller line in the legend, for example a slope.
    pub note: Option<String>,
    /// Points (x, y), in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
    /// An area behind the line: (x, least y, greatest y), ordered as the points.
    pub band: Vec<(f64, f64, f64)>,
    /// Colour and shape of the markers, repeating; that of the series' place in the plot if there is none.
    pub look: Option<usize>,
    /// Thin and dashed with hollow markers: somebody else's.
    pub dashed: bool,
}

impl Series {
    /// A solid line without a band.
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), note: None, points, band: Vec::new(), look: None, dashed: false }
    }
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
    /// The plot as an SVG document. Each point that its axes can show is one element of the class `point` that carries
    /// its values; how many could not be shown is said below the plot.
    pub fn svg(&self) -> String {
        let mut legend = String::new();
        let [left, top, bottom] = MARGIN;
        let (mut below, mut legend_width) = (top + 2.0, 60.0f64);
        for (index, series) in self.series.iter().enumerate() {
            let (used, wide) = entry(&mut legend, Look::of(series, index), series, [left + AREA[0] + 14.0, below]);
            below += used;
            legend_width = legend_width.max(wide);
        }
        let size = [left + AREA[0] + 14.0 + legend_width + 10.0, (top + AREA[1] + bottom).max(below + 8.0)];
        document(size, &self.title, &(self.drawing() + &legend))
    }

    /// All but the legend.
    fn drawing(&self) -> String {
        let shown = || self.series.iter().flat_map(|s| self.shown(s));
        let bands: Vec<_> = self.series.iter().map(|s| self.shown_band(s)).collect();
        let band_y = bands.iter().flatten().flat_map(|(_, low, high)| [*low, *high]);
        let [left, top, _] = MARGIN;
        let x = Scale::new(&self.x, shown().map(|p| p.0), [left, left + AREA[0]]);
        let y = Scale::new(&self.y, shown().map(|p| p.1).chain(band_y), [top + AREA[1], top]);
        let mut body = String::new();
        self.frame(&mut body, &x, &y);
        for (index, (series, band)) in self.series.iter().zip(&bands).enumerate() {
            area(&mut body, Look::of(series, index), band, [&x, &y]);
        }
        for (index, series) in self.series.iter().enumerate() {
            let look = Look::of(series, index);
            line(&mut body, look, self.shown(series).map(|p| (x.at(p.0), y.at(p.1))));
            for (px, py) in self.shown(series) {
                let text = escape(&format!("{}: {px}, {py}", series.name));
                let at = [x.at(px), y.at(py)];
                put(&mut body, format_args!("{}", marker("point", look, at, Some(&text))));
            }
        }
        let hidden = self.series.iter().map(|s| s.points.len()).sum::<usize>() - shown().count();
        if hidden > 0 {
            let (at, y) = (left + AREA[0], top + AREA[1] + 56.0);
            let text = format!("{hidden} not drawn: zero or not finite");
            put(&mut body, format_args!(r#"<text x="{at}" y="{y}" text-anchor="end" font-size="10">{text}</text>"#));
        }
        body
    }

    fn shown<'a>(&'a self, series: &'a Series) -> impl Iterator<Item = (f64, f64)> + 'a {
        series.points.iter().copied().filter(|(x, y)| self.x.shows(*x) && self.y.shows(*y))
    }

    fn shown_band(&self, series: &Series) -> Vec<(f64, f64, f64)> {
        let shows = |(x, low, high): &(f64, f64, f64)| self.x.shows(*x) && self.y.shows(*low) && self.y.shows(*high);
        series.band.iter().copied().filter(shows).collect()
    }

    /// Grid, ticks, labels of the axes.
    fn frame(&self, body: &mut String, x: &Scale, y: &Scale) {
        let ([x0, x1], [y0, y1]) = (x.pixels, y.pixels);
        let (cx, cy) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
        put(body, format_args!(r#"<g class="np-grid" color="{}" stroke="currentColor">"#, GRID[0]));
        for (tick, at) in x.ticks.iter().map(|tick| (tick, x.at(tick.value))) {
            let width = tick.width();
            put(body, format_args!(r#"<line x1="{at:.2}" x2="{at:.2}" y1="{y0}" y2="{y1}" stroke-width="{width}"/>"#));
        }
        for (tick, at) in y.ticks.iter().map(|tick| (tick, y.at(tick.value))) {
            let width = tick.width();
            put(body, format_args!(r#"<line x1="{x0}" x2="{x1}" y1="{at:.2}" y2="{at:.2}" stroke-width="{width}"/>"#));
        }
        put(body, format_args!("</g>"));
        for (label, at) in x.ticks.iter().filter_map(|tick| Some((tick.label.as_ref()?, x.at(tick.value)))) {
            let y = y0 + 17.0;
            put(body, format_args!(r#"<text x="{at:.2}" y="{y}" text-anchor="middle">{label}</text>"#));
        }
        for (label, at) in y.ticks.iter().filter_map(|tick| Some((tick.label.as_ref()?, y.at(tick.value)))) {
            let (x, y) = (x0 - 7.0, at + 4.0);
            put(body, format_args!(r#"<text x="{x}" y="{y:.2}" text-anchor="end">{label}</text>"#));
        }
        let (width, height, bottom) = (x1 - x0, y0 - y1, y0 + 40.0);
        let (across, up) = (escape(&self.x.label), escape(&self.y.label));
        put(
            body,
            format_args!(
                r#"<rect x="{x0}" y="{y1}" width="{width}" height="{height}" fill="none" stroke="currentColor"/>
<text x="{cx}" y="{bottom}" text-anchor="middle">{across}</text>
<text x="18" y="{cy}" text-anchor="middle" transform="rotate(-90 18 {cy})">{up}</text>"#
            ),
        );
    }
}

/// Background, title and `body` as a document.
fn document(size: [f64; 2], title: &str, body: &str) -> String {
    // A long title would leave the picture.
    let most = (size[0] / width("n", 15.0)) as usize;
    let (heading, title) = (escape(&shortened(title, most)), escape(title));
    let [w, h] = size.map(f64::ceil);
    let (back, ink) = (BACK[0], INK[0]);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<title>{title}</title>\n<style>{}</style>\n\
         <rect class=\"np-back\" color=\"{back}\" width=\"{w}\" height=\"{h}\" rx=\"6\" fill=\"currentColor\"/>\n\
         <g class=\"np-ink\" color=\"{ink}\" fill=\"currentColor\">\n\
         <text x=\"{}\" y=\"26\" text-anchor=\"middle\" font-size=\"15\">{heading}</text>\n{body}</g>\n</svg>\n",
        style(),
        0.5 * w
    )
}

/// What a dark page changes: everything is drawn in `currentColor`.
fn style() -> String {
    let mut rules = String::new();
    let named = [("np-back", BACK[1]), ("np-ink", INK[1]), ("np-grid", GRID[1])];
    for (class, colour) in named {
        let _ = write!(rules, ".{class}{{color:{colour}}}");
    }
    for (index, [_, colour]) in COLOURS.iter().enumerate() {
        let _ = write!(rules, ".np-{index}{{color:{colour}}}");
    }
    format!("@media (prefers-color-scheme:dark){{{rules}}}")
}

fn put(body: &mut String, line: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = writeln!(body, "{line}");
}

/// How a line looks.
#[derive(Clone, Copy)]
struct Look {
    index: usize,
    dashed: bool,
}

impl Look {
    fn of(series: &Series, index: usize) -> Self {
        Self { index: series.look.unwrap_or(index), dashed: series.dashed }
    }

    /// Class and colour of an element that draws in `currentColor`.
    fn paint(self) -> String {
        let index = self.index % COLOURS.len();
        format!(r#"class="np-{index}" color="{}""#, COLOURS[index][0])
    }
}

fn line(body: &mut String, look: Look, points: impl Iterator<Item = (f64, f64)>) {
    let points: Vec<String> = points.map(|(x, y)| format!("{x:.2},{y:.2}")).collect();
    let (points, paint) = (points.join(" "), look.paint());
    let stroke = if look.dashed { r#"stroke-width="1.3" stroke-dasharray="6 3""# } else { r#"stroke-width="2""# };
    put(body, format_args!(r#"<polyline {paint} points="{points}" fill="none" stroke="currentColor" {stroke}/>"#));
}

/// The area between the lower and the upper ends of a band.
fn area(body: &mut String, look: Look, band: &[(f64, f64, f64)], [x, y]: [&Scale; 2]) {
    if band.is_empty() {
        return;
    }
    let upper = band.iter().map(|(at, _, high)| (at, high));
    let lower = band.iter().rev().map(|(at, low, _)| (at, low));
    let points: Vec<String> = upper.chain(lower).map(|(px, py)| format!("{:.2},{:.2}", x.at(*px), y.at(*py))).collect();
    let (points, paint) = (points.join(" "), look.paint());
    put(
        body,
        format_args!(r#"<polygon {paint} points="{points}" fill="currentColor" fill-opacity="0.18" stroke="none"/>"#),
    );
}

/// One entry of a legend with its upper left corner at a place; its height and its width.
fn entry(body: &mut String, look: Look, series: &Series, [x, y]: [f64; 2]) -> (f64, f64) {
    let middle = y + 8.0;
    line(body, look, [(x, middle), (x + 28.0, middle)].into_iter());
    put(body, format_args!("{}", marker("key", look, [x + 14.0, middle], None)));
    let name = shortened(&series.name, LONGEST_NAME);
    let (tx, ty) = (x + 34.0, middle + 4.0);
    put(body, format_args!(r#"<text class="legend" x="{tx}" y="{ty}">{}</text>"#, escape(&name)));
    let Some(note) = &series.note else { return (18.0, 34.0 + width(&name, 12.0)) };
    let note = shortened(note, LONGEST_NAME + 6);
    let ny = ty + 13.0;
    put(body, format_args!(r#"<text class="note" x="{tx}" y="{ny}" font-size="10">{}</text>"#, escape(&note)));
    (32.0, 34.0 + width(&name, 12.0).max(width(&note, 10.0)))
}

#[cfg(test)]
mod tests {
    use super::well_formed::check;
    use super::*;

    fn plot(series: Vec<Series>) -> Plot {
        Plot { title: "t".into(), x: Axis::logarithmic("photons"), y: Axis::logarithmic("ms"), series }
    }

    fn series(name: &str, points: &[(f64, f64)]) -> Series {
        Series::new(name, points.to_vec())
    }

    /// Where the elements of a class are.
    fn places(svg: &str, class: &str) -> Vec<[f64; 2]> {
        let of_class =
            svg.lines().filter(|line| line.starts_with("<g") && line.contains(&format!("class=\"{class}\"")));
        of_class
            .map(|line| {
                let at = line.split_once("translate(").expect("a place").1.split_once(')').expect("its end").0;
                let numbers: Vec<f64> = at.split(' ').map(|n| n.parse().expect("a number")).collect();
                [numbers[0], numbers[1]]
            })
            .collect()
    }

    #[test]
    fn every_point_is_where_its_logarithm_is() {
        let svg = plot(vec![series("bvh", &[(1e4, 1.0), (1e5, 10.0), (1e6, 1000.0)])]).svg();
        let points = places(&svg, "point");
        let [a, b, c] = points[..] else { panic!("{points:?}") };
        assert!(a[0] < b[0] && (b[0] - a[0] - (c[0] - b[0])).abs() < 0.03, "equal decades: {points:?}");
        assert!(a[1] > b[1] && (2.0 * (a[1] - b[1]) - (b[1] - c[1])).abs() < 0.05, "two decades, upwards: {points:?}");
        assert!(svg.contains(">100000<") || svg.contains(">1e5<"), "a tick has its decade: {svg}");
    }

    #[test]
    fn a_band_encloses_its_line() {
        let mut banded = series("a", &[(1.0, 2.0), (10.0, 0.2)]);
        banded.band = vec![(1.0, 1.0, 4.0), (10.0, 0.1, 0.4), (100.0, 0.0, 1.0), (50.0, 1.0, f64::INFINITY)];
        let svg = plot(vec![banded]).svg();
        let polygon = svg.split_once("<polygon").expect("a band").1.split_once("points=\"").expect("points").1;
        let corners: Vec<f64> = polygon
            .split_once('"')
            .expect("their end")
            .0
            .split(' ')
            .map(|p| p.split_once(',').expect("a pair").1.parse().expect("a number"))
            .collect();
        let points = places(&svg, "point");
        assert_eq!(corners.len(), 4, "what has no logarithm is left out: {corners:?}");
        assert!(corners[0] < points[0][1] && points[0][1] < corners[3], "{corners:?} {points:?}");
        assert!(((corners[0] + corners[3]) / 2.0 - points[0][1]).abs() < 0.02, "a factor of two both ways");
    }

    #[test]
    fn what_has_no_logarithm_is_left_out_and_counted() {
        let odd = [(1e4, 0.0), (0.0, 1.0), (1e5, f64::NAN), (1e5, 2.0)];
        let svg = plot(vec![series("a", &odd)]).svg();
        assert_eq!(svg.matches("class=\"point\"").count(), 1);
        assert!(svg.contains("3 not drawn"), "{svg}");
        let linear = Plot { y: Axis::linear("y"), x: Axis::linear("x"), ..plot(vec![series("a", &odd)]) };
        assert_eq!(linear.svg().matches("class=\"point\"").count(), 3);
        assert!(!plot(vec![series("a", &[(1.0, 1.0)])]).svg().contains("not drawn"));
    }

    #[test]
    fn a_plot_of_nothing_and_of_one_value_has_axes() {
        for points in [&[][..], &[(5.0, 5.0)], &[(1e-320, 1e308), (1e300, 1e-300)]] {
            let svg = plot(vec![series("a", points)]).svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            check(&svg).expect("an SVG");
        }
    }

    #[test]
    fn a_legend_never_meets_the_plot_or_itself() {
        let many: Vec<Series> = (0..40)
            .map(|i| Series { note: Some("slope -1".into()), ..series(&"m".repeat(i * 3), &[(1.0, 1.0)]) })
            .collect();
        let svg = plot(many).svg();
        let attribute = |line: &str, name: &str| -> f64 {
            let rest = line.split_once(&format!(" {name}=\"")).expect("the attribute").1;
            rest.split_once('"').expect("its end").0.parse().expect("a number")
        };
        let texts = || svg.lines().filter(|line| line.contains("class=\"legend\"") || line.contains("class=\"note\""));
        let ys: Vec<f64> = texts().map(|line| attribute(line, "y")).collect();
        assert_eq!(ys.len(), 80);
        assert!(ys.windows(2).all(|w| w[1] - w[0] >= 12.0), "{ys:?}");
        assert!(texts().all(|line| attribute(line, "x") > MARGIN[0] + AREA[0]));
        let head = svg.lines().next().expect("a head");
        assert!(attribute(head, "height") > ys[79] && attribute(head, "width") > MARGIN[0] + AREA[0] + 300.0, "{head}");
    }

    #[test]
    fn text_is_escaped() {
        let hostile = "<&>\"'</svg><script>\u{1}";
        let mut plot = plot(vec![Series { note: Some(hostile.into()), ..series(hostile, &[(1.0, 1.0)]) }]);
        (plot.title, plot.x.label, plot.y.label) = (hostile.into(), hostile.into(), hostile.into());
        let svg = plot.svg();
        assert!(!svg.contains("<script") && !svg.contains("<&"), "{svg}");
        check(&svg).expect("an SVG");
    }

    /// Lightness differs or hue does, also without one kind of cones (matrices of Viénot, Brettel and Mollon 1999 in
    /// linear RGB).
    #[test]
    fn colours_differ_for_every_colour_vision() {
        let kinds = [
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
            [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
        ];
        for page in [0, 1] {
            for (kind, matrix) in kinds.iter().enumerate() {
                let seen: Vec<[f64; 3]> = COLOURS.iter().map(|colour| seen(colour[page], matrix)).collect();
                for (i, a) in seen.iter().enumerate() {
                    for (j, b) in seen.iter().enumerate().skip(i + 1) {
                        let apart = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
                        assert!(
                            apart > 0.3,
                            "{} and {} for vision {kind}: {apart}",
                            COLOURS[i][page],
                            COLOURS[j][page]
                        );
                    }
                }
            }
        }
    }

    /// A colour through a matrix in linear light, with the square root as the eye's response.
    fn seen(colour: &str, matrix: &[[f64; 3]; 3]) -> [f64; 3] {
        let part = |k: usize| u8::from_str_radix(&colour[1 + 2 * k..3 + 2 * k], 16).expect("a colour");
        let linear: Vec<f64> = (0..3).map(|k| (f64::from(part(k)) / 255.0).powf(2.2)).collect();
        matrix.map(|row| row.iter().zip(&linear).map(|(m, v)| m * v).sum::<f64>().max(0.0).sqrt())
    }
}
