//! A camera for hits made up by tests, so that estimators that work in the image have one.

use nephroid::low_level::kernels::generated::{Camera, EyeHit};

/// A camera and the number of bands that its image is cut into.
#[derive(Clone, Copy)]
pub struct View {
    /// The camera, without a band.
    pub camera: Camera,
    /// Bands of about equal size.
    pub bands: u32,
}

/// Hits of distinct pixels of one band.
pub struct Frame {
    /// First pixel of the band and number of pixels.
    pub band: [u32; 2],
    /// (pixel in the band, index of the hit), ascending.
    pub places: Vec<(u32, usize)>,
}

impl View {
    /// A camera at `position` that looks at `target`; the image is `half` high (half of it, at distance 1 or,
    /// orthographic, anywhere).
    pub fn new(position: [f32; 3], target: [f32; 3], half: f32, size: [u32; 2]) -> Self {
        let unit = |v: [f32; 3]| v.map(|x| x / dot(v, v).sqrt());
        let forward = unit(std::array::from_fn(|k| target[k] - position[k]));
        let right = unit(cross(forward, if forward[1].abs() > 0.9 { [0.0, 0.0, 1.0] } else { [0.0, 1.0, 0.0] }));
        let up = cross(right, forward);
        Self { camera: camera(position, [right, up, forward], half, size), bands: 1 }
    }

    /// The same with parallel rays.
    pub fn orthographic(mut self) -> Self {
        self.camera.orthographic = 1;
        self
    }

    /// The same with the image cut into bands.
    pub fn cut(self, bands: u32) -> Self {
        Self { bands, ..self }
    }

    /// Index of the pixel at which a point is seen (strips of four rows, column by column).
    pub fn pixel(&self, position: [f32; 3]) -> Option<u32> {
        let c = &self.camera;
        let offset: [f32; 3] = std::array::from_fn(|k| position[k] - c.position[k]);
        let depth = dot(offset, c.forward);
        let scale = if c.orthographic == 0 { depth } else { 1.0 };
        let place = |axis: [f32; 3], size: u32| (dot(offset, axis) / dot(axis, axis) / scale + 1.0) * 0.5 * size as f32;
        let (x, y) = (place(c.right, c.width), place(c.up.map(|x| -x), c.height));
        let inside = depth > 0.0 && x >= 0.0 && y >= 0.0 && x < c.width as f32 && y < c.height as f32;
        inside.then(|| {
            let (x, y) = (x as u32, y as u32);
            let rows = (c.height - y / 4 * 4).min(4);
            y / 4 * 4 * c.width + x * rows + y % 4
        })
    }

    /// Hits at the pixels where they are seen. Each frame has one at most in each pixel.
    ///
    /// # Panics
    /// If one is not seen.
    pub fn frames(&self, hits: &[EyeHit]) -> Vec<Frame> {
        let pixels = self.camera.width * self.camera.height;
        let each = pixels.div_ceil(self.bands);
        let mut frames: Vec<Frame> = vec![];
        for (index, hit) in hits.iter().enumerate() {
            let position = [hit.a[0], hit.a[1], hit.a[2]].map(f32::from_bits);
            let pixel = self.pixel(position).unwrap_or_else(|| panic!("{position:?} is not seen"));
            let first = pixel / each * each;
            let free = |f: &&mut Frame| f.band[0] == first && f.places.iter().all(|place| place.0 != pixel - first);
            match frames.iter_mut().find(free) {
                Some(frame) => frame.places.push((pixel - first, index)),
                None => {
                    frames.push(Frame { band: [first, each.min(pixels - first)], places: vec![(pixel - first, index)] })
                }
            }
        }
        frames.iter_mut().for_each(|frame| frame.places.sort_unstable());
        frames
    }
}

/// A camera with unit axes `right`, `up`, `forward`, whose image is `half` high (half of it, at distance 1).
pub fn camera(position: [f32; 3], [right, up, forward]: [[f32; 3]; 3], half: f32, size: [u32; 2]) -> Camera {
    Camera {
        position,
        width: size[0],
        right: right.map(|x| x * half * size[0] as f32 / size[1] as f32),
        height: size[1],
        up: up.map(|x| x * half),
        orthographic: 0,
        forward,
        slots: 1,
        first_pixel: 0,
        pixels: size[0] * size[1],
        lens_radius: 0.0,
        inverse_focus: 0.0,
    }
}

/// Vector product.
pub fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Scalar product.
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
