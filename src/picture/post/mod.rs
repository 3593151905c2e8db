//! Optional passes over a finished film, each left out unless it is asked for.
//!
//! They work on the mean of all passes and so cost once for every picture that is written, not once for every pass.
//! Two kinds: *linear* ones change the beauty layer, in this order: ambient occlusion ([`ssao`]), depth of field
//! ([`defocus`]), bloom ([`bloom`]); and *display-referred* ones change only what a PNG shows, after tone curve and
//! sRGB encoding ([`display`]): grading ([`grade`]), then antialiasing ([`antialias`]). All other layers stay as
//! rendered.

pub mod antialias;
pub mod bloom;
pub mod defocus;
pub mod display;
pub mod grade;
mod rows;
pub mod ssao;

use crate::error::{Error, Result};
use crate::picture::image::{Channels, Picture};

use bloom::Bloom;
use defocus::Defocus;
use ssao::Ssao;

/// What the passes must know of the camera that made the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Unit vectors to the right, to the top and along the view, in world space.
    pub axes: [[f32; 3]; 3],
    /// Half width and half height of the picture: tangents of the half angles for a perspective camera, scene units
    /// for an orthographic one.
    pub half: [f32; 2],
    /// Parallel projection.
    pub orthographic: bool,
}

impl View {
    /// Position in view space (right, top, forward) of the middle of pixel `(x, y)` of `width` x `height` at a depth.
    fn position(&self, [x, y]: [usize; 2], [width, height]: [usize; 2], depth: f32) -> [f32; 3] {
        let right = ((x as f32 + 0.5) / width as f32 * 2.0 - 1.0) * self.half[0];
        let top = (1.0 - (y as f32 + 0.5) / height as f32 * 2.0) * self.half[1];
        let spread = if self.orthographic { 1.0 } else { depth };
        [right * spread, top * spread, depth]
    }

    /// A world-space vector in view space.
    fn direction(&self, world: [f32; 3]) -> [f32; 3] {
        self.axes.map(|axis| dot(axis, world))
    }

    /// Side of a pixel in scene units at a depth.
    fn pixel_side(&self, height: usize, depth: f32) -> f32 {
        2.0 * self.half[1] / height as f32 * if self.orthographic { 1.0 } else { depth }
    }
}

/// The linear passes of a render.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Post {
    /// Screen-space ambient occlusion of the indirect light.
    pub ssao: Option<Ssao>,
    /// Screen-space depth of field.
    pub defocus: Option<Defocus>,
    /// Light that a lens scatters around what is bright.
    pub bloom: Option<Bloom>,
}

impl Post {
    /// Layers that must be in the picture beside the beauty layer.
    pub fn layers(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        if self.ssao.is_some() {
            names.extend(["depth", "normal", "indirect"]);
        } else if self.defocus.is_some() {
            names.push("depth");
        }
        names
    }

    /// What is done, in order: one short text for each pass, with its numbers. Empty without passes.
    pub fn describe(&self) -> Vec<String> {
        let texts =
            [self.ssao.map(|s| s.describe()), self.defocus.map(|d| d.describe()), self.bloom.map(|b| b.describe())];
        texts.into_iter().flatten().collect()
    }

    /// Changes the beauty layer. Without passes nothing is touched.
    ///
    /// # Errors
    /// [`Error::Usage`] if a layer is missing or does not hold what its name says, or if a perspective camera is
    /// needed.
    pub fn apply(&self, picture: &mut Picture, view: &View) -> Result<()> {
        if *self == Self::default() {
            return Ok(());
        }
        let mut beauty = layer(picture, "", Channels::Rgb)?.to_vec();
        let size = [picture.width as usize, picture.height as usize];
        if let Some(ssao) = self.ssao {
            let (depth, normal) =
                (layer(picture, "depth", Channels::Scalar)?, layer(picture, "normal", Channels::Vector)?);
            let indirect = layer(picture, "indirect", Channels::Rgb)?;
            let visibility = ssao.visibility(size, depth, normal, view);
            ssao::darken(&mut beauty, indirect, &visibility);
        }
        if let Some(defocus) = self.defocus {
            if view.orthographic {
                return Err(Error::Usage("depth of field needs a perspective camera; this one is orthographic".into()));
            }
            beauty = defocus.blur(size, &beauty, layer(picture, "depth", Channels::Scalar)?, view);
        }
        if let Some(bloom) = self.bloom {
            beauty = bloom.apply(size, &beauty);
        }
        if let Some(found) = picture.layers.iter_mut().find(|found| found.name.is_empty()) {
            found.data = beauty;
        }
        Ok(())
    }
}

fn layer<'a>(picture: &'a Picture, name: &str, channels: Channels) -> Result<&'a [f32]> {
    let found = picture.layer(name).filter(|layer| layer.channels == channels);
    let shown = if name.is_empty() { "colour" } else { name };
    found.map(|layer| layer.data.as_slice()).ok_or_else(|| Error::Usage(format!("the picture lacks layer '{shown}'")))
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEW: View =
        View { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]], half: [0.8, 0.6], orthographic: false };

    fn all() -> Post {
        Post {
            ssao: Some(Ssao { radius: 0.5, strength: 1.0 }),
            defocus: Some(Defocus { radius: 0.05, focus: 1.0 }),
            bloom: Some(Bloom { amount: 0.2, size: 0.08 }),
        }
    }

    fn picture(width: u32, height: u32, depth: f32) -> Picture {
        let pixels = (width * height) as usize;
        let mut picture = Picture::new(width, height);
        picture.push("", Channels::Rgb, (0..3 * pixels).map(|i| (i % 7) as f32 + 1.0).collect());
        picture.push("depth", Channels::Scalar, vec![depth; pixels]);
        picture.push("normal", Channels::Vector, [0.0, 0.0, 1.0].repeat(pixels));
        picture.push("indirect", Channels::Rgb, vec![0.5; 3 * pixels]);
        picture
    }

    #[test]
    fn nothing_asked_nothing_touched() {
        let mut bare = Picture::new(2, 1); // not even a beauty layer
        Post::default().apply(&mut bare, &VIEW).expect("nothing to do");
        assert_eq!((Post::default().layers().len(), Post::default().describe().len()), (0, 0));
        let mut touched = picture(9, 7, 2.0);
        all().apply(&mut touched, &VIEW).expect("all layers are there");
        let original = picture(9, 7, 2.0);
        assert_ne!(touched.layers[0], original.layers[0], "the comparison can fail");
        assert_eq!(touched.layers[1..], original.layers[1..], "only the beauty layer changes");
    }

    #[test]
    fn the_smallest_picture_and_broken_numbers_are_safe() {
        for depth in [0.0, 1.0, f32::INFINITY, f32::NAN, -1.0, f32::MAX, f32::MIN_POSITIVE] {
            for (width, height) in [(1, 1), (1, 5), (5, 1), (3, 3)] {
                let mut small = picture(width, height, depth);
                let pixels = small.pixel_count();
                all().apply(&mut small, &VIEW).expect("all layers are there");
                assert!(small.layers[0].data.iter().all(|x| x.is_finite() && *x >= 0.0), "{width} x {height}, {depth}");
                assert_eq!(small.layers[0].data.len(), 3 * pixels);
            }
        }
        // A broken pixel stays where it is.
        for broken in [f32::NAN, f32::INFINITY] {
            let mut one = picture(9, 9, 2.0);
            one.layers[0].data[3 * 40] = broken;
            one.layers[2].data[3 * 13] = broken;
            one.layers[3].data[3 * 22] = broken;
            one.layers[1].data[60] = broken;
            all().apply(&mut one, &VIEW).expect("all layers are there");
            let bad: Vec<usize> = (0..3 * 81).filter(|&i| !one.layers[0].data[i].is_finite()).collect();
            assert_eq!(bad, [3 * 40]);
        }
    }

    #[test]
    fn missing_layers_and_parallel_cameras_are_named() {
        for name in ["depth", "normal", "indirect", ""] {
            let mut poor = picture(2, 2, 1.0);
            poor.layers.retain(|layer| layer.name != name);
            let message = all().apply(&mut poor, &VIEW).expect_err("a layer is missing").to_string();
            assert!(message.contains(if name.is_empty() { "colour" } else { name }), "{message}");
        }
        let parallel = View { orthographic: true, ..VIEW };
        let message = all().apply(&mut picture(2, 2, 1.0), &parallel).expect_err("parallel").to_string();
        assert!(message.contains("orthographic"), "{message}");
        let without = Post { defocus: None, ..all() };
        without.apply(&mut picture(2, 2, 1.0), &parallel).expect("the other passes need no perspective");
    }

    #[test]
    fn passes_say_what_they_are_and_need() {
        assert_eq!(all().layers(), ["depth", "normal", "indirect"]);
        assert_eq!(Post { defocus: all().defocus, ..Post::default() }.layers(), ["depth"]);
        let texts = all().describe();
        assert_eq!(texts[0], "ssao radius 0.5 strength 1");
        assert_eq!(texts[1], "screen-space depth of field, aperture radius 0.05 focus 1");
        assert_eq!(texts[2], "bloom 0.2 size 0.08");
    }

    #[test]
    fn positions_are_those_of_the_camera() {
        // The corner of a 2 x 2 picture: pixel middles lie at half of the half angles.
        assert_eq!(VIEW.position([1, 0], [2, 2], 4.0), [1.6, 1.2, 4.0]);
        let parallel = View { orthographic: true, ..VIEW };
        assert_eq!(parallel.position([0, 1], [2, 2], 4.0), [-0.4, -0.3, 4.0]);
        assert_eq!(VIEW.direction([1.0, 2.0, 3.0]), [1.0, 2.0, -3.0]);
        assert_eq!((VIEW.pixel_side(2, 4.0), parallel.pixel_side(2, 4.0)), (2.4, 0.6));
    }
}
