//! The filters of FLIP: what the eye blurs and which features it sees, at a number of pixels per degree.
//!
//! Source: Andersson et al., "FLIP: A Difference Evaluator for Alternating Images" (2020), sections 4.1.1 (contrast
//! sensitivity as sums of Gaussians) and 4.2.1 (edges and points as derivatives of a Gaussian). All are separable.
//! Beyond the border of the picture its outermost pixels go on.

use std::f64::consts::PI;

/// Contrast sensitivity in space: sums of `a sqrt(pi / b) exp(-pi^2 d^2 / b)`, `(a, b)` with d in degrees.
const LUMINANCE: &[(f64, f64)] = &[(1.0, 0.0047)];
const RED_GREEN: &[(f64, f64)] = &[(1.0, 0.0053)];
const BLUE_YELLOW: &[(f64, f64)] = &[(34.1, 0.04), (13.5, 0.025)];

/// The greatest b above: it decides how far all three filters reach.
const WIDEST: f64 = 0.04;

/// Width in degrees of the features that the eye sees best.
const FEATURE_WIDTH: f64 = 0.082;

/// Weights below this part of the greatest are left out at the ends of a filter.
const NEGLIGIBLE: f64 = 1e-9;

/// One number per pixel.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plane {
    /// Width and height.
    pub size: [usize; 2],
    /// Rows from the top.
    pub values: Vec<f32>,
}

impl Plane {
    pub fn new(size: [usize; 2]) -> Self {
        Self { size, values: vec![0.0; size[0] * size[1]] }
    }

    /// Filters along the rows.
    fn rows(&self, weights: &[f32]) -> Self {
        let mut filtered = Self::new(self.size);
        let ([width, _], reach) = (self.size, weights.len() / 2);
        let mut padded = Vec::with_capacity(width + 2 * reach);
        for (row, out) in self.values.chunks_exact(width).zip(filtered.values.chunks_exact_mut(width)) {
            padded.clear();
            padded.extend(std::iter::repeat_n(row[0], reach));
            padded.extend_from_slice(row);
            padded.extend(std::iter::repeat_n(row[width - 1], reach));
            for (tap, weight) in weights.iter().enumerate() {
                add_scaled(out, &padded[tap..tap + width], *weight);
            }
        }
        filtered
    }

    /// Filters along the columns.
    fn columns(&self, weights: &[f32]) -> Self {
        let mut filtered = Self::new(self.size);
        let ([width, height], reach) = (self.size, weights.len() / 2);
        for (y, out) in filtered.values.chunks_exact_mut(width).enumerate() {
            for (tap, weight) in weights.iter().enumerate() {
                let row = (y + tap).saturating_sub(reach).min(height - 1);
                add_scaled(out, &self.values[row * width..][..width], *weight);
            }
        }
        filtered
    }
}

fn add_scaled(sums: &mut [f32], values: &[f32], weight: f32) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
}

/// The filters at one viewing distance.
pub(super) struct Eye {
    luminance: Vec<f32>,
    red_green: Vec<f32>,
    /// Two Gaussians; the share of each is in `blue_yellow_shares`.
    blue_yellow: [Vec<f32>; 2],
    blue_yellow_shares: [f32; 2],
    /// A Gaussian and its first two derivatives; the positive weights of a derivative have the sum 1, the negative -1.
    derivatives: [Vec<f32>; 3],
}

impl Eye {
    pub fn new(pixels_per_degree: f64) -> Self {
        let reach = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
        let gaussian = |b: f64| {
            let weight = |x: i32| (-(PI * f64::from(x) / pixels_per_degree).powi(2) / b).exp();
            (-reach..=reach).map(weight).collect::<Vec<f64>>()
        };
        let shares = [0, 1].map(|i| {
            let (a, b) = BLUE_YELLOW[i];
            a * (PI / b).sqrt() * gaussian(b).iter().sum::<f64>().powi(2)
        });
        Self {
            luminance: normalised(&gaussian(LUMINANCE[0].1)),
            red_green: normalised(&gaussian(RED_GREEN[0].1)),
            blue_yellow: [0, 1].map(|i| normalised(&gaussian(BLUE_YELLOW[i].1))),
            blue_yellow_shares: shares.map(|share| (share / (shares[0] + shares[1])) as f32),
            derivatives: derivatives(0.5 * FEATURE_WIDTH * pixels_per_degree),
        }
    }

    /// Luminance, red-green and blue-yellow as the eye blurs them.
    pub fn blur(&self, opponent: &[Plane; 3]) -> [Plane; 3] {
        let [luminance, red_green, blue_yellow] = opponent;
        let [wide, narrow] = self.blue_yellow.each_ref().map(|weights| blue_yellow.rows(weights).columns(weights));
        let mut sum = Plane::new(wide.size);
        for (plane, share) in [wide, narrow].iter().zip(self.blue_yellow_shares) {
            add_scaled(&mut sum.values, &plane.values, share);
        }
        [
            luminance.rows(&self.luminance).columns(&self.luminance),
            red_green.rows(&self.red_green).columns(&self.red_green),
            sum,
        ]
    }

    /// Strength of edges and of points at each pixel: lengths of the vectors of first and second derivatives.
    pub fn features(&self, luminance: &Plane) -> Vec<[f32; 2]> {
        let [smooth, first, second] = &self.derivatives;
        let upright = luminance.columns(smooth);
        let level = luminance.rows(smooth);
        let strength = |derivative: &[f32]| {
            let (x, y) = (upright.rows(derivative), level.columns(derivative));
            x.values.into_iter().zip(y.values).map(|(x, y)| x.hypot(y)).collect::<Vec<f32>>()
        };
        strength(first).into_iter().zip(strength(second)).map(|(edge, point)| [edge, point]).collect()
    }
}

/// A Gaussian of the given standard deviation in pixels, and its first and second derivative.
fn derivatives(deviation: f64) -> [Vec<f32>; 3] {
    let reach = (3.0 * deviation).ceil() as i32;
    let sampled = |factor: &dyn Fn(f64) -> f64| {
        let weight = |x: i32| {
            let x = f64::from(x) / deviation;
            factor(x) * (-0.5 * x * x).exp()
        };
        (-reach..=reach).map(weight).collect::<Vec<f64>>()
    };
    let balanced = |weights: Vec<f64>| {
        let sum = |sign: f64| weights.iter().map(|weight| (sign * weight).max(0.0)).sum::<f64>();
        let (above, below) = (sum(1.0), sum(-1.0));
        weights.iter().map(|weight| (weight / if *weight > 0.0 { above } else { below }) as f32).collect()
    };
    let smooth = sampled(&|_| 1.0);
    let total: f64 = smooth.iter().sum();
    let smooth = smooth.iter().map(|weight| (weight / total) as f32).collect();
    [smooth, balanced(sampled(&|x| -x)), balanced(sampled(&|x| x * x - 1.0))]
}

/// Symmetric weights with the sum 1, without the negligible ones at both ends.
fn normalised(weights: &[f64]) -> Vec<f32> {
    let (total, middle) = (weights.iter().sum::<f64>(), weights.len() / 2);
    let cut = weights[..middle].iter().take_while(|weight| **weight < NEGLIGIBLE * weights[middle]).count();
    weights[cut..weights.len() - cut].iter().map(|weight| (weight / total) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of distinct numbers.
    fn plane(width: usize, height: usize) -> Plane {
        Plane { size: [width, height], values: (0..width * height).map(|i| (i * 37 % 101) as f32 / 101.0).collect() }
    }

    /// The definition: two-dimensional sums over weights `a[x] * b[y]`.
    fn by_definition(plane: &Plane, along_x: &[f32], along_y: &[f32]) -> Vec<f32> {
        let [width, height] = plane.size;
        let at = |index: usize, tap: usize, taps: usize, end: usize| {
            (index as i64 + tap as i64 - taps as i64 / 2).clamp(0, end as i64 - 1) as usize
        };
        let pixel = |x: usize, y: usize| {
            let mut sum = 0.0_f64;
            for (j, b) in along_y.iter().enumerate() {
                for (i, a) in along_x.iter().enumerate() {
                    let (column, row) = (at(x, i, along_x.len(), width), at(y, j, along_y.len(), height));
                    sum += f64::from(a * b) * f64::from(plane.values[row * width + column]);
                }
            }
            sum as f32
        };
        (0..width * height).map(|i| pixel(i % width, i / width)).collect()
    }

    #[test]
    fn separable_filters_equal_the_double_sum() {
        let eye = Eye::new(30.0);
        // Narrower and lower than the filters reach, too.
        for plane in [plane(23, 17), plane(2, 40), plane(5, 1)] {
            let [smooth, first, _] = &eye.derivatives;
            let got = plane.rows(first).columns(smooth);
            for (got, want) in got.values.iter().zip(by_definition(&plane, first, smooth)) {
                assert!((got - want).abs() < 2e-6, "{got} {want}");
            }
        }
    }

    #[test]
    fn filters_reach_as_far_as_the_paper_says_and_keep_a_constant() {
        // 67 pixels per degree: 10 pixels for colour, 9 for features.
        let eye = Eye::new(67.0206);
        assert_eq!(eye.blue_yellow[0].len(), 21);
        assert!(eye.derivatives.iter().all(|weights| weights.len() == 19));
        assert!((7..=21).contains(&eye.luminance.len()));
        let constant = [0.3, -0.2, 0.1].map(|value| Plane { size: [4, 3], values: vec![value; 12] });
        for (blurred, constant) in eye.blur(&constant).iter().zip(&constant) {
            assert!(blurred.values.iter().all(|value| (value - constant.values[0]).abs() < 1e-6));
        }
        for feature in eye.features(&constant[0]) {
            assert!(feature[0] < 1e-6 && feature[1] < 1e-6);
        }
    }

    #[test]
    fn a_step_is_an_edge_and_a_dot_is_a_point() {
        let eye = Eye::new(67.0206);
        let mut step = Plane::new([41, 41]);
        (0..41 * 41).filter(|i| i % 41 >= 20).for_each(|i| step.values[i] = 1.0);
        let edge = eye.features(&step)[20 * 41 + 20];
        // All weights of one sign see the bright side.
        assert!((edge[0] - 1.0).abs() < 1e-5 && edge[1] < 0.3, "{edge:?}");
        let mut dot = Plane::new([41, 41]);
        dot.values[20 * 41 + 20] = 1.0;
        let point = eye.features(&dot)[20 * 41 + 20];
        assert!(point[1] > 0.01 && point[0] < 1e-6, "{point:?}");
    }
}
