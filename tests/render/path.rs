//! Path tracing: known answers, and agreement with the photons and with references that others made.
//!
//! `NEPHROID_TEST_DEVICE` and `NEPHROID_VALIDATE` as in the other device tests.

use std::f64::consts::PI;

use glam::DVec3;
use nephroid::low_level::kernels::lobes::Opaque;
use nephroid::low_level::picture::exr;
use nephroid::low_level::render::{Lens, Method, Session, Settings};
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Alpha, Camera, Environment, Light, Limits, Material, Projection, Scene, load};

use crate::support::device::runtime;
use crate::support::lab::asset;
use crate::support::proof;
use crate::support::shared;
use crate::support::ztest::{ZTest, z_test};

fn path(side: u32) -> Settings {
    Settings {
        width: side,
        height: side,
        method: Method::Path,
        photon_bounces: 24,
        eye_depth: 12,
        ..Settings::default()
    }
}

/// Means and standard errors of blocks of a picture, row by row, three channels each.
struct Blocks {
    mean: Vec<f64>,
    error: Vec<f64>,
}

/// Renders `passes` in blocks of `cell` x `cell` pixels. Errors come from the spread of the blocks' means over at most
/// 64 groups of passes: the pixels of a photon pass see the same photons.
fn render(scene: &Scene, settings: &Settings, cell: usize, passes: std::ops::Range<u64>) -> Blocks {
    let runtime = runtime();
    let (width, height) = (settings.width as usize, settings.height as usize);
    let group = (passes.end - passes.start).div_ceil(64);
    let count = (passes.end - passes.start) as f64 / group as f64;
    assert_eq!(count.fract(), 0.0, "whole groups");
    let mut session = Session::new(runtime.device(), scene.clone(), settings.clone()).expect("a session");
    let across = width / cell;
    let numbers = across * (height / cell) * 3;
    let (mut before, mut sum, mut squares) = (vec![0.0; numbers], vec![0.0; numbers], vec![0.0; numbers]);
    for first in passes.step_by(group as usize) {
        for index in first..first + group {
            session.run_pass(index).expect("a pass without validation message");
        }
        let mut total = vec![0.0; numbers];
        for (pixel, moments) in session.moments().expect("the film").iter().enumerate() {
            let (x, y) = (pixel % width, pixel / width);
            for (channel, value) in moments[..3].iter().enumerate() {
                total[3 * (y / cell * across + x / cell) + channel] += value / (cell * cell) as f64 / group as f64;
            }
        }
        for k in 0..numbers {
            let pass = total[k] - before[k];
            sum[k] += pass;
            squares[k] += pass * pass;
        }
        before = total;
    }
    proof::ran(session.plan_text());
    let statistics = session.statistics().expect("counts");
    assert_eq!(statistics.rejected, 0, "pixels that are not finite");
    println!("{:.2} s, {} paths truncated", statistics.seconds, statistics.eye_paths_truncated);
    let mean: Vec<f64> = sum.iter().map(|s| s / count).collect();
    let variance = |k: usize| (squares[k] / count - mean[k] * mean[k]).max(0.0) / (count - 1.0);
    Blocks { error: (0..numbers).map(|k| variance(k).sqrt()).collect(), mean }
}

impl Blocks {
    fn against(&self, other: &Self) -> ZTest {
        z_test(&self.mean, &self.error, &other.mean, &other.error, 0.01)
    }

    /// Largest standard error, relative.
    fn precision(&self) -> f64 {
        self.mean.iter().zip(&self.error).map(|(mean, error)| error / mean.max(1e-9)).fold(0.0, f64::max)
    }

    /// Passes against one value everywhere, fails against 2 % more.
    #[track_caller]
    fn assert_value(&self, what: &str, expected: f64) {
        let found = self.mean[1];
        println!("{what}: {found:.5} +- {:.5}, expected {expected:.5}", self.error[1]);
        let n = self.mean.len();
        assert!(self.precision() < 0.004, "{what}: too noisy to tell, {}", self.precision());
        // Floats round, and spheres are made of triangles: what has no noise at all is not off by more than 1e-4.
        let rounding = vec![1e-4 * expected; n];
        let test = |expected: f64| z_test(&self.mean, &self.error, &vec![expected; n], &rounding, 0.01);
        assert!(test(expected).passed, "{what}: {found}, expected {expected}: {:?}", test(expected));
        assert!(!test(1.02 * expected).passed, "{what}: 2 % must be noticed");
    }
}

/// A camera that looks along `forward` in parallel at a point of 1e-6 units.
fn at_point(position: [f32; 3], forward: [f32; 3], up: [f32; 3]) -> Camera {
    let target = std::array::from_fn(|k| position[k] + forward[k]);
    let camera = Camera::look_at(position, target, up, 1.0);
    Camera { position, projection: Projection::Orthographic { xmag: 1e-6, ymag: 1e-6 }, ..camera }
}

/// A closed box that emits inwards and reflects `albedo`, with a ball in its middle that fills the view. The box is
/// flat: no direction is above one of two horizons and below the other.
fn furnace(object: Option<Material>, albedo: f32, emissive: f32) -> Scene {
    let shell = Mesh::cuboid([-4.0; 3], [4.0; 3]).flipped();
    let wall = Material { emissive: [emissive; 3], double_sided: false, ..Material::lambert([albedo; 3]) };
    let camera = Camera::look_at([0.0, 0.4, 3.0], [0.0; 3], [0.0, 1.0, 0.0], 0.5);
    let ball = object.map(|material| (Mesh::sphere([0.0; 3], 1.0, 48, 96), material));
    Scene::from_parts(std::iter::once((shell, wall)).chain(ball).collect(), vec![], camera)
}

#[test]
fn furnaces_have_their_answers() {
    let ball = |material| render(&furnace(Some(material), 0.0, 1.0), &path(32), 32, 0..32);
    render(&furnace(None, 0.5, 0.5), &path(32), 16, 0..64).assert_value("room", 1.0);
    render(&furnace(None, 0.75, 0.25), &path(32), 32, 0..64).assert_value("bright room", 1.0);
    ball(Material::lambert([0.7; 3])).assert_value("diffuse ball", 0.7);
    ball(Material::glass(1.5)).assert_value("glass", 1.0);
    ball(Material::mirror()).assert_value("mirror", 1.0);
    // Paths through glass to a room that reflects: radiance is 1 everywhere, seen by way of whatever reflects all.
    render(&furnace(Some(Material::glass(1.5)), 0.5, 0.5), &path(32), 32, 0..64).assert_value("glass in a room", 1.0);
    proof::by_answer(&["path_scatter"]);
}

/// Where nothing can focus light, no photon is traced, and the picture has the bits of path tracing.
#[test]
fn without_casters_hybrid_is_path_tracing() {
    let runtime = runtime();
    let take = |name: &str, method| {
        let settings = Settings { width: 32, height: 24, method, ..Settings::default() };
        let mut session = Session::new(runtime.device(), asset(name), settings).expect("a session");
        (0..2).for_each(|index| session.run_pass(index).expect("a pass"));
        (session.film().expect("a film").sums, session.photons_per_pass())
    };
    let (by_paths, _) = take("cornell", Method::Path);
    assert!(take("cornell", Method::Hybrid) == (by_paths, (0, 0)));
    assert!(take("cornell-glass", Method::Hybrid).0 != take("cornell-glass", Method::Path).0, "the test can fail");
    let (caustic, global) = take("cornell-glass", Method::Hybrid).1;
    assert!(caustic > 0 && global == 0, "{caustic} {global}");
}

/// Half the side of the square light and its height over the floor.
const LIGHT: (f64, f64) = (1.5, 0.5);

/// Radiance of the floor's origin towards `wo` (z is up) under a square light of radiance 1: the midpoint rule over it.
fn under_square(bsdf: impl Fn([f64; 3]) -> f64) -> f64 {
    let ((half, height), cells) = (LIGHT, 1500);
    let step = 2.0 * half / f64::from(cells);
    let at = |i: i32| (f64::from(i) + 0.5) * step - half;
    let mut sum = 0.0;
    for (x, y) in (0..cells).flat_map(|i| (0..cells).map(move |k| (at(i), at(k)))) {
        let d2 = x * x + y * y + height * height;
        let wi = [x, y, height].map(|c| c / d2.sqrt());
        sum += bsdf(wi) * wi[2] * wi[2] / d2 * step * step;
    }
    sum
}

/// A floor and a large light close above it, seen from the side.
fn close_light(floor: Material) -> Scene {
    let (half, height) = (LIGHT.0 as f32, LIGHT.1 as f32);
    let floor_mesh = Mesh::quad([-4.0, 0.0, 4.0], [8.0, 0.0, 0.0], [0.0, 0.0, -8.0]);
    let light = Mesh::quad([-half, height, -half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, 2.0 * half]);
    let camera = at_point([0.3, 0.4, 0.0], [-0.6, -0.8, 0.0], [0.0, 1.0, 0.0]);
    Scene::from_parts(vec![(floor_mesh, floor), (light, Material::emitter([1.0; 3]))], vec![], camera)
}

/// A light that both strategies find with ease: only together, weighted right, they count it once.
#[test]
fn strategies_share_a_large_light() {
    let wo = [0.6, 0.0, 0.8];
    let see = |floor| render(&close_light(floor), &path(64), 64, 0..64);
    see(Material::lambert([0.8; 3])).assert_value("diffuse floor", under_square(|_| 0.8 / PI));
    let wo = DVec3::from(wo);
    for roughness in [0.35f64, 0.6] {
        let metal = Opaque { metallic: 1.0, base: 1.0, coat: [0.0; 2], alpha: roughness * roughness };
        let expected = under_square(|wi| metal.bsdf(wo, wi.into()));
        see(Material::metal([1.0; 3], roughness as f32)).assert_value("metal floor", expected);
    }
    for metallic in [0.0, 0.4] {
        let coated = Opaque { metallic, base: 0.8, coat: [0.04, 1.0], alpha: 0.16 };
        let plastic = Material { metallic: metallic as f32, roughness: 0.4, ..Material::lambert([0.8; 3]) };
        let seen = see(Material { specular: 1.0, ior: 1.5, ..plastic });
        seen.assert_value("coated floor", under_square(|wi| coated.bsdf(wo, wi.into())));
    }
}

/// What a mask cuts away stands in nobody's way: density and distance of a drawn direction pass through it. Surfaces
/// without light of their own to give (unlit) are seen and light nothing.
#[test]
fn masks_and_unlit_surfaces_change_no_light() {
    let expected = under_square(|_| 0.8 / PI);
    let mut scene = close_light(Material::lambert([0.8; 3]));
    let sheet = |y: f32| Mesh::quad([-2.0, y, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]);
    let cut = Material { base_color: [1.0, 1.0, 1.0, 0.0], alpha: Alpha::Mask(0.5), ..Material::lambert([1.0; 3]) };
    scene.add(&sheet(0.1), Material { double_sided: true, ..cut.clone() });
    scene.add(&sheet(0.3), Material { double_sided: true, ..cut });
    let wall = Mesh::quad([3.0, 0.0, 4.0], [0.0, 0.0, -8.0], [0.0, 3.0, 0.0]);
    scene.add(&wall, Material { unlit: true, double_sided: true, base_color: [1.0; 4], ..Material::default() });
    render(&scene, &path(64), 64, 0..64).assert_value("floor behind masks", expected);
    // The wall does shine for whoever looks at it.
    scene.cameras[0] = at_point([2.0, 2.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    render(&scene, &path(4), 4, 0..4).assert_value("unlit wall", 1.0);
}

/// What a scene does not need is left out of the program, and no bit of the picture tells.
#[test]
fn lean_programs_give_the_same_bits() {
    for scene in [room(None, glass_ball()), furnace(None, 0.5, 0.5)] {
        let lean = render(&scene, &path(16), 1, 0..2);
        let full = render(&scene, &Settings { full_program: true, ..path(16) }, 1, 0..2);
        assert!(lean.mean == full.mean, "lean and full programs differ");
        let other = render(&scene, &Settings { seed: 1, ..path(16) }, 1, 0..2);
        assert!(lean.mean != other.mean, "another seed must be noticed");
    }
}

/// An environment bright in one corner of the sky: irradiance by the midpoint rule over bilinear texels.
#[test]
fn environment_is_shared_by_both_strategies() {
    let (width, height) = (8usize, 8usize);
    let texel = |x: usize, y: usize| if (x, y) == (5, 1) { 40.0 } else { 0.2 + 0.1 * ((x + 2 * y) % 3) as f64 };
    let look_up = |u: f64, v: f64| {
        let (px, py) = (u * width as f64 - 0.5, (v * height as f64 - 0.5).clamp(0.0, height as f64 - 1.0));
        let (x, y) = (px.floor(), py.floor().min(height as f64 - 2.0));
        let (fx, fy) = (px - x, py - y);
        let column = |k: f64| (x + k).rem_euclid(width as f64) as usize;
        let row = |k: usize| texel(column(0.0), y as usize + k) * (1.0 - fx) + texel(column(1.0), y as usize + k) * fx;
        row(0) * (1.0 - fy) + row(1) * fy
    };
    let cells = 1000;
    let mut irradiance = 0.0;
    for (i, k) in (0..cells).flat_map(|i| (0..cells / 2).map(move |k| (i, k))) {
        let (u, v) = ((f64::from(i) + 0.5) / f64::from(cells), (f64::from(k) + 0.5) / f64::from(cells));
        let area = 2.0 * PI * PI / f64::from(cells * cells);
        irradiance += look_up(u, v) * (PI * v).cos() * (PI * v).sin() * area;
    }
    let floor = Mesh::quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]);
    let camera = at_point([0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]);
    let mut scene = Scene::from_parts(vec![(floor, Material::lambert([0.5; 3]))], vec![], camera);
    let radiance = (0..height).flat_map(|y| (0..width).map(move |x| [texel(x, y) as f32; 3])).collect();
    scene.environment = Some(Environment { width: width as u32, height: height as u32, radiance });
    render(&scene, &path(64), 64, 0..64).assert_value("floor under a sky", 0.5 / PI * irradiance);
}

/// A room with a coloured wall, a rough metal box and an object, lit by a square light or by the given one.
fn room(light: Option<Light>, object: (Mesh, Material)) -> Scene {
    let side = |corner, u, v, material| (Mesh::quad(corner, u, v), material);
    let white = Material::lambert([0.6; 3]);
    let (x, y) = ([4.0, 0.0, 0.0], [0.0, 4.0, 0.0]);
    let mut parts = vec![
        side([-2.0, 0.0, 2.0], x, [0.0, 0.0, -4.0], white.clone()),
        side([-2.0, 0.0, -2.0], x, y, Material::lambert([0.6, 0.3, 0.2])),
        side([-2.0, 0.0, 2.0], [0.0, 0.0, -4.0], y, white),
        (Mesh::cuboid([-1.5, 0.0, -1.2], [-0.3, 1.0, 0.0]), Material::metal([0.9, 0.7, 0.5], 0.5)),
        object,
    ];
    if light.is_none() {
        let lamp = Mesh::quad([-1.0, 3.9, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
        parts.push((lamp, Material::emitter([4.0; 3])));
    }
    let camera = Camera::look_at([0.6, 2.2, 6.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], 0.7);
    Scene::from_parts(parts, light.into_iter().collect(), camera)
}

fn glass_ball() -> (Mesh, Material) {
    (Mesh::sphere([0.9, 0.9, 0.0], 0.7, 24, 48), Material::glass(1.5))
}

#[test]
fn paths_agree_with_photons_of_small_footprints() {
    let paths = render(&room(None, glass_ball()), &path(32), 8, 0..192);
    let settings = Settings { method: Method::Photons, photons: Some(40_000), seed: 7, ..path(32) };
    // Late passes have small footprints: the bias is below the noise.
    let photons = render(&room(None, glass_ball()), &settings, 8, 1000..1064);
    println!("precision {} and {}", paths.precision(), photons.precision());
    let test = paths.against(&photons);
    println!("{test:?}");
    assert!(test.passed, "{test:?}");
    // Glass that reflects but does not let through loses the caustic: this must be noticed.
    let darker = Blocks { mean: paths.mean.iter().map(|x| 0.95 * x).collect(), error: paths.error.clone() };
    assert!(!darker.against(&photons).passed, "5 % must be noticed");
}

/// Direct light of a light without extent, and its first reflection, against the photons; with a lens.
#[test]
fn point_lights_and_lenses_agree() {
    let lamp = Light::Point { position: [0.5, 3.0, 1.0], intensity: [10.0; 3] };
    // Nothing of glass: paths would not see this light's caustic.
    let scene = room(Some(lamp), (Mesh::cuboid([0.2, 0.0, -0.7], [1.6, 1.4, 0.7]), Material::lambert([0.5; 3])));
    let lens = Some(Lens { radius: 0.2, focus: 5.0 });
    let paths = render(&scene, &Settings { lens, ..path(32) }, 8, 0..96);
    let settings = Settings { method: Method::Photons, photons: Some(40_000), lens, seed: 7, ..path(32) };
    let photons = render(&scene, &settings, 8, 1000..1064);
    let test = paths.against(&photons);
    println!("{test:?}; precision {} and {}", paths.precision(), photons.precision());
    assert!(test.passed, "{test:?}");
    let darker = Blocks { mean: paths.mean.iter().map(|x| 0.95 * x).collect(), error: paths.error.clone() };
    assert!(!darker.against(&photons).passed, "5 % must be noticed");
}

/// Mean of the green channel of a layer.
fn layer(scene: &Scene, settings: &Settings, names: [&str; 3], passes: std::ops::Range<u64>) -> [f64; 3] {
    let runtime = runtime();
    let mut session = Session::new(runtime.device(), scene.clone(), settings.clone()).expect("a session");
    passes.for_each(|index| session.run_pass(index).expect("a pass"));
    proof::ran(session.plan_text());
    let picture = session.picture().expect("a picture");
    names.map(|name| {
        let data = &picture.layer(name).expect("a layer").data;
        data.chunks(3).map(|pixel| f64::from(pixel[1])).sum::<f64>() / (data.len() / 3) as f64
    })
}

#[test]
fn layers_are_those_of_the_photons() {
    let names = ["direct", "caustic", "indirect"];
    let paths = layer(&room(None, glass_ball()), &Settings { layers: true, ..path(32) }, names, 0..256);
    let settings = Settings { layers: true, method: Method::Photons, photons: Some(40_000), ..path(32) };
    let photons = layer(&room(None, glass_ball()), &settings, names, 0..32);
    println!("{paths:?} and {photons:?}");
    for ((name, a), (b, tolerance)) in names.iter().zip(paths).zip(photons.iter().zip([0.02, 0.1, 0.03])) {
        assert!((a / b - 1.0).abs() < tolerance, "{name}: {a} by paths, {b} by photons");
    }
    assert!(paths[1] > 0.0 && paths[1] < 0.5 * paths[2], "caustics are a layer of their own");
    proof::by_answer(&["path_layers"]);
}

/// A photon render knows nothing of path tracing: its constants are off, its kernels not there.
#[test]
fn photons_plan_no_paths() {
    let runtime = runtime();
    let text = |settings| {
        Session::new(runtime.device(), room(None, glass_ball()), settings).expect("a session").plan_text().to_owned()
    };
    let photons = text(Settings { method: Method::Photons, photons: Some(1000), ..path(8) });
    assert!(!photons.contains("path_") && !photons.contains("path scatter"), "{photons}");
    let paths = text(path(8));
    assert!(paths.contains("path_scatter") && !paths.contains("photon_") && !paths.contains("gather_"), "{paths}");
}

/// The box of `../shared/scenes`, whose reference was made by other means. Blocks of 16 x 16 of a smaller picture; a
/// pixel of it is 2 x 2 of the reference.
#[test]
fn cornell_agrees_with_its_reference() {
    let Some(folder) = shared::path("scenes/cornell") else { return };
    let (reference, _) = exr::read(&folder.join("reference.exr")).expect("the reference");
    let scene = load(&folder.join("cornell.gltf"), &Limits::default()).expect("the scene");
    let cells = 8usize; // across
    let side = reference.width as usize / cells;
    let mut expected = vec![0.0; 3 * cells * cells];
    for (i, value) in reference.layer("").expect("beauty").data.iter().enumerate() {
        let (x, y, channel) = (i / 3 % reference.width as usize, i / 3 / reference.width as usize, i % 3);
        expected[3 * (y / side * cells + x / side) + channel] += f64::from(*value) / (side * side) as f64;
    }
    // Its noise is given as relMSE 4.9e-5, 0.7 % of a pixel; within a block at least a pixel in 16 is independent.
    let known: Vec<f64> = expected.iter().map(|x| 0.007 * x / (side as f64 / 4.0)).collect();
    let test = |scene: &Scene| {
        let found = render(scene, &path(128), 16, 0..80);
        println!("precision {}", found.precision());
        z_test(&found.mean, &found.error, &expected, &known, 0.01)
    };
    let right = test(&scene);
    println!("{right:?}");
    assert!(right.passed, "{right:?}");
    let mut wrong = scene;
    let brightest = (0..wrong.materials.len()).max_by_key(|m| (1e6 * wrong.materials[*m].base_color[2]) as u32);
    wrong.materials[brightest.expect("materials")].base_color.iter_mut().take(3).for_each(|c| *c *= 1.02);
    let failed = test(&wrong);
    println!("{failed:?}");
    assert!(!failed.passed, "2 % in one material must be noticed: {failed:?}");
}
