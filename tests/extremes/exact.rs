//! Renders that must agree to the last bit: cases 29, 30 and 42.

use nephroid::low_level::render::{Session, Settings};
use nephroid::low_level::scene::shapes::Mesh;
use nephroid::low_level::scene::{Light, Material, Scene};

use crate::support::device::runtime;
use crate::support::lab::{Shot, assert_same, difference, settings};
use crate::variants::{kinds, lamp, panel, room};

fn small() -> Settings {
    settings(16, 12, 3_000)
}

/// The scene in other units of length: everything 2^k times as large, intensities so that radiance stays.
fn in_other_units(scene: &Scene, k: i32) -> Scene {
    let unit = 2f32.powi(k);
    let far = |p: &mut [f32; 3]| *p = p.map(|x| x * unit);
    let mut scaled = scene.clone();
    scaled.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(far);
    for light in &mut scaled.lights {
        match light {
            Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
                far(position);
                *intensity = intensity.map(|x| x * unit * unit);
            }
            Light::Directional { .. } => {}
        }
    }
    scaled.cameras.iter_mut().for_each(|camera| far(&mut camera.position));
    for material in &mut scaled.materials {
        material.absorption = material.absorption.map(|x| x / unit);
    }
    scaled
}

/// The picture's bits without the depth, which is a length.
fn without_depth(shot: &Shot) -> Vec<u32> {
    let layers = shot.picture.layers.iter().filter(|layer| layer.name != "depth");
    layers.flat_map(|layer| layer.data.iter().map(|x| x.to_bits())).collect()
}

/// Case 29: no hidden length. Scenes of every kind in units from 2^-20 to 2^20.
#[test]
fn case_29_geometry_times_powers_of_two() {
    let mut failures = Vec::new();
    for (name, scene) in kinds().into_iter().filter(|(name, _)| !name.contains("rough")) {
        let expected = Shot::take(&scene, &small(), 0..2);
        for k in [-20, -7, 7, 20] {
            println!("{name}, 2^{k}");
            let found = Shot::take(&in_other_units(&scene, k), &small(), 0..2);
            let (a, b) = (without_depth(&found), without_depth(&expected));
            if difference(&a, &b).is_some() {
                let count = a.iter().zip(&b).filter(|(a, b)| a != b).count();
                failures.push(format!("{name}, 2^{k}: {count} of {}", a.len()));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    let (_, scene) = kinds().swap_remove(0);
    let mut dim = in_other_units(&scene, 7);
    dim.lights = scene.lights.clone();
    let (a, b) = (Shot::take(&dim, &small(), 0..2), Shot::take(&scene, &small(), 0..2));
    assert!(difference(&without_depth(&a), &without_depth(&b)).is_some(), "unscaled lights must be noticed");
}

/// Case 29 for the smallest footprints: the focus of a glass ball, where fourth powers of lengths are below the normal
/// numbers.
#[test]
fn case_29_focus_times_powers_of_two() {
    let mut scene = room(Material::lambert([0.5; 3]), vec![]);
    scene.lights = vec![Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [1.0; 3] }];
    scene.add(&Mesh::sphere([-1.0, 0.75, 0.7], 0.3, 48, 96), Material::glass(1.5));
    let settings = Settings { caustic_smoothing: 0.5, global_smoothing: 0.5, ..settings(32, 24, 60_000) };
    let expected = Shot::take(&scene, &settings, 0..1);
    for k in [-24, -20, 20] {
        let found = Shot::take(&in_other_units(&scene, k), &settings, 0..1);
        assert_same(&without_depth(&found), &without_depth(&expected), &format!("2^{k}"));
        assert_eq!(found.statistics.counters, expected.statistics.counters, "guards, 2^{k}");
    }
}

/// Case 30: all light 2^k times as strong gives the picture times 2^k.
#[test]
fn case_30_light_times_powers_of_two() {
    let mut base = room(Material::glass(1.5), vec![lamp()]);
    base.lights.push(Light::Directional { direction: [0.0, -0.8, -0.6], irradiance: [0.5, 0.4, 0.3] });
    panel(&mut base);
    let expected = Shot::take(&base, &small(), 0..2);
    for k in [-20, -3, 5, 20] {
        let factor = 2f32.powi(k);
        let brighter = |c: &mut [f32; 3]| *c = c.map(|x| x * factor);
        let mut scene = base.clone();
        for light in &mut scene.lights {
            match light {
                Light::Point { intensity, .. } | Light::Spot { intensity, .. } => brighter(intensity),
                Light::Directional { irradiance, .. } => brighter(irradiance),
            }
        }
        scene.materials.iter_mut().for_each(|m| brighter(&mut m.emissive));
        let found = Shot::take(&scene, &small(), 0..2);
        for name in ["", "direct", "indirect", "caustic"] {
            let bits = |shot: &Shot, factor: f32| -> Vec<u32> {
                let layer = shot.picture.layer(name).expect("a layer");
                layer.data.iter().map(|x| (x * factor).to_bits()).collect()
            };
            assert_same(&bits(&found, 1.0), &bits(&expected, factor), &format!("'{name}', light times 2^{k}"));
        }
        let off = (found.mean("") / expected.mean("") / f64::from(factor) - 1.0).abs();
        assert!(off < 1e-6 && found.mean("caustic") > 0.0 && found.mean("direct") > 0.0, "the picture is not black");
    }
}

/// Case 42: the same seed twice.
#[test]
fn case_42_the_same_seed_twice() {
    for (name, scene) in kinds() {
        let (a, b) = (Shot::take(&scene, &small(), 0..2), Shot::take(&scene, &small(), 0..2));
        assert_same(&a.bits(), &b.bits(), name);
        let unchanged = (&a.moments, &a.statistics.counters) == (&b.moments, &b.statistics.counters);
        assert!(unchanged, "{name}: sums or guards");
    }
}

/// Case 42: a pass depends on its global index alone, and the film's sums are exact. Films of parts, in any order, are
/// the film of the whole bit for bit, and so is one that was stopped and went on.
#[test]
fn case_42_merged_and_resumed() {
    let mut scene = room(Material::glass(1.5), vec![lamp()]);
    scene.add(&Mesh::sphere([-0.9, 0.6, 0.8], 0.35, 8, 16), Material::mirror());
    let whole = Shot::take(&scene, &small(), 0..8).film;
    let parts = [5..8, 0..2, 2..5].map(|passes| Shot::take(&scene, &small(), passes).film);
    let mut merged = parts[0].clone();
    merged.merge(&parts[1]).expect("apart");
    assert!(merged != whole, "passes are missing");
    merged.merge(&parts[2]).expect("apart");
    assert!(merged == whole, "merged");
    assert!(merged.merge(&parts[2]).is_err(), "a part twice");

    let runtime = runtime();
    let mut session = Session::new(runtime.device(), scene.clone(), small()).expect("a session");
    session.restore(&parts[1]).expect("the same render");
    assert!(session.run_pass(1).is_err(), "a pass twice");
    (2..8).for_each(|index| session.run_pass(index).expect("a pass"));
    assert!(session.film().expect("a film") == whole, "resumed");
    let mut other = Session::new(runtime.device(), scene, Settings { seed: 1, ..small() }).expect("a session");
    other.restore(&parts[1]).expect("the same size");
    (2..8).for_each(|index| other.run_pass(index).expect("a pass"));
    assert!(other.film().expect("a film") != whole, "another seed must be noticed");
    let mut small_session =
        Session::new(runtime.device(), kinds().swap_remove(0).1, settings(8, 8, 100)).expect("a session");
    assert!(small_session.restore(&whole).is_err(), "another size");
}
