//! Triangles for trees that the device builds: their boxes, and their places in the leaves.
//!
//! The boxes go to a builder of trees over boxes ([`super::lbvh`]), whose order of the items says where each triangle
//! lies. Ids stay what they are: a triangle's place in the list of the scene. What no ray can hit gets an inverted box
//! and is left out, by the same rule as in [`super::bvh_host`] but for needles thinner than 2^-44 of their length,
//! which are left out here and which no ray of single precision meets.
//!
//! 48 bytes read and 24 written per box, 100 read and 48 written per packed triangle.

use super::bvh_host::TriangleTag;
use super::generated::{Aabb, BvhTriangle};
use super::generated::{TriangleBoxes, TriangleBoxesBindings, TriangleBoxesParams};
use super::generated::{TrianglePack, TrianglePackBindings, TrianglePackParams};
use super::lbvh::{self, Lbvh};
use super::reduce::reference_bounds;
use super::{collapse, hploc};
use crate::graph::{Buf, Graph, Grid};

/// Who decides which triangles lie together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Builder {
    /// The codes of the triangles' places ([`super::lbvh`]): fast.
    Lbvh,
    /// The areas of boxes around neighbours ([`super::hploc`]): better.
    Hploc,
}

/// Triangles in device memory.
#[derive(Clone, Copy)]
pub struct Mesh<'a> {
    /// Corners, in scene units.
    pub positions: &'a Buf<[f32; 3]>,
    /// Three indices into the corners for each triangle.
    pub triangles: &'a Buf<[u32; 3]>,
    /// Flags and material of each triangle, see [`tags`].
    pub tags: &'a Buf<[u32; 2]>,
}

/// What is in the leaves of a tree; the parts are those of [`Lbvh`].
#[derive(Clone, Copy)]
pub struct Leaves<'a> {
    /// Triangles in the order of the leaves.
    pub items: &'a Buf<u32>,
    /// Three words: triangles in the tree, those left out, nodes.
    pub counts: &'a Buf<u32>,
}

/// The box of each triangle, inverted where no ray can hit it.
pub fn boxes(g: &mut Graph, mesh: Mesh<'_>) -> Buf<Aabb> {
    let triangles = mesh.triangles.len();
    let mut boxes = g.buffer("triangle_boxes", triangles);
    let params = TriangleBoxesParams { vertices: mesh.positions.len(), triangles };
    let bind = TriangleBoxesBindings { positions: mesh.positions, corners: mesh.triangles, boxes: &mut boxes };
    g.dispatch(TriangleBoxes, Grid::Threads(triangles), params, bind);
    boxes
}

/// Writes the triangles of a tree in the order of its leaves.
///
/// # Panics
/// If there is room for fewer than the tree may hold.
pub fn pack(g: &mut Graph, mesh: Mesh<'_>, boxes: &Buf<Aabb>, leaves: Leaves<'_>, packed: &mut Buf<BvhTriangle>) {
    let capacity = mesh.triangles.len();
    assert!(packed.len() >= capacity, "room for {} of {capacity} triangles", packed.len());
    let bind = TrianglePackBindings {
        counts: leaves.counts,
        items: leaves.items,
        boxes,
        positions: mesh.positions,
        corners: mesh.triangles,
        tags: mesh.tags,
        triangles: packed,
    };
    g.dispatch(TrianglePack, Grid::Threads(capacity), TrianglePackParams { capacity }, bind);
}

/// Builds a tree over `boxes`, those of triangles, with leaves as the surface-area heuristic wants them.
///
/// `fences` as in [`lbvh::Options`].
pub fn tree(g: &mut Graph, boxes: &Buf<Aabb>, builder: Builder, fences: bool) -> Lbvh {
    let binary = match builder {
        Builder::Lbvh => lbvh::binary(g, boxes, fences),
        Builder::Hploc => hploc::binary(g, boxes),
    };
    collapse::leaves(g, boxes, binary, fences)
}

/// What rides with triangles as the device reads it.
pub fn tags(tags: impl IntoIterator<Item = TriangleTag>) -> Vec<[u32; 2]> {
    tags.into_iter().map(|TriangleTag { flags, material }| [flags, material]).collect()
}

/// The specification of [`boxes`].
pub fn reference_boxes(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<Aabb> {
    let corner = |&index: &u32| positions.get(index as usize).filter(|p| p.iter().all(|x| x.is_finite())).copied();
    let hittable = |corners: &[u32; 3]| -> Option<[[f32; 3]; 3]> {
        let [a, b, c] = corners;
        Some([corner(a)?, corner(b)?, corner(c)?]).filter(|corners| has_area(*corners))
    };
    let around = |points: [[f32; 3]; 3]| reference_bounds(&points.map(|point| Aabb { min: point, max: point }));
    triangles.iter().map(|corners| hittable(corners).map_or_else(|| reference_bounds(&[]), around)).collect()
}

/// The specification of [`pack`]: triangles by id in the order of `items`.
pub fn reference_pack(
    (positions, triangles): (&[[f32; 3]], &[[u32; 3]]),
    tags: &[[u32; 2]],
    boxes: &[Aabb],
    items: &[u32],
) -> Vec<BvhTriangle> {
    let with_bits = |[x, y, z]: [f32; 3], bits: u32| [x, y, z, f32::from_bits(bits)];
    let pack = |&id: &u32| {
        let hittable = super::reduce::is_valid(&boxes[id as usize]);
        let place = |corner: u32| if hittable { positions[corner as usize] } else { [0.0; 3] };
        let ([a, b, c], [flags, material]) = (triangles[id as usize].map(place), tags[id as usize]);
        BvhTriangle { v0: with_bits(a, id), v1: with_bits(b, flags), v2: with_bits(c, material) }
    };
    items.iter().map(pack).collect()
}

/// Mirror of glsl/lib/area.glsl, where the reasons stand.
fn has_area([a, b, c]: [[f32; 3]; 3]) -> bool {
    let ((e, e_low), (f, f_low)) = (halved_edge(b, a), halved_edge(c, a));
    let (e_size, f_size) = (largest_part(e), largest_part(f));
    if !(e_size >= f32::MIN_POSITIVE && f_size >= f32::MIN_POSITIVE) {
        return false;
    }
    let exponent = |size: f32| ((size.to_bits() >> 23) as i32 - 127).clamp(-126, 126);
    let power = |exponent: i32| f32::from_bits(((127 + exponent) as u32) << 23);
    let (e_unit, f_unit) = (power(-exponent(e_size)), power(-exponent(f_size)));
    let ([e, e_low], [f, f_low]) =
        ([e, e_low].map(|v| v.map(|x| x * e_unit)), [f, f_low].map(|v| v.map(|x| x * f_unit)));
    let area: [f32; 3] = std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let ((p, p_low), (q, q_low)) = (exact_product(e[i], f[j]), exact_product(e[j], f[i]));
        let p_rest = p_low + (e[i] * f_low[j] + e_low[i] * f[j]);
        let q_rest = q_low + (e[j] * f_low[i] + e_low[j] * f[i]);
        (p - q) + (p_rest - q_rest)
    });
    largest_part(area) >= power((-128 - exponent(e_size) - exponent(f_size)).clamp(-44, 5))
}

/// Half of `to - from` with its rounding error.
fn halved_edge(to: [f32; 3], from: [f32; 3]) -> ([f32; 3], [f32; 3]) {
    let difference = |k: usize| {
        let (x, y) = (0.5 * to[k], 0.5 * from[k]);
        let difference = x - y;
        let part = difference - x;
        (difference, (x - (difference - part)) - (y + part))
    };
    (std::array::from_fn(|k| difference(k).0), std::array::from_fn(|k| difference(k).1))
}

/// `x y` with its rounding error.
fn exact_product(x: f32, y: f32) -> (f32, f32) {
    let product = x * y;
    let high = |v: f32| {
        let wide = 4097.0 * v;
        wide - (wide - v)
    };
    let (x_high, y_high) = (high(x), high(y));
    let (x_low, y_low) = (x - x_high, y - y_high);
    (product, ((x_high * y_high - product) + x_high * y_low + x_low * y_high) + x_low * y_low)
}

fn largest_part([x, y, z]: [f32; 3]) -> f32 {
    x.abs().max(y.abs().max(z.abs()))
}
