//! Horizontal stacked bars.

use super::scale::Scale;
use super::text::{escape, shortened, width};
use super::{Axis, COLOURS, GRID, LONGEST_NAME, Look, document, put};

/// Width of the longest bar in user units.
const WIDTH: f64 = 480.0;
/// Height of a bar with its gap.
const STEP: f64 = 26.0;

/// One bar.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// What it is of.
    pub name: String,
    /// Length of each part, in the order of [`Bars::parts`]; what is negative or not finite is drawn as 0.
    pub values: Vec<f64>,
}

/// Bars of the same parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Bars {
    /// Title of the picture.
    pub title: String,
    /// What the length means, with its unit.
    pub label: String,
    /// Names of the parts.
    pub parts: Vec<String>,
    /// The bars, from top to bottom.
    pub bars: Vec<Bar>,
}

impl Bars {
    /// The bars as an SVG document: each part that is longer than 0 is one element of the class `part`.
    pub fn svg(&self) -> String {
        let names: Vec<String> = self.bars.iter().map(|bar| shortened(&bar.name, LONGEST_NAME)).collect();
        let left = 20.0 + names.iter().map(|name| width(name, 12.0)).fold(30.0, f64::max);
        let (legend, top) = self.legend(left + WIDTH);
        let bottom = top + STEP * self.bars.len() as f64;
        let totals = self.bars.iter().map(|bar| bar.values.iter().copied().map(drawn).sum());
        let x =
            Scale::new(&Axis::linear(""), totals.chain([0.0]).filter(|v: &f64| v.is_finite()), [left, left + WIDTH]);
        let mut body = legend;
        for tick in &x.ticks {
            let (at, y, grid) = (x.at(tick.value), bottom + 16.0, GRID[0]);
            let label = tick.label.as_deref().unwrap_or_default();
            let ends = format!(r#"x1="{at:.2}" x2="{at:.2}" y1="{top}" y2="{bottom}""#);
            put(
                &mut body,
                format_args!(
                    r#"<line class="np-grid" color="{grid}" {ends} stroke="currentColor"/>
<text x="{at:.2}" y="{y}" text-anchor="middle">{label}</text>"#
                ),
            );
        }
        for (row, (bar, name)) in self.bars.iter().zip(&names).enumerate() {
            let y = top + STEP * row as f64;
            let (tx, ty, name) = (left - 8.0, y + 17.0, escape(name));
            put(&mut body, format_args!(r#"<text x="{tx}" y="{ty}" text-anchor="end">{name}</text>"#));
            self.bar(&mut body, bar, &x, y);
        }
        let (cx, cy, label) = (left + 0.5 * WIDTH, bottom + 36.0, escape(&self.label));
        put(&mut body, format_args!(r#"<text x="{cx}" y="{cy}" text-anchor="middle">{label}</text>"#));
        document([left + WIDTH + 24.0, bottom + 48.0], &self.title, &body)
    }

    fn bar(&self, body: &mut String, bar: &Bar, x: &Scale, y: f64) {
        let mut from = 0.0;
        for (index, (part, value)) in self.parts.iter().zip(bar.values.iter().copied().map(drawn)).enumerate() {
            let (start, end) = (x.at(from), x.at(from + value));
            from += value;
            if value > 0.0 && end.is_finite() {
                let (paint, title) = (Look { index, dashed: false }.paint(), escape(&format!("{part}: {value}")));
                let (wide, high, y) = (end - start, STEP - 8.0, y + 4.0);
                let place = format!(r#"x="{start:.2}" y="{y}" width="{wide:.2}" height="{high}""#);
                let fill = format!(r#"fill="currentColor" fill-opacity="{}""#, opacity(index));
                put(body, format_args!(r#"<g class="part"><title>{title}</title><rect {paint} {place} {fill}/></g>"#));
            }
        }
    }

    /// Names of the parts in rows that end before `right`, and where they end below.
    fn legend(&self, right: f64) -> (String, f64) {
        let (mut body, mut x, mut y) = (String::new(), 20.0, 42.0);
        for (index, part) in self.parts.iter().enumerate() {
            let name = shortened(part, LONGEST_NAME);
            let wide = 34.0 + width(&name, 12.0);
            if x > 20.0 && x + wide > right {
                (x, y) = (20.0, y + 18.0);
            }
            let (paint, opacity) = (Look { index, dashed: false }.paint(), opacity(index));
            let (tx, ty, name) = (x + 18.0, y + 10.0, escape(&name));
            let fill = format!(r#"fill="currentColor" fill-opacity="{opacity}""#);
            put(
                &mut body,
                format_args!(
                    r#"<rect {paint} x="{x:.2}" y="{y}" width="12" height="12" {fill}/>
<text class="legend" x="{tx:.2}" y="{ty}">{name}</text>"#
                ),
            );
            x += wide;
        }
        (body, y + 24.0)
    }
}

fn drawn(value: f64) -> f64 {
    if value.is_finite() { value.max(0.0) } else { 0.0 }
}

/// Colours that come again are paler.
fn opacity(index: usize) -> f64 {
    0.85 * 0.55f64.powi((index / COLOURS.len()) as i32)
}

#[cfg(test)]
mod tests {
    use super::super::well_formed::check;
    use super::*;

    fn bars(values: &[&[f64]]) -> Bars {
        Bars {
            title: "<t>".into(),
            label: "seconds".into(),
            parts: vec!["load".into(), "trace & <gather>".into(), "write".into()],
            bars: values.iter().map(|v| Bar { name: "\"a\"".into(), values: v.to_vec() }).collect(),
        }
    }

    /// An attribute of all parts.
    fn of_parts(svg: &str, attribute: &str) -> Vec<f64> {
        let rects = svg.lines().filter(|line| line.contains("class=\"part\""));
        rects
            .map(|line| {
                let rest = line.split_once(&format!(" {attribute}=\"")).expect("the attribute").1;
                rest.split_once('"').expect("its end").0.parse().expect("a number")
            })
            .collect()
    }

    #[test]
    fn parts_are_as_long_as_their_values() {
        let svg = bars(&[&[1.0, 3.0, 2.0], &[2.0, 0.0]]).svg();
        let (from, widths) = (of_parts(&svg, "x"), of_parts(&svg, "width"));
        let near = |a: f64, b: f64| (a - b).abs() < 0.03;
        assert_eq!(widths.len(), 4, "what is 0 long is not drawn");
        assert!(near(widths[1], 3.0 * widths[0]) && near(widths[3], 2.0 * widths[0]), "{widths:?}");
        assert!((0..2).all(|k| near(from[k + 1] - from[k], widths[k])) && from[3] == from[0], "end to end: {from:?}");
        check(&svg).expect("an SVG");
    }

    #[test]
    fn odd_values_are_survived() {
        let odd = [vec![], vec![f64::NAN, f64::INFINITY], vec![-1.0, 0.0, 7.0], vec![f64::MAX, f64::MAX]];
        check(&bars(&[]).svg()).expect("an SVG");
        for values in &odd {
            let svg = bars(&[values]).svg();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            check(&svg).expect("an SVG");
        }
    }
}
