//! Lights and direct light: cases 5 to 7, 23 and 50 to 52.

use std::f64::consts::PI;

use super::lab::{Lab, blocks, mean, settings};
use super::scenes::{floor, from_above, sun};
use super::{Case, Within};
use crate::error::Result;
use crate::render::{Method, Settings};
use crate::scene::shapes::Mesh;
use crate::scene::{Camera, Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 5,
        title: "point light over a plane",
        reason: "I h / (h^2 + x^2)^1.5: shadow rays at points are exact but for rounding, photons have noise",
        parameter: Some("x"),
        run: point_light,
    },
    Case {
        number: 6,
        title: "Lambertian disc light, from far to almost touching",
        reason: "pi L r^2 / (r^2 + h^2) on the axis, less 0.2 % for a polygon of 64 corners",
        parameter: Some("height over radius"),
        run: disc_light,
    },
    Case {
        number: 7,
        title: "unit squares, parallel and perpendicular",
        reason: "form factors 0.199825 and 0.200044 (Howell's catalogue, by quadrature)",
        parameter: None,
        run: form_factors,
    },
    Case {
        number: 23,
        title: "two lights, power 1 : 10^8",
        reason: "light adds up: the sum of the separate renders",
        parameter: None,
        run: unequal_lights,
    },
    Case {
        number: 50,
        title: "a lamp 10^-6 wide beside one 10^6 wide",
        reason: "light adds up; both give the floor the same irradiance by their analytic values",
        parameter: None,
        run: unequal_sizes,
    },
    Case {
        number: 51,
        title: "10^5 lights of which one matters",
        reason: "that light alone, to which the others add a thousandth",
        parameter: None,
        run: many_lights,
    },
    Case {
        number: 52,
        title: "sun 0.01 degrees above the ground",
        reason: "E sin t, exact but for rounding; a wall's shadow holds no light",
        parameter: Some("degrees above the ground"),
        run: grazing_sun,
    },
];

fn point_light(lab: &mut Lab) -> Result<()> {
    let intensity = 2.0f64;
    let h = 0.5f64;
    let lamp = Light::Point { position: [0.0, h as f32, 0.0], intensity: [intensity as f32; 3] };
    // Points: pictures of 1e-6 units.
    for x in [0.0f64, 0.3, 1.0, 2.9] {
        let parts = vec![(floor(3.0, 0.0), Material::lambert([1.0; 3]))];
        let scene = Scene::from_parts(parts, vec![lamp], from_above([x as f32, 0.25, 0.0], 5e-7));
        let shot = lab.shot(&scene, &settings(1, 1, 0), 0..1)?;
        let at = f64::from(x as f32);
        let expected = intensity * h / (h * h + at * at).powf(1.5) / PI;
        lab.found(format!("by shadow rays, x = {x}"), shot.mean("direct"), expected, Within::Part(1e-5)).at(x);
    }
    // The renderer leaves direct light to shadow rays, so photons show the light's image in a plane mirror above it,
    // which lights the floor from h' = 2 * 1 - 0.5 by the same law.
    let ceiling = Mesh::quad([-1.5, 1.0, -1.5], [3.0, 0.0, 0.0], [0.0, 0.0, 3.0]);
    let parts = vec![(floor(3.0, 0.0), Material::lambert([1.0; 3])), (ceiling, Material::mirror())];
    let scene = Scene::from_parts(parts, vec![lamp], from_above([0.0, 0.25, 0.0], 1.0));
    let shot = lab.shot(&scene, &settings(32, 32, 200_000), 0..lab.pick(6, 10))?;
    let h = 1.5f64;
    let at = |x: f64, z: f64| intensity * h / (h * h + x * x + z * z).powf(1.5) / PI;
    let grid: Vec<f64> = (0..256)
        .flat_map(|j| (0..256).map(move |i| at((f64::from(i) - 127.5) / 128.0, (f64::from(j) - 127.5) / 128.0)))
        .collect();
    lab.found("by photons", shot.mean("caustic"), mean(&grid), Within::Part(0.005));
    let (found, expected) = (blocks(&shot.red("caustic"), 4), blocks(&grid, 4));
    let part = lab.pick(0.008, 0.005);
    lab.worst("by photons, the worst sixteenth of the floor", &found, &expected, part);
    Ok(())
}

/// A disc of radius 1 that shines down from the height `h`, and a point of the floor below its centre.
fn under_disc(h: f64) -> Scene {
    let disc = Mesh::disc([0.0, h as f32, 0.0], [0.0, -1.0, 0.0], 1.0, 64);
    let camera = from_above([0.0, 0.5 * h as f32, 0.0], 1e-3 * h as f32);
    Scene::from_parts(
        vec![(floor(2.0, 0.0), Material::lambert([0.5; 3])), (disc, Material::emitter([1.0; 3]))],
        vec![],
        camera,
    )
}

const BY_AREA: &str = "shadow rays choose points of a light by area: a light much nearer than it is wide is noise";

fn disc_light(lab: &mut Lab) -> Result<()> {
    for h in [100.0, 1.0, 1e-2, 1e-4] {
        let expected = 0.5 / (1.0 + h * h);
        let scene = under_disc(h);
        for method in [Method::Photons, Method::Path] {
            let settings = Settings { method, photon_bounces: 4, eye_depth: 4, ..settings(48, 48, 0) };
            // A path knows emitters from both ends, so it needs no more samples for a light that is near.
            let passes = if method == Method::Path { lab.pick(32, 64) } else { lab.pick(16, 64) };
            let shot = lab.shot(&scene, &settings, 0..passes)?;
            let direct = shot.red("direct");
            let brightest = direct.iter().copied().fold(0.0, f64::max) / expected;
            let name = if method == Method::Path { "path" } else { "photons" };
            let gap = if method == Method::Photons && h < 0.5 { Some(BY_AREA) } else { None };
            let what = format!("h = {h}, {name}");
            lab.found(what, mean(&direct), expected, Within::Part(0.01)).at(h).gap = gap;
            let what = format!("h = {h}, {name}: brightest pixel over the mean");
            lab.found(what, brightest, 1.2, Within::AtMost).at(h).gap = gap;
        }
    }
    Ok(())
}

/// Share of the light that leaves a point of the floor and meets the unit square that stands at distance `c`, from its
/// side `z`: the configuration factor of a rectangle perpendicular to the receiver, for the parts on both sides of the
/// point.
fn perpendicular_factor(c: f64, z: f64) -> f64 {
    let s = (1.0 + c * c).sqrt();
    let part = |b: f64| ((b / c).atan() - c / s * (b / s).atan()) / (2.0 * PI);
    part(z) + part(1.0 - z)
}

/// The receiver is the floor, the emitter a wall that shares an edge with it: form factor 0.200044 by shadow rays. A
/// mirror on the diagonal between them shows the emitter as the parallel square at distance 1: 0.199825, by photons.
///
/// Shadow rays at uniform points of the emitter have infinite variance where the squares touch, so the quarter of the
/// receiver at the edge has no useful error bound; there only the analytic factors enter, whose mean over the whole
/// square is the form factor.
fn form_factors(lab: &mut Lab) -> Result<()> {
    let albedo = 0.8;
    // The floor goes on beyond the square, where footprints reach; light and mirror are as wide as the square's photons
    // need.
    let ground = Mesh::quad([-0.5, 0.0, 1.5], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]);
    let wall = Mesh::quad([1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]);
    let mirror = Mesh::quad([0.0, 0.0, 1.5], [1.0, 1.0, 0.0], [0.0, 0.0, -2.0]);
    let material = Material::lambert([albedo as f32; 3]);
    let parts = vec![(ground, material), (wall, Material::emitter([1.0; 3])), (mirror, Material::mirror())];
    let scene = Scene::from_parts(parts, vec![], from_above([0.5, 1e-4, 0.5], 0.5));
    let grid: Vec<f64> = (0..512 * 512)
        .map(|i| perpendicular_factor(1.0 - (f64::from(i % 512) + 0.5) / 512.0, (f64::from(i / 512) + 0.5) / 512.0))
        .collect();
    lab.found("mean of the configuration factors", mean(&grid), 0.200044, Within::Part(2e-4));
    let shot = lab.shot(&scene, &settings(32, 32, 0), 0..lab.pick(32, 64))?;
    let far = |pixels: &[f64]| {
        let blocks = blocks(pixels, 4);
        (0..12).map(|i| blocks[i / 3 * 4 + i % 3]).sum::<f64>() / 12.0
    };
    let expected = albedo * far(&grid);
    lab.found("perpendicular, by shadow rays", far(&shot.red("direct")), expected, Within::Part(0.005));
    // A frame of 1.5 x 1 units: footprints carry flux over the borders at the mirror and at the wall.
    let shot = lab.shot(&scene, &settings(48, 32, 200_000), 0..10)?;
    lab.found("parallel, by photons", shot.mean("caustic") * 1.5, albedo * 0.199825, Within::Part(0.005));

    let ground = Mesh::quad([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let lamp = Mesh::quad([0.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]).flipped();
    let parts = vec![(ground, Material::lambert([1.0; 3])), (lamp, Material::emitter([1.0; 3]))];
    let scene = Scene::from_parts(parts, vec![], from_above([0.5, 0.5, 0.5], 0.5));
    let shot = lab.shot(&scene, &settings(32, 32, 0), 0..lab.pick(16, 32))?;
    lab.found("parallel, by shadow rays", shot.mean("direct"), 0.199825, Within::Part(0.005)).not(0.199825 * 1.011);
    Ok(())
}

/// Mean of the picture with all `lights`, and the sum of those with each alone.
fn together(lab: &mut Lab, scene: &Scene, settings: &Settings, passes: u64) -> Result<(f64, f64)> {
    let whole = lab.shot(scene, settings, 0..passes)?.mean("");
    let mut sum = 0.0;
    for light in &scene.lights {
        let alone = Scene { lights: vec![*light], ..scene.clone() };
        sum += lab.shot(&alone, settings, 0..passes)?.mean("");
    }
    Ok((whole, sum))
}

fn unequal_lights(lab: &mut Lab) -> Result<()> {
    let point = |x: f32, intensity: f32| Light::Point { position: [x, 1.0, 0.0], intensity: [intensity; 3] };
    let white = Material::lambert([0.5; 3]);
    let lamps = vec![point(-1.0, 1.0), point(1.0, 1e8)];
    let camera = from_above([0.0, 1.5, 0.0], 1.0);
    let open = Scene::from_parts(vec![(floor(4.0, 0.0), white.clone())], lamps, camera);
    let passes = lab.pick(32, 128);
    let (found, expected) = together(lab, &open, &settings(16, 16, 0), passes)?;
    lab.found("one room for both", found, expected, Within::Part(0.02));
    // A wall between them: the weak lamp alone lights its side.
    let mut walled = open;
    walled.add(&Mesh::quad([0.0, 0.0, 4.0], [0.0, 4.0, 0.0], [0.0, 0.0, -8.0]), white);
    walled.cameras = vec![from_above([-1.0, 1.5, 0.0], 0.5)];
    let (found, expected) = together(lab, &walled, &settings(16, 16, 0), passes)?;
    lab.found("the weak one behind a wall", found, expected, Within::Part(0.02));
    Ok(())
}

fn unequal_sizes(lab: &mut Lab) -> Result<()> {
    let quad = |width: f32, y: f32| {
        let half = 0.5 * width;
        Mesh::quad([-half, y, half], [width, 0.0, 0.0], [0.0, 0.0, -width]).flipped()
    };
    let camera = from_above([0.0, 0.5, 0.0], 1e-3);
    let white = Material::lambert([0.5; 3]);
    // One unit above the floor; irradiance 1 of each: L A / h^2, and pi L of what fills the sky.
    let small = (quad(1e-6, 1.0), Material::emitter([1e12; 3]));
    let wide = (quad(1e6, 2.0), Material::emitter([1.0 / std::f32::consts::PI; 3]));
    let scene = Scene::from_parts(vec![(floor(2.0, 0.0), white), small, wide], vec![], camera);
    let shot = lab.shot(&scene, &settings(64, 64, 0), 0..lab.pick(16, 64))?;
    let each = 0.5 / PI;
    let gap = "shadow rays choose points of a light by area: of a light much wider than it is far, few are near";
    lab.found("both together", shot.mean("direct"), 2.0 * each, Within::Part(0.02)).gap(gap);
    let path = Settings { method: Method::Path, photon_bounces: 4, eye_depth: 4, ..settings(64, 64, 0) };
    let shot = lab.shot(&scene, &path, 0..lab.pick(16, 64))?;
    lab.found("both together, by path tracing", shot.mean("direct"), 2.0 * each, Within::Part(0.02));
    Ok(())
}

fn many_lights(lab: &mut Lab) -> Result<()> {
    let count = lab.pick(20_000, 100_000);
    let white = Material::lambert([0.5; 3]);
    let near = Light::Point { position: [0.0, 1.0, 0.0], intensity: [1.0; 3] };
    // A thousandth of the power of the near one in all of them.
    let side = f64::from(count).sqrt().ceil() as u32;
    let other = |i: u32| {
        let place = |k: u32| (k as f32 / side as f32 - 0.5) * 3.0;
        Light::Point { position: [place(i % side), 1.2, place(i / side)], intensity: [1e-3 / count as f32; 3] }
    };
    let lights = std::iter::once(near).chain((0..count).map(other)).collect();
    let camera = from_above([0.0, 0.5, 0.0], 0.4);
    let scene = Scene::from_parts(vec![(floor(4.0, 0.0), white)], lights, camera);
    let shot = lab.shot(&scene, &settings(16, 16, 1_000), 0..lab.pick(16, 32))?;
    let at = |x: f64, z: f64| (1.0 + x * x + z * z).powf(-1.5) * 0.5 / PI;
    let grid: Vec<f64> =
        (0..64 * 64).map(|i| at((f64::from(i % 64) - 31.5) / 80.0, (f64::from(i / 64) - 31.5) / 80.0)).collect();
    lab.found(format!("dim ones, {count} lights"), shot.mean("direct"), mean(&grid), Within::Part(0.02));
    // All of the same power, and a wall keeps the light of all others away.
    let mut walled = scene;
    walled.lights.iter_mut().skip(1).for_each(|light| {
        if let Light::Point { position, intensity } = light {
            (position[1], *intensity) = (3.0, [1.0; 3]);
        }
    });
    walled.add(&floor(8.0, 2.0), Material::lambert([0.0; 3]));
    let shot = lab.shot(&walled, &settings(16, 16, 1_000), 0..lab.pick(16, 32))?;
    lab.found(
        format!("strong ones behind a wall, {count} lights"),
        shot.mean("direct"),
        mean(&grid),
        Within::Part(0.02),
    )
    .gap("lights are chosen by power, not by what a place gets of them: without bias, but noise");
    Ok(())
}

fn grazing_sun(lab: &mut Lab) -> Result<()> {
    for degrees in [1.0f64, 0.1, 0.01] {
        let angle = degrees.to_radians();
        let light = sun([angle.cos() as f32, -angle.sin() as f32, 0.0]);
        // As the kernels have it: the direction's own sine, rounded.
        let sine = if let Light::Directional { direction, .. } = light { -f64::from(direction[1]) } else { 0.0 };
        let camera = from_above([0.0, 1.0, 0.0], 0.8);
        let ground = Mesh::grid([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0], [32, 32]);
        let white = Material::lambert([0.5; 3]);
        let mut scene = Scene::from_parts(vec![(ground, white.clone())], vec![light], camera.clone());
        let shot = lab.shot(&scene, &settings(32, 32, 1_000), 0..2)?;
        let what = format!("ground of 2048 triangles, {degrees} degrees");
        lab.found(what, shot.mean("direct"), sine * 0.5 / PI, Within::Part(1e-4)).at(degrees);
        let darkest = shot.red("direct").into_iter().fold(f64::INFINITY, f64::min) / (sine * 0.5 / PI);
        lab.found("its darkest pixel over the mean", darkest, 0.999, Within::AtLeast).at(degrees);
        let wall = Mesh::cuboid([-1.0, 0.0, -2.0], [-0.99, 1.0, 2.0]);
        scene.add(&wall, white);
        scene.cameras = vec![Camera { ..camera }];
        let shot = lab.shot(&scene, &settings(32, 32, 1_000), 0..2)?;
        lab.found("in the shadow of a wall", shot.mean("direct"), 0.0, Within::Exact).at(degrees);
    }
    Ok(())
}
