//! FLIP beside the authors' program: `flip-evaluator` 1.7 from PyPI (its module for Python, numbers of 32 bits) gave
//! the numbers below for the same pictures; `tools/verify-flip --rust` makes them anew.

use super::*;

/// A linear congruence modulo 2^32; tools/verify-flip has the same.
struct Congruence(u32);

impl Congruence {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0 >> 8) / f64::from(1 << 24)
    }
}

/// Interleaved numbers of a reference and of a picture.
type Pair = [Vec<f64>; 2];

fn pixels(width: u32, height: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..height).flat_map(move |y| (0..width).map(move |x| (x.into(), y.into())))
}

/// A smooth gradient, and the same with noise; all within 0 ... 1.
fn noise(random: &mut Congruence, width: u32, height: u32) -> Pair {
    let (w, h) = (f64::from(width), f64::from(height));
    let [mut reference, mut picture] = Pair::default();
    for (x, y) in pixels(width, height) {
        for base in [x / w, y / h, (x + y) / (w + h)] {
            reference.push(0.1 + 0.8 * base);
            picture.push(0.05 + 0.8 * base + 0.1 * random.next());
        }
    }
    [reference, picture]
}

/// Light that falls off from two lamps over four decades; the picture is 5 % brighter and has fireflies.
fn fireflies(random: &mut Congruence, width: u32, height: u32) -> Pair {
    let [mut reference, mut picture] = Pair::default();
    for (x, y) in pixels(width, height) {
        let near = 30.0 / (0.05 + (x - 20.0) * (x - 20.0) + (y - 15.0) * (y - 15.0));
        let far = 4.0 / (1.0 + (x - 50.0) * (x - 50.0) + (y - 30.0) * (y - 30.0));
        let firefly = if random.next() < 0.01 { 20.0 } else { 0.0 };
        for tint in [1.0, 0.75, 0.5] {
            let value = 0.01 + tint * near + (1.5 - tint) * far;
            reference.push(value);
            picture.push(1.05 * value + tint * firefly);
        }
    }
    [reference, picture]
}

/// Coloured stripes, some thin, and the same one pixel to the right.
fn stripes(_: &mut Congruence, width: u32, height: u32) -> Pair {
    let color = |x: u32, y: u32| {
        if (x * x / 40 + y / 8).is_multiple_of(2) { [1.5, 0.25, 0.125] } else { [0.0625, 0.5, 0.75] }
    };
    [1, 0].map(|shift| (0..width * height).flat_map(|i| color(i % width + shift, i / width)).collect())
}

/// Black but for a bright window: the median luminance is 0. The picture has light around it.
fn window(random: &mut Congruence, width: u32, height: u32) -> Pair {
    let [mut reference, mut picture] = Pair::default();
    for (x, y) in pixels(width, height) {
        let inside = (10.0..25.0).contains(&x) && (8.0..20.0).contains(&y);
        let leak = 0.004 * random.next();
        for tint in [0.9, 1.0, 1.3] {
            let value = tint * (1.0 + x / 4.0);
            reference.push(if inside { value } else { 0.0 });
            picture.push(if inside { value } else { tint * leak });
        }
    }
    [reference, picture]
}

type Maker = fn(&mut Congruence, u32, u32) -> Pair;

/// Pictures, their size, and the evaluator's LDR-FLIP, HDR-FLIP, first and last exposure and their number.
const EVALUATED: [(Maker, u32, u32, [f64; 5]); 4] = [
    (noise, 96, 64, [0.064531, 0.055192, 1.253746, 2.099627, 2.0]),
    (fireflies, 80, 60, [0.137510, 0.205752, -7.796508, 5.685167, 14.0]),
    (stripes, 63, 41, [0.125835, 0.096732, 2.064022, 2.064022, 2.0]),
    (window, 45, 33, [0.076730, 0.913992, -1.724635, 24.083298, 26.0]),
];

fn picture(width: u32, height: u32, data: Vec<f32>) -> Picture {
    let mut picture = Picture::new(width, height);
    picture.push("", Channels::Rgb, data);
    picture
}

/// Reference and picture of entry `index` of [`EVALUATED`].
fn pair_of(index: usize) -> [Picture; 2] {
    let (make, width, height, _) = EVALUATED[index];
    make(&mut Congruence(index as u32 + 1), width, height)
        .map(|data| picture(width, height, data.into_iter().map(|number| number as f32).collect()))
}

fn ldr_of(x: &Picture, r: &Picture) -> Flip {
    ldr(x, r, "", PIXELS_PER_DEGREE).expect("a pair").expect("colour")
}

fn hdr_of(x: &Picture, r: &Picture) -> (Flip, Exposures) {
    hdr(x, r, "", PIXELS_PER_DEGREE).expect("a pair").expect("colour")
}

#[test]
fn the_numbers_are_those_of_the_authors_program() {
    for (index, (.., width, _, want)) in EVALUATED.into_iter().enumerate() {
        let [reference, picture] = pair_of(index);
        let (hdr, exposures) = hdr_of(&picture, &reference);
        let got = [ldr_of(&picture, &reference).mean, hdr.mean, exposures.start, exposures.stop];
        for (got, want) in got.iter().zip(want) {
            assert!((got - want).abs() < 5e-6, "pair {index}, {width} pixels wide: {got} is not {want}");
        }
        assert_eq!(f64::from(exposures.count), want[4]);
    }
}

#[test]
fn equal_pictures_do_not_differ_and_opposite_ones_differ_wholly() {
    for index in 0..EVALUATED.len() {
        let [reference, _] = pair_of(index);
        assert_eq!(ldr_of(&reference, &reference).mean, 0.0);
        assert_eq!(hdr_of(&reference, &reference).0.mean, 0.0);
    }
    let [black, white, green, blue] =
        [[0.0; 3], [1.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|color| picture(30, 30, color.repeat(900)));
    assert!(ldr_of(&white, &black).mean > 0.95);
    assert!((ldr_of(&green, &blue).mean - 1.0).abs() < 1e-4);
}

#[test]
fn more_noise_and_more_shift_are_more_difference() {
    let [reference, _] = pair_of(0);
    let mut last = 0.0;
    for amplitude in [0.01_f32, 0.03, 0.1, 0.3] {
        let (mut random, mut noisy) = (Congruence(9), reference.clone());
        noisy.layers[0].data.iter_mut().for_each(|c| *c += amplitude * (random.next() as f32 - 0.5));
        let mean = ldr_of(&noisy, &reference).mean;
        assert!(mean > 1.3 * last, "{amplitude}: {mean} after {last}");
        last = mean;
    }
    // Blurred or shifted edges are seen although the mean stays.
    let [reference, mut shifted] = pair_of(2);
    let one = ldr_of(&shifted, &reference).mean;
    shifted.layers[0].data.rotate_right(6);
    assert!(ldr_of(&shifted, &reference).mean > 1.3 * one);
}

#[test]
fn the_map_is_where_the_difference_is() {
    let reference = picture(60, 40, vec![0.4; 7200]);
    let mut spoiled = reference.clone();
    spoiled.layers[0].data[(20 * 60 + 45) * 3] = 0.9;
    let map = ldr_of(&spoiled, &reference).map;
    let worst = (0..map.len()).max_by(|a, b| map[*a].total_cmp(&map[*b])).expect("pixels");
    assert!((worst % 60).abs_diff(45) <= 1 && (worst / 60).abs_diff(20) <= 1, "{worst}");
    assert!(map[..20].iter().all(|error| *error < 1e-3), "far away nothing differs");
    // The same picture turned by a quarter has the same error turned.
    let turn = |data: &[Vec3]| (0..2400).map(|i| data[i % 40 * 60 + i / 40]).collect::<Vec<Vec3>>();
    let turned = |source: &Picture| {
        let colors: Vec<Vec3> = source.layers[0].data.chunks_exact(3).map(Vec3::from_slice).collect();
        picture(40, 60, turn(&colors).iter().flat_map(|color| color.to_array()).collect())
    };
    let other = ldr_of(&turned(&spoiled), &turned(&reference)).map;
    for (i, error) in other.iter().enumerate() {
        assert!((error - map[i % 40 * 60 + i / 40]).abs() < 1e-3, "{i}");
    }
}

#[test]
fn numbers_that_are_not_finite_differ_wholly_and_spoil_no_others() {
    let [reference, _] = pair_of(1);
    for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut spoiled = reference.clone();
        spoiled.layers[0].data[500 * 3 + 1] = broken;
        for flip in [ldr_of(&spoiled, &reference), hdr_of(&spoiled, &reference).0] {
            assert_eq!(flip.map[500], 1.0);
            assert!(flip.map.iter().all(|error| (0.0..=1.0).contains(error)) && flip.mean < 0.1);
        }
    }
}

#[test]
fn extreme_references_have_a_finite_range() {
    for value in [0.0, 1e-30, 1.0, f32::MAX] {
        let constant = picture(3, 3, vec![value; 27]);
        let (flip, exposures) = hdr_of(&picture(3, 3, vec![0.5; 27]), &constant);
        assert!(exposures.start.is_finite() && exposures.count == 2, "{value}: {exposures:?}");
        assert!((0.0..=1.0).contains(&flip.mean), "{value}: {flip:?}");
    }
    let mut spread = vec![0.0; 27];
    spread[..3].fill(f32::MAX);
    // From 2^128 to 2^-23.
    assert_eq!(hdr_of(&picture(3, 3, vec![0.0; 27]), &picture(3, 3, spread)).1.count, 151);
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let small = picture(2, 1, vec![0.5; 6]);
    for pixels_per_degree in [0.0, -1.0, f64::NAN, 1e9] {
        assert_eq!(ldr(&small, &small, "", pixels_per_degree).expect_err("refused").exit_code(), 1);
    }
    assert!(hdr(&small, &picture(1, 2, vec![0.5; 6]), "", PIXELS_PER_DEGREE).is_err());
    let mut depth = Picture::new(1, 1);
    depth.push("depth", Channels::Scalar, vec![1.0]);
    assert_eq!(ldr(&depth, &depth, "depth", PIXELS_PER_DEGREE).expect("a pair"), None);
}
