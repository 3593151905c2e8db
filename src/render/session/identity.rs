//! What determines the passes of a render, so that films of the same one can be told from others.

use std::fmt::{self, Debug, Write};

use sha2::{Digest, Sha256};

use super::moving::is_blurred;
use crate::film::film_file::{Identity, hex};
use crate::kernels::photon::Footprint;
use crate::render::settings::{Lens, Sampling, Settings, Shutter, Tracer, TreeBuild};
use crate::scene::{Environment, Image, Instance, Mesh, Scene};

/// The scene's content and every setting that a pass depends on, as the user would name them.
///
/// Content is what was loaded, not the bytes of the files: a copy in another folder is the same scene. What the session
/// chooses by itself (leaf size, estimator) is called `automatic`: on one device it is the same each time.
pub fn identity(scene: &Scene, settings: &Settings) -> Identity {
    let mut named: Vec<(&str, String)> = settings_as_text(&settings.clone().resolved());
    let (mut opened, shutter) = (None, settings.shutter.filter(|_| is_blurred(scene, settings)));
    if let Some(Shutter { open, close }) = shutter {
        // The keys count as well: what moves while the shutter is open is not seen in the scene as it is.
        named.push(("shutter", format!("{open} s to {close} s")));
        named.push(("motion", scene.motion.as_ref().map_or_else(String::new, |motion| debug_hash(motion))));
        let mut scene = scene.clone();
        scene.move_to(open);
        opened = Some(scene);
    }
    let settings = named.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    Identity { scene: scene_hash(opened.as_ref().unwrap_or(scene)), settings }
}

/// All fields by name, so that a new one has to be judged here.
fn settings_as_text(settings: &Settings) -> Vec<(&'static str, String)> {
    let Settings {
        width,
        height,
        camera,
        lens,
        // Where nothing moves it makes no difference.
        shutter: _,
        seed,
        method,
        tracer,
        photons: _,
        estimator,
        knn_photons,
        sampling,
        weight,
        footprint,
        largest_footprint,
        fold,
        record,
        blinn_phong,
        layers,
        eye_depth,
        photon_bounces,
        caustic_smoothing,
        global_smoothing,
        alpha,
        photon_build,
        tree_build,
        leaf_photons,
        bound_vertices,
        amplification,
        full_program,
        lambert_estimate,
        // Measurements: they change no pass.
        count_work: _,
        count_pairs: _,
        read_photons: _,
    } = settings;
    let automatic = |value: Option<String>| value.unwrap_or_else(|| "automatic".into());
    let mut text = vec![
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("size", format!("{width}x{height}")),
        ("camera", camera.to_string()),
        ("lens", lens.map_or("none".into(), |Lens { radius, focus }| format!("radius {radius} focus {focus}"))),
        ("seed", seed.to_string()),
        ("method", format!("{method:?}")),
        ("photons", settings.photon_count().to_string()),
        ("layers", if *layers { "yes" } else { "no" }.into()),
        ("estimator", automatic(estimator.map(|estimator| estimator.name().to_owned()))),
        ("sampling", sampling_as_text(*sampling)),
        ("footprint", footprint_as_text(*footprint)),
        ("largest footprint", largest_footprint.to_string()),
        ("folds", fold.to_string()),
        ("kernel", format!("{weight:?}")),
        ("caustic smoothing", caustic_smoothing.to_string()),
        ("global smoothing", global_smoothing.to_string()),
        ("radius exponent", alpha.to_string()),
        ("eye depth", eye_depth.to_string()),
        ("photon bounces", photon_bounces.to_string()),
        ("knn photons", knn_photons.to_string()),
        ("photon record", format!("{record:?}")),
        ("photon build", format!("{photon_build:?}")),
        ("leaf photons", automatic(leaf_photons.map(|n| n.to_string()))),
        ("bounds vertices", bound_vertices.to_string()),
        ("bounds stage", format!("{amplification:?}")),
        ("Blinn-Phong", blinn_phong.to_string()),
        ("full program", full_program.to_string()),
        ("Lambert estimate", lambert_estimate.to_string()),
    ];
    // Films from before there was a choice go on.
    text.extend((*tracer != Tracer::Tree).then(|| ("tracer", format!("{tracer:?}"))));
    // All builders but the first give the same passes.
    text.extend((*tree_build != TreeBuild::Sah).then(|| ("order of lights", "scene".into())));
    text
}

fn sampling_as_text(sampling: Sampling) -> String {
    format!("{sampling:?}")
}

fn footprint_as_text(footprint: Footprint) -> String {
    format!("{footprint:?}")
}

/// SHA-256 of a debug text, in which a number is exact.
fn debug_hash(value: &dyn Debug) -> String {
    struct Text(Sha256);
    impl fmt::Write for Text {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            self.0.update(text.as_bytes());
            Ok(())
        }
    }
    let mut text = Text(Sha256::new());
    // Hashing never fails.
    let _ = write!(text, "{value:?}");
    hex(&text.0.finalize())
}

/// SHA-256 of everything in a scene that can be seen or shines.
fn scene_hash(scene: &Scene) -> String {
    // Names, warnings and counts of what was left out are not part of the picture.
    let Scene { path: _, files: _, meshes, instances, materials, images, textures, lights, .. } = scene;
    let Scene { environment, cameras, warnings: _, skipped: _, .. } = scene;
    let mut hash = Sha256::new();
    // Lengths stand before contents, so that no two scenes give the same bytes.
    let mut add = |bytes: &[u8]| {
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
    };
    for Mesh { name: _, positions, normals, tangents, uvs, colors, triangles, material } in meshes {
        add(bytemuck::cast_slice(positions));
        add(bytemuck::cast_slice(normals));
        add(bytemuck::cast_slice(tangents));
        uvs.iter().for_each(|set| add(bytemuck::cast_slice(set)));
        add(bytemuck::cast_slice(colors));
        add(bytemuck::cast_slice(triangles));
        add(&material.0.to_le_bytes());
    }
    for Instance { name: _, mesh, transform, visible } in instances {
        add(format!("{mesh:?} {transform:?} {visible}").as_bytes());
    }
    for Image { width, height, rgba } in images {
        add(format!("{width}x{height}").as_bytes());
        add(bytemuck::cast_slice(rgba));
    }
    if let Some(Environment { width, height, radiance }) = environment {
        add(format!("{width}x{height}").as_bytes());
        add(bytemuck::cast_slice(radiance));
    }
    // Debug text of a number is exact, and has every field, also those that are yet to come.
    add(format!("{materials:?} {textures:?} {lights:?} {cameras:?}").as_bytes());
    hex(&hash.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::settings::Method;
    use crate::scene::{Camera, Material, Projection, Transform};

    fn scene() -> Scene {
        let projection = Projection::Perspective { yfov: 0.7, aspect: None };
        let camera = Camera {
            name: "front".into(),
            position: [0.0, 1.0, 4.0],
            right: [1.0, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            forward: [0.0, 0.0, -1.0],
            projection,
        };
        let mesh = Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        Scene::from_parts(vec![(mesh, Material::default())], vec![], camera)
    }

    #[test]
    fn whatever_can_be_seen_changes_the_hash_and_nothing_else_does() {
        let same = Scene { path: "b.glb".into(), warnings: vec!["w".into()], ..scene() };
        assert_eq!(scene_hash(&scene()), scene_hash(&same));
        let mut hashes = vec![scene_hash(&scene())];
        let mut changed = |change: fn(&mut Scene)| {
            let mut scene = scene();
            change(&mut scene);
            hashes.push(scene_hash(&scene));
        };
        changed(|s| s.meshes[0].positions[1][0] = 1.000_000_1);
        changed(|s| s.meshes[0].uvs[0] = vec![[0.0; 2]; 3]);
        changed(|s| s.meshes[0].uvs[1] = vec![[0.0; 2]; 3]);
        changed(|s| s.instances[0].transform = Some(Transform::IDENTITY));
        changed(|s| s.instances[0].transform = Some(Transform::translation([0.0, 0.0, 1e-300])));
        changed(|s| s.instances[0].visible = false);
        changed(|s| s.instances.clear());
        changed(|s| s.materials[0].roughness = 0.999_999_94);
        changed(|s| s.cameras[0].position[0] = 1e-30);
        changed(|s| s.images = vec![Image { width: 1, height: 2, rgba: vec![[0; 4]; 2] }]);
        changed(|s| s.images = vec![Image { width: 2, height: 1, rgba: vec![[0; 4]; 2] }]);
        changed(|s| s.environment = Some(Environment { width: 1, height: 2, radiance: vec![[0.0; 3]; 2] }));
        changed(|s| s.environment = Some(Environment { width: 1, height: 2, radiance: vec![[-0.0; 3]; 2] }));
        let count = hashes.len();
        hashes.sort();
        hashes.dedup();
        assert_eq!(hashes.len(), count);
    }

    #[test]
    fn the_first_setting_that_differs_is_named() {
        let of = |settings: Settings| identity(&scene(), &settings);
        let base = of(Settings::default());
        assert_eq!(base.difference(&of(Settings { count_work: true, ..Settings::default() })), None);
        let photons = || Settings::of(Method::Photons);
        assert_eq!(of(photons()).difference(&of(Settings { count_pairs: true, ..photons() })), None);
        // What only photons have is rendered by these.
        let method = base.difference(&of(Settings { blinn_phong: true, ..Settings::default() })).expect("another");
        assert_eq!((method.name.as_str(), method.theirs.as_str()), ("method", "Photons"));
        let explicit = Settings { photons: Some(Settings::default().photon_count()), ..Settings::default() };
        assert_eq!(base.difference(&of(explicit)), None, "the default, said aloud");
        let differs = |settings: Settings| base.difference(&of(settings)).expect("another render");
        let seed = differs(Settings { seed: 1, alpha: 0.5, ..Settings::default() });
        assert_eq!((seed.name.as_str(), seed.ours.as_str(), seed.theirs.as_str()), ("seed", "0", "1"));
        assert_eq!(differs(Settings { width: 8, ..Settings::default() }).theirs, "8x480");
        let lens = Some(Lens { radius: 0.5, focus: 2.0 });
        assert_eq!(differs(Settings { lens, ..Settings::default() }).theirs, "radius 0.5 focus 2");
        let mut other = scene();
        other.materials[0].metallic = 0.0;
        assert_eq!(base.difference(&identity(&other, &Settings::default())).expect("another scene").name, "scene");
    }
}
