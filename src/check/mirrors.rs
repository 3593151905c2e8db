//! Curved mirrors and lenses: cases 9 to 13 and 53.

use std::f64::consts::PI;

use super::lab::{Lab, Shot, mean, settings};
use super::scenes::{cap, floor, from_above, parallel, revolved, sun};
use super::{Case, Within};
use crate::error::Result;
use crate::fit;
use crate::render::{Footprint, Settings, Weight};
use crate::scene::shapes::Mesh;
use crate::scene::{Camera, Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 9,
        title: "cylindrical mirror, parallel light: the nephroid",
        reason: "x = (3 cos a - cos 3a) / 4, z = (3 sin a - sin 3a) / 4; 0.5 % of the radius holds footprints and the \
                 strip that is looked at",
        parameter: Some("angle on the mirror"),
        run: nephroid,
    },
    Case {
        number: 10,
        title: "ring mirror, light on the rim: the cardioid",
        reason: "the mirror equation gives the focus 2/3 R cos i from the mirror, the cusp at x = -R / 3",
        parameter: Some("angle on the mirror"),
        run: cardioid,
    },
    Case {
        number: 11,
        title: "light in the centre of a spherical mirror",
        reason: "footprints shrink to nothing and are raised to the least radius; two of these radii hold all flux",
        parameter: None,
        run: centre,
    },
    Case {
        number: 12,
        title: "paraboloid mirror, collimated light: a point focus",
        reason: "all light in a disc of the kernel's radius: Phi / (pi r^2), slope -2; facets blur by 1e-4",
        parameter: Some("radius of the kernel"),
        run: paraboloid,
    },
    Case {
        number: 13,
        title: "ball lens n = 1.5, paraxial focus",
        reason: "n R / (2 (n - 1)) = 1.5 R from the centre; the aperture of 0.1 R moves the focus by less than 0.5 %",
        parameter: Some("distance from the centre"),
        run: ball_lens,
    },
    Case {
        number: 53,
        title: "a caustic 10^6 times brighter than its surroundings",
        reason: "each is what it is without the other",
        parameter: None,
        run: bright_caustic,
    },
];

const TILT: f64 = 0.5;
const HEIGHT: f64 = 0.6;

/// Part of a mirror cylinder of radius 1 on a floor, seen from above: azimuths `angles` from +x, heights `heights`.
fn ring(angles: [f64; 2], heights: [f64; 2]) -> Vec<(Mesh, Material)> {
    let segments = 256;
    let mut mirror = Mesh::default();
    for i in 0..=segments {
        let angle = angles[0] + (angles[1] - angles[0]) * f64::from(i) / f64::from(segments);
        let (sine, cosine) = angle.sin_cos();
        for y in heights {
            mirror.positions.push([cosine as f32, y as f32, sine as f32]);
            mirror.normals.push([-cosine as f32, 0.0, -sine as f32]);
            mirror.uvs[0].push([0.0; 2]);
        }
        if i > 0 {
            let a = 2 * i as u32;
            mirror.triangles.extend([[a - 2, a, a + 1], [a - 2, a + 1, a - 1]]);
        }
    }
    let floor = Mesh::quad([-4.0, 0.0, 3.0], [7.0, 0.0, 0.0], [0.0, 0.0, -6.0]);
    vec![(floor, Material::lambert([1.0; 3])), (mirror, Material::mirror())]
}

/// It is lit along +x by parallel light that falls at the angle TILT. Seen from above the vertical component plays no
/// part: the rays are those of the plane problem.
fn cup(angles: [f64; 2], heights: [f64; 2], camera: Camera) -> Scene {
    let sun = Light::Directional { direction: [TILT.cos() as f32, -TILT.sin() as f32, 0.0], irradiance: [1.0; 3] };
    Scene::from_parts(ring(angles, heights), vec![sun], camera)
}

/// Pixels of a strip that crosses a caustic along x, and the length of one.
const STRIP: u32 = 128;
const PIXEL: f64 = 4e-4;

/// Where the brightest place of a strip around `x` is, and how bright it is in terms of the strip's mean.
///
/// Sums of nine pixels, 0.36 % of the radius: near the curve footprints are so small that single pixels are noise.
fn ridge(image: &[f64], x: f64) -> (f64, f64) {
    let half = 0.5 * f64::from(STRIP) * PIXEL;
    let sums: Vec<f64> = image.windows(9).map(mean).collect();
    let best = (0..sums.len()).max_by(|&a, &b| sums[a].total_cmp(&sums[b])).unwrap_or(0);
    (x + half * ((best as f64 + 4.5) / image.len() as f64 * 2.0 - 1.0), sums[best] / mean(image))
}

/// The curve: the brightest places of narrow strips along x, one through the cusp and others through points of the
/// nephroid, are on it. The strips are narrow because the cusp is: z = sin^3 a where x = 1/2 + 3/4 a^2. Only the part
/// of the mirror that makes this part of the curve is there, so that most photons come to it: light leaves the mirror
/// at the height from which it has fallen to the floor after the distance cos(a) / 2 to the curve.
fn nephroid(lab: &mut Lab) -> Result<()> {
    for angle in [0.0f64, 0.4, 0.8] {
        let x = (3.0 * angle.cos() - (3.0 * angle).cos()) / 4.0;
        let z = (3.0 * angle.sin() - (3.0 * angle).sin()) / 4.0;
        let height = 0.5 * angle.cos() * TILT.tan();
        let camera = from_above([x as f32, 0.001, z as f32], (0.5 * PIXEL) as f32);
        let scene = cup([angle - 0.25, angle + 0.25], [height - 0.08, height + 0.08], camera);
        // Footprints keep their length along the beam, which the floor stretches by 1 / sin TILT.
        let settings = Settings { caustic_smoothing: 0.4, ..settings(STRIP, 1, 200_000) };
        let image = lab.shot(&scene, &settings, 0..lab.pick(3, 5))?.red("caustic");
        let (found, height) = ridge(&image, x);
        let cusp_of_case_10 = x * 2.0 / 3.0;
        lab.found(format!("ridge at x, angle {angle}"), found, x, Within::Range(0.005)).at(angle).not(cusp_of_case_10);
        lab.found("its height over the mean", height, 1.5, Within::AtLeast);
    }
    // All light on the mirror, 2 R H times its irradiance, ends on the floor, however often it is reflected. Wide
    // footprints: a few samples per pixel integrate no singular curve, and blur keeps flux.
    let camera = from_above([-0.5, 0.001, 0.0], 2.4);
    let settings = Settings { caustic_smoothing: 30.0, ..settings(64, 64, 100_000) };
    let shot = lab.shot(&cup([-0.5 * PI, 0.5 * PI], [0.0, HEIGHT], camera), &settings, 0..lab.pick(2, 4))?;
    let (flux, expected) = (shot.mean("caustic") * PI * 4.8 * 4.8, 2.0 * HEIGHT * TILT.cos());
    lab.found("flux", flux, expected, Within::Part(0.02)).not(expected * 1.05);
    Ok(())
}

/// A light on the rim at +x and a band of the mirror opposite to it. A ray meets the mirror after the chord 2 cos i and
/// the curve 2/3 cos i later; what reaches the floor there left the light's height by a quarter of the way down.
fn cardioid(lab: &mut Lab) -> Result<()> {
    let lamp_height = 0.8;
    for angle in [0.0f64, 0.5] {
        // From the mirror's place the way back to the light and the inward normal make the angle i.
        let incidence = 0.5 * angle;
        let place = [-angle.cos(), angle.sin()];
        let chord = [place[0] - 1.0, place[1]].map(|c| c / (2.0 * incidence.cos()));
        let inward = [-place[0], -place[1]];
        let along = chord[0] * inward[0] + chord[1] * inward[1];
        let leaves = [0, 1].map(|k| chord[k] - 2.0 * along * inward[k]);
        let focus = [0, 1].map(|k| place[k] + leaves[k] * 2.0 / 3.0 * incidence.cos());
        let camera = from_above([focus[0] as f32, 0.001, focus[1] as f32], (0.5 * PIXEL) as f32);
        let height = 0.25 * lamp_height;
        let around = PI - angle;
        let parts = ring([around - 0.2, around + 0.2], [height - 0.06, height + 0.06]);
        let lamp = Light::Point { position: [0.9999, lamp_height as f32, 0.0], intensity: [1.0; 3] };
        let scene = Scene::from_parts(parts, vec![lamp], camera);
        let settings = Settings { caustic_smoothing: 0.4, ..settings(STRIP, 1, 200_000) };
        let image = lab.shot(&scene, &settings, 0..lab.pick(3, 6))?.red("caustic");
        let (found, height) = ridge(&image, focus[0]);
        let what = format!("ridge at x, angle {angle}");
        lab.found(what, found, focus[0], Within::Range(0.005)).at(angle).not(-0.5);
        lab.found("its height over the mean", height, 1.5, Within::AtLeast);
    }
    Ok(())
}

/// Every ray comes back. The floor lies just behind the focus.
fn centre(lab: &mut Lab) -> Result<()> {
    // The cap of 60 degrees around the zenith, of a sphere of 24 bands of 5 degrees below the pole.
    let mut cap = Mesh::sphere([0.0; 3], 1.0, 36, 96).flipped();
    let positions = cap.positions.clone();
    cap.triangles.retain(|t| t.iter().all(|&i| positions[i as usize][1] > 0.4999));
    let behind = 1e-5f32;
    let floor = Mesh::quad([-0.5, -behind, 0.5], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let light = Light::Point { position: [0.0; 3], intensity: [1.0; 3] };
    let parts = vec![(floor, Material::lambert([1.0; 3])), (cap, Material::mirror())];
    let mut scene = Scene::from_parts(parts, vec![light], from_above([0.0, 0.1, 0.0], 1.0));
    let whole = scene.bounds().map_or(0.0, |bounds| f64::from(bounds.radius()));
    let radius = 1e-4 * whole; // MIN_RADIUS of the footprints
    let half = 3.0 * radius;
    scene.cameras = vec![from_above([0.0, 0.1, 0.0], half as f32)];
    let shot = lab.shot(&scene, &settings(48, 48, 20_000), 0..2)?;
    let raised = shot.guard("footprints_raised_to_minimum") as f64;
    lab.found("footprints raised to the least radius", raised, 1000.0, Within::AtLeast);
    let caustic = shot.red("caustic");
    let place = |i: usize| ((i as f64 + 0.5) / 48.0 * 2.0 - 1.0) * half;
    let inside = |limit: f64| {
        let disc = (0..48 * 48).filter(|&i| place(i % 48).hypot(place(i / 48)) <= limit);
        disc.map(|i| caustic[i]).sum::<f64>() * (2.0 * half / 48.0).powi(2) * PI
    };
    // Solid angle of the cap: 2 pi (1 - cos 60 degrees); facets do not matter, their edges are arcs seen from the
    // centre only along meridians, so the rim's polygon is 0.1 % smaller.
    let expected = PI;
    lab.found("flux within two radii", inside(2.0 * radius), expected, Within::Part(0.02)).not(inside(0.5 * radius));
    Ok(())
}

/// A mirror y = r^2 / (4 f), r from 0 to `rim`, that collects light from above at the height `f`.
fn dish(focus: f64, rim: f64, [rings, segments]: [u32; 2]) -> Mesh {
    let point = |i: u32| {
        let r = rim * f64::from(i) / f64::from(rings);
        [[r, r * r / (4.0 * focus)], [-r / (2.0 * focus), 1.0]]
    };
    revolved(&(0..=rings).map(point).collect::<Vec<_>>(), segments)
}

/// A plate of `half` width at height `y` that is lit from below, and a camera that looks up at a square of it.
fn plate_above(half: f32, y: f32, view: f32) -> (Mesh, Camera) {
    let plate = Mesh::quad([-half, y, half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, -2.0 * half]).flipped();
    (plate, parallel([0.0, y - 1e-3, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], view))
}

fn paraboloid(lab: &mut Lab) -> Result<()> {
    let (focus, rim) = (1.0, 0.5);
    let (half, albedo) = (0.06f32, 0.01);
    let mut points = vec![];
    let radii = [0.04, 0.02, 0.01, 0.005];
    for &radius in lab.pick(&radii[..3], &radii[..]) {
        let (plate, camera) = plate_above(half, focus as f32, 0.1 * radius as f32);
        let parts =
            vec![(plate, Material::lambert([albedo as f32; 3])), (dish(focus, rim, [48, 96]), Material::mirror())];
        let scene = Scene::from_parts(parts, vec![sun([0.0, -1.0, 0.0])], camera);
        let settings = Settings {
            footprint: Footprint::Fixed(radius as f32),
            weight: Weight::Constant,
            fold: false,
            ..settings(8, 8, 50_000)
        };
        let shot = lab.shot(&scene, &settings, 0..4)?;
        // The plate's shadow is missing from the aperture, a polygon of 96 corners.
        let step = PI / 48.0;
        let flux = rim * rim * PI * step.sin() / step - f64::from(4.0 * half * half);
        let expected = albedo / PI * flux / (PI * radius * radius);
        let found = shot.mean("caustic");
        lab.found(format!("peak, radius {radius}"), found, expected, Within::Part(0.02)).at(radius);
        points.push((radius, found));
    }
    let slope = fit::fit(&points).map_or(f64::NAN, |fit| fit.exponent);
    lab.found("slope of the peak over the radius", slope, -2.0, Within::Range(0.1)).not(-1.0);
    Ok(())
}

/// Two polar caps of a ball of radius 1 are all of it that paraxial light meets.
fn ball_lens(lab: &mut Lab) -> Result<()> {
    let angle = 0.1f64;
    let mut points = vec![];
    for distance in [1.3, 1.4, 1.5, 1.6, 1.7] {
        let mut ball = cap([0.0; 3], 1.0, angle, [16, 48]);
        ball.append(&cap([0.0; 3], -1.0, angle, [16, 48]));
        let floor = floor(0.3, -distance as f32);
        let camera = from_above([0.0, -1.05, 0.0], 0.06);
        let parts = vec![(floor, Material::lambert([1.0; 3])), (ball, Material::glass(1.5))];
        let scene = Scene::from_parts(parts, vec![sun([0.0, -1.0, 0.0])], camera);
        let settings = Settings { caustic_smoothing: 1.0, ..settings(64, 64, 50_000) };
        let shot = lab.shot(&scene, &settings, 0..lab.pick(2, 4))?;
        points.push((distance, spread(&shot, 64, 0.06)));
    }
    // A bundle with a focus has a parabola of squared widths: the lowest point is the focus.
    let focus = lowest(&points);
    lab.found("distance of the focus", focus, 1.5, Within::Part(0.01)).at(1.5).not(1.45);
    Ok(())
}

/// Mean squared distance of the light of a square picture from its middle.
fn spread(shot: &Shot, size: usize, half: f64) -> f64 {
    let place = |i: usize| ((i as f64 + 0.5) / size as f64 * 2.0 - 1.0) * half;
    let (mut sum, mut squares) = (0.0, 0.0);
    for (i, light) in shot.red("caustic").into_iter().enumerate() {
        sum += light;
        squares += light * (place(i % size).powi(2) + place(i / size).powi(2));
    }
    squares / sum
}

/// Where the parabola through points at equal distances, by least squares, is lowest.
fn lowest(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let middle = points.iter().map(|p| p.0).sum::<f64>() / n;
    let moment = |power: i32| points.iter().map(|p| (p.0 - middle).powi(power)).sum::<f64>();
    let (second, fourth) = (moment(2), moment(4));
    let b = points.iter().map(|p| (p.0 - middle) * p.1).sum::<f64>() / second;
    let (sum, curved): (f64, f64) =
        points.iter().fold((0.0, 0.0), |(sum, curved), p| (sum + p.1, curved + (p.0 - middle).powi(2) * p.1));
    let c = (n * curved - second * sum) / (n * fourth - second * second);
    middle - b / (2.0 * c)
}

/// A dish sends the sun to a plate just short of its focus; a weak light from the side lights the plate around the
/// spot.
fn bright_caustic(lab: &mut Lab) -> Result<()> {
    const SIDE: usize = 64;
    let (focus, rim, ratio) = (1.0f64, 0.4, 1e6);
    // At this height the cone of light is a hundredth as wide as the dish.
    let height = focus - (focus - rim * rim / 4.0 / focus) * 0.04;
    let (half, view) = (0.1f32, 0.08);
    let (plate, camera) = plate_above(half, height as f32, view);
    let dish = dish(focus, rim, [48, 96]);
    let parts =
        vec![(plate, Material::lambert([0.5; 3])), (dish, Material { double_sided: true, ..Material::mirror() })];
    let bright = sun([0.0, -1.0, 0.0]);
    let spot = rim * 0.04;
    let flux = PI * rim * rim - f64::from(4.0 * half * half);
    let irradiance = flux / (PI * spot * spot);
    // From the side, past the dish.
    let around_it = irradiance / ratio;
    let side = 0.5f32.sqrt();
    let weak = Light::Directional { direction: [side, side, 0.0], irradiance: [around_it as f32 / side; 3] };
    let scene = Scene::from_parts(parts, vec![bright, weak], camera);
    let settings = Settings { caustic_smoothing: 1.5, ..settings(SIDE as u32, SIDE as u32, 60_000) };
    let shot = lab.shot(&scene, &settings, 0..lab.pick(8, 32))?;
    let all = shot.mean("caustic") * f64::from(4.0 * view * view) * PI / 0.5;
    lab.found("flux of the caustic", all, flux, Within::Part(0.02));
    let place = |i: usize| ((i as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0) * f64::from(view);
    let at = |i: usize| place(i % SIDE).hypot(place(i / SIDE));
    // The dish throws the spot's own light back on all of the plate: that is indirect light.
    let (caustic, direct) = (shot.red("caustic"), shot.red("direct"));
    let around: Vec<usize> = (0..SIDE * SIDE).filter(|&i| at(i) > 2.5 * spot).collect();
    let expected = around_it * 0.5 / PI;
    let found = around.iter().map(|&i| caustic[i] + direct[i]).sum::<f64>() / around.len() as f64;
    lab.found("surroundings", found, expected, Within::Part(0.02));
    let lit = around.iter().map(|&i| direct[i]).sum::<f64>() / around.len() as f64;
    lab.found("surroundings, direct light alone", lit, expected, Within::Part(0.02));
    Ok(())
}
