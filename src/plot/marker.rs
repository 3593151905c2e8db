//! Markers: a shape per series, hollow for dashed ones.

use super::{BACK, Look};

/// Shapes around the origin.
const SHAPES: [&str; 6] = [
    "M3.4 0A3.4 3.4 0 1 1 -3.4 0A3.4 3.4 0 1 1 3.4 0Z",
    "M-3.1 -3.1H3.1V3.1H-3.1Z",
    "M0 -4.2L4 2.9H-4Z",
    "M0 -4.4L4.4 0L0 4.4L-4.4 0Z",
    "M0 4.2L4 -2.9H-4Z",
    "M-1.4 -3.8H1.4V-1.4H3.8V1.4H1.4V3.8H-1.4V1.4H-3.8V-1.4H-1.4Z",
];

/// An element of a class at a place, with the escaped text that a reader sees who points at it.
pub(super) fn marker(class: &str, look: Look, [x, y]: [f64; 2], title: Option<&str>) -> String {
    let (shape, paint) = (SHAPES[look.index % SHAPES.len()], look.paint());
    let title = title.map(|text| format!("<title>{text}</title>")).unwrap_or_default();
    let back = BACK[0];
    // A hollow one hides the line behind it.
    let fill = if look.dashed {
        format!(r#"<path class="np-back" color="{back}" d="{shape}" fill="currentColor"/>"#)
    } else {
        String::new()
    };
    let inside = if look.dashed { "none" } else { "currentColor" };
    let outline = format!(r#"<path {paint} d="{shape}" fill="{inside}" stroke="currentColor" stroke-width="1"/>"#);
    format!(r#"<g class="{class}" transform="translate({x:.2} {y:.2})">{title}{fill}{outline}</g>"#)
}
