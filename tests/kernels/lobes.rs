//! Lobes of materials: the kernels' functions against the reference in double precision.

use glam::{DVec2, DVec3};
use nephroid::low_level::graph::Graph;
use nephroid::low_level::kernels::generated::ProbedLobe;
use nephroid::low_level::kernels::lobes::microfacet::{facet_weight, sample_visible_normal};
use nephroid::low_level::kernels::lobes::probe::probe;
use nephroid::low_level::kernels::lobes::{Boundary, Opaque, Way, table};

use crate::support::device::runtime;
use crate::support::proof;

/// Directions and random numbers that differ from probe to probe.
fn numbers(i: u32) -> (DVec3, DVec3, DVec2) {
    let at = |k: f64| (f64::from(i) * k + 0.31 * k).fract();
    let direction = |a: f64, b: f64| {
        let (z, phi) = (0.03 + 0.97 * at(a), std::f64::consts::TAU * at(b));
        DVec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z)
    };
    (direction(0.754_877, 0.569_84), direction(0.819_17, 0.671_04), DVec2::new(at(0.856_67), at(0.733_89)))
}

fn probed(i: u32, alpha: f64) -> ProbedLobe {
    let (wo, wi, u) = numbers(i);
    let (wo, wi, u) = (wo.as_vec3().to_array(), wi.as_vec3().to_array(), u.as_vec2().to_array());
    ProbedLobe { wo, wi, u, alpha: alpha as f32, ..ProbedLobe::default() }
}

fn run(probes: &[ProbedLobe], lobes: &[u32]) -> Vec<[f32; 4]> {
    let runtime = runtime();
    let input = runtime.persistent_from("probes", probes).expect("memory");
    let words = runtime.persistent_from("lobes", lobes).expect("memory");
    let mut g = Graph::new();
    let (input, words) = (g.import_read(&input), g.import_read(&words));
    let mut results = g.buffer("results", 3 * probes.len() as u32);
    probe(&mut g, &input, &words, &mut results);
    let readback = g.readback(&results);
    let plan = g.plan().expect("a plan");
    let mut executable = runtime.prepare(&plan).expect("memory");
    executable.run().expect("no validation message");
    proof::ran(&plan.dump());
    executable.read(&readback)
}

#[track_caller]
fn assert_close(what: &str, found: f32, expected: f64) {
    let error = (f64::from(found) - expected).abs();
    assert!(error <= 2e-3 * expected.abs() + 2e-5, "{what}: {found}, expected {expected}");
}

#[test]
fn opaque_lobes_are_the_reference() {
    let surface = |i: u32| Opaque {
        metallic: [0.0, 0.4, 1.0][i as usize % 3],
        base: 0.7,
        coat: [0.05, 0.9],
        alpha: [0.11, 0.3, 0.62, 1.0][i as usize % 4],
    };
    let probes: Vec<ProbedLobe> = (0..240)
        .map(|i| {
            let Opaque { metallic, base, coat: [f0, f90], alpha } = surface(i);
            let [metallic, base, coat_f0, coat_f90] = [metallic, base, f0, f90].map(|x| x as f32);
            ProbedLobe { metallic, base, coat_f0, coat_f90, ..probed(i, alpha) }
        })
        .collect();
    let results = run(&probes, table::reflection_words());
    for (i, result) in (0..).zip(results.chunks(3)) {
        let (s, (wo, wi, u)) = (surface(i), numbers(i));
        let [lobe, density, weight, chance] = result[0];
        assert_close("lobe", lobe, s.bsdf(wo, wi));
        assert_close("density", density, s.density(wo, wi, true));
        let h = sample_visible_normal(wo, s.alpha, u);
        let drawn = 2.0 * wo.dot(h) * h - wo;
        if drawn.z > 1e-3 {
            let reflected = s.facet_reflectance(wo.dot(h), s.scale(wo.z) * s.scale(drawn.z));
            assert_close("sample", weight * chance, reflected * facet_weight(wo.z, drawn.z, s.alpha));
            assert_close("lobe of the sample", result[1][3], s.bsdf(wo, drawn));
        }
    }
    proof::by(Opaque::bsdf, &["lobe_probe"]);
}

#[test]
fn frosted_glass_is_the_reference() {
    let mut words = table::reflection_words().to_vec();
    let boundary = words.len() as u32;
    let glass = Boundary::new(1.5, 0.0);
    words.extend(glass.words());
    let alpha = |i: u32| [0.04, 0.3, 0.62, 1.0][i as usize % 4];
    let side = |i: u32| i % 2;
    let probe = |i| ProbedLobe { ior: 1.5, boundary, inside: side(i), ..probed(i, alpha(i)) };
    let results = run(&(0..240).map(probe).collect::<Vec<_>>(), &words);
    let (mut again, mut compared) = (0, 0);
    for (i, result) in (0..).zip(results.chunks(3)) {
        let (wo, _, u) = numbers(i);
        let glass = glass.with_alpha(alpha(i));
        again += u32::from(u.x < glass.missing(Some(wo.z), side(i) == 1));
        for (found, way) in result[1..].iter().zip(glass.ways(wo, side(i) == 1, u)) {
            // Rounding decides what happens at the horizon.
            if let Some(Way { direction, weight }) = way.filter(|way| way.direction.z.abs() > 1e-2) {
                assert_close("weight", found[3], weight);
                (0..3).for_each(|k| assert!((f64::from(found[k]) - direction[k]).abs() < 2e-3));
                compared += 1;
            }
        }
    }
    assert!(again > 20 && compared > 300, "{again} met more than one facet, {compared} compared");
}
