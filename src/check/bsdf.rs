//! Scattering: cases 17, 20 and 54.

use glam::DVec3;

use super::lab::{Lab, settings};
use super::scenes::{floor, from_above, parallel, sun};
use super::{Case, Within};
use crate::error::Result;
use crate::kernels::lobes::Opaque;
use crate::render::{Method, Settings};
use crate::scene::shapes::Mesh;
use crate::scene::{Environment, Image, Material, Scene, Texture, TextureRef, Wrap};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 17,
        title: "roughness 1 ... 0: GGX tends to the mirror",
        reason: "GGX by quadrature in double precision; 10^-4 and 0 agree to 2 %",
        parameter: Some("roughness"),
        run: roughness,
    },
    Case {
        number: 20,
        title: "white furnace and reciprocity of every lobe",
        reason: "albedo at most 1, three deviations of its mean are below 1e-3; both ways by shadow rays, exact but \
                 for rounding",
        parameter: Some("degrees from the normal"),
        run: furnaces,
    },
    Case {
        number: 54,
        title: "textures of roughness and transmission that jump from 0 to 1",
        reason: "the mean of the two renders, as each texel is one of them",
        parameter: None,
        run: jumping_textures,
    },
];

/// A plate of 2 x 2 units that a parallel camera sees at `angle` from its normal.
fn tilted(material: Material, angle: f64, view: f32) -> Scene {
    let (sine, cosine) = angle.sin_cos();
    let camera = parallel(
        [2.0 * sine as f32, 2.0 * cosine as f32, 0.0],
        [-sine as f32, -cosine as f32, 0.0],
        [-cosine as f32, sine as f32, 0.0],
        view,
    );
    Scene::from_parts(vec![(floor(1.0, 0.0), material)], vec![], camera)
}

/// What a white GGX surface shows of a square emitter of radiance 1 and side 2 `half` around `middle`, by the midpoint
/// rule.
fn reflected_square(alpha: f64, wo: DVec3, middle: DVec3, half: f64) -> f64 {
    let metal = Opaque { metallic: 1.0, base: 1.0, coat: [0.0; 2], alpha };
    let in_frame = |w: DVec3| DVec3::new(w.z, w.x, w.y);
    let cells = 400;
    let place = |k: i32| ((f64::from(k) + 0.5) / f64::from(cells) * 2.0 - 1.0) * half;
    let area = (2.0 * half / f64::from(cells)).powi(2);
    let one = |i: i32, j: i32| {
        let to = middle + DVec3::new(place(i), 0.0, place(j));
        let wi = to.normalize();
        metal.bsdf(in_frame(wo), in_frame(wi)) * wi.y * wi.y / to.length_squared() * area
    };
    (0..cells * cells).map(|k| one(k % cells, k / cells)).sum()
}

/// A metal plate under a square lamp that faces down; the camera sees the mirror image of the lamp's rim.
fn under_square(roughness: f32, angle: f64) -> Scene {
    let mut scene = tilted(Material::metal([1.0; 3], roughness), angle, 1e-3);
    let middle = -2.0 * angle.tan() + 0.25;
    let corner = [middle as f32 - 0.25, 2.0, 0.25];
    let lamp = Mesh::quad(corner, [0.5, 0.0, 0.0], [0.0, 0.0, -0.5]).flipped();
    scene.add(&lamp, Material::emitter([1.0; 3]));
    scene
}

fn roughness(lab: &mut Lab) -> Result<()> {
    let angle = 0.5f64;
    let wo = DVec3::new(angle.sin(), angle.cos(), 0.0);
    let middle = DVec3::new(-2.0 * angle.tan() + 0.25, 2.0, 0.0);
    for roughness in [1.0f64, 0.5, 0.2] {
        let passes = lab.pick(64, 256);
        let path = Settings { method: Method::Path, ..settings(16, 16, 0) };
        let shot = lab.shot(&under_square(roughness as f32, angle), &path, 0..passes)?;
        let expected = reflected_square(roughness * roughness, wo, middle, 0.25);
        let what = format!("lamp's rim in a metal of roughness {roughness}");
        lab.found(what, shot.mean(""), expected, Within::Part(0.03)).at(roughness);
    }
    // The mirror shows the rim sharply: half of the pixels see the lamp.
    let take = |lab: &mut Lab, roughness: f32| -> Result<Vec<f64>> {
        let mut scene = under_square(roughness, angle);
        scene.cameras[0] = tilted(Material::mirror(), angle, 0.2).cameras.swap_remove(0);
        Ok(lab.shot(&scene, &settings(16, 16, 0), 0..lab.pick(16, 64))?.red(""))
    };
    let mirror = take(lab, 0.0)?;
    let lit = mirror.iter().sum::<f64>() / 256.0;
    lab.found("part of the mirror that shows the lamp", lit, 0.5, Within::Range(0.35)).at(1e-6);
    for roughness in [1e-4f64, 1e-2] {
        let rough = take(lab, roughness as f32)?;
        let off = rough.iter().zip(&mirror).map(|(a, b)| (a - b).abs()).sum::<f64>() / 256.0 / lit;
        let what = format!("roughness {roughness}: mean difference to the mirror");
        lab.found(what, off, 0.02, Within::AtMost).at(roughness);
    }
    Ok(())
}

fn lobes() -> Vec<(&'static str, Material)> {
    let coated = |roughness: f32| Material { roughness, specular: 1.0, ..Material::lambert([1.0; 3]) };
    vec![
        ("Lambert", Material::lambert([1.0; 3])),
        ("metal 0.4", Material::metal([1.0; 3], 0.4)),
        ("metal 1", Material::metal([1.0; 3], 1.0)),
        ("coat 0", coated(0.0)),
        ("coat 0.4", coated(0.4)),
        ("coat 1", coated(1.0)),
        ("glass 0", Material { volume: false, ..Material::glass(1.5) }),
        ("glass 0.5", Material { volume: false, roughness: 0.5, ..Material::glass(1.5) }),
    ]
}

fn furnaces(lab: &mut Lab) -> Result<()> {
    let angles: &[f64] = lab.pick(&[10.0, 75.0], &[0.0, 30.0, 60.0, 75.0, 85.0, 89.0]);
    for (name, material) in lobes() {
        for &degrees in angles {
            let mut scene = tilted(material.clone(), degrees.to_radians(), 1e-3);
            scene.environment = Some(Environment::constant([1.0; 3]));
            let path = Settings { method: Method::Path, photon_bounces: 3, eye_depth: 3, ..settings(24, 24, 0) };
            let shot = lab.shot(&scene, &path, 0..lab.pick(16, 64))?;
            let what = format!("{name} at {degrees} degrees: albedo");
            let noise = 3.0 * deviation(&shot.moments);
            lab.found(what, shot.mean(""), 1.001 + noise, Within::AtMost).at(degrees);
        }
    }
    for (name, material) in lobes().into_iter().filter(|(name, _)| !name.contains("glass") && !name.ends_with(" 0")) {
        for (from, to) in [(20.0, 70.0), (0.0, 85.0)] {
            let direction = |degrees: f64, z: f64| {
                let (sine, cosine) = degrees.to_radians().sin_cos();
                DVec3::new(sine, cosine, z).normalize()
            };
            let (a, b) = (direction(from, 0.4), direction(to, 0.0));
            let one = scattered(lab, &material, a, b)?;
            let other = scattered(lab, &material, b, a)?;
            lab.found(format!("{name}: {from} to {to} degrees and back"), one, other, Within::Part(1e-4)).at(to);
        }
    }
    Ok(())
}

/// Standard deviation of the mean of a picture, by that of its pixels.
fn deviation(moments: &[[f64; 9]]) -> f64 {
    let n = moments.len() as f64;
    let mean = moments.iter().map(|m| m[0]).sum::<f64>() / n;
    let squares = moments.iter().map(|m| (m[0] - mean).powi(2)).sum::<f64>();
    if mean > 0.0 { (squares / (n - 1.0) / n).sqrt() / mean } else { 0.0 }
}

/// What a camera sees from the direction `eye` of light from the direction `light`, over the light's cosine: the BSDF.
fn scattered(lab: &mut Lab, material: &Material, light: DVec3, eye: DVec3) -> Result<f64> {
    let vector = |v: DVec3| v.as_vec3().to_array();
    let camera = parallel(vector(2.0 * eye), vector(-eye), [0.0, 0.0, 1.0], 1e-3);
    let scene = Scene::from_parts(vec![(floor(1.0, 0.0), material.clone())], vec![sun(vector(-light))], camera);
    let shot = lab.shot(&scene, &settings(4, 4, 0), 0..1)?;
    Ok(shot.mean("direct") / light.y)
}

fn jumping_textures(lab: &mut Lab) -> Result<()> {
    // Texels of a chess board in green (roughness) and blue (metal), and in red (transmission).
    let board = |dark: [u8; 4], light: [u8; 4]| Image {
        width: 8,
        height: 8,
        rgba: (0..64u32).map(|i| if (i % 8 + i / 8) % 2 == 0 { dark } else { light }).collect(),
    };
    let plate = |metallic_roughness: Option<Image>, transmission: Option<Image>, material: Material| {
        let camera = from_above([0.0, 2.0, 0.0], 1.0);
        let mut scene = Scene::from_parts(vec![], vec![], camera);
        let mut texture = |image: Image| {
            scene.images.push(image);
            let image = scene.images.len() as u32 - 1;
            scene.textures.push(Texture { image, wrap: [Wrap::Repeat; 2], linear: false });
            TextureRef { texture: image, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] }
        };
        let material = Material {
            metallic_roughness_texture: metallic_roughness.map(&mut texture),
            transmission_texture: transmission.map(&mut texture),
            ..material
        };
        scene.add(&floor(1.0, 0.0), material);
        // Half of the sky: what a rough surface sees of it is not what a mirror sees.
        scene.environment = Some(super::scenes::sky(8, 4, |_, y| if y == 0 { 1.0 } else { 0.1 }));
        scene
    };
    let metal = |roughness: f32| Material::metal([0.9; 3], roughness);
    let glass = |transmission: f32| Material { transmission, volume: false, ..Material::glass(1.5) };
    let mut take = |scene: &Scene| -> Result<f64> {
        let path = Settings { method: Method::Path, ..settings(64, 64, 0) };
        Ok(lab.shot(scene, &path, 0..lab.pick(8, 32))?.mean(""))
    };
    let rough = board([255, 0, 255, 255], [255, 255, 255, 255]);
    let [smooth_metal, rough_metal] = [take(&plate(None, None, metal(0.0)))?, take(&plate(None, None, metal(1.0)))?];
    let jumping_metal = take(&plate(Some(rough), None, metal(1.0)))?;
    let clear = board([0, 0, 0, 255], [255, 0, 0, 255]);
    let [opaque, open] = [take(&plate(None, None, glass(0.0)))?, take(&plate(None, None, glass(1.0)))?];
    let jumping_glass = take(&plate(None, Some(clear), glass(1.0)))?;
    let mean = 0.5 * (smooth_metal + rough_metal);
    lab.found("roughness 0 and 1", jumping_metal, mean, Within::Part(0.02)).not(smooth_metal);
    let mean = 0.5 * (opaque + open);
    lab.found("transmission 0 and 1", jumping_glass, mean, Within::Part(0.02)).not(open);
    Ok(())
}
