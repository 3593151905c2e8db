//! Antialiasing of a finished picture: an edge filter for pictures of few passes, in which edges are still stairs.
//!
//! The idea is that of FXAA (Lottes 2009, "FXAA", NVIDIA white paper), the code our own. Where the luma jumps, the edge
//! is followed both ways to its ends, the places where the stair steps. How far the nearer end is, and to which side
//! the edge steps there, tells how a straight edge through both steps would cut this pixel; the pixel is mixed with its
//! neighbour across the edge accordingly. An edge whose end is not found within 24 pixels counts as
//! straight along the axis and stays as it is.

use super::grade::luma;
use super::rows::for_each_row;

/// Least contrast of an edge, in display values.
const LEAST_CONTRAST: f32 = 1.0 / 32.0;

/// Least contrast of an edge relative to the brightest of its neighbourhood.
const LEAST_RELATIVE_CONTRAST: f32 = 1.0 / 8.0;

/// Pixels that an edge is followed in each direction.
const MOST_STEPS: isize = 24;

/// The filtered picture: interleaved display values, 0 ... 1, of `[width, height]` pixels.
pub fn smooth_edges(size: [usize; 2], colors: &[f32]) -> Vec<f32> {
    let lumas: Vec<f32> = colors.chunks_exact(3).map(|c| luma([c[0], c[1], c[2]])).collect();
    let edges = Edges { size, lumas };
    let mut result = colors.to_vec();
    for_each_row(&mut result, 3 * size[0], |y, row| {
        for (x, color) in row.chunks_exact_mut(3).enumerate() {
            let Some(([i, j], share)) = edges.mix([x as isize, y as isize]) else { continue };
            let other = &colors[3 * (j as usize * size[0] + i as usize)..][..3];
            color.iter_mut().zip(other).for_each(|(c, other)| *c += share * (other - *c));
        }
    });
    result
}

struct Edges {
    size: [usize; 2],
    lumas: Vec<f32>,
}

/// An end of an edge: pixels to it, and how far the mean luma of the edge's two sides there is above that here.
struct End {
    distance: f32,
    rise: f32,
}

impl Edges {
    /// Luma of a pixel; beyond the border that of the nearest pixel.
    fn at(&self, [x, y]: [isize; 2]) -> f32 {
        let inside = |i: isize, length: usize| i.clamp(0, length as isize - 1) as usize;
        self.lumas[inside(y, self.size[1]) * self.size[0] + inside(x, self.size[0])]
    }

    fn is_inside(&self, [x, y]: [isize; 2]) -> bool {
        x >= 0 && y >= 0 && x < self.size[0] as isize && y < self.size[1] as isize
    }

    /// The neighbour that a pixel is mixed with, and its share of at most a half.
    fn mix(&self, at: [isize; 2]) -> Option<([isize; 2], f32)> {
        let near = |x: isize, y: isize| self.at([at[0] + x, at[1] + y]);
        let (middle, north, south, west, east) = (near(0, 0), near(0, -1), near(0, 1), near(-1, 0), near(1, 0));
        let cross = [middle, north, south, west, east];
        let brightest = cross.into_iter().fold(0.0, f32::max);
        let contrast = brightest - cross.into_iter().fold(f32::INFINITY, f32::min);
        if contrast < LEAST_CONTRAST.max(LEAST_RELATIVE_CONTRAST * brightest) {
            return None;
        }
        // Second differences along y are great at a horizontal edge, those along x at a vertical one.
        let along_y = |x: isize| (near(x, -1) + near(x, 1) - 2.0 * near(x, 0)).abs();
        let along_x = |y: isize| (near(-1, y) + near(1, y) - 2.0 * near(0, y)).abs();
        let horizontal = along_y(-1) + 2.0 * along_y(0) + along_y(1) >= along_x(-1) + 2.0 * along_x(0) + along_x(1);
        let (before, after) = if horizontal { (north, south) } else { (west, east) };
        let back = (before - middle).abs() >= (after - middle).abs();
        let side = if back { -1 } else { 1 };
        let (across, along) = if horizontal { ([0, side], [1, 0]) } else { ([side, 0], [0, 1]) };
        let other = [at[0] + across[0], at[1] + across[1]];
        if !self.is_inside(other) {
            return None;
        }
        let (step, level) = (self.at(other) - middle, 0.5 * (self.at(other) + middle));
        let ends = [-1, 1].map(|sign| self.end(at, across, along.map(|a| a * sign), (level, 0.25 * step.abs())));
        let nearest = ends.iter().flatten().min_by(|a, b| a.distance.total_cmp(&b.distance))?;
        // At its nearer end the edge must step away from this pixel: there both sides look like the other side here.
        if nearest.rise * step <= 0.0 {
            return None;
        }
        let length: f32 = ends.iter().map(|end| end.as_ref().map_or(MOST_STEPS as f32, |end| end.distance)).sum();
        let share = 0.5 - nearest.distance / length;
        (share > 0.0).then_some((other, share))
    }

    /// Follows the edge from a pixel until the mean of its two sides leaves `level` by `tolerance`. The distance is
    /// that from the middle of the pixel to the border between the last pixel of the edge and the next.
    fn end(&self, at: [isize; 2], across: [isize; 2], step: [isize; 2], (level, tolerance): (f32, f32)) -> Option<End> {
        for i in 1..=MOST_STEPS {
            let p = [at[0] + i * step[0], at[1] + i * step[1]];
            if !self.is_inside(p) {
                return None;
            }
            let rise = 0.5 * (self.at(p) + self.at([p[0] + across[0], p[1] + across[1]])) - level;
            if rise.abs() >= tolerance {
                return Some(End { distance: i as f32 - 0.5, rise });
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of `f` with `n` x `n` samples in each pixel.
    fn sampled(size: [usize; 2], n: usize, f: impl Fn(f32, f32) -> f32) -> Vec<f32> {
        let mut data = Vec::new();
        for index in 0..size[0] * size[1] {
            let at = |k: usize, i: usize| k as f32 + (i as f32 + 0.5) / n as f32;
            let samples = (0..n * n).map(|i| f(at(index % size[0], i % n), at(index / size[0], i / n)));
            data.extend([samples.sum::<f32>() / (n * n) as f32; 3]);
        }
        data
    }

    fn rms(a: &[f32], b: &[f32]) -> f32 {
        (a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>() / a.len() as f32).sqrt()
    }

    #[test]
    fn constants_ramps_and_straight_edges_stay() {
        let pictures: [&dyn Fn(f32, f32) -> f32; 5] = [
            &|_, _| 0.4,
            &|x, y| 0.01 * x + 0.005 * y,
            &|x, _| if x < 12.0 { 0.1 } else { 0.9 },
            &|_, y| if y < 7.0 { 1.0 } else { 0.0 },
            &|_, y| if (7.0..8.0).contains(&y) { 1.0 } else { 0.0 },
        ];
        for (index, f) in pictures.into_iter().enumerate() {
            let picture = sampled([40, 30], 1, f);
            assert_eq!(smooth_edges([40, 30], &picture), picture, "picture {index}");
        }
        for size in [[1, 1], [1, 5], [2, 2]] {
            let picture = sampled(size, 1, |x, y| if x + y > 2.0 { 1.0 } else { 0.0 });
            assert!(smooth_edges(size, &picture).iter().all(|x| (0.0..=1.0).contains(x)));
        }
    }

    #[test]
    fn stairs_come_nearer_to_the_supersampled_edge() {
        for (slope, greatest) in [(0.05, 0.6), (0.13, 0.6), (0.3, 0.6), (0.62, 0.8), (0.9, 0.9)] {
            for (turned, invert) in [(false, false), (true, false), (false, true)] {
                let f = |x: f32, y: f32| {
                    let (x, y) = if turned { (y, x) } else { (x, y) };
                    if (y < 10.3 + slope * x) != invert { 0.8 } else { 0.1 }
                };
                let (aliased, ideal) = (sampled([48, 48], 1, f), sampled([48, 48], 16, f));
                let smoothed = smooth_edges([48, 48], &aliased);
                let (before, after) = (rms(&aliased, &ideal), rms(&smoothed, &ideal));
                println!("slope {slope}: {before:.4} to {after:.4}");
                assert!(after < greatest * before, "slope {slope}: {before} to {after}");
            }
        }
    }

    #[test]
    fn texture_below_the_threshold_stays() {
        let picture = sampled([20, 20], 1, |x, y| 0.5 + 0.01 * ((x as i32 * 7 + y as i32 * 5) % 3) as f32);
        assert_eq!(smooth_edges([20, 20], &picture), picture);
    }
}
