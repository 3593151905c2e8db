//! Sampling tables of the light from infinity.

use std::f64::consts::PI;

use super::lights::luminance;
use crate::scene::Environment;

/// An environment map that gives light, and how it is sampled.
#[derive(Clone)]
pub struct Sky {
    /// Radiance per texel, and its density: of samples per unit of the image's area.
    pub texels: Vec<[f32; 4]>,
    /// One cumulative row per image row, then the cumulative column.
    pub cdf: Vec<f32>,
    /// Sum of luminance times the sine of the polar angle over all texels.
    total: f64,
    /// Solid angle of a texel at the equator.
    solid: f64,
    /// Sum of all texels.
    pub sum: [f32; 3],
    /// Width and height.
    pub size: [u32; 2],
}

impl Sky {
    /// The tables of a map; `None` if it gives no light.
    pub fn of(e: &Environment) -> Option<Self> {
        let (width, height) = (e.width as usize, e.height as usize);
        let weights = texel_weights(e);
        let total: f64 = weights.iter().sum();
        if total <= 0.0 {
            return None;
        }
        let texels: Vec<_> = e.radiance.iter().map(|t| [t[0], t[1], t[2], 0.0]).collect();
        let mut cdf = Vec::with_capacity((width + 1) * height);
        let mut column = Vec::with_capacity(height);
        let mut so_far = 0.0;
        for row in weights.chunks(width) {
            let sum: f64 = row.iter().sum();
            let mut inside = 0.0;
            cdf.extend(row.iter().map(|w| {
                inside += w;
                if sum > 0.0 { (inside / sum) as f32 } else { 0.0 }
            }));
            so_far += sum;
            column.push((so_far / total) as f32);
        }
        cdf.extend(column);
        // Texel weights are radiance times solid angle.
        let solid = 2.0 * PI * PI / (width as f64 * height as f64);
        let sum = texels.iter().fold([0.0; 3], |sum: [f32; 3], texel| std::array::from_fn(|k| sum[k] + texel[k]));
        let mut sky = Self { texels, cdf, total, solid, sum, size: [e.width, e.height] };
        sky.add_texel_densities(width, height);
        Some(sky)
    }

    /// The direction towards the environment of two uniform numbers: as `sample_environment` of
    /// glsl/lib/environment.glsl finds it, up to rounding.
    pub fn direction(&self, [u, v]: [f32; 2]) -> [f32; 3] {
        let [width, height] = self.size.map(|length| length as usize);
        let search = |first: usize, count: usize, u: f32| {
            let steps = &self.cdf[first..first + count];
            let at = steps.partition_point(|step| *step <= u).min(count - 1);
            let before = if at == 0 { 0.0 } else { steps[at - 1] };
            let inside = ((u - before) / (steps[at] - before).max(1e-12)).clamp(0.0, 1.0);
            (at as f64 + f64::from(inside), at)
        };
        let (down, y) = search(width * height, height, v);
        let (along, _) = search(y * width, width, u);
        let (sin_phi, cos_phi) = (2.0 * PI * (along / width as f64 - 0.5)).sin_cos();
        let (sin_theta, cos_theta) = (PI * down / height as f64).sin_cos();
        [sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi].map(|x| x as f32)
    }

    /// Luminance of the power that enters a sphere of this radius [W].
    pub fn power(&self, radius: f64) -> f64 {
        PI * radius * radius * self.total * self.solid
    }

    /// Probability of each texel per unit of the image's area, by the rounded numbers that are searched for samples.
    fn add_texel_densities(&mut self, width: usize, height: usize) {
        let cdf = &self.cdf;
        let step = |first: usize, k: usize| cdf[first + k] - if k > 0 { cdf[first + k - 1] } else { 0.0 };
        for y in 0..height {
            for x in 0..width {
                let texels = (width * height) as f32;
                self.texels[y * width + x][3] = step(y * width, x) * step(width * height, y) * texels;
            }
        }
    }
}

/// Luminance times the sine of the polar angle, smoothed over the neighbours that bilinear lookup reaches, so that no
/// direction with light has density zero.
fn texel_weights(e: &Environment) -> Vec<f64> {
    let (width, height) = (e.width as usize, e.height as usize);
    let at = |x: usize, y: usize| luminance(e.radiance[y * width + x]);
    let mut weights = Vec::with_capacity(width * height);
    for y in 0..height {
        let sine = (PI * (y as f64 + 0.5) / height as f64).sin();
        for x in 0..width {
            let (left, right) = ((x + width - 1) % width, (x + 1) % width);
            let row = |y: usize| 0.125 * (at(left, y) + at(right, y)) + 0.75 * at(x, y);
            let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
            weights.push(sine * (0.125 * (row(above) + row(below)) + 0.75 * row(y)));
        }
    }
    weights
}
