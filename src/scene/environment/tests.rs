//! Maps as programs write them, and as nobody should.

use super::canvas::BRIGHTEST_HALF;
use super::*;
use ::exr::math::Vec2;
use ::exr::meta::attribute::{Chromaticities, IntegerBounds};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, Layer, LayerAttributes, WritableImage,
};
use std::io::Cursor;

/// A flat (not run-length coded) 2 x 1 map: mantissas over 256 times 2^(exponent - 128).
const HDR: &[u8] = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x40\x20\x81\x00\x00\x00\x00";

/// 1, 0.5, 0.25 and black.
const TEXELS: &[u8] = b"\x80\x40\x20\x81\x00\x00\x00\x00";

fn decoded(bytes: &[u8]) -> (Environment, Vec<String>) {
    Environment::decode(bytes, &Limits::default()).expect("a map")
}

fn refused(bytes: &[u8]) -> String {
    Environment::decode(bytes, &Limits::default()).expect_err("refused")
}

/// A Radiance file with these lines in its header.
fn hdr(lines: &str, size: &str, pixels: &[u8]) -> Vec<u8> {
    [format!("#?RADIANCE\n{lines}\n{size}\n").as_bytes(), pixels].concat()
}

fn first(bytes: &[u8]) -> [f32; 3] {
    decoded(bytes).0.radiance[0]
}

mod radiance {
    use super::*;

    #[test]
    fn values() {
        let (map, warnings) = decoded(HDR);
        assert_eq!((map.width, map.height, warnings.len()), (2, 1, 0));
        assert_eq!(map.radiance, [[1.0, 0.5, 0.25], [0.0; 3]]);
    }

    #[test]
    fn the_brightest_and_the_darkest() {
        let pixels = b"\xff\x00\x00\xff\x80\x00\x00\x01";
        let map = decoded(&hdr("", "-Y 1 +X 2", pixels)).0;
        assert_eq!(map.radiance[0][0], 255.0 * 2f32.powi(119));
        assert_eq!(map.radiance[1][0], 2f32.powi(-128));
    }

    #[test]
    fn exposure_and_colour_correction_are_taken_back() {
        let of = |lines: &str| first(&hdr(lines, "-Y 1 +X 2", TEXELS));
        assert_eq!(of("EXPOSURE=0.25\n"), [4.0, 2.0, 1.0]);
        assert_eq!(of("EXPOSURE= 2\nEXPOSURE=\t2.0\n"), [0.25, 0.125, 0.0625], "they multiply");
        assert_eq!(of("COLORCORR= 2 1 0.5\n"), [0.5, 0.5, 0.5]);
        assert_eq!(of("COLORCORR=2 1 0.5\nEXPOSURE=0.5\n"), [1.0; 3]);
        assert_eq!(of("\tEXPOSURE=4\n# EXPOSURE=4\n"), [1.0, 0.5, 0.25], "of a picture that this one was made of");
    }

    #[test]
    fn nonsense_in_the_header_is_told_and_ignored() {
        for line in ["EXPOSURE=0", "EXPOSURE=-1", "EXPOSURE=nan", "COLORCORR=1 2", "PRIMARIES=1 2", "EXPOSURE=x\x1b[2J"]
        {
            let bytes = hdr(&format!("{line}\n"), "-Y 1 +X 2", TEXELS);
            let (map, warnings) = decoded(&bytes);
            assert_eq!(map.radiance[0], [1.0, 0.5, 0.25], "{line}");
            assert!(warnings.len() == 1 && !warnings[0].contains('\x1b'), "{warnings:?}");
            let strict = Limits { strict: true, ..Limits::default() };
            assert!(Environment::decode(&bytes, &strict).is_err(), "{line}");
        }
        assert!(refused(&hdr("FORMAT=8-bit\n", "-Y 1 +X 2", TEXELS)).contains("'8-bit'"));
    }

    #[test]
    fn other_beginnings_and_ends_of_lines() {
        let usual = decoded(HDR).0;
        for bytes in [
            [b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n", TEXELS].concat(),
            [b"#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 2\r\n", TEXELS].concat(),
            [b"#?AUTOPANO11\nEXPOSURE=1\n\n-Y  1   +X 2\n", TEXELS].concat(),
            hdr("VIEW= -vta\nGAMMA=1\n", "-Y 1 +X 2", TEXELS),
        ] {
            assert_eq!(decoded(&bytes).0, usual);
        }
        // A first pixel that looks like the end of a line.
        assert_eq!(decoded(&hdr("", "-Y 1 +X 2", b"\r\x80\x00\x88\0\0\0\0")).0.radiance[0], [13.0, 128.0, 0.0]);
    }

    /// Rows of three and columns of two, in every order: the same picture.
    #[test]
    fn all_eight_orientations() {
        let texel = |x: i32, y: i32| [(1 + x) as u8, (1 + y) as u8, 0, 136];
        for (major, minor) in [("Y", "X"), ("X", "Y")] {
            for signs in ["--", "-+", "+-", "++"] {
                let (a, b) = signs.split_at(1);
                let length = |axis: &str| if axis == "X" { 3 } else { 2 };
                let order = |axis: &str, sign: &str| -> Vec<i32> {
                    let forward = (axis == "X") == (sign == "+");
                    let all = 0..length(axis);
                    if forward { all.collect() } else { all.rev().collect() }
                };
                let mut pixels = Vec::new();
                for i in order(major, a) {
                    for j in order(minor, b) {
                        pixels.extend(if major == "Y" { texel(j, i) } else { texel(i, j) });
                    }
                }
                let size = format!("{a}{major} {} {b}{minor} {}", length(major), length(minor));
                let map = decoded(&hdr("", &size, &pixels)).0;
                assert_eq!((map.width, map.height), (3, 2), "{size}");
                for (at, texel) in map.radiance.iter().enumerate() {
                    assert_eq!(*texel, [(1 + at % 3) as f32, (1 + at / 3) as f32, 0.0], "{size}");
                }
            }
        }
        for size in ["", "-Y 1", "-Y 1 +Y 2", "Y 1 X 2", "-Y 0 +X 2", "-Y 1 +X -2", "-Y 1 +X 2 0"] {
            assert!(refused(&hdr("", size, TEXELS)).contains("orientation"), "{size}");
        }
        assert!(refused(&hdr("", "-Y 99999 +X 99999", TEXELS)).contains("99999 x 99999 texels are out of bounds"));
    }

    #[test]
    fn xyz_and_primaries_become_rec_709() {
        // X, Y, Z of the white D65 give grey.
        let bytes = hdr("FORMAT=32-bit_rle_xyze\n", "-Y 1 +X 2", b"\x7a\x80\x8b\x81\0\0\0\0");
        let [r, g, b] = first(&bytes);
        assert!([r, g, b].iter().all(|x| (x - 1.0).abs() < 0.02), "{r} {g} {b}");
        let rec_2020 = "PRIMARIES= .708 .292 .170 .797 .131 .046 .3127 .329\n";
        let [r, g, b] = first(&hdr(rec_2020, "-Y 1 +X 2", b"\x80\x00\x00\x81\0\0\0\0"));
        assert!((r - 1.6605).abs() < 1e-3 && g == 0.0 && b == 0.0, "{r} {g} {b}");
        let usual = "PRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n";
        assert_eq!(first(&hdr(usual, "-Y 1 +X 2", TEXELS)), [1.0, 0.5, 0.25]);
    }

    #[test]
    fn runs_of_pixels_and_of_planes() {
        // 300 equal pixels as one pixel, a run of 43 and a run of 1 x 256.
        let pixels = b"\x80\x40\x20\x81\x01\x01\x01\x2b\x01\x01\x01\x01";
        let map = decoded(&hdr("", "-Y 1 +X 300", pixels)).0;
        assert!(map.radiance.iter().all(|texel| *texel == [1.0, 0.5, 0.25]));
        let planes = b"\x02\x02\x00\x08\x88\x80\x88\x40\x08\x20\x20\x20\x20\x20\x20\x20\x20\x88\x81";
        let map = decoded(&hdr("", "-Y 1 +X 8", planes)).0;
        assert!(map.radiance.iter().all(|texel| *texel == [1.0, 0.5, 0.25]));
        assert!(refused(&hdr("", "-Y 1 +X 9", planes)).contains("a row of 8 pixels, not 9"));
        let endless = b"\x02\x02\x00\x08\x00\x00\x00\x00";
        assert!(refused(&hdr("", "-Y 1 +X 8", endless)).contains("do not fill a row"));
        assert!(refused(&hdr("", "-Y 1 +X 8", b"\x02\x02\x00\x08\xff\x80")).contains("do not fill a row"));
        assert!(refused(&hdr("", "-Y 1 +X 2", b"\x01\x01\x01\x02\0\0\0\0")).contains("a run without a pixel"));
    }
}

mod openexr {
    use super::*;

    /// Channel names with a value for all pixels.
    type Planes<'a> = &'a [(&'a str, f32)];

    fn layer(size: [usize; 2], at: [i32; 2], name: &str, planes: Planes<'_>) -> Layer<AnyChannels<FlatSamples>> {
        let count = size[0] * size[1];
        let channel = |&(name, value): &(&str, f32)| AnyChannel::new(name, FlatSamples::F32(vec![value; count]));
        let channels = AnyChannels::sort(planes.iter().map(channel).collect());
        let mut attributes = if name.is_empty() { LayerAttributes::default() } else { LayerAttributes::named(name) };
        attributes.layer_position = Vec2(at[0], at[1]);
        Layer::new((size[0], size[1]), attributes, Encoding::SMALL_LOSSLESS, channels)
    }

    fn written(layers: Vec<Layer<AnyChannels<FlatSamples>>>, display: IntegerBounds) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let image = Image::from_layers(ImageAttributes::new(display), layers);
        image.write().to_buffered(&mut bytes).expect("in memory");
        bytes.into_inner()
    }

    fn small(planes: Planes<'_>) -> Vec<u8> {
        written(vec![layer([4, 2], [0, 0], "", planes)], IntegerBounds::from_dimensions((4, 2)))
    }

    fn texels(texels: [[f32; 3]; 2]) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let channels = ::exr::prelude::SpecificChannels::rgb(|at: Vec2<usize>| {
            let [r, g, b] = texels[at.x()];
            (r, g, b)
        });
        Image::from_channels((2, 1), channels).write().to_buffered(&mut bytes).expect("in memory");
        bytes.into_inner()
    }

    #[test]
    fn values_are_clamped_and_counted() {
        let bytes = texels([[1.5, 2.0, 0.25], [f32::NAN, -1.0, f32::INFINITY]]);
        let (map, warnings) = decoded(&bytes);
        assert_eq!(map.radiance, [[1.5, 2.0, 0.25], [0.0, 0.0, BRIGHTEST_HALF]]);
        assert!(warnings.len() == 1 && warnings[0].contains(" 1 negative"), "{warnings:?}");
        let strict = Limits { strict: true, ..Limits::default() };
        assert!(Environment::decode(&bytes, &strict).is_err());
    }

    #[test]
    fn the_display_window_is_the_sphere() {
        let window = |data: [i32; 2], size: [usize; 2], display: [i32; 2], display_size: (usize, usize)| {
            let planes: Planes<'_> = &[("R", 1.0), ("G", 2.0), ("B", 3.0)];
            let display = IntegerBounds::new((display[0], display[1]), display_size);
            decoded(&written(vec![layer(size, data, "", planes)], display))
        };
        let lit = |map: &Environment| -> Vec<usize> {
            (0..map.radiance.len()).filter(|&at| map.radiance[at] == [1.0, 2.0, 3.0]).collect()
        };
        let (map, _) = window([1, 1], [2, 1], [0, 0], (4, 2));
        assert_eq!((map.width, map.height, lit(&map)), (4, 2, vec![5, 6]), "a part");
        assert!(map.radiance[0] == [0.0; 3]);
        let (map, _) = window([-3, -2], [9, 9], [0, 0], (4, 2));
        assert_eq!((map.width, map.height, lit(&map).len()), (4, 2, 8), "more than is to be seen");
        let (map, _) = window([-10, 7], [4, 2], [-10, 7], (4, 2));
        assert_eq!((map.width, map.height, lit(&map).len()), (4, 2, 8), "both are moved");
        let (map, _) = window([-1, 0], [3, 2], [-2, -1], (4, 2));
        assert_eq!(lit(&map), [5, 6, 7]);
        let (map, warnings) = window([100, 100], [4, 2], [0, 0], (4, 2));
        assert_eq!((lit(&map).len(), warnings.len()), (8, 1), "apart: {warnings:?}");
    }

    #[test]
    fn luminance_is_grey_and_names_have_no_case() {
        assert_eq!(decoded(&small(&[("Y", 0.5)])).0.radiance, [[0.5; 3]; 8]);
        assert_eq!(first(&small(&[("Y", 0.5), ("A", 0.25)])), [0.5; 3]);
        assert_eq!(first(&small(&[("r", 1.0), ("g", 2.0), ("b", 3.0)])), [1.0, 2.0, 3.0]);
        assert_eq!(first(&small(&[("Red", 1.0), ("Green", 2.0), ("Blue", 3.0), ("Y", 9.0)])), [1.0, 2.0, 3.0]);
        let message = refused(&small(&[("X", 1.0), ("Y", 2.0), ("Z", 3.0)]));
        assert!(message.contains("it has X, Y, Z"), "a direction is no colour: {message}");
    }

    #[test]
    fn layers_are_found_by_what_they_are_called() {
        let named = |layers: &[(&'static str, f32)]| {
            let names: Vec<(String, f32)> = layers
                .iter()
                .flat_map(|(layer, value)| ["R", "G", "B"].map(|c| (format!("{layer}{c}"), *value)))
                .collect();
            let planes: Vec<(&str, f32)> = names.iter().map(|(name, value)| (name.as_str(), *value)).collect();
            let (map, warnings) = decoded(&small(&planes));
            (map.radiance[0][0], warnings.len())
        };
        assert_eq!(named(&[("ViewLayer.Combined.", 1.0)]), (1.0, 0));
        assert_eq!(named(&[("albedo.", 1.0), ("", 2.0)]), (2.0, 0));
        assert_eq!(named(&[("Layer.Albedo.", 1.0), ("Layer.Combined.", 2.0), ("Layer.Depth.", 3.0)]), (2.0, 1));
        assert_eq!(named(&[("zenith.", 2.0), ("albedo.", 1.0)]), (1.0, 1), "the first in the file");
    }

    #[test]
    fn parts_are_found_too() {
        let planes = |value: f32| [("R", value), ("G", value), ("B", value)];
        let of = |parts: &[(&str, f32)]| {
            let mut layers = vec![layer([4, 2], [0, 0], "depth", &[("Z", 9.0)])];
            layers.extend(parts.iter().map(|(name, value)| layer([4, 2], [0, 0], name, &planes(*value))));
            first(&written(layers, IntegerBounds::from_dimensions((4, 2))))[0]
        };
        assert_eq!(of(&[("beauty", 1.0)]), 1.0);
        assert_eq!(of(&[("albedo", 1.0), ("rgba", 2.0)]), 2.0);
        assert_eq!(of(&[("left", 1.0), ("right", 2.0)]), 1.0);
    }

    #[test]
    fn chromaticities_become_rec_709() {
        let with = |chromaticities: Option<Chromaticities>| {
            let planes: Planes<'_> = &[("R", 1.0), ("G", 0.0), ("B", 0.0)];
            let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions((4, 2)));
            attributes.chromaticities = chromaticities;
            let mut bytes = Cursor::new(Vec::new());
            let image = Image::from_layers(attributes, vec![layer([4, 2], [0, 0], "", planes)]);
            image.write().to_buffered(&mut bytes).expect("in memory");
            decoded(&bytes.into_inner())
        };
        let of = |red, green, blue| Chromaticities { red, green, blue, white: Vec2(0.3127, 0.329) };
        let (map, warnings) = with(Some(of(Vec2(0.708, 0.292), Vec2(0.17, 0.797), Vec2(0.131, 0.046))));
        assert!((map.radiance[0][0] - 1.6605).abs() < 1e-3 && map.radiance[0][1] == 0.0);
        assert!(warnings.len() == 1 && warnings[0].contains("chromaticities"), "{warnings:?}");
        let (map, warnings) = with(Some(of(Vec2(0.64, 0.33), Vec2(0.3, 0.6), Vec2(0.15, 0.06))));
        assert_eq!((map.radiance[0], warnings.len()), ([1.0, 0.0, 0.0], 0));
        let (map, warnings) = with(Some(of(Vec2(0.0, 0.0), Vec2(0.0, 0.0), Vec2(0.0, 0.0))));
        assert_eq!((map.radiance[0], warnings.len()), ([1.0, 0.0, 0.0], 1), "nonsense is ignored: {warnings:?}");
    }

    #[test]
    fn a_window_that_takes_more_than_its_file_can_account_for_is_reduced() {
        let planes: Planes<'_> = &[("R", 1.0), ("G", 1.0), ("B", 1.0)];
        let (map, warnings) =
            decoded(&written(vec![layer([4, 2], [0, 0], "", planes)], IntegerBounds::from_dimensions((16384, 8192))));
        assert!(map.width <= 4096 && warnings[0].contains("reduced from 16384 x 8192"), "{warnings:?}");
        let (large, beyond) = (vec![layer([4, 2], [0, 0], "", planes)], IntegerBounds::from_dimensions((1 << 28, 2)));
        assert!(refused(&written(large, beyond)).contains("out of bounds"));
    }

    #[test]
    fn cut_and_foreign_files_are_errors() {
        let whole = texels([[1.0; 3]; 2]);
        let limits = Limits::default();
        assert!((0..whole.len()).all(|n| Environment::decode(&whole[..n], &limits).is_err()));
        assert!((0..HDR.len()).all(|n| Environment::decode(&HDR[..n], &limits).is_err()));
        assert!(Environment::decode(b"P6 1 1 255 abc", &limits).is_err());
        let small = Limits { image_side: 1, ..limits };
        assert!(Environment::decode(&whole, &small).is_err() && Environment::decode(HDR, &small).is_err());
    }
}

#[test]
fn a_map_from_a_file_is_turned_and_scaled() {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    std::fs::write(file.path(), HDR).expect("written");
    let wanted = EnvironmentFile { rotation: 180.0, scale: 2.0, ..EnvironmentFile::new(file.path()) };
    let (map, _) = wanted.load(&Limits::default()).expect("a map");
    assert_eq!(map.radiance, [[0.0; 3], [2.0, 1.0, 0.5]]);
}

#[test]
fn directions_follow_the_convention() {
    let close = |a: [f32; 3], b: [f32; 3]| assert!(Vec3::from(a).distance(b.into()) < 1e-6, "{a:?} {b:?}");
    close(Environment::direction(0.3, 0.0), [0.0, 1.0, 0.0]);
    close(Environment::direction(0.5, 0.5), [0.0, 0.0, -1.0]);
    close(Environment::direction(0.75, 0.5), [1.0, 0.0, 0.0]);
    close(Environment::direction(0.0, 0.5), [0.0, 0.0, 1.0]);
}

#[test]
fn the_sky_is_finite_positive_and_brightest_at_the_sun() {
    let sky = Environment::default_sky();
    assert_eq!(sky.radiance.len(), 128 * 64);
    assert!(sky.radiance.iter().flatten().all(|x| x.is_finite() && *x > 0.0));
    let brightest = (0..sky.radiance.len()).max_by(|&a, &b| sky.radiance[a][0].total_cmp(&sky.radiance[b][0]));
    let (x, y) = (brightest.unwrap() % 128, brightest.unwrap() / 128);
    let direction = Environment::direction((x as f32 + 0.5) / 128.0, (y as f32 + 0.5) / 64.0);
    assert!(Vec3::from(direction).dot(Vec3::new(0.55, 0.6, 0.58).normalize()) > 0.998);
}
