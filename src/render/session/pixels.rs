//! Order of pixels on the device, the host's copy of glsl/lib/pixels.glsl.

use crate::constants::PIXEL_ROWS as ROWS;

/// Column and row of the pixel with this index.
pub fn position(index: u32, width: u32, height: u32) -> (u32, u32) {
    let strip = index / (ROWS * width);
    let rows = ROWS.min(height - strip * ROWS);
    let inside = index - strip * ROWS * width;
    (inside / rows, strip * ROWS + inside % rows)
}

/// The other way round: `pixel_index` of the same file.
#[cfg(test)]
fn index((x, y): (u32, u32), width: u32, height: u32) -> u32 {
    let strip = y / ROWS;
    strip * ROWS * width + x * ROWS.min(height - strip * ROWS) + y % ROWS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_one_index() {
        for (width, height) in [(1, 1), (1, 9), (7, 3), (5, 4), (6, 11), (16, 8)] {
            let mut seen = vec![false; (width * height) as usize];
            for index in 0..width * height {
                let (x, y) = position(index, width, height);
                assert!(x < width && y < height);
                assert_eq!(super::index((x, y), width, height), index);
                assert!(!std::mem::replace(&mut seen[(y * width + x) as usize], true));
            }
        }
        assert_eq!(position(5, 16, 8), (1, 1), "strips of four rows, column by column");
    }
}
