//! The film: exact sums over passes, and which passes are in them. All that error bars, resuming and merging need.

use std::borrow::Cow;
use std::ops::Range;

use super::exact::ExactSum;
use super::mix::{Mix, Turns, mixed};
use crate::constants::{self, FILM_SCALED, FILM_SQUARES};
use crate::error::{Error, Result};
use crate::picture::image::{Channels, Picture};

/// Sums per pixel: value, square, value times squared footprint scale, three channels each.
pub const SUMS: usize = constants::FILM_SUMS as usize;

/// Sums per pixel of the layers: albedo, normal, depth, coverage, direct, indirect, caustic.
pub const LAYER_SUMS: usize = constants::LAYER_SUMS as usize;

/// A set of global pass indices.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct PassSet {
    /// Ascending, apart from each other, none empty.
    ranges: Vec<Range<u64>>,
}

impl PassSet {
    /// The indices of one range.
    pub fn of(range: Range<u64>) -> Self {
        Self { ranges: if range.is_empty() { vec![] } else { vec![range] } }
    }

    /// Ascending ranges that do not touch.
    pub fn ranges(&self) -> &[Range<u64>] {
        &self.ranges
    }

    /// Number of indices.
    pub fn count(&self) -> u64 {
        self.ranges.iter().map(|range| range.end - range.start).sum()
    }

    /// Whether an index is in the set.
    pub fn contains(&self, index: u64) -> bool {
        self.ranges.iter().any(|range| range.contains(&index))
    }

    /// The first range that both sets have in common.
    pub fn overlap(&self, other: &Self) -> Option<Range<u64>> {
        let (mut ours, mut theirs) = (self.ranges.iter().peekable(), other.ranges.iter().peekable());
        while let (Some(a), Some(b)) = (ours.peek(), theirs.peek()) {
            let common = a.start.max(b.start)..a.end.min(b.end);
            if !common.is_empty() {
                return Some(common);
            }
            if a.end <= b.end {
                ours.next()
            } else {
                theirs.next()
            };
        }
        None
    }

    /// The lowest index of `range` that is not in the set.
    pub fn first_missing(&self, range: Range<u64>) -> Option<u64> {
        let holder = self.ranges.iter().find(|held| held.contains(&range.start));
        let lowest = holder.map_or(range.start, |held| held.end);
        range.contains(&lowest).then_some(lowest)
    }

    /// Adds an index; `false` if it was there.
    pub fn insert(&mut self, index: u64) -> bool {
        // The usual case, passes in order, takes no search.
        if let Some(last) = self.ranges.last_mut()
            && last.end == index
        {
            last.end += 1;
            return true;
        }
        let new = !self.contains(index);
        self.unite(&Self::of(index..index + 1));
        new
    }

    /// Adds all indices of another set.
    pub fn unite(&mut self, other: &Self) {
        let mut all: Vec<Range<u64>> = self.ranges.iter().chain(&other.ranges).cloned().collect();
        all.sort_by_key(|range| range.start);
        self.ranges.clear();
        for range in all {
            match self.ranges.last_mut() {
                Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
                _ => self.ranges.push(range),
            }
        }
    }
}

impl std::fmt::Display for PassSet {
    /// `0..16,32..48`, empty for none.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ranges: Vec<String> = self.ranges.iter().map(|range| format!("{}..{}", range.start, range.end)).collect();
        f.write_str(&ranges.join(","))
    }
}

impl std::str::FromStr for PassSet {
    type Err = Error;

    /// Reads what `Display` writes: ascending ranges apart from each other.
    fn from_str(text: &str) -> Result<Self> {
        let wrong = || Error::Usage(format!("'{text}' is not a list of passes such as 0..16,32..48"));
        let mut set = Self::default();
        for part in text.split(',').filter(|part| !part.is_empty()) {
            let (start, end) = part.split_once("..").ok_or_else(wrong)?;
            let range = start.parse::<u64>().map_err(|_| wrong())?..end.parse::<u64>().map_err(|_| wrong())?;
            let after = set.ranges.last().is_none_or(|last| last.end < range.start);
            if range.is_empty() || !after {
                return Err(wrong());
            }
            set.ranges.push(range);
        }
        Ok(set)
    }
}

/// The film of a render or of a part of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Film {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Exponents of the powers of two that radiance and depth are counted in: from the scene, so that scaling a scene
    /// by a power of two changes no bit.
    pub exponents: [i32; 2],
    /// Passes added.
    pub passes: PassSet,
    /// Pixel values that were not finite (they count as 0) or beyond the range of the sums (they are cut). A correct
    /// renderer keeps this at 0.
    pub rejected: u64,
    /// [`SUMS`] per pixel, rows from the top.
    pub sums: Vec<[ExactSum; SUMS]>,
    /// [`LAYER_SUMS`] per pixel, rows from the top; empty without layers.
    pub layers: Vec<[ExactSum; LAYER_SUMS]>,
    /// The sums of the passes of a second method, where passes take turns: those above are of the first one alone.
    pub mix: Option<Mix>,
}

impl Film {
    /// A black film without passes.
    pub fn new(width: u32, height: u32, exponents: [i32; 2], with_layers: bool) -> Self {
        let pixels = width as usize * height as usize;
        Self {
            width,
            height,
            exponents,
            passes: PassSet::default(),
            rejected: 0,
            sums: vec![[ExactSum::default(); SUMS]; pixels],
            layers: vec![[ExactSum::default(); LAYER_SUMS]; if with_layers { pixels } else { 0 }],
            mix: None,
        }
    }

    /// The same film with room for the passes of a second method.
    pub fn with_turns(self, turns: Option<Turns>) -> Self {
        let (sums, layers) = (self.sums.len(), self.layers.len());
        let mix = turns.map(|turns| Mix {
            turns,
            sums: vec![[ExactSum::default(); SUMS]; sums],
            layers: vec![[ExactSum::default(); LAYER_SUMS]; layers],
        });
        Self { mix, ..self }
    }

    /// The passes of the first method by their indices among those, and of the second one.
    pub fn split_passes(&self) -> [PassSet; 2] {
        match &self.mix {
            Some(mix) => mix.turns.split(&self.passes),
            None => [self.passes.clone(), PassSet::default()],
        }
    }

    /// All sums: those of pixels, then those of layers, then the same of the second method.
    pub(super) fn all_sums(&self) -> impl Iterator<Item = &[ExactSum]> {
        let second = self.mix.iter().flat_map(|mix| slices(&mix.sums).chain(slices(&mix.layers)));
        slices(&self.sums).chain(slices(&self.layers)).chain(second)
    }

    fn all_sums_mut(&mut self) -> impl Iterator<Item = &mut ExactSum> {
        let second =
            self.mix.iter_mut().flat_map(|mix| mix.sums.iter_mut().flatten().chain(mix.layers.iter_mut().flatten()));
        self.sums.iter_mut().flatten().chain(self.layers.iter_mut().flatten()).chain(second)
    }

    /// Adds the passes of another film, bit for bit as if they had been rendered into this one.
    ///
    /// # Errors
    /// [`Error::Usage`] if size, units or layers differ, or both hold one pass.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        let shape = |film: &Self| (film.width, film.height, film.exponents, film.layers.is_empty(), film.mix.is_some());
        if shape(self) != shape(other) {
            return Err(Error::Usage("films of other sizes, layers or scenes cannot be merged".into()));
        }
        let turns = self.agreed_turns(other)?;
        if let Some(range) = self.passes.overlap(&other.passes) {
            return Err(Error::Usage(format!("passes {}..{} are in both films", range.start, range.end)));
        }
        let pairs = self.all_sums_mut().zip(other.all_sums().flatten());
        pairs.for_each(|(ours, theirs)| *ours = ours.plus_sum(*theirs));
        self.passes.unite(&other.passes);
        if let (Some(mix), Some(turns)) = (&mut self.mix, turns) {
            mix.turns = turns;
        }
        self.rejected = self.rejected.saturating_add(other.rejected);
        Ok(())
    }

    /// Whose turn passes are in this film and another one of the same render; `None` for films of one method.
    fn agreed_turns(&self, other: &Self) -> Result<Option<Turns>> {
        let (Some(ours), Some(theirs)) = (&self.mix, &other.mix) else { return Ok(None) };
        let agreed = ours.turns.agreed(theirs.turns).ok_or_else(|| {
            let cause = "the films have passes of their two methods in other turns, as two devices may choose them";
            Error::Usage(format!("{cause}: render the parts on devices of one kind, or with one method"))
        });
        agreed.map(Some)
    }

    /// Per pixel and channel: sum, sum of squares, sum of values times squared footprint scale; of passes of two
    /// methods, those of the first.
    pub fn moments(&self) -> Vec<[f64; SUMS]> {
        let unit = 2f64.powi(self.exponents[0]);
        let squares = FILM_SQUARES as usize..FILM_SCALED as usize;
        let units: [f64; SUMS] = std::array::from_fn(|k| if squares.contains(&k) { unit * unit } else { unit });
        self.sums.iter().map(|sums| std::array::from_fn(|k| sums[k].to_f64() * units[k])).collect()
    }

    /// The mean of all passes: beauty, and the layers if there are any. Black without passes. Of passes of two methods
    /// see [`super::mix`]; what is seen and not light is the mean of all.
    pub fn picture(&self) -> Picture {
        let mut picture = Picture::new(self.width, self.height);
        let [first, second] = self.split_passes().map(|passes| 1.0 / passes.count().max(1) as f64);
        let weights = mixed(self);
        let unit = 2f64.powi(self.exponents[0]);
        let light = |pixel: usize, sums: &[ExactSum], others: Option<&[ExactSum]>| {
            [0, 1, 2].map(|k| {
                let p = sums[k].to_f64() * unit * first;
                let t = others.map_or(p, |others| others[k].to_f64() * unit * second);
                (p + weights.get(pixel).map_or(0.0, |w| w.weight) * (t - p)) as f32
            })
        };
        let mix = self.mix.as_ref();
        let beauty = |(pixel, sums)| light(pixel, sums, mix.map(|mix| &mix.sums[pixel][..]));
        picture.push("", Channels::Rgb, slices(&self.sums).enumerate().flat_map(beauty).collect());
        if self.layers.is_empty() {
            return picture;
        }
        let depth_unit = 2f64.powi(self.exponents[1]);
        let scale = 1.0 / self.passes.count().max(1) as f64;
        let both = match mix {
            Some(mix) => {
                let pairs = self.layers.iter().zip(&mix.layers);
                Cow::Owned(pairs.map(|(a, b)| std::array::from_fn(|k| a[k].plus_sum(b[k]))).collect())
            }
            None => Cow::Borrowed(&self.layers[..]),
        };
        for (name, channels, at) in LAYERS {
            let at = at as usize;
            let pixels = both.iter().map(|sums| &sums[at..]);
            let data = match (name, channels) {
                (_, Channels::Vector) => pixels.flat_map(direction).collect(),
                (_, Channels::Scalar) => pixels.map(|sums| depth(sums, depth_unit)).collect(),
                ("albedo", _) => pixels.flat_map(|sums| [0, 1, 2].map(|k| (sums[k].to_f64() * scale) as f32)).collect(),
                _ => {
                    let layer = |(pixel, sums): (usize, &[ExactSum])| {
                        light(pixel, &sums[at..], mix.map(|mix| &mix.layers[pixel][at..]))
                    };
                    slices(&self.layers).enumerate().flat_map(layer).collect()
                }
            };
            picture.push(name, channels, data);
        }
        picture
    }
}

fn slices<const N: usize>(pixels: &[[ExactSum; N]]) -> impl Iterator<Item = &[ExactSum]> {
    pixels.iter().map(|sums| &sums[..])
}

/// Layers, and where their sums begin.
const LAYERS: [(&str, Channels, u32); 6] = [
    ("albedo", Channels::Rgb, constants::LAYER_AT_ALBEDO),
    ("normal", Channels::Vector, constants::LAYER_AT_NORMAL),
    ("depth", Channels::Scalar, constants::LAYER_AT_DEPTH),
    ("direct", Channels::Rgb, constants::LAYER_AT_DIRECT),
    ("indirect", Channels::Rgb, constants::LAYER_AT_INDIRECT),
    ("caustic", Channels::Rgb, constants::LAYER_AT_CAUSTIC),
];

fn direction(sums: &[ExactSum]) -> [f32; 3] {
    let vector = [0, 1, 2].map(|k| sums[k].to_f64());
    let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
    vector.map(|x| if length > 0.0 { (x / length) as f32 } else { 0.0 })
}

/// The mean over the samples that met a surface; infinity where none did. `sums` begins with that of the depths.
fn depth(sums: &[ExactSum], unit: f64) -> f32 {
    let covered = sums[(constants::LAYER_AT_COVERAGE - constants::LAYER_AT_DEPTH) as usize].to_f64();
    if covered > 0.0 { (sums[0].to_f64() * unit / covered) as f32 } else { f32::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A film of one pixel with the passes `range`, each of a value of its own.
    fn film(range: Range<u64>) -> Film {
        let mut film = Film::new(1, 1, [3, -2], true);
        for index in range {
            let value = 0.1 / (1.0 + index as f32);
            film.sums[0].iter_mut().for_each(|sum| *sum = sum.plus(value));
            film.layers[0].iter_mut().for_each(|sum| *sum = sum.plus(value));
            assert!(film.passes.insert(index));
        }
        film
    }

    #[test]
    fn merged_films_equal_one_film() {
        let mut merged = film(700..1000);
        merged.merge(&film(0..300)).expect("apart");
        merged.merge(&film(300..700)).expect("apart");
        assert_eq!(merged, film(0..1000));
        assert_ne!(merged, film(0..999), "the check can fail");
        assert_eq!(merged.passes.to_string(), "0..1000");
    }

    #[test]
    fn what_does_not_belong_together_is_refused() {
        let mut one = film(0..10);
        let before = one.clone();
        let message = one.merge(&film(8..12)).expect_err("twice").to_string();
        assert!(message.contains("passes 8..10"), "{message}");
        assert!(one.merge(&Film::new(2, 1, [3, -2], true)).is_err(), "size");
        assert!(one.merge(&Film::new(1, 1, [4, -2], true)).is_err(), "units");
        assert!(one.merge(&Film::new(1, 1, [3, -2], false)).is_err(), "layers");
        assert_eq!(one, before, "a refusal changes nothing");
    }

    #[test]
    fn units_return_in_the_picture() {
        let mut film = Film::new(1, 1, [3, -2], true);
        film.passes = PassSet::of(0..2);
        film.sums[0][0] = ExactSum::default().plus(0.5);
        film.layers[0][6] = ExactSum::default().plus(8.0);
        film.layers[0][7] = ExactSum::default().plus(2.0);
        film.layers[0][3] = ExactSum::default().plus(-7.0);
        let picture = film.picture();
        assert_eq!(picture.beauty().expect("a colour").data, [2.0, 0.0, 0.0]);
        assert_eq!(picture.layer("depth").expect("a depth").data, [1.0]);
        assert_eq!(picture.layer("normal").expect("a normal").data, [-1.0, 0.0, 0.0]);
        assert_eq!((film.moments()[0][0], picture.layers.len()), (4.0, 7));
    }

    #[test]
    fn sets_of_passes_are_read_as_they_are_written() {
        let mut set = PassSet::default();
        assert_eq!((set.to_string().as_str(), set.count()), ("", 0));
        for index in [5, 6, 2, 0, 1, 9] {
            assert!(set.insert(index));
        }
        assert!(!set.insert(6));
        assert_eq!((set.to_string().as_str(), set.count()), ("0..3,5..7,9..10", 6));
        assert_eq!(set.to_string().parse::<PassSet>().expect("ours"), set);
        assert_eq!("".parse::<PassSet>().expect("none"), PassSet::default());
        for wrong in ["0..0", "3..1", "5..9,0..2", "0..3,2..4", "0..3,3..4", "x..2", "1", "-1..2", "0...3"] {
            assert!(wrong.parse::<PassSet>().is_err(), "{wrong}");
        }
        assert_eq!(set.overlap(&PassSet::of(6..20)), Some(6..7));
        assert_eq!(set.overlap(&PassSet::of(3..5)), None);
        assert_eq!(set.overlap(&"3..4,8..12".parse().expect("a set")), Some(9..10));
        let missing = |range| set.first_missing(range);
        assert_eq!([missing(0..9), missing(1..3), missing(5..8), missing(8..9)], [Some(3), None, Some(7), Some(8)]);
        assert_eq!((missing(9..10), missing(4..4), PassSet::default().first_missing(0..1)), (None, None, Some(0)));
    }
}
