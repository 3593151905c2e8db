//! Screen-space ambient occlusion: how much of the indirect light near surfaces keep from a point, guessed from the
//! depths of its neighbours in the picture.
//!
//! It stands in for indirect light that is too coarse to show corners and creases, as where photons are subsampled; a
//! photon map with all its photons holds that darkening already, and this adds it a second time.
//!
//! The estimator is that of Scalable Ambient Obscurance (McGuire, Mara and Luebke 2012, section 2.3), which descends
//! from Alchemy AO (McGuire et al. 2011): a neighbour at `v` from the point counts by how far it rises above the
//! tangent plane, `v . n`, over `v . v`, with a weight `(1 - v . v / r^2)^3` that ends smoothly at the radius `r`:
//!
//! `A = max(0, 1 - 5 strength / samples * r * sum of (1 - v.v / r^2)^3 max(0, v.n - bias) / (v.v + eps))`
//!
//! in our notation; the factor `r` makes it free of units, as `(v.n) / (v.v)` is one over a length. Neighbours lie on a
//! spiral within the projected disc, turned by pixel; a blur that respects depth and normal removes the noise
//! of the turns. The bias is a fraction of the radius or half a pixel, whichever is greater: a depth is a mean over its
//! pixel and known no better.

use super::rows::for_each_row;
use super::{View, dot};

/// Ambient occlusion of the indirect light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ssao {
    /// Radius in scene units within which surfaces occlude each other.
    pub radius: f32,
    /// Factor on the occlusion; 1 is that of the paper.
    pub strength: f32,
}

/// Neighbours that are looked at.
const SAMPLES: usize = 48;

/// Turns of the spiral: coprime to the number of samples, so that they spread over all directions.
const TURNS: f32 = 11.0;

/// Least bias as a fraction of the radius.
const BIAS: f32 = 0.01;

/// Least radius of the projected disc in pixels; below it no neighbour is another surface.
const LEAST_PIXELS: f32 = 1.0;

/// Half width of the blur in pixels.
const BLUR: isize = 3;

/// What is seen in one pixel, in view space.
#[derive(Debug, Clone, Copy)]
struct Point {
    position: [f32; 3],
    normal: [f32; 3],
}

impl Ssao {
    /// What is done, with its numbers.
    pub fn describe(&self) -> String {
        format!("ssao radius {} strength {}", self.radius, self.strength)
    }

    /// Visibility per pixel, 0 ... 1: 1 where nothing was seen or nothing is near. `depth` has one number for each of
    /// `[width, height]` pixels, `normal` three.
    pub fn visibility(&self, size: [usize; 2], depth: &[f32], normal: &[f32], view: &View) -> Vec<f32> {
        let points = points(size, depth, normal, view);
        let raw = self.unfiltered(size, &points, view);
        let across = self.blurred(&raw, size, &points, [1, 0]);
        self.blurred(&across, size, &points, [0, 1])
    }

    /// The estimate, with the noise of its turned spirals.
    fn unfiltered(&self, size: [usize; 2], points: &[Option<Point>], view: &View) -> Vec<f32> {
        let mut raw = vec![1.0; points.len()];
        for_each_row(&mut raw, size[0], |y, row| {
            for (x, visible) in row.iter_mut().enumerate() {
                if let Some(point) = points[y * size[0] + x] {
                    *visible = self.visible([x, y], size, point, points, view);
                }
            }
        });
        raw
    }

    fn visible(&self, at: [usize; 2], size: [usize; 2], point: Point, points: &[Option<Point>], view: &View) -> f32 {
        let pixel = view.pixel_side(size[1], point.position[2]);
        let reach = (self.radius / pixel).min(size[0].max(size[1]) as f32);
        if reach < LEAST_PIXELS {
            return 1.0;
        }
        let bias = (BIAS * self.radius).max(0.5 * pixel);
        let phase = turn(at);
        let mut sum = 0.0;
        for i in 0..SAMPLES {
            let along = (i as f32 + 0.5) / SAMPLES as f32;
            let (sine, cosine) = (std::f32::consts::TAU * (along * TURNS + phase)).sin_cos();
            let distance = (along * reach).max(1.0);
            let x = (at[0] as f32 + 0.5 + distance * cosine).floor();
            let y = (at[1] as f32 + 0.5 + distance * sine).floor();
            if x < 0.0 || y < 0.0 || x >= size[0] as f32 || y >= size[1] as f32 {
                continue;
            }
            let Some(other) = points[y as usize * size[0] + x as usize] else { continue };
            let v: [f32; 3] = std::array::from_fn(|k| other.position[k] - point.position[k]);
            sum += self.occlusion(dot(v, v), dot(v, point.normal) - bias);
        }
        (1.0 - 5.0 * self.strength * self.radius * sum / SAMPLES as f32).max(0.0)
    }

    /// One neighbour's part, per scene unit: `square` is its squared distance, `rise` its height above the tangent
    /// plane.
    fn occlusion(&self, square: f32, rise: f32) -> f32 {
        let r2 = self.radius * self.radius;
        let falloff = 1.0 - square / r2;
        // The comparison is false for NaN, too.
        if falloff > 0.0 && rise > 0.0 { falloff.powi(3) * rise / (square + 1e-4 * r2) } else { 0.0 }
    }

    /// Averages along one axis over pixels of the same surface: those near the point and its tangent plane, with a
    /// similar normal.
    fn blurred(&self, values: &[f32], size: [usize; 2], points: &[Option<Point>], step: [isize; 2]) -> Vec<f32> {
        let mut result = values.to_vec();
        for_each_row(&mut result, size[0], |y, row| {
            for (x, value) in row.iter_mut().enumerate() {
                let Some(point) = points[y * size[0] + x] else { continue };
                let (mut sum, mut weights) = (0.0, 0.0);
                for offset in -BLUR..=BLUR {
                    let (x, y) = (x as isize + offset * step[0], y as isize + offset * step[1]);
                    if x < 0 || y < 0 || x >= size[0] as isize || y >= size[1] as isize {
                        continue;
                    }
                    let index = y as usize * size[0] + x as usize;
                    let Some(other) = points[index] else { continue };
                    let v: [f32; 3] = std::array::from_fn(|k| other.position[k] - point.position[k]);
                    let off_plane = dot(v, point.normal).abs() / (0.1 * self.radius);
                    let alike = dot(point.normal, other.normal).clamp(0.0, 1.0).powi(8);
                    let far = dot(v, v) / (0.25 * self.radius * self.radius);
                    let tent = 1.0 - offset.abs() as f32 / (BLUR + 1) as f32;
                    let weight = (1.0 - off_plane).max(0.0) * (1.0 - far).max(0.0) * alike * tent;
                    sum += weight * values[index];
                    weights += weight;
                }
                if weights > 0.0 {
                    *value = sum / weights;
                }
            }
        });
        result
    }
}

/// What the layers show, pixel by pixel; nothing where they hold no surface.
fn points(size: [usize; 2], depth: &[f32], normal: &[f32], view: &View) -> Vec<Option<Point>> {
    let point = |index: usize| {
        let usable = depth[index].is_finite() && (depth[index] > 0.0 || view.orthographic);
        let position = view.position([index % size[0], index / size[0]], size, depth[index]);
        let normal = view.direction([normal[3 * index], normal[3 * index + 1], normal[3 * index + 2]]);
        let square = dot(normal, normal);
        let whole = square.is_finite() && square > 0.25 && dot(position, position).is_finite();
        (usable && whole).then_some(Point { position, normal })
    };
    (0..depth.len()).map(point).collect()
}

/// Rotation of the spiral in turns, 0 ... 1: neighbours differ widely (interleaved gradient noise, Jimenez 2014).
fn turn([x, y]: [usize; 2]) -> f32 {
    (52.982_918 * (0.067_110_56 * x as f32 + 0.005_837_15 * y as f32).fract()).fract()
}

/// Takes the occluded part of the indirect light out of the beauty layer; both are interleaved RGB. Broken numbers of
/// the indirect light count as 0.
pub fn darken(beauty: &mut [f32], indirect: &[f32], visibility: &[f32]) {
    for (index, (x, light)) in beauty.iter_mut().zip(indirect).enumerate() {
        let lost = (1.0 - visibility[index / 3]) * light;
        if lost.is_finite() && lost > 0.0 {
            // What is left of rounding may be below 0 where nearly all light is indirect.
            *x = if x.is_finite() { (*x - lost).max(0.0) } else { *x };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [96, 72];
    const SSAO: Ssao = Ssao { radius: 0.5, strength: 1.0 };

    /// From the origin down to the horizon and right by a half: oblique to everything below.
    fn view(orthographic: bool) -> View {
        View { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]], half: [0.8, 0.6], orthographic }
    }

    /// Depth and normal layers of planes `normal . p = distance` in world space, the nearest in each pixel.
    fn render(view: &View, planes: &[([f32; 3], f32)]) -> (Vec<f32>, Vec<f32>) {
        let (mut depth, mut normals) = (Vec::new(), Vec::new());
        for index in 0..SIZE[0] * SIZE[1] {
            // The ray in view space and world space; world z is against the view.
            let at = [index % SIZE[0], index / SIZE[0]];
            let (origin, direction) = if view.orthographic {
                (view.position(at, SIZE, 0.0), [0.0, 0.0, 1.0])
            } else {
                ([0.0; 3], view.position(at, SIZE, 1.0))
            };
            let mut nearest = (f32::INFINITY, [0.0; 3]);
            for (normal, distance) in planes {
                let local = view.direction(*normal);
                let t = (distance - dot(local, origin)) / dot(local, direction);
                if t > 0.0 && t < nearest.0 {
                    nearest = (t, *normal);
                }
            }
            depth.push(nearest.0);
            normals.extend(nearest.1);
        }
        (depth, normals)
    }

    fn unit(v: [f32; 3]) -> [f32; 3] {
        let length = dot(v, v).sqrt();
        v.map(|x| x / length)
    }

    #[test]
    fn a_plane_occludes_nothing() {
        for orthographic in [false, true] {
            for normal in [[0.0, 0.0, 1.0], unit([0.3, 1.0, 0.8]), unit([-0.5, 0.2, 0.6])] {
                let (depth, normals) = render(&view(orthographic), &[(normal, -2.0)]);
                assert!(depth.iter().filter(|z| z.is_finite()).count() > 2000);
                let visible = SSAO.visibility(SIZE, &depth, &normals, &view(orthographic));
                assert!(visible.iter().all(|v| *v == 1.0), "{normal:?}, orthographic {orthographic}");
            }
        }
    }

    /// A back wall at z = -3 meets a floor at y = -0.8.
    const CORNER: [([f32; 3], f32); 2] = [([0.0, 0.0, 1.0], -3.0), ([0.0, 1.0, 0.0], -0.8)];

    #[test]
    fn a_corner_is_dark_and_only_within_the_radius() {
        let (depth, normals) = render(&view(false), &CORNER);
        let visible = SSAO.visibility(SIZE, &depth, &normals, &view(false));
        // Along the middle column the corner lies between two rows.
        let column: Vec<(f32, f32)> = (0..SIZE[1])
            .map(|y| {
                let index = y * SIZE[0] + SIZE[0] / 2;
                let p = view(false).position([SIZE[0] / 2, y], SIZE, depth[index]);
                // Distance from the edge of the two planes.
                ((p[1] + 0.8).hypot(3.0 - p[2]), visible[index])
            })
            .collect();
        let darkest = column.iter().map(|(_, v)| *v).fold(1.0, f32::min);
        assert!((0.1..0.7).contains(&darkest), "{darkest}");
        for (distance, v) in &column {
            // The blur may carry it on by half of the radius.
            assert!(*v == 1.0 || *distance < 0.75, "{distance}: {v}");
            assert!(*v < 0.85 || *distance > 0.1, "{distance}: {v}");
        }
        // Twice the strength, twice the darkness, as long as it does not end at black.
        let double = Ssao { strength: 2.0, ..SSAO }.visibility(SIZE, &depth, &normals, &view(false));
        let (a, b) = (1.0 - visible[10 * 96 + 40], 1.0 - double[10 * 96 + 40]);
        assert!((b - 2.0 * a).abs() < 1e-5);
        let total = |v: &[f32]| v.iter().map(|v| 1.0 - v).sum::<f32>();
        assert!(total(&double) > 1.5 * total(&visible));
    }

    #[test]
    fn few_samples_agree_with_all_neighbours() {
        // The same estimator over all pixels of the disc by numbers, with the spiral's density 1 / (2 pi h reach). The
        // spiral is noisy: the mean over a row, in which nothing changes but its turn.
        let (depth, normals) = render(&view(false), &CORNER);
        let points = points(SIZE, &depth, &normals, &view(false));
        let at = |x: usize, y: usize| points[y * SIZE[0] + x].expect("a surface");
        let raw = SSAO.unfiltered(SIZE, &points, &view(false));
        let (mut worst, mut darkest) = (0.0f32, 1.0f32);
        for y in 15..60 {
            let p = at(48, y);
            let pixel = view(false).pixel_side(SIZE[1], p.position[2]);
            let (reach, bias) = (SSAO.radius / pixel, (0.5 * pixel).max(0.005));
            let (mut sum, mut weights) = (0.0, 0.0);
            for index in 0..SIZE[0] * SIZE[1] {
                let (x2, y2) = (index % SIZE[0], index / SIZE[0]);
                let h = (x2 as f32 - 48.0).hypot(y2 as f32 - y as f32);
                if h < 0.5 || h > reach {
                    continue;
                }
                let v: [f32; 3] = std::array::from_fn(|k| at(x2, y2).position[k] - p.position[k]);
                sum += SSAO.occlusion(dot(v, v), dot(v, p.normal) - bias) / h;
                weights += 1.0 / h;
            }
            let all = (1.0 - 5.0 * SSAO.radius * sum / weights).max(0.0);
            let mean = raw[y * SIZE[0] + 24..][..48].iter().sum::<f32>() / 48.0;
            worst = worst.max((all - mean).abs());
            darkest = darkest.min(all);
        }
        assert!(darkest < 0.5 && worst < 0.08, "off by {worst}, darkest {darkest}");
    }

    #[test]
    fn only_the_indirect_part_gets_darker() {
        let mut beauty = vec![1.0, 2.0, 3.0, 1.0, 1.0, 1.0, 0.5, f32::NAN, 0.5];
        darken(&mut beauty, &[0.5, 1.0, 3.0, 0.5, 0.5, 0.5, f32::INFINITY, 1.0, 0.6], &[0.5, 1.0, 0.0]);
        assert_eq!(beauty[..7], [0.75, 1.5, 1.5, 1.0, 1.0, 1.0, 0.5]);
        assert!(beauty[7].is_nan() && beauty[8] == 0.0);
    }
}
