//! What a display shows of a picture: tone curve and sRGB encoding, then what works on display values.

use super::antialias::smooth_edges;
use super::grade::Cdl;
use crate::picture::image::Layer;
use crate::picture::tonemap::ToneMap;

/// From linear radiance to the numbers of a PNG. A [`ToneMap`] alone is one without the optional passes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Display {
    /// Exposure and tone curve.
    pub map: ToneMap,
    /// Colour grading.
    pub grade: Option<Cdl>,
    /// Whether the stairs of edges are smoothed.
    pub antialias: bool,
}

impl From<ToneMap> for Display {
    fn from(map: ToneMap) -> Self {
        Self { map, grade: None, antialias: false }
    }
}

impl Display {
    /// What is done beside the tone curve, in order. Empty without passes.
    pub fn describe(&self) -> Vec<String> {
        let antialias = self.antialias.then(|| "antialias".to_owned());
        self.grade.iter().map(Cdl::describe).chain(antialias).collect()
    }

    /// 8-bit sRGB of the colours of a layer, interleaved.
    pub fn encode(&self, layer: &Layer, width: u32) -> Vec<u8> {
        let byte = |x: f32| (x * 255.0).round() as u8;
        let colors = layer.data.chunks_exact(3).map(|c| self.map.display([c[0], c[1], c[2]]));
        if self.grade.is_none() && !self.antialias {
            return colors.flat_map(|color| color.map(byte)).collect();
        }
        let grade = self.grade.unwrap_or_default();
        let mut values: Vec<f32> = colors.flat_map(|color| grade.apply(color)).collect();
        if self.antialias {
            let width = width.max(1) as usize;
            values = smooth_edges([width, values.len() / 3 / width], &values);
        }
        values.into_iter().map(byte).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::image::Channels;
    use crate::picture::tonemap::Curve;

    fn layer(data: Vec<f32>) -> Layer {
        Layer { name: String::new(), channels: Channels::Rgb, data }
    }

    #[test]
    fn without_passes_it_is_the_tone_map() {
        for curve in [Curve::Neutral, Curve::Linear, Curve::Reinhard] {
            let map = ToneMap { curve, exposure: 0.7 };
            let data: Vec<f32> =
                (0..3000).map(|i| i as f32 * 0.001 - 0.1).chain([f32::NAN, f32::INFINITY, -1.0]).collect();
            let expected: Vec<u8> = data.chunks(3).flat_map(|c| map.encode([c[0], c[1], c[2]])).collect();
            assert_eq!(Display::from(map).encode(&layer(data.clone()), 1001), expected);
            // The long way round gives the same as long as the passes do nothing.
            let idle = Display { grade: Some(Cdl::default()), ..map.into() };
            assert_eq!(idle.encode(&layer(data), 1001), expected);
            assert_eq!(Display::from(map).describe(), [""; 0]);
        }
    }

    #[test]
    fn grading_works_on_encoded_values_and_comes_before_antialiasing() {
        let map = ToneMap { curve: Curve::Linear, exposure: 0.0 };
        let cdl = Cdl { slope: [0.5; 3], ..Cdl::default() };
        let graded = Display { grade: Some(cdl), ..map.into() };
        // Linear 0.214041 is 128 of 255: half of that.
        assert_eq!(graded.encode(&layer(vec![0.214_041_14; 3]), 1), [64; 3]);
        // A stair that grading makes flat has no edge left.
        let stair: Vec<f32> =
            (0..16 * 4).flat_map(|i| [if i / 16 < 1 + (i % 16) / 8 { 1.0 } else { 0.0 }; 3]).collect();
        let smooth = Display { antialias: true, ..map.into() };
        assert_ne!(smooth.encode(&layer(stair.clone()), 16), Display::from(map).encode(&layer(stair.clone()), 16));
        let flat = Cdl { slope: [0.0; 3], offset: [0.2; 3], ..Cdl::default() };
        assert_eq!(Display { grade: Some(flat), ..smooth }.encode(&layer(stair), 16), [51; 192]);
        assert_eq!(Display { grade: Some(flat), ..smooth }.describe().len(), 2);
    }

    #[test]
    fn one_pixel_and_broken_numbers_are_safe() {
        let all =
            Display { grade: Some(Cdl { saturation: 2.0, ..Cdl::default() }), antialias: true, ..Display::default() };
        assert_eq!(all.encode(&layer(vec![f32::NAN; 3]), 1), [0; 3]);
        assert_eq!(all.encode(&layer(vec![f32::INFINITY; 3]), 1), [255; 3]);
        assert_eq!(all.encode(&layer(vec![]), 1), [0; 0]);
    }
}
