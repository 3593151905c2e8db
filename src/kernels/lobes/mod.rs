//! Lobes of materials: the reference in double precision of `glsl/lib/{bsdf,scatter,glass}.glsl`, and the tables that
//! the kernels read.
//!
//! Directions are unit vectors away from the surface in the frame of the shading normal: z is the cosine. A surface has
//! one colour channel here.

pub mod microfacet;
pub mod probe;
pub mod table;

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use microfacet::{
    facet_weight, fresnel_dielectric, ggx_d, ggx_lambda, ggx_reflection, refract, sample_visible_normal, schlick_edge,
};

/// An opaque surface: metal, and a base under a coat, by share.
#[derive(Debug, Clone, Copy)]
pub struct Opaque {
    /// Share of metal.
    pub metallic: f64,
    /// Reflectance of the metal head-on and of the base.
    pub base: f64,
    /// Reflectance of the coat, head-on and at the horizon.
    pub coat: [f64; 2],
    /// GGX alpha.
    pub alpha: f64,
}

impl Opaque {
    /// What a facet reflects, where `scales` is the product of the scales of both directions.
    pub fn facet_reflectance(&self, cosine: f64, scales: f64) -> f64 {
        let ([f0, f90], m) = (self.coat, self.metallic);
        let mix = |coat: f64, metal: f64| coat * (1.0 - m) + metal * m;
        let edge = schlick_edge(cosine);
        let (head_on, horizon, again) = (mix(f0, self.base), mix(f90, 1.0), mix(f0 * f0, self.base * self.base));
        head_on + (horizon - head_on) * edge + (scales - 1.0) * (again + (head_on - again) * edge)
    }

    /// Scale of the glossy lobe for a cosine.
    pub fn scale(&self, cosine: f64) -> f64 {
        table::reflection(self.alpha, Some(cosine)).scale
    }

    fn below(&self, lobe: table::LobeEntry) -> f64 {
        1.0 - lobe.albedo(self.coat[0], self.coat[1])
    }

    /// Diffuse reflectance of the base under its coat, between directions with these cosines.
    pub fn base_reflectance(&self, own: f64, other: f64) -> f64 {
        let below = |cosine| self.below(table::reflection(self.alpha, cosine));
        self.base * (1.0 - self.metallic) * below(Some(own)) * below(Some(other)) / below(None)
    }

    /// The BSDF [1/sr].
    pub fn bsdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let cosine = wo.dot((wo + wi).normalize());
        let scales = self.scale(wo.z) * self.scale(wi.z);
        self.facet_reflectance(cosine, scales) * ggx_reflection(wo, wi, self.alpha)
            + self.base_reflectance(wo.z, wi.z) / PI
    }

    /// Density [1/sr] with which a gathered direction is drawn (`gathered_density`); `absorb` lets paths end.
    pub fn density(&self, wo: DVec3, wi: DVec3, absorb: bool) -> f64 {
        let facet = (wo + wi).normalize();
        let scales = self.scale(wo.z) * self.scale(wi.z);
        let reflect = self.facet_reflectance(wo.dot(facet), scales) * facet_weight(wo.z, wi.z, self.alpha);
        let diffuse = self.base * (1.0 - self.metallic) * self.below(table::reflection(self.alpha, Some(wo.z)));
        let facets = ggx_d(facet.z, self.alpha) / (1.0 + ggx_lambda(wo.z, self.alpha)) / (4.0 * wo.z);
        let total = diffuse + reflect;
        let norm = if total > 1.0 || !absorb { 1.0 / total } else { 1.0 };
        (reflect * facets + diffuse * wi.z / PI) * norm
    }
}

/// A rough boundary between dielectrics that absorbs nothing.
#[derive(Debug, Clone)]
pub struct Boundary {
    /// Index inside over that outside.
    pub ior: f64,
    /// GGX alpha.
    pub alpha: f64,
    words: Vec<u32>,
}

/// A way on from a boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    /// Unit direction.
    pub direction: DVec3,
    /// Share of the light that goes there.
    pub weight: f64,
}

impl Boundary {
    /// Works out its table.
    pub fn new(ior: f64, alpha: f64) -> Self {
        Self { ior, alpha, words: table::boundary_words(ior) }
    }

    /// The same index with another roughness.
    pub fn with_alpha(&self, alpha: f64) -> Self {
        Self { alpha, ..self.clone() }
    }

    /// Table for the kernels.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Share of the light that meets more than one facet.
    pub fn missing(&self, cosine: Option<f64>, inside: bool) -> f64 {
        1.0 - table::boundary(&self.words, self.alpha, (cosine, inside))
    }

    /// Weight of radiance on a side: the square of its index.
    fn side(&self, inside: bool) -> f64 {
        if inside { self.ior * self.ior } else { 1.0 }
    }

    /// Lobe of the light that meets more than one facet, from a cosine on one side to one on the other or the same,
    /// with the cosine of the latter left out: times pi, a share of the flux.
    pub fn again(&self, (own, from_inside): (f64, bool), (other, to_inside): (f64, bool)) -> f64 {
        let all = |inside| self.side(inside) * self.missing(None, inside);
        self.missing(Some(own), from_inside) * self.missing(Some(other), to_inside) * self.side(to_inside)
            / (all(false) + all(true))
    }

    /// Reflection and refraction as `glass_ways` samples them: `w` is the direction to the side from which light is
    /// seen, with z > 0 on that side, `u` in [0, 1)^2.
    pub fn ways(&self, w: DVec3, inside: bool, u: DVec2) -> [Option<Way>; 2] {
        let missing = self.missing(Some(w.z), inside);
        if u.x < missing {
            let (r, phi) = ((u.x / missing).sqrt(), 2.0 * PI * u.y);
            let up = DVec3::new(r * phi.cos(), r * phi.sin(), (1.0 - r * r).max(0.0).sqrt());
            let share = |to| self.again((w.z, inside), (up.z, to)) / missing;
            let down = up - 2.0 * up.z * DVec3::Z;
            return [(up, inside), (down, !inside)].map(|(direction, to)| Some(Way { direction, weight: share(to) }));
        }
        let kept = 1.0 - missing;
        let h = sample_visible_normal(w, self.alpha, DVec2::new((u.x - missing) / kept, u.y));
        let eta = if inside { self.ior } else { 1.0 / self.ior };
        let reflectance = fresnel_dielectric(w.dot(h), eta);
        let up = 2.0 * w.dot(h) * h - w;
        let way = |direction: DVec3, share: f64| Way {
            direction,
            weight: share * facet_weight(w.z, direction.z, self.alpha) / kept,
        };
        let down = refract(w, h, eta).filter(|down| down.z < 0.0);
        [(up.z > 0.0).then(|| way(up, reflectance)), down.map(|down| way(down, 1.0 - reflectance))]
    }
}

#[cfg(test)]
mod tests;
