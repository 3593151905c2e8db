//! Loads the sample models and damaged files of the shared folder, where there is one.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use nephroid::low_level::picture::exr;
use nephroid::low_level::scene::{Environment, EnvironmentFile, Limits, Scene, World, load, load_with_environment};

use crate::support::shared;

/// All files below a folder, in a fixed order.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    entries.sort();
    entries.into_iter().flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "gltf" || e == "glb")
}

/// What every loaded scene promises to the renderer.
fn check(scene: &Scene, path: &Path) {
    scene.validate().unwrap_or_else(|fault| panic!("{fault}"));
    check_world(scene, &World::of(scene), path);
}

fn check_world(scene: &Scene, world: &World, path: &Path) {
    let at = path.display();
    let count = world.positions.len();
    assert_eq!(world.normals.len(), count, "{at}");
    for optional in [world.tangents.len(), world.colors.len(), world.uvs[0].len(), world.uvs[1].len()] {
        assert!(optional == 0 || optional == count, "{at}: {optional} attributes for {count} vertices");
    }
    assert_eq!(world.material.len(), world.triangles.len(), "{at}");
    assert!(world.triangles.iter().flatten().all(|&i| (i as usize) < count), "{at}");
    assert!(world.material.iter().all(|&m| (m as usize) < scene.materials.len()), "{at}");
    assert!(world.positions.iter().flatten().all(|x| x.is_finite()), "{at}");
    let length = |v: &[f32]| v.iter().map(|x| x * x).sum::<f32>().sqrt();
    assert!(world.normals.iter().all(|n| (length(n) - 1.0).abs() < 1e-5), "{at}");
    assert!(world.tangents.iter().all(|t| (length(&t[..3]) - 1.0).abs() < 1e-5 && t[3].abs() == 1.0), "{at}");
    let refs = || scene.materials.iter().flat_map(|m| m.texture_refs());
    assert!(refs().all(|r| (r.texture as usize) < scene.textures.len()), "{at}");
    assert!(refs().all(|r| world.uvs[r.uv_set as usize].len() == count), "{at}");
    assert!(scene.textures.iter().all(|t| (t.image as usize) < scene.images.len()), "{at}");
    for image in &scene.images {
        assert_eq!(image.rgba.len(), image.width as usize * image.height as usize, "{at}");
    }
    assert!(!scene.materials.is_empty() && !scene.cameras.is_empty() && scene.has_light(), "{at}");
}

#[test]
fn sample_models_load() {
    let folders = ["assets/khronos", "assets/scenes", "scenes"].map(shared::path);
    let [Some(khronos), Some(scenes), Some(ours)] = folders else { return };
    let limits = Limits::default();
    let mut count = 0;
    for folder in [khronos, scenes, ours] {
        for path in files(&folder).iter().filter(|p| is_scene(p)) {
            let started = std::time::Instant::now();
            let scene = load(path, &limits).unwrap_or_else(|e| panic!("{e}"));
            check(&scene, path);
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            println!(
                "{name}: {} triangles, {:?}, {:?}",
                World::of(&scene).triangles.len(),
                started.elapsed(),
                scene.warnings
            );
            count += 1;
        }
    }
    assert!(count >= 60, "only {count} models were found");
}

#[test]
fn the_check_finds_damage() {
    let Some(path) = shared::path("assets/khronos/BoxVertexColors/BoxVertexColors.gltf") else { return };
    let whole = load(&path, &Limits::default()).unwrap();
    let sabotage: [fn(&mut Scene, &mut World); 5] = [
        |_, w| w.positions[0][0] = f32::NAN,
        |_, w| w.normals[0] = [2.0, 0.0, 0.0],
        |_, w| w.triangles[0][0] = 1 << 20,
        |_, w| w.colors.truncate(1),
        |s, _| s.cameras.clear(),
    ];
    for damage in sabotage {
        let (mut scene, mut world) = (whole.clone(), World::of(&whole));
        damage(&mut scene, &mut world);
        assert!(catch_unwind(AssertUnwindSafe(|| check_world(&scene, &world, &path))).is_err());
    }
}

/// A copy of a binary glTF file whose meshes have lost an attribute; the name is overwritten in place.
fn without(path: &Path, attribute: &str, folder: &Path) -> PathBuf {
    let mut bytes = std::fs::read(path).unwrap();
    let (name, hidden) = (format!("\"{attribute}\""), format!("\"_{}\"", &attribute[1..]));
    let places: Vec<usize> =
        (0..bytes.len() - name.len()).filter(|&i| bytes[i..].starts_with(name.as_bytes())).collect();
    assert!(!places.is_empty());
    for at in places {
        bytes[at..at + name.len()].copy_from_slice(hidden.as_bytes());
    }
    let copy = folder.join("without.glb");
    std::fs::write(&copy, bytes).unwrap();
    copy
}

#[test]
fn generated_tangents_agree_with_those_of_the_file() {
    let Some(path) = shared::path("assets/khronos/NormalTangentMirrorTest/NormalTangentMirrorTest.glb") else { return };
    let folder = tempfile::tempdir().unwrap();
    let given = load(&path, &Limits::default()).unwrap();
    let made = load(&without(&path, "TANGENT", folder.path()), &Limits::default()).unwrap();
    let (given, made) = (World::of(&given), World::of(&made));
    let pairs: Vec<_> = given.tangents.iter().zip(&made.tangents).collect();
    let agree = |a: &[f32; 4], b: &[f32; 4]| (0..3).map(|k| a[k] * b[k]).sum::<f32>() > 0.95 && a[3] == b[3];
    let good = pairs.iter().filter(|(a, b)| agree(a, b)).count();
    let flipped = pairs.iter().filter(|(a, b)| agree(&a.map(|x| -x), b)).count();
    println!("{good} of {} tangents agree, {flipped} are opposite", pairs.len());
    assert!(given.tangents.iter().any(|t| t[3] < 0.0) && given.tangents.iter().any(|t| t[3] > 0.0));
    assert!(good * 100 >= pairs.len() * 97 && flipped * 100 < pairs.len());
}

#[test]
fn environment_maps_load() {
    let Some(scene) = shared::path("scenes/cornell/cornell.gltf") else { return };
    let Some(maps) = shared::path("assets/env") else { return };
    for path in files(&maps) {
        let map = EnvironmentFile::new(&path);
        let scene = load_with_environment(&scene, Some(&map), &Limits::default()).unwrap_or_else(|e| panic!("{e}"));
        let map = scene.environment.unwrap();
        assert_eq!(map.radiance.len(), map.width as usize * map.height as usize);
        assert!(map.radiance.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
        assert!(map.radiance.iter().flatten().any(|x| *x > 0.0), "{}", path.display());
    }
}

/// Calls `read` on every file; a panic is a failure, an error must be one line.
fn survives(paths: &[PathBuf], read: impl Fn(&Path) -> nephroid::Result<()>) -> usize {
    let mut errors = 0;
    for path in paths {
        let result = catch_unwind(AssertUnwindSafe(|| read(path)));
        let result = result.unwrap_or_else(|_| panic!("{} panics", path.display()));
        println!("{}: {}", path.display(), result.as_ref().map_or_else(|e| e.to_string(), |_| "read".into()));
        if let Err(error) = result {
            assert!(!error.to_string().contains('\n') && error.exit_code() == 2, "{error}");
            errors += 1;
        }
    }
    errors
}

#[test]
fn invalid_gltf_files_do_no_harm() {
    let Some(folder) = shared::path("assets/bad/gltf-validator") else { return };
    let paths: Vec<_> = files(&folder).into_iter().filter(|p| is_scene(p)).collect();
    assert!(paths.len() >= 70);
    survives(&paths, |path| load(path, &Limits::default()).map(|scene| check(&scene, path)));
    let strict = Limits { strict: true, ..Limits::default() };
    let errors = survives(&paths, |path| load(path, &strict).map(|scene| check(&scene, path)));
    // What nothing uses is not looked at.
    assert!(errors >= 15, "{errors} errors");
}

#[test]
fn damaged_openexr_files_do_no_harm() {
    let Some(folder) = shared::path("assets/bad/openexr-damaged") else { return };
    let paths = files(&folder);
    assert!(paths.len() >= 40);
    let errors = survives(&paths, |path| Environment::load(path, &Limits::default()).map(|_| ()));
    assert!(errors >= 30, "{errors} errors");
}

#[test]
fn damaged_openexr_pictures_do_no_harm() {
    let Some(folder) = shared::path("assets/bad/openexr-damaged") else { return };
    let paths = files(&folder);
    assert_eq!(survives(&paths, |path| exr::read(path).map(|_| ())), paths.len(), "each is damaged");
}

#[test]
fn corrupt_png_files_do_no_harm() {
    let Some(folder) = shared::path("assets/bad/pngsuite-corrupt") else { return };
    let paths = files(&folder);
    assert!(paths.len() >= 14);
    let folder = tempfile::tempdir().unwrap();
    let errors = survives(&paths, |path| {
        std::fs::copy(path, folder.path().join("t.png")).unwrap();
        let scene = folder.path().join("scene.gltf");
        std::fs::write(&scene, TEXTURED_TRIANGLE).unwrap();
        load(&scene, &Limits::default()).map(|scene| check(&scene, path))?;
        load(&scene, &Limits { strict: true, ..Limits::default() }).map(drop)
    });
    assert!(errors >= 10, "{errors} errors");
}

/// A triangle of three floats thrice: (0, 0, 0), (1, 0, 0), (0, 1, 0), with a texture in `t.png`.
const TEXTURED_TRIANGLE: &str = r#"{"asset": {"version": "2.0"},
  "buffers": [{"byteLength": 36, "uri":
    "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],
  "bufferViews": [{"buffer": 0, "byteLength": 36}],
  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
  "images": [{"uri": "t.png"}], "textures": [{"source": 0}],
  "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
  "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
  "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}"#;
