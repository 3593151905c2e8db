//! Light transport on tiny scenes with known answers: furnaces, equilibrium, and lights that stand for one another.
//!
//! `NEPHROID_TEST_DEVICE` and `NEPHROID_VALIDATE` as in the other device tests.

use nephroid::low_level::render::{Method, Session, Settings};
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{
    Alpha, Camera, Environment, Image, Light, Material, Scene, Texture, TextureRef, Wrap,
};

use crate::support::device::runtime;

/// Mean of the green channel over a small image; nothing may be rejected as not finite.
fn mean(scene: Scene, passes: u64, photons: u32) -> f64 {
    mean_with(scene, passes, Settings { photons: Some(photons), ..small() })
}

fn small() -> Settings {
    Settings { width: 24, height: 24, ..Settings::of(Method::Photons) }
}

/// First pass of the means: late ones have small footprints, so that the bias at edges is below the noise.
const FIRST: u64 = 256;

fn mean_with(scene: Scene, passes: u64, settings: Settings) -> f64 {
    let runtime = runtime();
    let pixels = f64::from(settings.pixels());
    let mut session = Session::new(runtime.device(), scene, settings).expect("a session");
    for index in FIRST..FIRST + passes {
        session.run_pass(index).expect("a pass");
    }
    let statistics = session.statistics().expect("counts");
    assert_eq!(statistics.rejected, 0, "pixels that are not finite");
    let sum: f64 = session.moments().expect("the film").iter().map(|m| m[1]).sum();
    sum / (pixels * passes as f64)
}

#[track_caller]
fn assert_near(what: &str, value: f64, expected: f64, tolerance: f64) {
    let error = value / expected - 1.0;
    println!("{what}: {value:.4}, expected {expected:.4} ({:+.2} %)", 100.0 * error);
    assert!(error.abs() <= tolerance, "{what}: {value}, expected {expected} within {tolerance}");
}

/// Radius of the shell around the furnaces.
const SHELL: f32 = 4.0;

/// A closed shell that emits 1 inwards and reflects `albedo`, with an object in its middle that fills the view.
fn furnace(object: Option<(Mesh, Material)>, albedo: f32, yfov: f32) -> Scene {
    let shell = Mesh::sphere([0.0; 3], SHELL, 16, 32).flipped();
    let wall = Material { emissive: [1.0; 3], double_sided: false, ..Material::lambert([albedo; 3]) };
    let camera = Camera::look_at([0.0, 0.4, 3.0], [0.0; 3], [0.0, 1.0, 0.0], yfov);
    let parts = std::iter::once((shell, wall)).chain(object).collect();
    Scene::from_parts(parts, vec![], camera)
}

fn ball() -> Mesh {
    Mesh::sphere([0.0; 3], 1.0, 24, 48)
}

fn plastic(roughness: f32) -> Material {
    Material { metallic: 0.0, roughness, double_sided: true, ..Material::default() }
}

fn rough_glass(roughness: f32) -> Material {
    Material { roughness, ..Material::glass(1.5) }
}

fn thin_sheet(roughness: f32) -> Material {
    Material { volume: false, ..rough_glass(roughness) }
}

/// Albedo of a ball in a furnace, seen under angles up to about 60 degrees.
fn albedo(material: Material, passes: u64) -> f64 {
    mean(furnace(Some((ball(), material)), 0.0, 0.5), passes, 1024)
}

/// The same at normal incidence.
fn normal_albedo(material: Material, passes: u64) -> f64 {
    mean(furnace(Some((ball(), material)), 0.0, 0.04), passes, 1024)
}

#[test]
fn lossless_objects_vanish_in_a_furnace() {
    assert_near("white", albedo(Material::lambert([1.0; 3]), 32), 1.0, 0.03);
    assert_near("mirror", albedo(Material::mirror(), 2), 1.0, 0.002);
    assert_near("sharp metal", albedo(Material::metal([1.0; 3], 0.2), 4), 1.0, 0.004);
    assert_near("glass", albedo(Material::glass(1.5), 4), 1.0, 0.005);
    assert_near("thin sheet", albedo(thin_sheet(0.0), 4), 1.0, 0.005);
    assert_near("glass of index 1", albedo(Material::glass(1.0), 1), 1.0, 0.001);
}

#[test]
fn rough_objects_lose_nothing() {
    for roughness in [0.5, 1.0] {
        let metal = Material::metal([1.0; 3], roughness);
        assert_near(&format!("metal {roughness}"), normal_albedo(metal, 48), 1.0, 0.04);
    }
    // A lobe that is both gathered and followed would add its albedo once more.
    for roughness in [0.2, 0.6] {
        assert_near(&format!("rough glass {roughness}"), normal_albedo(rough_glass(roughness), 16), 1.0, 0.01);
        assert_near(&format!("rough sheet {roughness}"), normal_albedo(thin_sheet(roughness), 16), 1.0, 0.01);
    }
    for roughness in [0.0, 0.4, 1.0] {
        assert_near(&format!("plastic {roughness}"), albedo(plastic(roughness), 32), 1.0, 0.03);
    }
}

/// In a closed shell of albedo 1/2 that emits 1 the radiance is 2 everywhere and in every direction, whatever lossless
/// thing stands in it: direct, caustic, global and followed light each bring a part, and only if every path is counted
/// once do they add up.
#[test]
fn equilibrium_counts_every_path_once() {
    let equilibrium = |object: Option<Material>| mean(furnace(object.map(|m| (ball(), m)), 0.5, 1.6), 6, 16384);
    assert_near("empty shell", equilibrium(None), 2.0, 0.015);
    assert_near("mirror", equilibrium(Some(Material::mirror())), 2.0, 0.015);
    assert_near("glass", equilibrium(Some(Material::glass(1.5))), 2.0, 0.015);
    assert_near("thin sheet", equilibrium(Some(thin_sheet(0.0))), 2.0, 0.015);
    assert_near("sharp metal", equilibrium(Some(Material::metal([1.0; 3], 0.25))), 2.0, 0.02);
    assert_near("gathered metal", equilibrium(Some(Material::metal([1.0; 3], 0.4))), 2.0, 0.02);
    assert_near("rough glass", equilibrium(Some(rough_glass(0.35))), 1.98, 0.025);
    assert_near("white ball", equilibrium(Some(Material::lambert([1.0; 3]))), 2.0, 0.02);
}

/// A closed shell of albedo 1/2 with a light in its middle: every bounce is uniform, so a wall that the light does not
/// reach has the radiance a^2 P / (4 pi^2 r^2 (1 - a)).
#[test]
fn photons_of_delta_lights_carry_their_power() {
    let wall = Mesh::sphere([0.0; 3], SHELL, 24, 48).flipped();
    let pi = std::f64::consts::PI;
    let area = 4.0 * pi * f64::from(SHELL) * f64::from(SHELL);
    let view = |lights| {
        let camera = Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 0.8);
        let parts = vec![(wall.clone(), Material::lambert([0.5; 3]))];
        mean(Scene::from_parts(parts, lights, camera), 12, 16384)
    };
    let point = view(vec![Light::Point { position: [0.0; 3], intensity: [10.0; 3] }]);
    assert_near("point", point, 4.0 * pi * 10.0 * 0.5 / (pi * area) / 0.5, 0.015);
    let (inner, outer) = (0.3f32, 0.9f32);
    let light = Light::Spot {
        position: [0.0; 3],
        direction: [0.0, 0.0, 1.0],
        intensity: [100.0; 3],
        inner_angle: inner,
        outer_angle: outer,
    };
    let (ci, co) = (f64::from(inner).cos(), f64::from(outer).cos());
    let power = 100.0 * 2.0 * pi * ((1.0 - ci) + (ci - co) / 3.0);
    assert_near("spot", view(vec![light]), power * 0.25 / (pi * area) / 0.5, 0.015);
}

/// A floor, a wall and an object; seen from above.
fn stage(object: Option<Material>, lights: Vec<Light>) -> Scene {
    let camera = Camera::look_at([0.0, 3.0, 4.0], [0.0, 0.3, 0.0], [0.0, 1.0, 0.0], 0.8);
    let mut parts = vec![
        (Mesh::quad([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0]), Material::lambert([0.7; 3])),
        (Mesh::quad([-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]), Material::lambert([0.7; 3])),
    ];
    parts.extend(object.map(|m| (Mesh::sphere([0.3, 0.7, 0.2], 0.5, 24, 48), m)));
    Scene::from_parts(parts, lights, camera)
}

/// Adds a small emitting sphere of the power of a point light of intensity 10.
fn with_small_sphere(mut scene: Scene, position: [f32; 3]) -> Scene {
    let radius = 0.02f32;
    let bulb = Mesh::sphere(position, radius, 16, 32);
    // A polyhedron of projected area a (a quarter of its surface) and radiance L has the mean intensity L a.
    let projected: f32 = bulb
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| glam::Vec3::from(bulb.positions[i as usize]));
            0.125 * (b - a).cross(c - a).length()
        })
        .sum();
    scene.add(&bulb, Material::emitter([10.0 / projected; 3]));
    scene
}

#[test]
fn lights_that_stand_for_one_another_agree() {
    let position = [-0.8, 3.4, 0.6]; // outside of the view
    for (name, object) in [("bare", None), ("glass", Some(Material::glass(1.5)))] {
        let point = stage(object.clone(), vec![Light::Point { position, intensity: [10.0; 3] }]);
        let sphere = with_small_sphere(stage(object, vec![]), position);
        let expected = mean(sphere, 64, 16384);
        assert_near(&format!("point against small sphere, {name}"), mean(point, 32, 16384), expected, 0.025);
    }
    let direction = [0.48f32, -0.8, -0.36];
    let far = direction.map(|x| -2000.0 * x);
    let sun = stage(Some(Material::glass(1.5)), vec![Light::Directional { direction, irradiance: [3.0; 3] }]);
    let point = stage(Some(Material::glass(1.5)), vec![Light::Point { position: far, intensity: [3.0 * 4e6; 3] }]);
    // A far point light must not spread its photons over the sphere: they would all miss. Direct light alone then.
    let direct = |scene| mean_with(scene, 8, Settings { photons: Some(0), ..small() });
    assert_near("sun against far point, direct", direct(sun), direct(point), 0.005);
}

/// A shadow ray ends before the lamp that it goes to, however small the lamp's triangles are and however far it is: its
/// picture depends on neither.
#[test]
fn the_cells_of_a_small_lamp_do_not_matter() {
    for (side, height) in [(0.04f32, 3.4f32), (0.001, 3.4), (0.04, 60.0)] {
        let lit = |cells: u32| {
            let mut scene = stage(None, vec![]);
            let corner = [-0.8, height, 0.6];
            let lamp = Mesh::grid(corner, [side, 0.0, 0.0], [0.0, 0.0, side], [cells, cells]);
            let radiance = 10.0 * (height / side) * (height / side);
            scene.add(&lamp, Material::emitter([radiance; 3]));
            mean_with(scene, 4, Settings { photons: Some(0), ..small() })
        };
        let whole = lit(1);
        assert!(whole > 0.1, "{whole}");
        for cells in [2, 3, 16] {
            assert_near(&format!("a lamp of {side} at {height} in {cells} parts"), lit(cells), whole, 0.001);
        }
    }
}

/// Radiance [1/(sr m^2)] of a floor of albedo 1 straight below a spot light, at an angle to its axis.
fn spot_floor(angle: f32) -> f64 {
    let floor = Mesh::quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]);
    let light = Light::Spot {
        position: [0.0, 2.0, 0.0],
        direction: [angle.sin(), -angle.cos(), 0.0],
        intensity: [4.0; 3],
        inner_angle: 0.2,
        outer_angle: 0.6,
    };
    let camera = Camera::look_at([0.0, 1.0, 0.0], [0.0; 3], [0.0, 0.0, -1.0], 0.002);
    let scene = Scene::from_parts(vec![(floor, Material::lambert([1.0; 3]))], vec![light], camera);
    mean_with(scene, 1, Settings { photons: Some(0), ..small() })
}

#[test]
fn spot_falls_off_as_the_extension_recommends() {
    let full = 1.0 / std::f64::consts::PI;
    assert_near("inside of the inner cone", spot_floor(0.1), full, 0.001);
    let t = (0.4f64.cos() - 0.6f64.cos()) / (0.2f64.cos() - 0.6f64.cos());
    assert_near("between the cones", spot_floor(0.4), full * t * t, 0.005);
    assert_eq!(spot_floor(0.7), 0.0);
}

#[test]
fn a_constant_environment_equals_a_closed_emitter() {
    let sky = Environment { width: 8, height: 4, radiance: vec![[1.0; 3]; 32] };
    for (name, object) in [("white", plastic(0.5)), ("glass", Material::glass(1.5))] {
        let mut environment = stage(Some(object.clone()), vec![]);
        environment.environment = Some(sky.clone());
        let mut closed = stage(Some(object), vec![]);
        closed.add(&Mesh::sphere([0.0; 3], 7.0, 16, 32).flipped(), Material::emitter([1.0; 3]));
        let expected = mean(closed, 24, 65536);
        assert_near(&format!("environment, {name}"), mean(environment, 24, 16384), expected, 0.02);
    }
}

/// A lamp above the stage: the left half of it shines, by geometry, by a texture, or by an alpha mask.
fn half_lamp(how: usize) -> Scene {
    let mut scene = stage(None, vec![]);
    let width = if how == 0 { 0.5 } else { 1.0 };
    // From below: its front faces down.
    let lamp = Mesh::quad([-0.5, 2.0, -0.5], [width, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let texture = TextureRef { texture: 0, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
    let mut material = Material::emitter([5.0; 3]);
    match how {
        1 => material.emissive_texture = Some(texture),
        2 => (material.base_color_texture, material.alpha) = (Some(texture), Alpha::Mask(0.5)),
        _ => {}
    }
    scene.images.push(Image { width: 2, height: 1, rgba: vec![[255; 4], [0; 4]] });
    scene.textures.push(Texture { image: 0, wrap: [Wrap::Clamp; 2], linear: false });
    scene.add(&lamp, material);
    scene
}

#[test]
fn half_of_a_lamp_is_half_of_a_lamp() {
    let expected = mean(half_lamp(0), 72, 8192);
    assert_near("emissive texture", mean(half_lamp(1), 72, 8192), expected, 0.025);
    assert_near("alpha mask", mean(half_lamp(2), 72, 8192), expected, 0.025);
}

/// Geometry times a power of two, with emission unchanged: the same bits.
#[test]
fn scale_changes_no_bit() {
    let render = |scale: f32| {
        let mut scene = furnace(Some((ball(), Material::glass(1.5))), 0.5, 1.2);
        scene.meshes.iter_mut().flat_map(|m| &mut m.positions).for_each(|p| *p = p.map(|x| x * scale));
        scene.cameras[0].position = scene.cameras[0].position.map(|x| x * scale);
        let runtime = runtime();
        let settings = Settings { photons: Some(4096), ..small() };
        let mut session = Session::new(runtime.device(), scene, settings).expect("a session");
        session.run_pass(0).expect("a pass");
        session.moments().expect("the film")
    };
    let reference = render(1.0);
    assert!(reference == render(1024.0), "larger");
    assert!(reference == render(2f32.powi(-20)), "smaller");
    assert!(reference != render(1.01), "the check can fail");
}
