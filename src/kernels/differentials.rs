//! Photon differentials: the reference in double precision of glsl/lib/differentials.glsl, and a pass that runs the
//! kernels' version.
//!
//! Each function takes one derivative of position `dp` or direction `dd` along a parameter of the ray (Igehy 1999,
//! "Tracing ray differentials"); `d` is the unit direction of travel.

use glam::DVec3;

use super::generated::{DifferentialStep, PhotonDifferential, PhotonDifferentialBindings, PhotonDifferentialParams};
use crate::graph::{Buf, Graph, Grid};

/// Derivative of the position after a flight of length `t` to a plane with this normal. At grazing incidence the
/// position stays perpendicular to the ray instead of going to infinity.
pub fn transfer(dp: DVec3, dd: DVec3, d: DVec3, normal: DVec3, t: f64) -> DVec3 {
    let q = dp + t * dd;
    let cosine = d.dot(normal);
    if cosine.abs() < 1e-6 { q } else { q - d * (q.dot(normal) / cosine) }
}

/// A triangle's interpolated normal: its edges from the first corner, the differences of the vertex normals along them,
/// and the interpolated normal before normalisation.
#[derive(Debug, Clone, Copy)]
pub struct SmoothNormal {
    /// Edge to the second corner.
    pub e1: DVec3,
    /// Edge to the third corner.
    pub e2: DVec3,
    /// Difference of the normals along `e1`.
    pub dn1: DVec3,
    /// Difference of the normals along `e2`.
    pub dn2: DVec3,
    /// Not of unit length.
    pub unnormalized: DVec3,
}

impl SmoothNormal {
    /// Derivative of the unit normal along a displacement in the triangle's plane.
    pub fn derivative(&self, dp: DVec3) -> DVec3 {
        let n = self.e1.cross(self.e2);
        let (b1, b2) = (dp.cross(self.e2).dot(n) / n.dot(n), self.e1.cross(dp).dot(n) / n.dot(n));
        let dn = b1 * self.dn1 + b2 * self.dn2;
        let length = self.unnormalized.length();
        let direction = self.unnormalized / length;
        (dn - direction * direction.dot(dn)) / length
    }
}

/// Derivative of the reflected direction; `n` is the unit normal, `dn` its derivative.
pub fn reflect(dd: DVec3, d: DVec3, n: DVec3, dn: DVec3) -> DVec3 {
    dd - 2.0 * (d.dot(n) * dn + (dd.dot(n) + d.dot(dn)) * n)
}

/// A boundary that refracts.
#[derive(Debug, Clone, Copy)]
pub struct Boundary {
    /// Unit normal on the side of the incoming ray.
    pub n: DVec3,
    /// Index on that side over the index behind.
    pub eta: f64,
    /// Refracted direction.
    pub r: DVec3,
}

/// Derivative of the refracted direction.
pub fn refract(dd: DVec3, d: DVec3, dn: DVec3, Boundary { n, eta, r }: Boundary) -> DVec3 {
    let (d_n, r_n) = (d.dot(n), r.dot(n));
    let mu = eta * d_n - r_n;
    let dmu = (eta - eta * eta * d_n / r_n.min(-1e-6)) * (dd.dot(n) + d.dot(dn));
    eta * dd - (mu * dn + dmu * n)
}

/// Runs steps with the functions that the photon kernels use: two vectors of `results` per step, dp at the surface and
/// dd behind it.
pub fn run(g: &mut Graph, steps: &Buf<DifferentialStep>, results: &mut Buf<[f32; 4]>) {
    let count = steps.len();
    g.dispatch(
        PhotonDifferential,
        Grid::Threads(count),
        PhotonDifferentialParams { count },
        PhotonDifferentialBindings { steps, results },
    );
}
