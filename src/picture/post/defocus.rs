//! Depth of field after the fact, from the depth layer, as the composite of Mara, Luebke and McGuire 2013 has it (the
//! filter is our own): cheaper and less right than a lens in the eye paths, which sees what lies behind an edge.
//!
//! A pixel at depth z is spread over a disc, its circle of confusion, of radius `R |1 / focus - 1 / z|` as a tangent of
//! the angle of view (Potmesil and Chakravarty 1981). Here each pixel gathers the neighbours whose discs reach it,
//! every one weighted by one over the area of its disc. A neighbour that lies behind the pixel is only taken as far as
//! the pixel's own disc reaches: what is sharp has no background bleed over it. The weights are divided by their sum,
//! so a constant stays constant, but unlike with a lens the sum over the picture is only nearly kept. Mirrors and glass
//! have the depth of what is seen through them, or none, so their blur is a guess. The time grows with the square of
//! the blur.

use super::View;
use super::rows::for_each_row;

/// Screen-space depth of field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defocus {
    /// Radius of the aperture in scene units.
    pub radius: f32,
    /// Distance of the sharp plane along the view axis in scene units.
    pub focus: f32,
}

/// Greatest radius of a circle of confusion as a fraction of the picture's height: it bounds the time.
const MOST_BLUR: f32 = 0.05;

impl Defocus {
    /// What is done, with its numbers.
    pub fn describe(&self) -> String {
        format!("screen-space depth of field, aperture radius {} focus {}", self.radius, self.focus)
    }

    /// Radius of the circle of confusion in pixels at a depth; at most a twentieth of the picture's height.
    fn circle(&self, depth: f32, height: usize, view: &View) -> f32 {
        // Nothing seen is infinitely far; a depth that is no depth is left sharp.
        let nearness = if depth == f32::INFINITY { 0.0 } else { depth.recip() };
        let tangent = self.radius * (self.focus.recip() - nearness).abs();
        let pixels = tangent * height as f32 / (2.0 * view.half[1]);
        let usable = depth > 0.0 && pixels.is_finite();
        if usable { pixels.min(MOST_BLUR * height as f32) } else { 0.0 }
    }

    /// The blurred picture: interleaved linear RGB of `[width, height]` pixels. What is not finite is not spread.
    pub fn blur(&self, size: [usize; 2], beauty: &[f32], depth: &[f32], view: &View) -> Vec<f32> {
        let circles: Vec<f32> = depth.iter().map(|z| self.circle(*z, size[1], view)).collect();
        let most = circles.iter().copied().fold(0.0, f32::max).ceil() as usize;
        let reach = greatest_near(&circles, size, most);
        let texel = |((color, depth), circle): ((&[f32], &f32), &f32)| Texel {
            color: [color[0], color[1], color[2]],
            depth: *depth,
            circle: *circle,
            finite: color.iter().all(|c| c.is_finite()),
        };
        let texels = beauty.chunks_exact(3).zip(depth).zip(&circles).map(texel).collect();
        let source = Source { size, texels };
        let mut result = beauty.to_vec();
        for_each_row(&mut result, 3 * size[0], |y, row| {
            for (x, color) in row.chunks_exact_mut(3).enumerate() {
                let radius = reach[y * size[0] + x];
                if radius >= 0.5 && source.texels[y * size[0] + x].finite {
                    color.copy_from_slice(&source.gather([x, y], radius.ceil() as usize));
                }
            }
        });
        result
    }
}

/// What the inner loop needs of a pixel, side by side.
struct Texel {
    color: [f32; 3],
    depth: f32,
    /// Radius of its circle of confusion in pixels.
    circle: f32,
    finite: bool,
}

struct Source {
    size: [usize; 2],
    texels: Vec<Texel>,
}

impl Source {
    /// Weighted mean over the square of `reach` pixels around a pixel.
    fn gather(&self, [x, y]: [usize; 2], reach: usize) -> [f32; 3] {
        let [width, height] = self.size;
        let own = &self.texels[y * width + x];
        // A pixel always reaches itself.
        let mut weights = weight(own.circle);
        let mut sum = own.color.map(|c| weights * c);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
        for j in y.saturating_sub(reach)..(y + reach + 1).min(height) {
            let dy = j as f32 - y as f32;
            for (i, other) in columns.clone().zip(&self.texels[j * width..][columns.clone()]) {
                let dx = i as f32 - x as f32;
                let square = dx * dx + dy * dy;
                let circle = if other.depth > own.depth { other.circle.min(own.circle) } else { other.circle };
                let rim = circle + 0.5;
                if square < rim * rim && square > 0.0 && other.finite {
                    // A rim of one pixel, so that discs grow smoothly.
                    let weight = (rim - square.sqrt()).min(1.0) * weight(circle);
                    sum.iter_mut().zip(other.color).for_each(|(sum, c)| *sum += weight * c);
                    weights += weight;
                }
            }
        }
        sum.map(|sum| sum / weights)
    }
}

/// One over the area of a circle of confusion in pixels, of at least one.
fn weight(circle: f32) -> f32 {
    (std::f32::consts::PI * circle * circle).max(1.0).recip()
}

/// The greatest value within `reach` pixels along both axes.
fn greatest_near(values: &[f32], [width, height]: [usize; 2], reach: usize) -> Vec<f32> {
    let mut across = values.to_vec();
    for_each_row(&mut across, width, |y, row| {
        let line = &values[y * width..][..width];
        for (x, value) in row.iter_mut().enumerate() {
            *value = line[x.saturating_sub(reach)..=(x + reach).min(width - 1)].iter().copied().fold(0.0, f32::max);
        }
    });
    let mut result = across.clone();
    for_each_row(&mut result, width, |y, row| {
        for (x, value) in row.iter_mut().enumerate() {
            let rows = y.saturating_sub(reach)..=(y + reach).min(height - 1);
            *value = rows.map(|j| across[j * width + x]).fold(0.0, f32::max);
        }
    });
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: View =
        View { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]], half: [0.5, 0.5], orthographic: false };
    const SIZE: [usize; 2] = [81, 81];
    const LENS: Defocus = Defocus { radius: 0.1, focus: 2.0 };

    fn noise(pixels: usize) -> Vec<f32> {
        (0..3 * pixels as u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32).collect()
    }

    #[test]
    fn the_sharp_plane_is_untouched() {
        let picture = noise(81 * 81);
        assert_eq!(LENS.blur(SIZE, &picture, &[2.0; 81 * 81], &VIEW), picture);
        assert_ne!(LENS.blur(SIZE, &picture, &[8.0; 81 * 81], &VIEW), picture, "the comparison can fail");
    }

    #[test]
    fn a_point_becomes_a_disc_of_the_right_size_and_keeps_its_light() {
        // At depth 8: 0.1 (1/2 - 1/8) = 0.0375; 81 pixels span 1: 3.04 pixels, below the limit of 4.05.
        let mut picture = vec![0.0; 3 * 81 * 81];
        picture[3 * (40 * 81 + 40)] = 100.0;
        let blurred = LENS.blur(SIZE, &picture, &[8.0; 81 * 81], &VIEW);
        let (mut sum, mut second) = (0.0, 0.0);
        for (index, color) in blurred.chunks(3).enumerate() {
            let d = (index as f32 % 81.0 - 40.0).powi(2) + ((index / 81) as f32 - 40.0).powi(2);
            sum += color[0];
            second += color[0] * d;
            assert!(color[0] == 0.0 || d.sqrt() < 3.0375 + 0.5);
        }
        assert!((sum - 100.0).abs() < 1e-3, "{sum}");
        // Mean square of a disc is r^2 / 2.
        let radius = (2.0 * second / sum).sqrt();
        assert!((radius / 3.0375 - 1.0).abs() < 0.06, "{radius}");
    }

    #[test]
    fn the_circle_is_that_of_the_lens() {
        let pixels = |z: f32| LENS.circle(z, 1000, &VIEW);
        assert_eq!(pixels(2.0), 0.0);
        assert!((pixels(f32::INFINITY) - 50.0).abs() < 1e-3 && (pixels(4.0) - 25.0).abs() < 1e-3);
        assert!((pixels(1.5) - 16.667).abs() < 1e-2);
        assert_eq!([pixels(f32::NAN), pixels(-1.0), pixels(0.0)], [0.0; 3]);
        assert_eq!(pixels(1e-3), 50.0, "the limit");
    }

    #[test]
    fn a_constant_stays_and_a_sharp_front_gets_no_background() {
        let depth: Vec<f32> = (0..81 * 81).map(|i| if i % 81 < 40 { 2.0 } else { f32::INFINITY }).collect();
        let flat = LENS.blur(SIZE, &vec![0.3; 3 * 81 * 81], &depth, &VIEW);
        assert!(flat.iter().all(|x| (x - 0.3).abs() < 1e-6));
        // A sharp black front before a bright far background: its last column stays black.
        let picture: Vec<f32> = depth.iter().flat_map(|z| [if *z == 2.0 { 0.0 } else { 1.0 }; 3]).collect();
        let blurred = LENS.blur(SIZE, &picture, &depth, &VIEW);
        assert_eq!(blurred[3 * (40 * 81 + 39)], 0.0);
        // The other way round a blurred front spreads over the sharp background.
        let depth: Vec<f32> = (0..81 * 81).map(|i| if i % 81 < 40 { 1.2 } else { 2.0 }).collect();
        let picture: Vec<f32> = depth.iter().flat_map(|z| [if *z == 2.0 { 0.0 } else { 1.0 }; 3]).collect();
        assert!(LENS.blur(SIZE, &picture, &depth, &VIEW)[3 * (40 * 81 + 41)] > 0.0);
    }
}
