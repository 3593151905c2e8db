//! The map while it is read: texels come one by one, and a map that is too large is reduced at once, so that it never
//! stands in memory whole.

use glam::{Mat3, Vec3};

use super::Environment;

/// What an infinite texel becomes: the largest half float, because half-float files overflow to infinity.
pub(super) const BRIGHTEST_HALF: f32 = 65504.0;

/// Bytes of a texel.
const TEXEL_BYTES: u64 = 12;

/// A map of which some texels are known; the others are black.
pub(super) struct Canvas {
    /// Size before the reduction.
    full: [u64; 2],
    /// Texels of the file that become one, along each side: 2 to this power.
    halvings: u32,
    /// Share of a texel of the file in its mean.
    weight: f32,
    map: Environment,
    /// From the file's colours to Rec. 709.
    to_rec_709: Option<Mat3>,
    /// Texels that were not finite or negative.
    pub clamped: u64,
}

impl Canvas {
    /// A black map of this size, both sides at least 1, halved until it takes at most `most_bytes` or cannot be
    /// halved any more.
    pub fn new(full: [u64; 2], most_bytes: u64, to_rec_709: Option<Mat3>) -> Self {
        let [mut width, mut height] = full;
        let mut halvings = 0;
        while width * height * TEXEL_BYTES > most_bytes && width > 1 && height > 1 {
            (width, height, halvings) = (width / 2, height / 2, halvings + 1);
        }
        let radiance = vec![[0.0; 3]; (width * height) as usize];
        let map = Environment { width: width as u32, height: height as u32, radiance };
        Self { full, halvings, weight: 0.25_f32.powi(halvings as i32), map, to_rec_709, clamped: 0 }
    }

    /// Sets a texel of the file, once; the row and column may lie outside of the map.
    pub fn set(&mut self, x: i64, y: i64, texel: [f32; 3]) {
        let (Ok(x), Ok(y)) = (u64::try_from(x), u64::try_from(y)) else { return };
        if x >= self.full[0] || y >= self.full[1] {
            return;
        }
        let valid = texel.map(|v| if v == f32::INFINITY { BRIGHTEST_HALF } else { v.max(0.0) });
        // NaN differs from itself, and max() has replaced it.
        self.clamped += u64::from(valid != texel);
        // Colours that Rec. 709 does not have come out negative: no damage, but no light either.
        let radiance = self.to_rec_709.map_or(valid, |matrix| (matrix * Vec3::from(valid)).max(Vec3::ZERO).into());
        let (column, row) = ((x >> self.halvings) as usize, (y >> self.halvings) as usize);
        // The last row or column of an odd number falls away.
        if column < self.map.width as usize && row < self.map.height as usize {
            let mean = &mut self.map.radiance[row * self.map.width as usize + column];
            *mean = std::array::from_fn(|k| mean[k] + radiance[k] * self.weight);
        }
    }

    /// The map, with what the user should know: a shape that is stretched, a reduction.
    pub fn finish(self) -> (Environment, Vec<String>) {
        let [width, height] = self.full;
        let mut notes = Vec::new();
        if width != 2 * height {
            notes.push(format!("environment: {width} x {height} is not twice as wide as high; it is stretched"));
        }
        if self.halvings > 0 {
            let (to_width, to_height) = (self.map.width, self.map.height);
            notes.push(format!("environment: reduced from {width} x {height} to {to_width} x {to_height}"));
        }
        (self.map, notes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(full: [u64; 2], most_bytes: u64) -> Canvas {
        let mut canvas = Canvas::new(full, most_bytes, None);
        for y in 0..full[1] as i64 {
            for x in 0..full[0] as i64 {
                canvas.set(x, y, [(y * full[0] as i64 + x) as f32; 3]);
            }
        }
        canvas
    }

    #[test]
    fn large_maps_are_halved_keeping_the_mean() {
        let (map, notes) = filled([4, 2], 24).finish();
        assert_eq!((map.width, map.height, map.radiance), (2, 1, vec![[2.5; 3], [4.5; 3]]));
        assert_eq!(notes, ["environment: reduced from 4 x 2 to 2 x 1"]);
        let (map, _) = filled([8, 4], 24).finish();
        assert_eq!(map.radiance, [[13.5; 3], [17.5; 3]], "twice");
        let (map, notes) = filled([2, 1], 12).finish();
        assert_eq!((map.width, notes.len()), (2, 0), "one row cannot be halved");
        let (map, _) = filled([5, 3], 24).finish();
        assert_eq!((map.width, map.height), (2, 1), "the last row and column fall away");
    }

    #[test]
    fn values_are_clamped_and_counted_and_texels_outside_ignored() {
        let mut canvas = Canvas::new([2, 1], 1 << 10, None);
        canvas.set(0, 0, [1.5, 2.0, 0.25]);
        canvas.set(1, 0, [f32::NAN, -1.0, f32::INFINITY]);
        for (x, y) in [(-1, 0), (2, 0), (0, 1), (0, i64::MIN), (i64::MAX, 0)] {
            canvas.set(x, y, [f32::NAN; 3]);
        }
        assert_eq!(canvas.clamped, 1);
        assert_eq!(canvas.finish().0.radiance, [[1.5, 2.0, 0.25], [0.0, 0.0, BRIGHTEST_HALF]]);
    }

    #[test]
    fn colours_outside_of_rec_709_are_no_damage() {
        let mut canvas = Canvas::new([1, 1], 1 << 10, Some(Mat3::from_diagonal(Vec3::new(2.0, -1.0, 1.0))));
        canvas.set(0, 0, [1.0; 3]);
        assert_eq!(canvas.clamped, 0);
        assert_eq!(canvas.finish().0.radiance, [[2.0, 0.0, 1.0]]);
    }
}
