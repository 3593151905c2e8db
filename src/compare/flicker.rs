//! How much a sequence of pictures flickers where nothing moves.
//!
//! The index is the mean of |a - 2 b + c| over three pictures a, b, c in sequence, over the mean of their values: over
//! all such triples, channels, and pixels whose surface and light do not move. What brightens or darkens evenly has no
//! second difference; independent noise of standard deviation s and mean m has the index sqrt(12 / pi) s / m, about
//! 1.95 s / m, and the same noise in every picture has none.
//!
//! The surface of a pixel does not move where the layers `depth`, `normal` and `albedo` (those that are there) are the
//! same in the three pictures up to rounding and to noise at edges. Its light does not move where a and c differ by no
//! more than the layer `error` allows. For independent noise a - c says nothing of a - 2 b + c (their covariance is
//! zero), so leaving pixels out by the one does not make the other smaller.

use crate::error::{Error, Result};
use crate::picture::image::{Layer, Picture};

/// The flicker of a sequence.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Flicker {
    second_differences: f64,
    values: f64,
    /// Pixels of all triples that count, and all of them.
    counted: u64,
    all: u64,
    triples: u64,
}

/// Differences of layers that are rounding, or noise at edges: of depth as a share of it.
const SAME_DEPTH: f32 = 0.01;
const SAME_VECTOR: f32 = 0.02;

impl Flicker {
    /// Adds three pictures in sequence.
    ///
    /// # Errors
    /// [`Error::Usage`] if they have no colours, or differ in size.
    pub fn add(&mut self, pictures: [&Picture; 3]) -> Result<()> {
        let [a, b, c] = pictures;
        if [b, c].iter().any(|p| (p.width, p.height) != (a.width, a.height)) {
            return Err(Error::Usage("the pictures differ in size".into()));
        }
        if pictures.into_iter().any(|picture| picture.beauty().is_none()) {
            return Err(Error::Usage("a picture has no colours".into()));
        }
        let still: Vec<bool> = (0..a.pixel_count()).map(|pixel| is_still(pictures, pixel)).collect();
        let colors = pictures.map(|p| p.beauty().map_or(&[][..], |layer| &layer.data));
        for pixel in (0..still.len()).filter(|pixel| still[*pixel]) {
            for channel in 3 * pixel..3 * pixel + 3 {
                let [a, b, c] = colors.map(|data| f64::from(data[channel]));
                if [a, b, c].iter().all(|x| x.is_finite()) {
                    self.second_differences += (a - 2.0 * b + c).abs();
                    self.values += (a + b + c) / 3.0;
                }
            }
            self.counted += 1;
        }
        self.all += still.len() as u64;
        self.triples += 1;
        Ok(())
    }

    /// The index; `None` where no pixel stays, or all that do are black.
    pub fn index(&self) -> Option<f64> {
        (self.values > 0.0).then(|| self.second_differences / self.values)
    }

    /// The share of pixels that do not move.
    pub fn still_share(&self) -> f64 {
        self.counted as f64 / (self.all as f64).max(1.0)
    }

    /// Triples that were added.
    pub fn triples(&self) -> u64 {
        self.triples
    }
}

/// Whether neither surface nor light of a pixel moves.
fn is_still([a, b, c]: [&Picture; 3], pixel: usize) -> bool {
    let same = |name: &str, apart: fn(&[f32], &[f32]) -> bool| {
        let at = |picture: &'_ Picture| picture.layer(name).map(|layer| values(layer, pixel).to_vec());
        match (at(a), at(b), at(c)) {
            (Some(a), Some(b), Some(c)) => !apart(&a, &b) && !apart(&b, &c),
            _ => true,
        }
    };
    let far = |x: &[f32], y: &[f32]| x.iter().zip(y).any(|(x, y)| (x - y).abs() > SAME_VECTOR);
    let deeper = |x: &[f32], y: &[f32]| (x[0] - y[0]).abs() > SAME_DEPTH * x[0].abs().min(y[0].abs());
    same("depth", deeper) && same("normal", far) && same("albedo", far) && light_stays(a, c, pixel)
}

/// Whether two colours of a pixel differ by no more than their errors.
fn light_stays(a: &Picture, c: &Picture, pixel: usize) -> bool {
    let (Some(x), Some(y)) = (a.beauty(), c.beauty()) else { return false };
    let (Some(e), Some(f)) = (a.layer("error"), c.layer("error")) else { return true };
    if e.channels != x.channels || f.channels != y.channels {
        return true;
    }
    let differ = |k: usize| {
        let [x, y, e, f] = [x, y, e, f].map(|layer| f64::from(values(layer, pixel)[k]));
        // The layer is a bound of 90 %: twice as far is rare by chance.
        (x - y).abs() > 2.0 * (e * e + f * f).sqrt()
    };
    !(0..3).any(differ)
}

fn values(layer: &Layer, pixel: usize) -> &[f32] {
    let count = layer.channels.count();
    &layer.data[count * pixel..count * (pixel + 1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::image::Channels;
    use crate::random::Random;

    fn picture(colors: Vec<f32>) -> Picture {
        let mut picture = Picture::new(colors.len() as u32 / 3, 1);
        picture.push("", Channels::Rgb, colors);
        picture
    }

    fn index(pictures: &[Picture]) -> Option<f64> {
        let mut flicker = Flicker::default();
        pictures.windows(3).for_each(|p| flicker.add([&p[0], &p[1], &p[2]]).expect("pictures of one size"));
        flicker.index()
    }

    #[test]
    fn independent_noise_has_the_index_of_its_deviation() {
        let mut random = Random(7);
        let frames: Vec<Picture> =
            (0..6).map(|_| picture((0..30_000).map(|_| 5.0 + 0.1 * random.normal()).collect())).collect();
        let expected = (12.0 / std::f64::consts::PI).sqrt() * 0.1 / 5.0;
        let found = index(&frames).expect("not black");
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
        // The same noise in every picture, and light that grows evenly.
        assert_eq!(index(&[frames[0].clone(), frames[0].clone(), frames[0].clone()]), Some(0.0));
        let ramp: Vec<Picture> = (1..5).map(|i| picture(vec![i as f32; 3])).collect();
        assert_eq!(index(&ramp), Some(0.0));
        assert_eq!(index(&[picture(vec![0.0; 3]), picture(vec![0.0; 3]), picture(vec![0.0; 3])]), None);
    }

    #[test]
    fn what_moves_does_not_count() {
        let with = |colors: [f32; 2], depth: [f32; 2], error: f32| {
            let mut picture = picture(colors.into_iter().flat_map(|x| [x; 3]).collect());
            picture.push("depth", Channels::Scalar, depth.to_vec());
            picture.push("error", Channels::Rgb, vec![error; 6]);
            picture
        };
        let frames =
            [with([1.0, 1.0], [2.0, 2.0], 0.1), with([1.0, 9.0], [2.0, 3.0], 0.1), with([1.1, 1.0], [2.0, 2.0], 0.1)];
        let mut flicker = Flicker::default();
        flicker.add([&frames[0], &frames[1], &frames[2]]).expect("one size");
        assert_eq!(flicker.still_share(), 0.5);
        let expected = 0.1 / (3.1 / 3.0);
        assert!(flicker.index().is_some_and(|index| (index - expected).abs() < 1e-6), "{flicker:?}");
        // A lamp that is switched off is no flicker.
        let dark = [frames[0].clone(), frames[0].clone(), with([0.5, 0.5], [2.0, 2.0], 0.1)];
        let mut flicker = Flicker::default();
        flicker.add([&dark[0], &dark[1], &dark[2]]).expect("one size");
        assert_eq!((flicker.still_share(), flicker.index(), flicker.triples()), (0.0, None, 1));
        assert!(flicker.add([&dark[0], &dark[1], &picture(vec![0.0; 3])]).is_err());
    }
}
