//! Curved mirrors: cases 9 and 11.

use std::f64::consts::PI;

use nephroid::low_level::render::Settings;
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Camera, Light, Material, Scene};

use crate::support::lab::{Shot, assert_close, close, from_above, settings};

const TILT: f64 = 0.5;
const HEIGHT: f64 = 0.6;

/// Part of a mirror cylinder of radius 1 on a floor: azimuths `angles` from +x, heights `heights`. It is lit along +x
/// by parallel light that falls at the angle TILT. Seen from above the vertical component plays no part: the rays are
/// those of the plane problem.
fn cup(angles: [f64; 2], heights: [f64; 2], camera: Camera) -> Scene {
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
    let sun = Light::Directional { direction: [TILT.cos() as f32, -TILT.sin() as f32, 0.0], irradiance: [1.0; 3] };
    Scene::from_parts(vec![(floor, Material::lambert([1.0; 3])), (mirror, Material::mirror())], vec![sun], camera)
}

/// Case 9, the curve: the brightest places of narrow strips along x, one through the cusp and others through points of
/// the nephroid, are on it. The strips are narrow because the cusp is: z = sin^3 a where x = 1/2 + 3/4 a^2. Only the
/// part of the mirror that makes this part of the curve is there, so that most photons come to it: light leaves the
/// mirror at the height from which it has fallen to the floor after the distance cos(a) / 2 to the curve.
#[test]
fn case_09_nephroid_ridge() {
    let (width, pixel) = (128, 4e-4);
    let half = 0.5 * f64::from(width) * pixel;
    for angle in [0.0f64, 0.4, 0.8] {
        let x = (3.0 * angle.cos() - (3.0 * angle).cos()) / 4.0;
        let z = (3.0 * angle.sin() - (3.0 * angle).sin()) / 4.0;
        let height = 0.5 * angle.cos() * TILT.tan();
        let camera = from_above([x as f32, 0.001, z as f32], (0.5 * pixel) as f32);
        let scene = cup([angle - 0.25, angle + 0.25], [height - 0.08, height + 0.08], camera);
        // Footprints keep their length along the beam, which the floor stretches by 1 / sin TILT.
        let settings = Settings { caustic_smoothing: 0.4, ..settings(width, 1, 200_000) };
        let image = Shot::take(&scene, &settings, 0..5).red("caustic");
        // Sums of nine pixels, 0.36 % of the radius: near the curve footprints are so small that single pixels are
        // noise.
        let sums: Vec<f64> = image.windows(9).map(|w| w.iter().sum::<f64>() / 9.0).collect();
        let best = (0..sums.len()).max_by(|&a, &b| sums[a].total_cmp(&sums[b])).expect("a pixel");
        let found = x + half * ((best as f64 + 4.5) / image.len() as f64 * 2.0 - 1.0);
        let mean = image.iter().sum::<f64>() / image.len() as f64;
        println!("ridge at {found:.4}, nephroid at {x:.4}, {:.1} times the mean", sums[best] / mean);
        assert!((found - x).abs() <= 0.005, "ridge at {found}, nephroid at {x}, angle {angle}");
        assert!(sums[best] > 1.5 * mean, "a ridge, not noise");
        let cardioid = x * 2.0 / 3.0; // the cusp of case 10
        assert!((found - cardioid).abs() > 0.005, "another curve must be noticed");
    }
}

/// Case 9, the flux: all light on the mirror, 2 R H times its irradiance, ends on the floor, however often it is
/// reflected.
#[test]
fn case_09_nephroid_flux() {
    let camera = from_above([-0.5, 0.001, 0.0], 2.4);
    // Wide footprints: a few samples per pixel integrate no singular curve, and blur keeps flux.
    let settings = Settings { caustic_smoothing: 30.0, ..settings(64, 64, 100_000) };
    let shot = Shot::take(&cup([-0.5 * PI, 0.5 * PI], [0.0, HEIGHT], camera), &settings, 0..4);
    let flux = shot.mean("caustic") * PI * 4.8 * 4.8;
    let expected = 2.0 * HEIGHT * TILT.cos();
    assert_close(flux, expected, 0.02, "flux of the nephroid");
    assert!(close(flux, expected * 1.03, 0.02).is_err());
}

/// Case 11: a light in the centre of a spherical mirror: every ray comes back, footprints shrink to nothing. The floor
/// lies just behind the focus. Footprints are raised to the smallest radius r and counted; a disc of 2 r keeps the flux
/// of the cap.
#[test]
fn case_11_light_in_the_centre_of_a_mirror() {
    // The cap of 60 degrees around the zenith, of a sphere of 24 bands of 5 degrees below the pole.
    let mut cap = Mesh::sphere([0.0; 3], 1.0, 36, 96).flipped();
    let positions = cap.positions.clone();
    cap.triangles.retain(|t| t.iter().all(|&i| positions[i as usize][1] > 0.4999));
    let behind = 1e-5f32;
    let floor = Mesh::quad([-0.5, -behind, 0.5], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let light = Light::Point { position: [0.0; 3], intensity: [1.0; 3] };
    let parts = vec![(floor, Material::lambert([1.0; 3])), (cap, Material::mirror())];
    let mut scene = Scene::from_parts(parts, vec![light], from_above([0.0, 0.1, 0.0], 1.0));
    let radius = 1e-4 * f64::from(scene.bounds().expect("bounds").radius()); // MIN_RADIUS of the footprints
    let half = 3.0 * radius;
    scene.cameras = vec![from_above([0.0, 0.1, 0.0], half as f32)];
    let shot = Shot::take(&scene, &settings(48, 48, 20_000), 0..2);
    assert!(shot.guard("footprints_raised_to_minimum") > 1000, "the clamp is counted");
    let caustic = shot.red("caustic");
    let place = |i: usize| ((i as f64 + 0.5) / 48.0 * 2.0 - 1.0) * half;
    let inside = |limit: f64| {
        let disc = (0..48 * 48).filter(|&i| place(i % 48).hypot(place(i / 48)) <= limit);
        disc.map(|i| caustic[i]).sum::<f64>() * (2.0 * half / 48.0).powi(2) * PI
    };
    // Solid angle of the cap: 2 pi (1 - cos 60 degrees); facets do not matter, their edges are arcs seen from the
    // centre only along meridians, so the rim's polygon is 0.1 % smaller.
    let expected = 2.0 * PI * 0.5;
    assert_close(inside(2.0 * radius), expected, 0.02, "flux inside of two radii");
    assert!(close(inside(0.5 * radius), expected, 0.02).is_err(), "half a radius is too little");
}
