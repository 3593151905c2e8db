//! A map turned about the vertical axis, and made brighter or darker.

use super::Environment;

impl Environment {
    /// Turns the map about +Y by an angle in degrees, counter-clockwise seen from above: what was in front (-Z) is at
    /// the left (-X) after 90 degrees. By a fraction of a texel, neighbours are blended, so that the mean of each row
    /// stays.
    pub fn turn(&mut self, degrees: f32) {
        let width = self.width as usize;
        let columns = f64::from(degrees).rem_euclid(360.0) / 360.0 * f64::from(self.width);
        let (whole, part) = (columns.floor() as usize % width.max(1), columns.fract() as f32);
        if columns == 0.0 || !columns.is_finite() {
            return;
        }
        for row in self.radiance.chunks_exact_mut(width) {
            row.rotate_left(whole);
            if part > 0.0 {
                let first = row[0];
                for x in 0..width {
                    let (here, next) = (row[x], if x + 1 < width { row[x + 1] } else { first });
                    row[x] = std::array::from_fn(|k| here[k] * (1.0 - part) + next[k] * part);
                }
            }
        }
    }

    /// Multiplies the radiance; what would be beyond f32 stays at its greatest number.
    pub fn scale(&mut self, factor: f32) {
        if factor != 1.0 {
            let scaled = |x: f32| (x * factor).clamp(0.0, f32::MAX);
            self.radiance.iter_mut().for_each(|texel| *texel = texel.map(scaled));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(row: &[f32]) -> Environment {
        let radiance = row.iter().map(|x| [*x; 3]).collect();
        Environment { width: row.len() as u32, height: 1, radiance }
    }

    fn turned(row: &[f32], degrees: f32) -> Vec<f32> {
        let mut map = map(row);
        map.turn(degrees);
        map.radiance.iter().map(|texel| texel[0]).collect()
    }

    #[test]
    fn whole_texels_move_and_parts_are_blended() {
        let row = [1.0, 2.0, 4.0, 8.0];
        assert_eq!(turned(&row, 90.0), [2.0, 4.0, 8.0, 1.0]);
        assert_eq!(turned(&row, -90.0), [8.0, 1.0, 2.0, 4.0]);
        assert_eq!(turned(&row, 720.0), row);
        assert_eq!(turned(&row, 45.0), [1.5, 3.0, 6.0, 4.5]);
        assert_eq!(turned(&row, -1e-9), row, "less than a texel can show");
    }

    #[test]
    fn the_turn_is_counter_clockwise_from_above() {
        // A lamp in front (-Z, the middle of the map) comes to the left (-X).
        let mut row = [0.0; 360];
        row[180] = 1.0;
        let at = turned(&row, 90.0).iter().position(|x| *x == 1.0).expect("a lamp");
        let [x, _, z] = Environment::direction((at as f32 + 0.5) / 360.0, 0.5);
        assert!(x < -0.99 && z.abs() < 0.1, "{x} {z}");
    }

    #[test]
    fn a_scaled_map_is_finite() {
        let mut bright = map(&[1.0, f32::MAX]);
        bright.scale(2.5);
        assert_eq!(bright.radiance, [[2.5; 3], [f32::MAX; 3]]);
        bright.scale(0.0);
        assert_eq!(bright.radiance, [[0.0; 3]; 2]);
    }
}
