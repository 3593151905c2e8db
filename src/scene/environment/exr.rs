//! OpenEXR maps: the display window is the sphere, colours are R, G, B or a luminance Y, in any layer or part.

use std::io::Cursor;

use super::canvas::Canvas;
use super::color;
use super::read::{Outcome, Reading, shown};
use crate::input::exr::{Line, MAGIC, Part, Reader, Window};

/// Names of layers and parts that hold the whole picture, in lower case.
const BEAUTY: [&str; 11] =
    ["rgb", "rgba", "color", "colour", "beauty", "combined", "composite", "main", "default", "image", "final"];

/// Whether a file begins as OpenEXR files do.
pub(super) fn is_ours(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// Reads the picture in `bytes`.
pub(super) fn decode(bytes: &[u8], reading: &mut Reading) -> Outcome<Canvas> {
    let mut file = Reader::new(Cursor::new(bytes), bytes.len() as u64).map_err(|fault| fault.to_string())?;
    let chosen = choose(file.parts(), reading)?;
    let part = &file.parts()[chosen.part];
    let converted = match part.chromaticities {
        Some(known) if chosen.is_color() && !color::same(&known, &color::REC_709) => reading.conversion(&known),
        _ => None,
    };
    let sphere = sphere(part, reading);
    let origin = [0, 1].map(|k| part.data.min[k] - sphere.min[k]);
    let canvas = reading.canvas(sphere.size, converted)?;
    let mut rows = Rows { canvas, origin, slots: chosen.slots, row: Vec::new(), at: (0, 0) };
    file.lines(chosen.part, |line| rows.take(&line)).map_err(|fault| fault.to_string())?;
    Ok(rows.finish())
}

/// What the map covers: the display window, black where there are no pixels. Pixels beyond it are left out.
fn sphere(part: &Part, reading: &mut Reading) -> Window {
    let (data, display) = (part.data, part.display);
    let apart = (0..2).any(|k| {
        data.min[k] >= display.min[k] + display.size[k] as i64 || display.min[k] >= data.min[k] + data.size[k] as i64
    });
    if apart {
        reading.fault("environment: no pixel lies in its display window, which is ignored".into());
        return data;
    }
    display
}

/// Channels that make a picture.
struct Colors {
    part: usize,
    /// Channel indices of red, green and blue; all the same for luminance.
    slots: [usize; 3],
    /// Name of the layer; of the part where its channels have none.
    layer: String,
    /// Preferred is what is least: colours before luminance, then what has no name or one that says it is all.
    rank: (bool, u8),
}

impl Colors {
    fn is_color(&self) -> bool {
        !self.rank.0
    }
}

/// The picture to read, told to the user where another might have been meant.
fn choose(parts: &[Part], reading: &mut Reading) -> Outcome<Colors> {
    let flat = parts.iter().enumerate().filter(|(_, part)| !part.deep);
    let mut found: Vec<Colors> = flat.flat_map(|(index, part)| colors_of(index, part, parts.len())).collect();
    // Stable: of equals, the first in the file.
    found.sort_by_key(|colors| colors.rank);
    let count = found.iter().filter(|colors| colors.is_color() == found[0].is_color()).count();
    match found.into_iter().next() {
        None => Err(without_colors(parts)),
        Some(first) => {
            if count > 1 && first.rank.1 > 0 {
                let layer = shown(&first.layer);
                reading.note(format!("environment: '{layer}' is read, the first of {count} layers with colours"));
            }
            Ok(first)
        }
    }
}

fn without_colors(parts: &[Part]) -> String {
    if parts.iter().all(|part| part.deep) {
        return "OpenEXR with deep pixels is not supported".into();
    }
    let names: Vec<String> = parts.iter().flat_map(|part| &part.channels).take(8).map(|c| shown(&c.name)).collect();
    format!("OpenEXR without colours: R, G, B or Y are read, it has {}", names.join(", "))
}

/// All layers of a part that have colours or a luminance.
fn colors_of(index: usize, part: &Part, part_count: usize) -> Vec<Colors> {
    let split = |name: &str| {
        let (layer, channel) = name.rsplit_once('.').unwrap_or(("", name));
        (layer.to_owned(), channel.to_ascii_lowercase())
    };
    let names: Vec<(String, String)> = part.channels.iter().map(|channel| split(&channel.name)).collect();
    let mut layers: Vec<&str> = names.iter().map(|(layer, _)| layer.as_str()).collect();
    layers.sort_unstable();
    layers.dedup();
    // Two layers with thousands of channels each would take millions of comparisons.
    layers.truncate(256);
    let colors = |layer: &str| {
        let find = |wanted: &[&str]| names.iter().position(|(l, c)| l == layer && wanted.contains(&c.as_str()));
        let all = [find(&["r", "red"]), find(&["g", "green"]), find(&["b", "blue"])];
        let slots = match all {
            [Some(r), Some(g), Some(b)] => [r, g, b],
            // X, Y, Z are a direction or a position.
            _ if find(&["x", "z"]).is_some() => return None,
            _ => [find(&["y", "luminance"])?; 3],
        };
        let name = if layer.is_empty() { &part.name } else { layer };
        let own = if layer.is_empty() && part_count == 1 { 0 } else { rank_of_name(name) };
        Some(Colors { part: index, slots, layer: name.to_owned(), rank: (slots[0] == slots[1], own) })
    };
    layers.into_iter().filter_map(colors).collect()
}

fn rank_of_name(name: &str) -> u8 {
    let last = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    match last.as_str() {
        "" => 0,
        last if BEAUTY.contains(&last) => 1,
        _ => 2,
    }
}

/// Puts rows together, whose channels come one after the other.
struct Rows {
    canvas: Canvas,
    /// The data window's corner, from that of the map.
    origin: [i64; 2],
    slots: [usize; 3],
    row: Vec<[f32; 3]>,
    /// First column and row of `row`, from the corner of the data window.
    at: (u64, u64),
}

impl Rows {
    fn take(&mut self, line: &Line<'_>) {
        if self.at != (line.x, line.y) {
            self.flush();
            self.at = (line.x, line.y);
        }
        for slot in (0..3).filter(|&slot| self.slots[slot] == line.channel) {
            for (at, value) in line.samples.floats().enumerate() {
                if at == self.row.len() {
                    self.row.push([0.0; 3]);
                }
                self.row[at][slot] = value;
            }
        }
    }

    fn flush(&mut self) {
        let [x, y] = [self.origin[0] + self.at.0 as i64, self.origin[1] + self.at.1 as i64];
        for (at, texel) in (0..).zip(self.row.drain(..)) {
            self.canvas.set(x + at, y, texel);
        }
    }

    fn finish(mut self) -> Canvas {
        self.flush();
        self.canvas
    }
}
