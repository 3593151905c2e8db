//! Scenes that move: the samples against a second reader, damage, and the cases that files can ask for.

use std::path::PathBuf;

use nephroid::low_level::scene::{Choices, Limits, Scene, World, load, load_with};

use crate::second_reader::{Point, Reader};
use crate::support::shared;

/// The samples that move, with the animations that are played.
const SAMPLES: [(&str, &[usize]); 9] = [
    ("AnimatedCube/AnimatedCube.gltf", &[0]),
    ("AnimatedMorphCube/AnimatedMorphCube.glb", &[0]),
    ("BoxAnimated/BoxAnimated.glb", &[0]),
    ("InterpolationTest/InterpolationTest.glb", &[0, 1, 2, 3, 4, 5, 6, 7, 8]),
    ("RiggedSimple/RiggedSimple.gltf", &[0]),
    ("RiggedFigure/RiggedFigure.glb", &[0]),
    ("Fox/Fox.glb", &[0]),
    ("SimpleMorph/SimpleMorph.gltf", &[0]),
    ("SimpleSkin/SimpleSkin.gltf", &[0]),
];

fn sample(name: &str) -> Option<PathBuf> {
    shared::path("assets/khronos").map(|folder| folder.join(name)).filter(|path| path.exists())
}

/// Corners of all triangles of a scene at a time.
fn corners(scene: &Scene, time: f64) -> Vec<[Point; 3]> {
    let mut scene = scene.clone();
    scene.move_to(time);
    scene.validate().unwrap();
    let world = World::of(&scene);
    (0..world.triangles.len() as u32).map(|t| world.corners(t).map(|p| p.map(f64::from))).collect()
}

/// The largest distance of corners that should be the same, by the size of the scene.
fn distance(a: &[[Point; 3]], b: &[[Point; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let points = |all: &[[Point; 3]]| all.iter().flatten().copied().collect::<Vec<Point>>();
    let (a, b) = (points(a), points(b));
    let size = a.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let apart = |(p, q): (&Point, &Point)| (0..3).map(|k| (p[k] - q[k]).abs()).fold(0.0, f64::max);
    a.iter().zip(&b).map(apart).fold(0.0, f64::max) / size
}

#[test]
fn samples_are_where_a_second_reader_has_them() {
    for (name, played) in SAMPLES {
        let Some(path) = sample(name) else { continue };
        let (scene, reader) = (load(&path, &Limits::default()).unwrap(), Reader::open(&path));
        let motion = scene.motion.clone().expect("it moves");
        let on: Vec<usize> = (0..motion.animations().len()).filter(|i| motion.animations()[*i].1).collect();
        assert_eq!(on, played, "{name}");
        let [start, end] = reader.span(played);
        assert_eq!(motion.span(), [start, end], "{name}");
        let mut sabotaged = 0.0f64;
        for share in [0.0, 0.21, 0.5, 0.77, 1.0, -0.5, 1.5] {
            let time = start + share * (end - start);
            let ours = corners(&scene, time);
            let error = distance(&ours, &reader.corners(played, time));
            assert!(error < 2e-6, "{name} at {time} s: {error:.1e}");
            let later = reader.corners(played, time + 0.03 * (end - start));
            sabotaged = sabotaged.max(distance(&ours, &later));
        }
        println!("{name}: {start} s to {end} s, {} triangles", corners(&scene, start).len());
        assert!(sabotaged > 1e-3, "{name}: a later time is told from the right one: {sabotaged:.1e}");
    }
}

/// Poses do not depend on those before them, and the second of two equal ones changes nothing.
#[test]
fn poses_depend_on_the_time_alone() {
    for (name, _) in SAMPLES {
        let Some(path) = sample(name) else { continue };
        let mut scene = load(&path, &Limits::default()).unwrap();
        let motion = scene.motion.clone().expect("it moves");
        let mut fresh = scene.clone();
        for time in [0.9, 0.1, 100.0, 0.4] {
            scene.move_to(time);
        }
        fresh.move_to(0.4);
        assert_eq!((&scene.meshes, &scene.instances), (&fresh.meshes, &fresh.instances), "{name}");
        assert!(motion.pose(0.4, &scene).is_empty(), "{name}");
        assert!(!motion.pose(0.5, &scene).is_empty(), "{name}");
    }
}

#[test]
fn an_animation_is_chosen_by_name_or_index() {
    let Some(path) = sample("Fox/Fox.glb") else { return };
    let chosen = |animation: &str| {
        let choices = Choices { animation: Some(animation.into()), ..Choices::default() };
        load_with(&path, &choices, &Limits::default()).map(|scene| scene.motion.expect("it moves"))
    };
    for (wanted, played) in [("Walk", 1), ("2", 2), ("Survey", 0)] {
        let motion = chosen(wanted).unwrap();
        let on: Vec<bool> = motion.animations().iter().map(|(_, on)| *on).collect();
        assert_eq!(on, [0, 1, 2].map(|i| i == played), "{wanted}");
    }
    let error = chosen("Sleep").unwrap_err().to_string();
    assert!(error.ends_with("no animation 'Sleep'; the scene has 'Survey', 'Walk', 'Run'"), "{error}");
}
