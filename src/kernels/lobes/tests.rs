//! Furnaces: what each lobe reflects of light that is the same everywhere, by direct integration. The tables of
//! docs/materials.md are the output of
//! `cargo test --lib kernels::lobes -- --nocapture --test-threads 1`.

use super::microfacet::visible_normal_density;
use super::*;

const ROUGHNESSES: [f64; 10] = [0.04, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 0.9, 1.0];
const DEGREES: [f64; 8] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0];

fn direction(degrees: f64) -> DVec3 {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    DVec3::new(sine, 0.0, cosine)
}

/// Mean over the square by a Fibonacci lattice of its own on either side of `cut`, denser where the first number is
/// near 1; not the lattice of the tables.
fn mean_over_square(cut: f64, f: impl Fn(DVec2) -> f64) -> f64 {
    const LATTICE: [u32; 2] = [1597, 987];
    let [count, generator] = LATTICE;
    let part = |low: f64, high: f64| {
        if low == high {
            return 0.0;
        }
        let point = |i: u32| {
            let from_rim = 1.0 - (f64::from(i) + 0.5) / f64::from(count);
            let around = (f64::from(i * generator % count) + 0.5) / f64::from(count);
            2.0 * from_rim * f(DVec2::new(high - (high - low) * from_rim * from_rim, around))
        };
        (high - low) * (0..count).map(point).sum::<f64>() / f64::from(count)
    };
    part(0.0, cut) + part(cut, 1.0)
}

/// Albedo of an opaque surface: the glossy lobe over its facets, the base over cosines.
fn opaque_albedo(s: &Opaque, w: DVec3) -> f64 {
    let glossy = mean_over_square(1.0, |u| {
        let h = sample_visible_normal(w, s.alpha, u);
        let wi = 2.0 * w.dot(h) * h - w;
        let scales = || s.scale(w.z) * s.scale(wi.z);
        if wi.z > 0.0 { s.facet_reflectance(w.dot(h), scales()) * facet_weight(w.z, wi.z, s.alpha) } else { 0.0 }
    });
    let steps = 100;
    let cosine = |i: u32| (f64::from(i) + 0.5) / f64::from(steps);
    let base: f64 = (0..steps).map(|i| s.base_reflectance(w.z, cosine(i)) * 2.0 * cosine(i) / f64::from(steps)).sum();
    glossy + base
}

fn boundary_albedo(b: &Boundary, w: DVec3, inside: bool) -> f64 {
    let missing = b.missing(Some(w.z), inside);
    mean_over_square(missing, |u| b.ways(w, inside, u).iter().flatten().map(|way| way.weight).sum())
}

/// Prints a table of albedos over roughness and angle, and returns it.
fn table(name: &str, albedo: impl Fn(f64, DVec3) -> f64) -> Vec<[f64; DEGREES.len()]> {
    println!("\n{name}\n\n| roughness | {} |", DEGREES.map(|d| format!("{d}°")).join(" | "));
    println!("|{}", "---|".repeat(DEGREES.len() + 1));
    let row = |roughness: f64| {
        let row = DEGREES.map(|degrees| albedo(roughness * roughness, direction(degrees)));
        println!("| {roughness} | {} |", row.map(|x| format!("{x:.4}")).join(" | "));
        row
    };
    ROUGHNESSES.map(row).to_vec()
}

fn range(table: &[[f64; DEGREES.len()]]) -> [f64; 2] {
    table.iter().flatten().fold([f64::INFINITY, 0.0], |[low, high], &x| [low.min(x), high.max(x)])
}

/// Lossless lobes reflect everything, within what the interpolation of the tables costs: a degree from the horizon it
/// is more.
#[track_caller]
fn assert_lossless(name: &str, albedo: impl Fn(f64, DVec3) -> f64) {
    for row in table(name, albedo) {
        for (degrees, value) in DEGREES.into_iter().zip(row) {
            let tolerance = if degrees > 85.0 { 0.007 } else { 0.0025 };
            assert!((value - 1.0).abs() < tolerance, "{name} at {degrees} degrees: {value}");
        }
    }
}

fn surface(metallic: f64, base: f64, f0: f64) -> impl Fn(f64) -> Opaque {
    move |alpha| Opaque { metallic, base, coat: [f0, 1.0], alpha }
}

#[test]
fn white_surfaces_reflect_everything() {
    let white = [("White metal", 1.0, 0.04), ("White base under a coat of index 1.5", 0.0, 0.04)];
    for (name, metallic, f0) in white.into_iter().chain([("Half white metal, half coated white", 0.5, 0.04)]) {
        let surface = surface(metallic, 1.0, f0);
        assert_lossless(name, |alpha, w| opaque_albedo(&surface(alpha), w));
    }
}

#[test]
fn a_coat_without_a_base_loses_what_its_facets_absorb() {
    let [coat, metal] = [surface(0.0, 0.0, 0.04), surface(1.0, 0.5, 0.04)];
    let [low, high] = range(&table("Coat of index 1.5 over black", |alpha, w| opaque_albedo(&coat(alpha), w)));
    assert!(low > 0.01 && high < 1.0, "{low} to {high}");
    let [low, high] = range(&table("Metal of reflectance 0.5", |alpha, w| opaque_albedo(&metal(alpha), w)));
    assert!(low > 0.3 && high < 1.0, "{low} to {high}");
    // Of single scattering alone rough metal keeps a third.
    let single = table::reflection(1.0, Some(1.0)).single;
    assert!((single - 0.307).abs() < 0.003, "{single}");
}

#[test]
fn frosted_glass_loses_nothing() {
    for ior in [1.1, 1.5] {
        let glass = Boundary::new(ior, 0.0);
        for inside in [false, true] {
            let name = format!("Boundary of index {ior}, from {}", if inside { "inside" } else { "outside" });
            assert_lossless(&name, |alpha, w| boundary_albedo(&glass.with_alpha(alpha), w, inside));
        }
    }
}

/// Pairs of directions over the hemisphere.
fn pairs() -> impl Iterator<Item = (DVec3, DVec3)> {
    let at = |i: u32, turn: f64| {
        let (z, phi) = ((f64::from(i) + 0.5) / 12.0, turn + 2.4 * f64::from(i));
        DVec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z)
    };
    (0..12).flat_map(move |i| (0..12).map(move |k| (at(i, 0.0), at(k, 1.0))))
}

#[test]
fn lobes_are_reciprocal() {
    for alpha in [0.02, 0.2, 0.7] {
        let s = Opaque { metallic: 0.3, base: 0.6, coat: [0.06, 0.8], alpha };
        let glass = Boundary::new(1.5, alpha);
        for (a, b) in pairs() {
            let (there, back) = (s.bsdf(a, b), s.bsdf(b, a));
            assert!((there - back).abs() <= 1e-12 * there, "{there} and {back}");
            // Flux from side to side: a share over the measure n^2 cos of where it goes.
            let there = glass.again((a.z, false), (b.z, true)) / glass.side(true);
            let back = glass.again((b.z, true), (a.z, false)) / glass.side(false);
            assert!((there - back).abs() <= 1e-12 * there, "{there} and {back}");
        }
    }
    let one_sided = |a: DVec3, b: DVec3| ggx_reflection(a, b, 0.2) / surface(1.0, 1.0, 0.04)(0.2).scale(a.z);
    assert!(pairs().any(|(a, b)| (one_sided(a, b) / one_sided(b, a) - 1.0).abs() > 0.02), "must be noticed");
}

/// Integral over the directions of a hemisphere, denser at the pole and at the horizon.
fn over_hemisphere(f: impl Fn(DVec3) -> f64) -> f64 {
    let (rings, turns) = (400, 160);
    let mut sum = 0.0;
    for (i, k) in (0..rings).flat_map(|i| (0..turns).map(move |k| (i, k))) {
        let x = (f64::from(i) + 0.5) / f64::from(rings);
        let (z, phi) = (x * x * (3.0 - 2.0 * x), 2.0 * PI * (f64::from(k) + 0.5) / f64::from(turns));
        let sine = (1.0 - z * z).sqrt();
        sum += 6.0 * x * (1.0 - x) * f(DVec3::new(sine * phi.cos(), sine * phi.sin(), z));
    }
    2.0 * PI * sum / f64::from(rings * turns)
}

#[test]
fn densities_integrate_to_one() {
    for (alpha, degrees) in [(0.1, 20.0), (0.25, 60.0), (0.6, 0.0), (1.0, 80.0)] {
        let w = direction(degrees);
        let facets = over_hemisphere(|h| visible_normal_density(w, h, alpha));
        assert!((facets - 1.0).abs() < 2e-3, "facets of {alpha} at {degrees}: {facets}");
        let s = surface(0.3, 0.8, 0.04)(alpha);
        // The sampled lobe loses what is reflected below the horizon, and chances are those of each direction.
        let drawn = over_hemisphere(|wi| s.density(w, wi, true));
        let albedo = over_hemisphere(|wi| s.bsdf(w, wi) * wi.z);
        assert!((albedo - opaque_albedo(&s, w)).abs() < 2e-3, "{albedo} by directions");
        assert!(drawn > 0.5 * albedo && drawn < 1.001, "{drawn} drawn, {albedo} reflected");
    }
}

/// The sampler's weights are the lobe over its density: both give the same means of the direction.
#[test]
fn samples_of_facets_stand_for_the_lobe() {
    let (s, w) = (surface(1.0, 0.7, 0.04)(0.3), direction(50.0));
    let sampled = |axis: usize| {
        mean_over_square(1.0, |u| {
            let h = sample_visible_normal(w, s.alpha, u);
            let wi = 2.0 * w.dot(h) * h - w;
            let scales = || s.scale(w.z) * s.scale(wi.z);
            let weight = || s.facet_reflectance(w.dot(h), scales()) * facet_weight(w.z, wi.z, s.alpha);
            if wi.z > 0.0 { weight() * wi[axis] } else { 0.0 }
        })
    };
    for axis in [0, 2] {
        let integrated = over_hemisphere(|wi| s.bsdf(w, wi) * wi.z * wi[axis]);
        assert!((sampled(axis) / integrated - 1.0).abs() < 5e-3, "{} and {integrated}", sampled(axis));
    }
}
