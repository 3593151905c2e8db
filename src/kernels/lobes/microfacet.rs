//! Microfacets after GGX in double precision: the reference of the functions of the same names in `glsl/lib/bsdf.glsl`.
//!
//! Directions are unit vectors away from the surface in the frame of the shading normal: z is the cosine.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

/// Density of microfacet normals per projected area and solid angle (Walter et al. 2007, equation 33).
pub fn ggx_d(cosine: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let t = 1.0 + (a2 - 1.0) * cosine * cosine;
    a2 / (PI * t * t)
}

/// Smith's Lambda for a direction with this cosine (Heitz 2014, equation 72).
pub fn ggx_lambda(cosine: f64, alpha: f64) -> f64 {
    let c2 = (cosine * cosine).max(1e-12);
    0.5 * ((1.0 + alpha * alpha * (1.0 - c2) / c2).sqrt() - 1.0)
}

/// Part of the facets seen from one direction that is also seen from the other: G2 / G1 for cosines in [0, 1], with
/// masking and shadowing correlated by height.
pub fn facet_weight(own: f64, other: f64, alpha: f64) -> f64 {
    let (own, other) = (ggx_lambda(own.abs(), alpha), ggx_lambda(other.abs(), alpha));
    (1.0 + own) / (1.0 + own + other)
}

/// The lobe of reflection with reflectance 1 and single scattering [1/sr]: D G2 / (4 cos cos).
pub fn ggx_reflection(wo: DVec3, wi: DVec3, alpha: f64) -> f64 {
    if wo.z <= 0.0 || wi.z <= 0.0 {
        return 0.0;
    }
    let h = (wo + wi).normalize();
    let g = 1.0 / (1.0 + ggx_lambda(wo.z, alpha) + ggx_lambda(wi.z, alpha));
    ggx_d(h.z.clamp(0.0, 1.0), alpha) * g / (4.0 * wo.z * wi.z)
}

/// A facet from the distribution of normals that are visible from `w`, whose z is positive; `u` in [0, 1)^2 (Heitz
/// 2018).
pub fn sample_visible_normal(w: DVec3, alpha: f64, u: DVec2) -> DVec3 {
    let v = DVec3::new(alpha * w.x, alpha * w.y, w.z).normalize();
    let across = v.x.hypot(v.y);
    let t1 = if across > 0.0 { DVec3::new(-v.y, v.x, 0.0) / across } else { DVec3::X };
    let t2 = v.cross(t1);
    let (r, phi) = (u.x.sqrt(), 2.0 * PI * u.y);
    let (p1, s) = (r * phi.cos(), 0.5 * (1.0 + v.z));
    let p2 = (1.0 - s) * (1.0 - p1 * p1).max(0.0).sqrt() + s * r * phi.sin();
    let n = p1 * t1 + p2 * t2 + (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt() * v;
    DVec3::new(alpha * n.x, alpha * n.y, n.z.max(1e-9)).normalize()
}

/// Density of these facets [1/sr], seen from a direction with cosine `own`: D G1 max(0, w . h) / cos.
pub fn visible_normal_density(w: DVec3, h: DVec3, alpha: f64) -> f64 {
    ggx_d(h.z, alpha) * w.dot(h).max(0.0) / (1.0 + ggx_lambda(w.z, alpha)) / w.z
}

/// (1 - cos)^5 of Schlick's formula (1994).
pub fn schlick_edge(cosine: f64) -> f64 {
    (1.0 - cosine).clamp(0.0, 1.0).powi(5)
}

/// Reflectance of a smooth boundary between dielectrics; `eta` is n_incident / n_transmitted. Total reflection gives 1.
pub fn fresnel_dielectric(cosine: f64, eta: f64) -> f64 {
    let sin2 = eta * eta * (1.0 - cosine * cosine).max(0.0);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let inside = (1.0 - sin2).sqrt();
    let parallel = (cosine - eta * inside) / (cosine + eta * inside);
    let perpendicular = (eta * cosine - inside) / (eta * cosine + inside);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Direction behind a boundary with normal `h` for light that is seen from `w`; `None` where all is reflected.
pub fn refract(w: DVec3, h: DVec3, eta: f64) -> Option<DVec3> {
    let cosine = w.dot(h);
    let k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    (k > 0.0).then(|| (-eta * w + (eta * cosine - k.sqrt()) * h).normalize())
}
