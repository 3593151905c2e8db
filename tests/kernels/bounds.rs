//! Photons drawn as bounds against every photon at every hit: whatever the camera sees of them, no photon that counts
//! may be missed, and none counted twice.

use std::fmt::Write;

use nephroid::low_level::graph::{Buf, Graph};
use nephroid::low_level::kernels::deposits::Deposits;
use nephroid::low_level::kernels::gather::reference::{Disc, lambert_hit};
use nephroid::low_level::kernels::gather::{
    Amplification, Band, Bounds, Points, Program, Shape, Weight, bounds, brute,
};
use nephroid::low_level::kernels::generated::{Camera, EyeHit};

use crate::support::gather::{Light, gathered, lambert};
use crate::support::harness::Harness;
use crate::support::proof;
use crate::support::random::Random;
use crate::support::view::{self, cross, dot};

/// A camera at `position` that looks along a random direction, with a picture of `size` and its upper edge `slope`
/// above the middle at distance 1, or anywhere if it is orthographic.
fn camera(random: &mut Random, position: [f32; 3], (size, slope, orthographic): ([u32; 2], f32, bool)) -> Camera {
    let forward = random.direction();
    let unit = |v: [f32; 3]| v.map(|x| x / dot(v, v).sqrt());
    let right = unit(cross(forward, random.direction()));
    let up = cross(right, forward);
    Camera { orthographic: u32::from(orthographic), ..view::camera(position, [right, up, forward], slope, size) }
}

/// Column and row of a pixel: strips of four rows, column by column.
fn pixel_position(index: u32, camera: &Camera) -> [u32; 2] {
    let strip = index / (4 * camera.width);
    let rows = 4.min(camera.height - 4 * strip);
    let inside = index - 4 * strip * camera.width;
    [inside / rows, 4 * strip + inside % rows]
}

/// The point that is seen at `jitter` in [0, 1]^2 of a pixel of the band, at a distance along the view axis.
fn seen_at(camera: &Camera, slot: u32, jitter: [f32; 2], distance: f32) -> [f32; 3] {
    let [column, row] = pixel_position(camera.first_pixel + slot, camera);
    let x = (column as f32 + jitter[0]) / camera.width as f32 * 2.0 - 1.0;
    let y = (row as f32 + jitter[1]) / camera.height as f32 * 2.0 - 1.0;
    let spread = if camera.orthographic == 1 { 1.0 } else { distance };
    std::array::from_fn(|k| {
        let across = camera.right[k] * x - camera.up[k] * y;
        camera.position[k] + across * spread + camera.forward[k] * distance
    })
}

/// One hit in each pixel of the band, often at the very corner of its pixel, and photons around some of them: most of
/// the pairs that count are at the rim of a footprint.
fn seen(random: &mut Random, camera: &Camera, photons: usize, radii: [f32; 2]) -> (Vec<EyeHit>, Vec<Disc>) {
    let hits: Vec<EyeHit> = (0..camera.pixels)
        .map(|slot| {
            let jitter = [0, 1].map(|_| (1.6 * random.unit() - 0.3).clamp(0.0, 1.0));
            let place = seen_at(camera, slot, jitter, 0.05 * 200f32.powf(random.unit()));
            lambert_hit(place, random.direction(), [0.3, 0.2, 0.1])
        })
        .collect();
    let discs = (0..photons)
        .map(|i| {
            let radius = radii[0] * (radii[1] / radii[0]).powf(random.unit());
            let near = hits[(random.unit() * hits.len() as f32) as usize].a;
            let (away, distance) = (random.direction(), radius * random.unit());
            let normal = random.direction();
            Disc {
                position: std::array::from_fn(|k| f32::from_bits(near[k]) + away[k] * distance),
                normal,
                radii: [radius, radius * (1.0 - 0.8 * random.unit())],
                flux: [1.0, random.unit(), random.unit()],
                direction: normal.map(|x| -x),
                caustic: i % 3 == 0,
            }
        })
        .collect();
    (hits, discs)
}

fn by_brute(harness: &Harness, program: Program, hits: &[EyeHit], discs: &[Disc]) -> Vec<Light> {
    gathered(harness, hits, discs, |g, points, deposits, target| {
        brute(g, program, points, (&deposits.photons, &deposits.count), target);
    })
}

/// A camera and the picture that its band belongs to.
type Eye<'a> = (&'a Camera, Bounds);

fn declare(
    g: &mut Graph,
    program: Program,
    (camera, how): Eye<'_>,
    (points, deposits): (Points<'_>, &Deposits),
    target: &mut Buf<[f32; 4]>,
) {
    let memory = g.upload("camera", &[*camera]);
    let band = Band {
        camera: &memory,
        size: [camera.width, camera.height],
        first_pixel: camera.first_pixel,
        pixels: camera.pixels,
    };
    bounds(g, (program, how), (points, band), (&deposits.photons, &deposits.count), target);
}

fn by_bounds(harness: &Harness, program: Program, eye: Eye<'_>, hits: &[EyeHit], discs: &[Disc]) -> Vec<Light> {
    gathered(harness, hits, discs, |g, points, deposits, target| {
        declare(g, program, eye, (points, deposits), target);
    })
}

/// What differs between the light by bounds and by brute force, and the pairs that were accepted: all of them are to
/// be.
fn differences(found: &[Light], wanted: &[Light]) -> String {
    let mut text = String::new();
    for (slot, (f, w)) in found.iter().zip(wanted).enumerate() {
        let scale = w.iter().flat_map(|light| &light[..3]).fold(0.0f32, |a, x| a.max(x.abs()));
        let far = (0..6).any(|at| (f[at / 3][at % 3] - w[at / 3][at % 3]).abs() > 2e-5 * scale);
        if (far || f[1][3] != w[1][3]) && text.len() < 400 {
            let _ = writeln!(text, "slot {slot}: {f:?}, not {w:?}");
        }
    }
    text
}

const KINDS: [Bounds; 6] = [
    Bounds { shape: Shape::Polygon(6), amplification: Amplification::Vertex },
    Bounds { shape: Shape::Polygon(8), amplification: Amplification::Geometry },
    Bounds { shape: Shape::Polygon(13), amplification: Amplification::Vertex },
    Bounds { shape: Shape::Polygon(18), amplification: Amplification::Geometry },
    Bounds { shape: Shape::Icosahedron, amplification: Amplification::Vertex },
    Bounds { shape: Shape::Icosahedron, amplification: Amplification::Geometry },
];

/// Compares all kinds of bounds with brute force; gives the accepted pairs, and the tested ones by kind.
fn compare(harness: &Harness, what: &str, camera: &Camera, hits: &[EyeHit], discs: &[Disc]) -> (f32, Vec<f32>) {
    let program = lambert(harness, Weight::Epanechnikov);
    let wanted = by_brute(harness, program, hits, discs);
    let sum = |lights: &[Light], which: usize| lights.iter().map(|light| light[which][3]).sum::<f32>();
    let accepted = sum(&wanted, 1);
    let tested = KINDS.map(|kind| {
        let found = by_bounds(harness, program, (camera, kind), hits, discs);
        assert_eq!(differences(&found, &wanted), "", "{what}, {kind:?}, {accepted} pairs");
        sum(&found, 0)
    });
    println!("{what}: {accepted} pairs of {}, tested {tested:?}", hits.len() * discs.len());
    (accepted, tested.to_vec())
}

#[test]
fn bounds_hold_every_photon_that_counts() {
    let harness = Harness::lock();
    let mut random = Random(11);
    for (size, slope, orthographic) in [
        ([40, 30], 0.6, false),
        ([64, 9], 0.2, false),
        ([23, 37], 2.5, false), // 136 degrees high
        ([40, 30], 1.5, true),
    ] {
        let position = [random.unit() * 4.0, random.unit(), -random.unit()];
        let camera = camera(&mut random, position, (size, slope, orthographic));
        // From less than a pixel to more than the picture; the nearest hits are 0.05 away: many balls hold the camera.
        let (hits, discs) = seen(&mut random, &camera, 700, [0.003, 3.0]);
        let what = format!("{size:?}, slope {slope}, orthographic {orthographic}");
        let (accepted, tested) = compare(&harness, &what, &camera, &hits, &discs);
        let all = (hits.len() * discs.len()) as f32;
        assert!(accepted > 1000.0 && tested.iter().all(|&n| n < 0.5 * all), "{what}: {accepted} pairs, {tested:?}");
    }
    proof::by_answer(&[
        "bounds_args",
        "bounds_ball_geom",
        "bounds_ball_vert",
        "bounds_depth_frag",
        "bounds_depths",
        "bounds_point_vert",
        "bounds_polygon_geom",
        "bounds_polygon_vert",
        "bounds_resolve",
        "bounds_screen_vert",
        "bounds_seen",
        "bounds_splat_frag",
    ]);
}

#[test]
fn small_photons_are_found_at_the_corners_of_pixels() {
    let harness = Harness::lock();
    let mut random = Random(5);
    for (slope, orthographic) in [(0.5, false), (1.8, false), (0.5, true)] {
        let camera = camera(&mut random, [0.3, -0.2, 7.0], ([48, 48], slope, orthographic));
        let (hits, discs) = seen(&mut random, &camera, 4000, [0.0005, 0.05]);
        let (accepted, tested) = compare(&harness, "small", &camera, &hits, &discs);
        assert!(accepted > 500.0 && tested.iter().all(|&n| n < 2e6), "{accepted} pairs, {tested:?}");
    }
}

/// Bands begin and end within strips, the last strip is lower than the others, and a picture may be a single pixel.
#[test]
fn bands_and_small_pictures() {
    let harness = Harness::lock();
    let mut random = Random(3);
    for (size, first_pixel, pixels) in [
        ([1, 1], 0, 1),
        ([7, 3], 0, 21),
        ([21, 18], 0, 100),
        ([21, 18], 100, 1),
        ([21, 18], 101, 200),
        ([21, 18], 301, 77),
    ] {
        let mut camera = camera(&mut random, [0.0; 3], (size, 0.7, false));
        (camera.first_pixel, camera.pixels) = (first_pixel, pixels);
        let (hits, discs) = seen(&mut random, &camera, 300, [0.01, 2.0]);
        let (accepted, _) = compare(&harness, &format!("{size:?} from {first_pixel}"), &camera, &hits, &discs);
        assert!(accepted > 10.0, "{accepted} pairs");
    }
}

/// Photons around the camera, across the plane of the eye, and behind it, of which those behind reach no hit.
#[test]
fn photons_around_the_camera() {
    let harness = Harness::lock();
    let mut random = Random(8);
    let camera = camera(&mut random, [1.0, 2.0, 3.0], ([24, 24], 1.0, false));
    let (hits, mut discs) = seen(&mut random, &camera, 400, [0.5, 20.0]);
    for (i, disc) in discs.iter_mut().enumerate() {
        let (away, far) = (random.direction(), if i % 2 == 0 { 0.1 } else { 1.1 } * disc.radii[0]);
        let side = if i % 4 == 3 { -dot(away, camera.forward).signum() } else { 1.0 };
        disc.position = std::array::from_fn(|k| camera.position[k] + side * far * away[k]);
        disc.radii[1] = disc.radii[0];
    }
    let (accepted, _) = compare(&harness, "around", &camera, &hits, &discs);
    assert!(accepted > 1000.0, "{accepted} pairs");
    // Wholly behind.
    for disc in &mut discs {
        let away = 1.5 * disc.radii[0];
        disc.position = std::array::from_fn(|k| camera.position[k] - away * camera.forward[k]);
    }
    let (accepted, tested) = compare(&harness, "behind", &camera, &hits, &discs);
    assert_eq!((accepted, tested.iter().sum::<f32>()), (0.0, 0.0));
}

/// What is hidden is left out by depth: photons on a wall behind the hits cost nothing.
#[test]
fn hidden_photons_are_not_looked_at() {
    let harness = Harness::lock();
    let mut random = Random(2);
    let camera = camera(&mut random, [0.0; 3], ([32, 32], 0.5, false));
    let wall = |distance| -> Vec<EyeHit> {
        let hit = |slot| lambert_hit(seen_at(&camera, slot, [0.5; 2], distance), camera.forward, [1.0; 3]);
        (0..camera.pixels).map(hit).collect()
    };
    let (hits, hidden) = (wall(2.0), wall(3.0));
    let disc = |hit: &EyeHit| Disc {
        position: [0, 1, 2].map(|k| f32::from_bits(hit.a[k])),
        normal: camera.forward,
        radii: [0.1; 2],
        flux: [1.0; 3],
        direction: camera.forward.map(|x| -x),
        caustic: false,
    };
    let (visible, behind): (Vec<Disc>, Vec<Disc>) =
        (hits.iter().map(disc).collect(), hidden.iter().map(disc).collect());
    let (accepted, _) = compare(&harness, "visible", &camera, &hits, &visible);
    assert!(accepted > 5000.0, "{accepted} pairs");
    let (accepted, tested) = compare(&harness, "hidden", &camera, &hits, &behind);
    assert_eq!((accepted, tested.iter().sum::<f32>()), (0.0, 0.0));
}

#[test]
fn the_comparison_notices_a_lost_photon_and_another_camera() {
    let harness = Harness::lock();
    let mut random = Random(4);
    let eye = camera(&mut random, [0.0; 3], ([16, 16], 0.5, false));
    let (hits, discs) = seen(&mut random, &eye, 200, [0.01, 0.5]);
    let program = lambert(&harness, Weight::Epanechnikov);
    let wanted = by_brute(&harness, program, &hits, &discs);
    let counts =
        |disc: &Disc| by_brute(&harness, program, &hits, std::slice::from_ref(disc)).iter().any(|l| l[1][3] > 0.0);
    let needed = discs.iter().position(counts).expect("a photon that counts");
    let mut fewer = discs.clone();
    fewer.remove(needed);
    // A camera that sees a little more puts bounds elsewhere.
    let mut other = eye;
    other.right = other.right.map(|x| 1.5 * x);
    for kind in KINDS {
        let found = by_bounds(&harness, program, (&eye, kind), &hits, &fewer);
        assert_ne!(differences(&found, &wanted), "");
        let found = by_bounds(&harness, program, (&other, kind), &hits, &discs);
        assert_ne!(differences(&found, &wanted), "", "{kind:?}");
    }
}

/// Case 44 of the extreme cases for bounds: very many photons at one place, each drawn over most of a small picture.
#[test]
fn many_photons_at_one_place() {
    const MANY: usize = 200_000;
    let harness = Harness::lock();
    let mut random = Random(6);
    let camera = camera(&mut random, [0.0; 3], ([2, 2], 0.5, false));
    let hits: Vec<EyeHit> = (0..4)
        .map(|slot| lambert_hit(seen_at(&camera, slot, [0.5; 2], 1.0), camera.forward.map(|x| -x), [1.0; 3]))
        .collect();
    let disc = Disc {
        position: [0, 1, 2].map(|k| f32::from_bits(hits[1].a[k])),
        normal: camera.forward.map(|x| -x),
        radii: [0.2; 2],
        flux: [1.0; 3],
        direction: camera.forward,
        caustic: false,
    };
    let program = lambert(&harness, Weight::Constant);
    for shape in [Shape::Polygon(6), Shape::Icosahedron] {
        let kind = Bounds { shape, amplification: Amplification::Vertex };
        let found = by_bounds(&harness, program, (&camera, kind), &hits, &vec![disc; MANY]);
        let accepted: Vec<f32> = found.iter().map(|light| light[1][3]).collect();
        assert_eq!(accepted, [0.0, MANY as f32, 0.0, 0.0], "{shape:?}");
    }
}
