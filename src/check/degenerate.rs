//! Broken and empty scenes: cases 33, 40 and 41.

use std::path::Path;

use super::lab::{Lab, Shot, settings};
use super::scenes::{lamp, room};
use super::{Case, Within};
use crate::error::{Error, Result};
use crate::scene::shapes::Mesh;
use crate::scene::{self, Camera, Environment, Light, Limits, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 33,
        title: "triangles without area, needles, of size 10^-20, NaN",
        reason: "the picture without them, bit for bit; they are counted",
        parameter: None,
        run: triangles,
    },
    Case {
        number: 40,
        title: "no triangles, no lights, no photons; thin pictures; a camera inside glass",
        reason: "black or the background, exactly; n^2 inside glass in a sky of 1, as radiance over the squared index \
                 is constant along a ray",
        parameter: None,
        run: empty,
    },
    Case {
        number: 41,
        title: "albedo above 1, negative emission, NaN, a singular matrix in a file",
        reason: "clamped or skipped with a warning, and the picture is finite; strict reading refuses",
        parameter: None,
        run: out_of_range,
    },
];

fn triangle(corners: [[f32; 3]; 3]) -> Mesh {
    Mesh {
        positions: corners.to_vec(),
        normals: vec![[0.0, 1.0, 0.0]; 3],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    }
}

fn triangles(lab: &mut Lab) -> Result<()> {
    let small = settings(16, 12, 3_000);
    let clean = room(Material::lambert([0.5; 3]), vec![lamp()]);
    let expected = lab.shot(&clean, &small, 0..2)?;
    let bad = [
        [[0.0, 1.0, 0.0]; 3],
        [[0.0, 1.0, 0.0], [0.5, 1.0, 0.0], [1.0, 1.0, 0.0]],
        [[0.0; 3], [1e-20, 0.0, 0.0], [0.0, 1e-20, 0.0]],
        [[f32::NAN, 1.0, 0.0], [0.5, 1.0, 0.0], [0.0, 1.5, 0.0]],
        [[0.0, 1.0, 0.0], [0.5, f32::NAN, 0.0], [0.0, 1.5, 0.0]],
        [[0.0, 1.0, 0.0], [0.5, 1.0, f32::INFINITY], [0.0, 1.5, 0.0]],
        [[f32::NEG_INFINITY, 1.0, 0.0], [0.5, 1.0, 0.0], [0.0, 1.5, 0.0]],
    ];
    let count = bad.len() as f64;
    for (name, material) in [("emitters", Material::emitter([1.0; 3])), ("Lambert", Material::lambert([0.5; 3]))] {
        let mut scene = clean.clone();
        bad.iter().for_each(|corners| _ = scene.add(&triangle(*corners), material.clone()));
        let found = lab.shot(&scene, &small, 0..2)?;
        lab.found(format!("{name}: triangles left out"), f64::from(found.skipped), count, Within::Exact);
        lab.found(format!("{name}: lights"), f64::from(found.lights), f64::from(expected.lights), Within::Exact);
        lab.same(format!("{name}: picture"), &found.bits(), &expected.bits());
    }
    let mut mirrors = clean.clone();
    bad.iter().for_each(|corners| _ = mirrors.add(&triangle(*corners), Material::mirror()));
    let skipped = lab.shot(&mirrors, &small, 0..2)?.skipped;
    lab.found("mirrors: triangles left out", f64::from(skipped), count, Within::Exact);
    // A needle is no point: it is kept, and shines with what area it has.
    let mut scene = clean;
    let needle = triangle([[-1.0, 2.0, 0.0], [1.0, 2.0, 0.0], [1.0, 2.0, 1e-6]]).flipped();
    scene.add(&needle, Material::emitter([1e6; 3]));
    let found = lab.shot(&scene, &small, 0..2)?;
    lab.found("a needle left out", f64::from(found.skipped), 0.0, Within::Exact);
    lab.found("lights with it", f64::from(found.lights), 2.0, Within::Exact);
    Ok(())
}

fn view() -> Camera {
    Camera::look_at([0.0, 1.0, 3.0], [0.0; 3], [0.0, 1.0, 0.0], 0.8)
}

/// The brightest value of all layers of light.
fn brightest(shot: &Shot) -> f64 {
    let layers = ["", "direct", "indirect", "caustic"];
    layers.iter().flat_map(|layer| shot.red(layer)).map(f64::abs).fold(0.0, super::lab::worse)
}

fn black(lab: &mut Lab, what: &str, scene: &Scene) -> Result<()> {
    let shot = lab.shot(scene, &settings(8, 8, 1_000), 0..2)?;
    lab.found(format!("{what}: brightest value"), brightest(&shot), 0.0, Within::Exact);
    Ok(())
}

fn empty(lab: &mut Lab) -> Result<()> {
    black(lab, "nothing at all", &Scene::from_parts(vec![], vec![], view()))?;
    let sun = Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [1.0; 3] };
    black(lab, "lights alone", &Scene::from_parts(vec![], vec![lamp(), sun], view()))?;
    for (name, object) in
        [("Lambert", Material::lambert([0.5; 3])), ("mirror", Material::mirror()), ("glass", Material::glass(1.5))]
    {
        black(lab, &format!("no light on {name}"), &room(object, vec![]))?;
    }
    let mut dark = room(Material::mirror(), vec![Light::Point { position: [0.0, 2.0, 0.0], intensity: [0.0; 3] }]);
    dark.environment = Some(Environment::constant([0.0; 3]));
    black(lab, "lights of no power", &dark)?;
    let mut sky = Scene::from_parts(vec![], vec![], view());
    sky.environment = Some(Environment::constant([0.25, 0.5, 0.75]));
    let shot = lab.shot(&sky, &settings(8, 8, 1_000), 0..2)?;
    let background = shot.picture.layer("").map_or(&[][..], |layer| &layer.data);
    lab.holds("the background, exactly", background.chunks(3).all(|pixel| pixel == [0.25, 0.5, 0.75]));
    without_photons(lab)?;
    for (width, height) in [(1, 1), (1, 16_384), (16_384, 1)] {
        let shot = lab.shot(&room(Material::glass(1.5), vec![lamp()]), &settings(width, height, 500), 0..1)?;
        let pixels = shot.moments.len() as f64;
        lab.found(format!("{width} x {height}: pixels"), pixels, f64::from(width * height), Within::Exact);
    }
    inside_glass(lab)
}

/// Only direct light is left, and it is that of the render with photons.
fn without_photons(lab: &mut Lab) -> Result<()> {
    let scene = room(Material::glass(1.5), vec![lamp()]);
    let without = lab.shot(&scene, &settings(16, 12, 0), 0..2)?;
    lab.found("no photons: emitted", without.statistics.photons as f64, 0.0, Within::Exact);
    let other = without.red("indirect").iter().chain(&without.red("caustic")).map(|x| x.abs()).sum::<f64>();
    lab.found("no photons: other than direct light", other, 0.0, Within::Exact);
    let with = lab.shot(&scene, &settings(16, 12, 1_000), 0..2)?;
    lab.holds("no photons: direct light as with them", without.red("direct") == with.red("direct"));
    lab.holds("no photons: there is direct light", without.mean("direct") > 0.0);
    let one = lab.shot(&scene, &settings(16, 12, 1), 0..2)?;
    lab.found("one photon a pass", one.statistics.photons as f64, 2.0, Within::Exact);
    Ok(())
}

fn inside_glass(lab: &mut Lab) -> Result<()> {
    let mut scene = room(Material::lambert([0.5; 3]), vec![lamp()]);
    scene.add(&Mesh::sphere([1.5, 1.6, 3.0], 0.5, 24, 48), Material::glass(1.5));
    let shot = lab.shot(&scene, &settings(16, 12, 2_000), 0..2)?;
    lab.holds("a camera inside of glass sees the room", shot.mean("") > 0.0);
    let ball = Mesh::sphere([0.0, 1.0, 3.0], 0.5, 24, 48);
    let mut sky = Scene::from_parts(vec![(ball, Material::glass(1.5))], vec![], view());
    sky.environment = Some(Environment::constant([1.0; 3]));
    let shot = lab.shot(&sky, &settings(24, 24, 0), 0..8)?;
    lab.found("radiance inside of glass in a sky of 1", shot.mean(""), 2.25, Within::Part(0.01)).not(1.0);
    Ok(())
}

/// A triangle in a glTF file, with parts of it replaced.
fn file(material: &str, node: &str) -> String {
    // Positions (0,0,0), (1,0,0), (0,1,0) as little-endian floats.
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],
        "nodes":[{{"mesh":0}},{{"mesh":0{node}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "materials":[{{{material}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
        "min":[0,0,0],"max":[1,1,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{data}"}}]}}"#
    )
}

fn read(path: &Path, text: &str, strict: bool) -> Result<Scene> {
    std::fs::write(path, text).map_err(|source| Error::io(path, "write", source))?;
    scene::load(path, &Limits { strict, ..Limits::default() })
}

fn out_of_range(lab: &mut Lab) -> Result<()> {
    let folder = tempfile::tempdir().map_err(|source| Error::io(std::env::temp_dir(), "create a folder in", source))?;
    let path = folder.path().join("case.gltf");
    let colour = r#""pbrMetallicRoughness":{"baseColorFactor":[1.5,0.5,0.5,1]}"#;
    let clean = read(&path, &file("", ""), true)?.warnings.len() as f64;
    let singular = r#","matrix":[1,0,0,0, 0,0,0,0, 0,0,0,0, 0,0,0,1]"#;
    for (name, material, node) in [
        ("albedo 1.5", colour, ""),
        ("emission -1", r#""emissiveFactor":[-1,0,0]"#, ""),
        ("roughness 7", r#""pbrMetallicRoughness":{"roughnessFactor":7}"#, ""),
        ("singular matrix", "", singular),
    ] {
        let mut scene = read(&path, &file(material, node), false)?;
        lab.found(format!("{name}: warnings"), scene.warnings.len() as f64, clean + 1.0, Within::AtLeast);
        lab.holds(format!("{name}: strict reading refuses"), read(&path, &file(material, node), true).is_err());
        scene.lights = vec![lamp()];
        lab.shot(&scene, &settings(8, 8, 1_000), 0..2)?;
    }
    // By hand nothing is clamped: the scene says what is wrong with it.
    let damaged = |damage: &dyn Fn(&mut Scene)| {
        let mut scene = room(Material::lambert([0.5; 3]), vec![lamp()]);
        damage(&mut scene);
        scene.validate().is_err()
    };
    lab.holds("albedo 2 in memory is named", damaged(&|s| s.materials[0].base_color[0] = 2.0));
    lab.holds("emission -1 in memory is named", damaged(&|s| s.materials[0].emissive[0] = -1.0));
    lab.holds("a position that is NaN in memory is named", damaged(&|s| s.meshes[0].positions[0][0] = f32::NAN));
    // A texel of the sky that is not a number, as a map in memory can have it.
    let mut sky = Scene::from_parts(vec![], vec![], view());
    sky.add(&Mesh::quad([-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]), Material::lambert([0.5; 3]));
    let mut map = Environment { width: 4, height: 2, radiance: vec![[1.0; 3]; 8] };
    map.radiance[2] = [f32::NAN; 3];
    sky.environment = Some(map);
    // It is not like every render: what is not finite is counted here.
    let shot = Shot::take(lab.runtime().device(), &sky, &settings(8, 8, 1_000), 0..2)?;
    lab.holds("a texel of the sky that is NaN: the picture is finite", super::unfinished(&shot.picture).is_none());
    let counted = shot.statistics.rejected as f64;
    lab.found("a texel of the sky that is NaN: values counted as black", counted, 1.0, Within::AtLeast);
    Ok(())
}
