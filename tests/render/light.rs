//! Light tracing: against analytic answers, against photons in the limit of small footprints, and against references.
//!
//! Pictures are compared by means over blocks, whose errors come from the spread over passes, in a Z-test.

use std::f64::consts::PI;

use nephroid::Error;
use nephroid::low_level::render::{Lens, Method, Sampling, Session, Settings};
use nephroid::low_level::scene::shapes::{CylinderCells, Mesh};
use nephroid::low_level::scene::{Camera, Light, Limits, Material, Scene, load};

use crate::support::device::runtime;
use crate::support::lab::{self, Shot, assert_same, asset, from_above};
use crate::support::proof;
use crate::support::shared;
use crate::support::ztest::{ZTest, z_test};

/// Probability with which a correct picture fails.
const SIGNIFICANCE: f64 = 0.01;

fn settings(method: Method, size: [u32; 2], photons: u32) -> Settings {
    let [width, height] = size;
    Settings { width, height, method, photons: Some(photons), photon_bounces: 24, eye_depth: 12, ..Settings::default() }
}

/// Means of a picture's blocks and their standard errors, three channels for each block.
#[derive(Debug, Default, Clone)]
struct Blocks {
    mean: Vec<f64>,
    error: Vec<f64>,
}

/// Blocks of `side` x `side` pixels of a picture of `width` columns, row by row, of three values a pixel; what is left
/// over at the edges belongs to none.
fn block_means(values: &[[f64; 3]], width: usize, side: usize) -> Vec<f64> {
    let (columns, rows) = (width / side, values.len() / width / side);
    let mean = |bx: usize, by: usize, channel: usize| {
        let inside = (0..side * side).map(|i| values[(by * side + i / side) * width + bx * side + i % side][channel]);
        inside.sum::<f64>() / (side * side) as f64
    };
    let blocks = (0..rows).flat_map(|by| (0..columns).map(move |bx| (bx, by)));
    blocks.flat_map(|(bx, by)| (0..3).map(move |channel| (bx, by, channel))).map(|(x, y, c)| mean(x, y, c)).collect()
}

/// The parts of a picture that light paths and photons make.
const BY_LIGHT: [&str; 2] = ["caustic", "indirect"];

/// Renders the passes and keeps the means of the blocks of each, for their spread: pixels of a pass depend on each
/// other, passes do not. The picture is the sum of the named layers; "" is all light.
fn render(
    scene: &Scene,
    settings: &Settings,
    passes: std::ops::Range<u64>,
    (layers, side): (&[&str], usize),
) -> Blocks {
    let settings = Settings { layers: true, ..settings.clone() };
    let runtime = runtime();
    let mut session = Session::new(runtime.device(), scene.clone(), settings.clone()).expect("a session");
    let (mut sums, mut squares): (Vec<f64>, Vec<f64>) = (vec![], vec![]);
    proof::ran(session.plan_text());
    let n = passes.clone().count() as f64;
    for (done, index) in passes.enumerate() {
        session.run_pass(index).expect("a pass without validation message");
        let picture = session.picture().expect("the mean of all passes");
        let layers: Vec<_> = layers.iter().map(|name| &picture.layer(name).expect("a layer").data).collect();
        let value = |i: usize| layers.iter().map(|layer| f64::from(layer[i])).sum::<f64>();
        let pixels: Vec<[f64; 3]> =
            (0..settings.pixels() as usize).map(|p| std::array::from_fn(|k| value(3 * p + k))).collect();
        let means = block_means(&pixels, settings.width as usize, side);
        sums.resize(means.len(), 0.0);
        squares.resize(means.len(), 0.0);
        for ((sum, square), mean) in sums.iter_mut().zip(&mut squares).zip(means) {
            let total = mean * (done + 1) as f64;
            *square += (total - *sum).powi(2);
            *sum = total;
        }
    }
    let statistics = session.statistics().expect("counts");
    println!("{n} passes, {} deposits, {:.2} s", statistics.deposits, statistics.seconds);
    assert_eq!(statistics.rejected, 0, "pixels rejected as not finite");
    let error = |(sum, square): (&f64, &f64)| ((square - sum * sum / n) / (n - 1.0) / n).max(0.0).sqrt();
    Blocks { mean: sums.iter().map(|sum| sum / n).collect(), error: sums.iter().zip(&squares).map(error).collect() }
}

impl Blocks {
    fn exact(values: Vec<f64>) -> Self {
        Self { error: vec![0.0; values.len()], mean: values }
    }

    /// Those whose index the filter accepts, three channels each.
    fn only(&self, wanted: &[bool]) -> Self {
        let pick = |values: &[f64]| (0..values.len()).filter(|i| wanted[i / 3]).map(|i| values[i]).collect();
        Self { mean: pick(&self.mean), error: pick(&self.error) }
    }

    fn test(&self, expected: &Self) -> ZTest {
        let result = z_test(&self.mean, &self.error, &expected.mean, &expected.error, SIGNIFICANCE);
        let i = result.worst;
        let relative = |b: &Self| {
            let (error, mean) = (b.error.iter().sum::<f64>(), b.mean.iter().sum::<f64>());
            100.0 * error / mean
        };
        println!(
            "{} values, smallest p {:.2e} of {:.2e}: {:.6} +- {:.6}, expected {:.6} +- {:.6}; \
             errors {:.3} % and {:.3} %",
            self.mean.len(),
            result.smallest_p,
            result.threshold,
            self.mean[i],
            self.error[i],
            expected.mean[i],
            expected.error[i],
            relative(self),
            relative(expected)
        );
        result
    }
}

/// A closed room of flat walls that emit and reflect 1/2, with a block in it: the radiance is 1 everywhere.
fn furnace(albedo: f32) -> Scene {
    let wall = Material { emissive: [1.0 - albedo; 3], double_sided: false, ..Material::lambert([albedo; 3]) };
    let room = cuboid([-1.0, -0.7, -1.3], [1.0, 0.8, 1.1]).flipped();
    let inner = cuboid([-0.8, -0.65, -0.9], [-0.3, 0.1, -0.4]);
    let camera = Camera::look_at([0.6, 0.3, 0.7], [-0.5, -0.2, -0.6], [0.1, 1.0, 0.0], 1.6);
    Scene::from_parts(vec![(room, wall.clone()), (inner, wall)], vec![], camera)
}

/// A box between two corners, normals outwards.
fn cuboid(low: [f32; 3], high: [f32; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let edge = |k: usize| std::array::from_fn(|i| if i == k { high[k] - low[k] } else { 0.0 });
        let mut far = low;
        far[axis] = high[axis];
        for quad in [Mesh::quad(far, edge(u), edge(v)), Mesh::quad(low, edge(v), edge(u))] {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(&quad.positions);
            mesh.normals.extend(&quad.normals);
            mesh.uvs[0].extend(&quad.uvs[0]);
            mesh.triangles.extend(quad.triangles.iter().map(|t| t.map(|corner| corner + first)));
        }
    }
    mesh
}

#[test]
fn furnace_is_uniform() {
    let found = render(&furnace(0.5), &settings(Method::Light, [48, 36], 16_384), 0..64, (&[""], 6));
    let ones = Blocks::exact(vec![1.0; found.mean.len()]);
    assert!(found.test(&ones).passed);
    let dark = render(&furnace(0.5), &settings(Method::Light, [48, 36], 0), 0..4, (&[""], 6));
    assert!(!dark.test(&ones).passed, "without light paths the comparison must fail");
    proof::by_answer(&["light_sum"]);
}

/// A parallel camera sees the same, and a map with too little room is enlarged: at albedo 0.8 a photon leaves four
/// vertices.
#[test]
fn furnace_through_a_parallel_camera_with_too_little_room() {
    let mut scene = furnace(0.8);
    scene.cameras = vec![from_above([0.1, 0.75, -0.1], 0.6)];
    let found = render(&scene, &settings(Method::Light, [32, 32], 16_384), 0..48, (&[""], 8));
    assert!(found.test(&Blocks::exact(vec![1.0; found.mean.len()])).passed);
    let runtime = runtime();
    let mut session =
        Session::new(runtime.device(), scene, settings(Method::Light, [8, 8], 16_384)).expect("a session");
    session.run_pass(0).expect("a pass");
    let statistics = session.statistics().expect("counts");
    assert!(statistics.repeated == 1 && statistics.deposits > 32_768, "{statistics:?}");
}

/// All splats in one pixel, against the same ones spread over many: no driver's limit on loops may cut the sum.
#[test]
fn one_pixel_takes_a_hundred_thousand_splats() {
    let mut scene = furnace(0.8);
    scene.cameras = vec![Camera::look_at([0.6, 0.3, 0.7], [-0.5, -0.2, -0.6], [0.1, 1.0, 0.0], 2.4)];
    let take = |side| {
        let settings = Settings { layers: true, ..settings(Method::Light, [side, side], 100_000) };
        let shot = Shot::take(&scene, &settings, 0..1);
        (shot.mean("indirect"), shot.statistics.deposits)
    };
    let ((one, vertices), (many, same)) = (take(1), take(16));
    assert!(vertices == same && vertices > 350_000, "{vertices} and {same} vertices");
    lab::assert_close(one, many, 1e-5, "one pixel and the mean of 256");
    lab::assert_close(one, 0.64, 0.05, "light after two reflections and more");
    proof::by_answer(&["light_blocks"]);
}

/// More pixels than a band has room for: both bands get their light.
#[test]
fn bands_have_their_own_splats() {
    let (width, height) = (1024, 640);
    let shot = Shot::take(&furnace(0.5), &settings(Method::Light, [width, height], 100_000), 0..1);
    let green: Vec<f64> = shot.moments.iter().map(|m| m[1]).collect();
    for half in green.chunks((width * height / 8) as usize) {
        let mean = half.iter().sum::<f64>() / half.len() as f64;
        lab::assert_close(mean, 1.0, 0.02, "an eighth of the furnace");
    }
}

/// The image of a point light in a plane mirror lights the floor by the inverse square law: seen at a slant, so that
/// the size of pixels on the floor enters.
#[test]
fn light_by_way_of_a_mirror() {
    let (intensity, height, size) = (2.0f64, 1.5f64, [32u32, 24]);
    let floor = Mesh::quad([-20.0, 0.0, 20.0], [40.0, 0.0, 0.0], [0.0, 0.0, -40.0]);
    let ceiling = Mesh::quad([-4.0, 1.0, -4.0], [8.0, 0.0, 0.0], [0.0, 0.0, 8.0]);
    let light = Light::Point { position: [0.0, 0.5, 0.0], intensity: [intensity as f32; 3] };
    let parts = vec![(floor, Material::lambert([0.7; 3])), (ceiling, Material::mirror())];
    let yfov = 0.9;
    let camera = Camera::look_at([0.2, 0.8, 1.4], [0.0, 0.0, 0.6], [0.1, 1.0, 0.0], yfov);
    let (right, up, forward) = (camera.right, camera.up, camera.forward);
    let scene = Scene::from_parts(parts, vec![light], camera);
    // Two surfaces: what the floor sends by way of the mirror to the floor would be the third.
    let settings = Settings { photon_bounces: 2, ..settings(Method::Light, size, 16_384) };
    let found = render(&scene, &settings, 0..64, (&[""], 4));
    // Radiance where a ray of the camera meets the floor: direct light from the height 0.5, caustic from `height`.
    let radiance = |px: f64, py: f64| {
        let half = (0.5 * f64::from(yfov)).tan();
        let (x, y) = (half * f64::from(size[0]) / f64::from(size[1]) * (2.0 * px - 1.0), half * (1.0 - 2.0 * py));
        let d: [f64; 3] =
            std::array::from_fn(|k| f64::from(forward[k]) + x * f64::from(right[k]) + y * f64::from(up[k]));
        assert!(d[1] < 0.0, "the floor fills the picture");
        let t = 0.8 / -d[1];
        let r2 = (0.2 + t * d[0]).powi(2) + (1.4 + t * d[2]).powi(2);
        let from = |h: f64| intensity * h / (h * h + r2).powf(1.5);
        [0.7 / PI * (from(0.5) + from(height)); 3]
    };
    let fine = 8;
    let (w, h) = (size[0] as usize * fine, size[1] as usize * fine);
    let pixels: Vec<_> =
        (0..w * h).map(|i| radiance(((i % w) as f64 + 0.5) / w as f64, ((i / w) as f64 + 0.5) / h as f64)).collect();
    let expected = block_means(&pixels, w, 4 * fine);
    assert!(found.test(&Blocks::exact(expected.clone())).passed);
    let brighter = Blocks::exact(expected.iter().map(|x| 1.02 * x).collect());
    assert!(!found.test(&brighter).passed, "two percent must be noticed");
    proof::by_answer(&["light_append", "light_connect"]);
}

/// A ring that is a mirror, on a floor, with a light in it.
fn ring(floor: f32) -> Scene {
    let cells = CylinderCells { segments: 128, rows: 1 };
    let mirror = Mesh::cylinder([0.0; 3], [0.0, 1.2, 0.0], 1.0, cells).flipped();
    let ground = Mesh::quad([-3.0, 0.0, 3.0], [6.0, 0.0, 0.0], [0.0, 0.0, -6.0]);
    let light = Light::Point { position: [0.45, 0.9, 0.1], intensity: [3.0, 2.0, 1.0] };
    let parts =
        vec![(ground, Material::lambert([0.6 * floor, 0.5 * floor, 0.4 * floor])), (mirror, Material::mirror())];
    // From above, inside of the ring: no pixel sees the mirror.
    Scene::from_parts(parts, vec![light], from_above([0.0, 1.0, 0.0], 0.68))
}

/// First pass of the comparisons with photons: footprints have a sixth of the first ones' radius, and their bias is
/// below the noise. Few hold an eye hit then, so pictures have many pixels.
const LATE: u64 = 1 << 16;

#[test]
fn caustic_of_a_ring_as_by_late_photons() {
    let (size, part) = ([96, 96], (&BY_LIGHT[..], 16));
    let light = settings(Method::Light, size, 32_768);
    let found = render(&ring(1.0), &light, 0..32, part);
    let photons = render(&ring(1.0), &settings(Method::Photons, size, 65_536), LATE..LATE + 32, part);
    assert!(found.test(&photons).passed);
    let brighter = render(&ring(1.1), &light, 32..64, part);
    assert!(!brighter.test(&photons).passed, "a brighter floor must be noticed");
}

/// Coarse spheres with smooth normals, of rough metal and of plastic, on a floor that reflects a little like plastic.
fn glossy_things(colour: f32) -> Vec<(Mesh, Material)> {
    let plastic = |roughness, [r, g, b]: [f32; 3]| Material {
        metallic: 0.0,
        roughness,
        base_color: [r * colour, g * colour, b * colour, 1.0],
        ..Material::default()
    };
    let metal = Material::metal([0.9 * colour, 0.7 * colour, 0.4 * colour], 0.6);
    vec![
        (Mesh::quad([-20.0, 0.0, 20.0], [40.0, 0.0, 0.0], [0.0, 0.0, -40.0]), plastic(0.7, [0.6, 0.5, 0.4])),
        (Mesh::sphere([-0.45, 0.2, 0.3], 0.2, 16, 32), metal),
        (Mesh::sphere([0.4, 0.22, 0.2], 0.22, 16, 32), plastic(0.5, [0.2, 0.4, 0.7])),
    ]
}

/// A mirror's image of a light is as good as a light there: what light tracing shows by way of a mirror, shadow rays
/// show of the other light, with gathered glossy lobes and shading normals.
#[test]
fn glossy_surfaces_as_by_shadow_rays() {
    let scene = |colour, mirror: bool| {
        let ceiling = Mesh::quad([-4.0, 1.0, -4.0], [8.0, 0.0, 0.0], [0.0, 0.0, 8.0]);
        let mut parts = glossy_things(colour);
        parts.extend(mirror.then(|| (ceiling, Material::mirror())));
        let height = if mirror { 0.5 } else { 1.5 };
        let light = Light::Point { position: [0.0, height, 0.0], intensity: [2.0, 1.5, 1.0] };
        let camera = Camera::look_at([0.1, 0.8, 1.4], [0.0, 0.0, 0.3], [0.0, 1.0, 0.0], 0.8);
        Scene::from_parts(parts, vec![light], camera)
    };
    let (size, side) = ([64, 48], 8);
    let light = Settings { photon_bounces: 2, ..settings(Method::Light, size, 32_768) };
    let shadow_rays = render(&scene(1.0, false), &settings(Method::Light, size, 0), 0..64, (&["direct"], side));
    let found = render(&scene(1.0, true), &light, 0..64, (&["caustic"], side));
    assert!(found.test(&shadow_rays).passed);
    let brighter = render(&scene(1.02, true), &light, 64..128, (&["caustic"], side));
    assert!(!brighter.test(&shadow_rays).passed, "two percent of the colours must be noticed");
}

/// Metal, plastic and glass in a coloured corner.
fn still_life() -> Scene {
    let plastic = Material { metallic: 0.0, roughness: 0.5, base_color: [0.2, 0.4, 0.7, 1.0], ..Material::default() };
    let parts = vec![
        (Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]), Material::lambert([0.7, 0.6, 0.5])),
        (Mesh::quad([-2.0, 0.0, -1.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]), Material::lambert([0.3, 0.7, 0.4])),
        (Mesh::sphere([-0.9, 0.5, -0.2], 0.5, 8, 12), Material::metal([0.9, 0.7, 0.4], 0.5)),
        (Mesh::sphere([0.9, 0.5, -0.2], 0.5, 8, 12), plastic),
        (Mesh::sphere([0.1, 0.35, 0.6], 0.35, 16, 24), Material::glass(1.5)),
    ];
    let light = Light::Point { position: [0.6, 2.0, 1.5], intensity: [4.0; 3] };
    Scene::from_parts(parts, vec![light], Camera::look_at([0.0, 1.4, 3.2], [0.0, 0.5, 0.0], [0.0, 1.0, 0.0], 0.7))
}

/// Pixels in which the first surface is one of `dark`'s black ones: no light can be connected there. Sixteen camera
/// rays each.
fn seen(dark: &Scene, size: [u32; 2], side: usize) -> Vec<bool> {
    let settings = Settings { layers: true, ..settings(Method::Light, size, 0) };
    let albedo = Shot::take(dark, &settings, 0..16).picture.layer("albedo").expect("albedo").data.clone();
    let pixels: Vec<[f64; 3]> = albedo.chunks(3).map(|p| [f64::from(u8::from(p[0] < 0.999)), 0.0, 0.0]).collect();
    block_means(&pixels, size[0] as usize, side).chunks(3).map(|mean| mean[0] == 0.0).collect()
}

/// The scene with mirrors and glass in black, everything else in white.
fn mask_of(scene: &Scene) -> Scene {
    let mut dark = scene.clone();
    for material in &mut dark.materials {
        let black = material.transmission > 0.0 || (material.metallic > 0.5 && material.roughness < 0.3);
        *material = Material::lambert([if black { 0.0 } else { 1.0 }; 3]);
    }
    dark
}

#[test]
fn light_through_glass_as_by_late_photons() {
    let (scene, size, side) = (still_life(), [96, 72], 12);
    let wanted = seen(&mask_of(&scene), size, side);
    assert!(wanted.contains(&false) && wanted.iter().filter(|x| **x).count() > 30, "{wanted:?}");
    let part = (&BY_LIGHT[..], side);
    let light = settings(Method::Light, size, 32_768);
    let found = render(&scene, &light, 0..32, part).only(&wanted);
    let photons = render(&scene, &settings(Method::Photons, size, 65_536), LATE..LATE + 32, part).only(&wanted);
    assert!(found.test(&photons).passed);
    let mut changed = scene;
    changed.materials.iter_mut().for_each(|m| m.base_color[1] *= 1.1);
    let changed = render(&changed, &light, 32..64, part).only(&wanted);
    assert!(!changed.test(&photons).passed, "brighter materials must be noticed");
}

/// Path tracing that photons tell of caustics: all light is there, and no path is counted twice, in mirrors and glass
/// and beside them.
#[test]
fn paths_with_photons_as_by_late_photons() {
    let (scene, size, part) = (still_life(), [96, 72], (&[""][..], 12));
    let found = render(&scene, &settings(Method::Hybrid, size, 32_768), LATE..LATE + 40, part);
    let photons = render(&scene, &settings(Method::Photons, size, 65_536), LATE..LATE + 16, part);
    assert!(found.test(&photons).passed);
    let mut changed = scene;
    changed.materials.iter_mut().for_each(|m| m.base_color[1] *= 1.1);
    let changed = render(&changed, &settings(Method::Hybrid, size, 32_768), LATE + 40..LATE + 80, part);
    assert!(!changed.test(&photons).passed, "brighter materials must be noticed");
    proof::by_answer(&["path_hits", "path_gather"]);
}

/// A scene and the blocks of its reference, if there are any on this machine.
fn reference(name: &str, size: [u32; 2], side: usize) -> Option<(Scene, Blocks)> {
    let folder = shared::path(&format!("scenes/{name}"))?;
    let file = folder.join("reference.exr");
    let (picture, _) = nephroid::low_level::picture::exr::read(&file).expect("a reference");
    let scene = load(&folder.join(format!("{name}.gltf")), &Limits::default()).expect("a scene");
    let factor = picture.width / size[0];
    assert_eq!([picture.width, picture.height], size.map(|n| n * factor), "a whole multiple");
    let data = &picture.layers[0].data;
    let pixels: Vec<[f64; 3]> = data.chunks(3).map(|p| std::array::from_fn(|k| f64::from(p[k]))).collect();
    let mean = block_means(&pixels, picture.width as usize, side * factor as usize);
    // The references' relMSE of 5e-5, the mean of (x - r)^2 / (r^2 + 0.01), is 0.7 % of that root per pixel. Blocks of
    // n pixels have 0.7 % / sqrt(n) if pixels are independent; light that was binned and then gathered is not, which is
    // why a tenth of a percent stands here.
    let error = mean.iter().map(|x| 1e-3 * (x * x + 0.01).sqrt()).collect();
    Some((scene, Blocks { mean, error }))
}

fn against_reference(name: &str, size: [u32; 2], side: usize, changed: &str) {
    let Some((mut scene, expected)) = reference(name, size, side) else { return };
    let wanted = seen(&mask_of(&scene), size, side);
    let expected = expected.only(&wanted);
    let settings = settings(Method::Light, size, 32_768);
    let found = render(&scene, &settings, 0..64, (&[""], side)).only(&wanted);
    assert!(found.test(&expected).passed, "{name}");
    let names: Vec<_> = scene.materials.iter().map(|m| m.name.clone()).collect();
    let material = scene.materials.iter_mut().find(|m| m.name == changed);
    let material = material.unwrap_or_else(|| panic!("no {changed} in {names:?}"));
    (0..3).for_each(|k| material.base_color[k] *= 1.02);
    let found = render(&scene, &settings, 64..128, (&[""], side)).only(&wanted);
    assert!(!found.test(&expected).passed, "two percent of {changed} must be noticed");
}

#[test]
fn cornell_is_the_reference() {
    against_reference("cornell", [64, 64], 8, "white");
}

#[test]
fn ring_is_the_reference() {
    against_reference("ring", [80, 60], 5, "plane");
}

/// The two references of the program against each other, where both see everything.
#[test]
fn path_tracing_gives_the_same_picture() {
    let mut scene = asset("cornell");
    // Few passes of many pixels cost less than many of few.
    let (size, side) = ([64, 64], 16);
    let light = render(&scene, &settings(Method::Light, size, 16_384), 0..64, (&[""], side));
    let path = settings(Method::Path, size, 1024);
    assert!(render(&scene, &path, 0..128, (&[""], side)).test(&light).passed);
    // Two percent of one colour in one of the two.
    scene.materials[0].base_color.iter_mut().take(3).for_each(|c| *c *= 1.02);
    assert!(!render(&scene, &path, 128..256, (&[""], side)).test(&light).passed, "two percent must be noticed");
}

#[test]
fn every_run_has_the_same_bits() {
    let settings = Settings { layers: true, ..settings(Method::Light, [40, 30], 16_384) };
    let render = |passes| Shot::take(&still_life(), &settings, passes).bits();
    let first = render(0..3);
    assert_same(&render(0..3), &first, "light tracing");
    assert!(lab::difference(&render(1..4), &first).is_some(), "other passes are another picture");
}

#[test]
fn a_lens_and_sampling_are_refused() {
    let runtime = runtime();
    let refused = |settings: Settings| match Session::new(runtime.device(), still_life(), settings) {
        Err(Error::Setting { settings, .. }) => settings,
        Err(other) => panic!("{other}"),
        Ok(_) => &[],
    };
    let light = settings(Method::Light, [8, 8], 1024);
    let lens = Lens { radius: 0.1, focus: 3.0 };
    assert_eq!(refused(Settings { lens: Some(lens), ..light.clone() }), ["method", "lens"]);
    let sampling = Sampling::Regular(2);
    assert_eq!(refused(Settings { sampling, ..light.clone() }), ["method", "sampling"]);
    assert!(refused(light).is_empty());
}

/// Each program is free of the other's kernels, and the scene of both is the same.
#[test]
fn programs_hold_one_method() {
    let runtime = runtime();
    let plan = |method| {
        let session = Session::new(runtime.device(), still_life(), settings(method, [8, 8], 1024)).expect("a session");
        session.plan_text().to_string()
    };
    let (light, photons) = (plan(Method::Light), plan(Method::Photons));
    assert!(light.contains("light_connect") && light.contains("photon_bounce") && light.contains("direct_light"));
    for kernel in ["gather_", "lbvh_", "photon_append", "deposit_boxes"] {
        assert!(photons.contains(kernel) && !light.contains(kernel), "{kernel} is no part of light tracing");
    }
    assert!(!photons.contains("light_connect") && !photons.contains("light_sum") && !photons.contains("light_append"));
}
