//! Case 14: photon differentials against finite differences, and the kernels' version against the host's.

use glam::DVec3;

use super::lab::{Lab, worse};
use super::{Case, Within};
use crate::error::Result;
use crate::graph::Graph;
use crate::kernels::differentials::{Boundary, SmoothNormal, reflect, refract, run, transfer};
use crate::kernels::generated::DifferentialStep;

pub(super) const CASES: &[Case] = &[Case {
    number: 14,
    title: "photon differentials: mirror, spherical mirror, lens, three bounces",
    reason: "central differences with steps of 1e-5 in double precision; kernels have single precision",
    parameter: None,
    run: differentials,
}];

/// A triangle with normals of its own, and what happens there: reflection (`eta` 0) or refraction.
struct Facet {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
    eta: f64,
}

/// A ray and its derivative along one parameter.
#[derive(Clone, Copy)]
struct State {
    p: DVec3,
    d: DVec3,
    dp: DVec3,
    dd: DVec3,
}

impl Facet {
    /// A triangle on a sphere around `center` in the way of the ray from `p` along `d`, with the sphere's normals
    /// towards the ray.
    fn on_sphere(p: DVec3, d: DVec3, (center, radius, eta): (DVec3, f64, f64)) -> Self {
        let hit = p + d * Self::sphere_distance(p, d, center, radius);
        let n = (hit - center) / radius;
        let (x, y) = n.any_orthonormal_pair();
        let corner = |a: f64, b: f64| center + (n + 0.15 * (a * x + b * y)).normalize() * radius;
        let corners = [corner(-1.0, -0.7), corner(1.1, -0.6), corner(0.1, 1.2)];
        let side = if n.dot(d) < 0.0 { 1.0 } else { -1.0 };
        Self { corners, normals: corners.map(|c| side * (c - center) / radius), eta }
    }

    fn sphere_distance(p: DVec3, d: DVec3, center: DVec3, radius: f64) -> f64 {
        let (b, c) = (d.dot(p - center), (p - center).length_squared() - radius * radius);
        let root = (b * b - c).sqrt();
        if -b - root > 1e-6 { -b - root } else { -b + root }
    }

    fn edges(&self) -> (DVec3, DVec3) {
        (self.corners[1] - self.corners[0], self.corners[2] - self.corners[0])
    }

    /// Distance to the triangle's plane, the interpolated normal there.
    fn meet(&self, p: DVec3, d: DVec3) -> (f64, SmoothNormal) {
        let (e1, e2) = self.edges();
        let n = e1.cross(e2);
        let t = (self.corners[0] - p).dot(n) / d.dot(n);
        let at = p + t * d - self.corners[0];
        let (b1, b2) = (at.cross(e2).dot(n) / n.dot(n), e1.cross(at).dot(n) / n.dot(n));
        let (dn1, dn2) = (self.normals[1] - self.normals[0], self.normals[2] - self.normals[0]);
        (t, SmoothNormal { e1, e2, dn1, dn2, unnormalized: self.normals[0] + b1 * dn1 + b2 * dn2 })
    }

    fn bend(&self, d: DVec3, n: DVec3) -> DVec3 {
        if self.eta == 0.0 {
            return d - 2.0 * d.dot(n) * n;
        }
        let cosine = d.dot(n);
        self.eta * d - (self.eta * cosine + (1.0 - self.eta * self.eta * (1.0 - cosine * cosine)).sqrt()) * n
    }

    /// The ray behind the facet with its derivative by the rules under test.
    fn follow(&self, s: State) -> State {
        let (t, smooth) = self.meet(s.p, s.d);
        let (e1, e2) = self.edges();
        let dp = transfer(s.dp, s.dd, s.d, e1.cross(e2).normalize(), t);
        let (n, dn) = (smooth.unnormalized.normalize(), smooth.derivative(dp));
        let d = self.bend(s.d, n);
        let dd = match self.eta {
            0.0 => reflect(s.dd, s.d, n, dn),
            eta => refract(s.dd, s.d, dn, Boundary { n, eta, r: d }),
        };
        State { p: s.p + t * s.d, d, dp, dd }
    }

    /// The ray alone.
    fn trace(&self, (p, d): (DVec3, DVec3)) -> (DVec3, DVec3) {
        let (t, smooth) = self.meet(p, d);
        (p + t * d, self.bend(d, smooth.unnormalized.normalize()))
    }

    /// The same step for the kernel.
    fn step(&self, s: State) -> DifferentialStep {
        let (t, smooth) = self.meet(s.p, s.d);
        let v = |v: DVec3| v.as_vec3().to_array();
        let (e1, e2) = self.edges();
        DifferentialStep {
            dp: v(s.dp),
            t: t as f32,
            dd: v(s.dd),
            eta: self.eta as f32,
            d: v(s.d),
            normal: v(e1.cross(e2).normalize()),
            e1: v(e1),
            e2: v(e2),
            dn1: v(smooth.dn1),
            dn2: v(smooth.dn2),
            interpolated: v(smooth.unnormalized),
            ..DifferentialStep::default()
        }
    }
}

/// Systems of facets in the way of one ray: a plane mirror, a spherical mirror, a lens, and three bounces.
fn systems(p: DVec3, d: DVec3) -> Vec<(&'static str, Vec<Facet>)> {
    let flat = |normal: DVec3, at: DVec3, eta: f64| {
        let (x, y) = normal.any_orthonormal_pair();
        Facet { corners: [at - x - y, at + 2.0 * x, at + 2.0 * y], normals: [normal; 3], eta }
    };
    let behind = |facets: &[Facet]| facets.iter().fold((p, d), |ray, facet| facet.trace(ray));
    let plane = flat(DVec3::new(0.3, 0.2, -1.0).normalize(), p + 2.0 * d, 0.0);
    let concave = Facet::on_sphere(p, d, (p + 0.5 * d + DVec3::new(0.2, -0.1, 0.0), 2.0, 0.0));
    let mut lens = vec![Facet::on_sphere(p, d, (p + 3.0 * d + DVec3::new(0.2, 0.3, 0.1), 1.0, 1.0 / 1.5))];
    let (q, e) = behind(&lens);
    lens.push(Facet::on_sphere(q, e, (p + 3.0 * d + DVec3::new(0.2, 0.3, 0.1), 1.0, 1.5)));
    let mut bounces = vec![flat(DVec3::new(-0.2, 0.4, -1.0).normalize(), p + 1.5 * d, 0.0)];
    for center in [DVec3::new(0.3, -0.2, 0.1), DVec3::new(-0.4, 0.1, 0.2)] {
        let (q, e) = behind(&bounces);
        bounces.push(Facet::on_sphere(q, e, (q + 2.5 * e + center, 1.2, 0.0)));
    }
    vec![("mirror", vec![plane]), ("spherical mirror", vec![concave]), ("lens", lens), ("three bounces", bounces)]
}

fn rays() -> Vec<(DVec3, DVec3)> {
    let turn = |i: f64| DVec3::new((1.3 * i).sin(), (2.1 * i).cos(), 2.0 + (0.7 * i).sin()).normalize();
    (0..12).map(|i| (DVec3::new(0.1 * f64::from(i), 0.2, -0.3), turn(f64::from(i)))).collect()
}

/// Largest relative error of the end state's derivative against central differences.
fn error(facets: &[Facet], start: State) -> f64 {
    let h = 1e-5;
    let shifted = |h: f64| {
        let ray = (start.p + h * start.dp, (start.d + h * start.dd).normalize());
        facets.iter().fold(ray, |ray, facet| facet.trace(ray))
    };
    let (plus, minus) = (shifted(h), shifted(-h));
    let end = facets.iter().fold(start, |state, facet| facet.follow(state));
    let relative = |found: DVec3, exact: DVec3| (found - exact).length() / exact.length();
    relative(end.dp, (plus.0 - minus.0) / (2.0 * h)).max(relative(end.dd, (plus.1 - minus.1) / (2.0 * h)))
}

/// Derivatives of direction are perpendicular to it.
fn starts(p: DVec3, d: DVec3) -> [State; 2] {
    let (x, y) = d.any_orthonormal_pair();
    [State { p, d, dp: 0.2 * x + 0.1 * y, dd: 0.05 * y }, State { p, d, dp: DVec3::ZERO, dd: 0.3 * x - 0.1 * y }]
}

fn differentials(lab: &mut Lab) -> Result<()> {
    let names: Vec<&str> = systems(rays()[0].0, rays()[0].1).iter().map(|(name, _)| *name).collect();
    for (k, name) in names.into_iter().enumerate() {
        let of_ray = |(p, d): (DVec3, DVec3)| {
            let (_, facets) = systems(p, d).swap_remove(k);
            starts(p, d).map(|start| error(&facets, start)).into_iter().fold(0.0, worse)
        };
        let off = rays().into_iter().map(of_ray).fold(0.0, worse);
        lab.found(format!("{name}: against finite differences"), off, 1e-3, Within::AtMost);
    }
    // Without the derivative of the normal a curved mirror must fail.
    let (p, d) = rays()[0];
    let (_, mut facets) = systems(p, d).swap_remove(1);
    let start = starts(p, d)[0];
    let exact = facets[0].follow(start);
    facets[0].normals = [facets[0].normals[0]; 3];
    let flat = facets[0].follow(start);
    let curvature = (exact.dd - flat.dd).length() / exact.dd.length();
    lab.found("what the mirror's curvature changes", curvature, 1e-2, Within::AtLeast);
    kernels(lab)
}

/// The functions of the photon kernels against those of the host.
fn kernels(lab: &mut Lab) -> Result<()> {
    let (mut steps, mut expected) = (Vec::new(), Vec::new());
    for (p, d) in rays() {
        for (_, facets) in systems(p, d) {
            for mut state in starts(p, d) {
                for facet in &facets {
                    steps.push(facet.step(state));
                    state = facet.follow(state);
                    expected.push(state);
                }
            }
        }
    }
    let mut g = Graph::new();
    let input = g.upload("steps", &steps);
    let mut results = g.buffer("results", 2 * expected.len() as u32);
    run(&mut g, &input, &mut results);
    let readback = g.readback(&results);
    let found = lab.run(g, |executable| executable.read(&readback))?;
    let off = |found: [f32; 4], exact: DVec3| {
        (DVec3::new(found[0].into(), found[1].into(), found[2].into()) - exact).length() / exact.length()
    };
    let both = |(i, state): (usize, &State)| worse(off(found[2 * i], state.dp), off(found[2 * i + 1], state.dd));
    let worst = expected.iter().enumerate().map(both).fold(0.0, worse);
    lab.found("kernels against the host", worst, 1e-4, Within::AtMost);
    lab.found("a wrong vector against the host", off(found[1], expected[0].dp), 1e-4, Within::AtLeast);
    Ok(())
}
