//! Renders that must agree to the last bit: cases 29, 30 and 42.

use super::lab::{Lab, settings};
use super::scenes::{kinds, lamp, panel, room};
use super::{Case, Within};
use crate::error::Result;
use crate::render::{Session, Settings};
use crate::scene::shapes::Mesh;
use crate::scene::{Light, Material, Scene};

pub(super) const CASES: &[Case] = &[
    Case {
        number: 29,
        title: "geometry times 2^k",
        reason: "no hidden length: a power of two rounds nothing, so the picture has the same bits",
        parameter: Some("k"),
        run: scaled_geometry,
    },
    Case {
        number: 30,
        title: "light times 2^k",
        reason: "the picture times 2^k, bit for bit",
        parameter: Some("k"),
        run: scaled_light,
    },
    Case {
        number: 42,
        title: "the same seed twice; resumed; merged from parts",
        reason: "sums of passes are exact, so order and grouping leave no trace",
        parameter: None,
        run: repeated,
    },
];

fn small() -> Settings {
    settings(16, 12, 3_000)
}

/// The scene in other units of length: everything 2^k times as large, intensities so that radiance stays.
fn in_other_units(scene: &Scene, k: i32) -> Scene {
    super::scale::times(scene, 2f32.powi(k))
}

fn scaled_geometry(lab: &mut Lab) -> Result<()> {
    let ks: &[i32] = lab.pick(&[-20, 20], &[-20, -7, 7, 20]);
    for (at, (name, scene)) in kinds().into_iter().filter(|(name, _)| !name.contains("rough")).enumerate() {
        let expected = lab.shot(&scene, &small(), 0..2)?.bits_without_depth();
        // The tests take one scale for each scene.
        let some = lab.pick(&ks[at % ks.len()..][..1], ks);
        for &k in some {
            let found = lab.shot(&in_other_units(&scene, k), &small(), 0..2)?;
            lab.same(format!("{name}, 2^{k}"), &found.bits_without_depth(), &expected).at(f64::from(k));
        }
    }
    focus(lab)?;
    let (_, scene) = kinds().swap_remove(0);
    let mut dim = in_other_units(&scene, 7);
    dim.lights = scene.lights.clone();
    let (a, b) = (lab.shot(&dim, &small(), 0..2)?, lab.shot(&scene, &small(), 0..2)?);
    let differ = super::differences(&a.bits_without_depth(), &b.bits_without_depth()) as f64;
    lab.found("lights that are not scaled are noticed", differ, 1.0, Within::AtLeast);
    Ok(())
}

/// The smallest footprints: the focus of a glass ball, where fourth powers of lengths are below the normal numbers.
fn focus(lab: &mut Lab) -> Result<()> {
    let mut scene = room(Material::lambert([0.5; 3]), vec![]);
    scene.lights = vec![Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [1.0; 3] }];
    scene.add(&Mesh::sphere([-1.0, 0.75, 0.7], 0.3, 48, 96), Material::glass(1.5));
    let settings =
        Settings { caustic_smoothing: 0.5, global_smoothing: 0.5, ..settings(32, 24, lab.pick(20_000, 60_000)) };
    let expected = lab.shot(&scene, &settings, 0..1)?;
    for k in lab.pick(vec![-24], vec![-24, -20, 20]) {
        let found = lab.shot(&in_other_units(&scene, k), &settings, 0..1)?;
        lab.same(format!("focus, 2^{k}"), &found.bits_without_depth(), &expected.bits_without_depth()).at(f64::from(k));
        lab.holds("the same guards fired", found.statistics.counters == expected.statistics.counters);
    }
    Ok(())
}

fn scaled_light(lab: &mut Lab) -> Result<()> {
    let mut base = room(Material::glass(1.5), vec![lamp()]);
    base.lights.push(Light::Directional { direction: [0.0, -0.8, -0.6], irradiance: [0.5, 0.4, 0.3] });
    panel(&mut base);
    let expected = lab.shot(&base, &small(), 0..2)?;
    for k in lab.pick(vec![-20, 20], vec![-20, -3, 5, 20]) {
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
        let found = lab.shot(&scene, &small(), 0..2)?;
        for name in ["", "direct", "indirect", "caustic"] {
            let bits = |shot: &super::Shot, factor: f32| -> Vec<u32> {
                let data = shot.picture.layer(name).map_or(&[][..], |layer| &layer.data);
                data.iter().map(|x| (x * factor).to_bits()).collect()
            };
            let what = format!("layer '{name}', 2^{k}");
            lab.same(what, &bits(&found, 1.0), &bits(&expected, factor)).at(f64::from(k));
        }
        let ratio = found.mean("") / expected.mean("");
        lab.found(format!("mean, 2^{k}"), ratio, f64::from(factor), Within::Part(1e-6)).at(f64::from(k));
        lab.holds("no layer is black", ["direct", "indirect", "caustic"].iter().all(|name| found.mean(name) > 0.0));
    }
    Ok(())
}

fn repeated(lab: &mut Lab) -> Result<()> {
    let scenes = kinds();
    let some = lab.pick(3, 1);
    for (name, scene) in scenes.iter().step_by(some) {
        let (a, b) = (lab.shot(scene, &small(), 0..2)?, lab.shot(scene, &small(), 0..2)?);
        lab.same(format!("{name}, twice"), &a.bits(), &b.bits());
        let unchanged = (&a.moments, &a.statistics.counters) == (&b.moments, &b.statistics.counters);
        lab.holds(format!("{name}: the same sums and guards"), unchanged);
    }
    let (_, scene) = &scenes[0];
    let other = lab.shot(scene, &Settings { seed: 1, ..small() }, 0..2)?;
    let first = lab.shot(scene, &small(), 0..2)?;
    let differ = super::differences(&first.bits(), &other.bits()) as f64;
    lab.found("another seed is noticed", differ, 1.0, Within::AtLeast);
    merged_and_resumed(lab)
}

/// A pass depends on its global index alone, and the film's sums are exact. Films of parts, in any order, are the film
/// of the whole bit for bit, and so is one that was stopped and went on.
fn merged_and_resumed(lab: &mut Lab) -> Result<()> {
    let mut scene = room(Material::glass(1.5), vec![lamp()]);
    scene.add(&Mesh::sphere([-0.9, 0.6, 0.8], 0.35, 8, 16), Material::mirror());
    let whole = lab.shot(&scene, &small(), 0..8)?.film;
    let mut parts = vec![];
    for passes in [5..8, 0..2, 2..5] {
        parts.push(lab.shot(&scene, &small(), passes)?.film);
    }
    let mut merged = parts[0].clone();
    merged.merge(&parts[1])?;
    lab.holds("missing passes are noticed", merged != whole);
    merged.merge(&parts[2])?;
    lab.holds("merged from parts", merged == whole);
    lab.holds("a part twice is refused", merged.merge(&parts[2]).is_err());
    let device = lab.runtime().device().clone();
    let resume = |settings: Settings| -> Result<(crate::film::accumulate::Film, bool)> {
        let mut session = Session::new(&device, scene.clone(), settings)?;
        session.restore(&parts[1])?;
        (2..8).try_for_each(|index| session.run_pass(index))?;
        let again = session.run_pass(1).is_err();
        Ok((session.film()?, again))
    };
    let (resumed, refused) = resume(small())?;
    let (other, _) = resume(Settings { seed: 1, ..small() })?;
    lab.holds("resumed", resumed == whole);
    lab.holds("a pass twice is refused", refused);
    lab.holds("resumed with another seed is noticed", other != whole);
    Ok(())
}
