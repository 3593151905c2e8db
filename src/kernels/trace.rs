//! Rays against the triangles of a tree: closest hit and any hit.
//!
//! The device side is glsl/lib/traverse.glsl, used by every kernel that traces, and the two kernels here, which trace
//! buffers of rays. The host side mirrors glsl/lib/intersect.glsl operation by operation. The specification is
//! [`reference()`]: a loop over all triangles. Hits do not depend on the tree, not even among hits at equal distance.
//!
//! Host and device agree bit for bit where the device rounds additions, multiplications *and divisions* correctly
//! (software devices do). Vulkan allows 2.5 ulp for a division; there `t` and the barycentrics may differ in the last
//! bits.
//!
//! Sources: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013); Ize, "Robust BVH Ray Traversal"
//! (JCGT 2013); Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th edition, section 6.8.6.

use super::bvh_host::{Aabb, COUNT_ONE, FIRST_MASK, LEAF};
use super::generated::{
    BvhNode, BvhTriangle, Ray, RayHit, TraceAny, TraceAnyBindings, TraceAnyParams, TraceClosest, TraceClosestBindings,
    TraceClosestParams, TraceSpawn, TraceSpawnBindings, TraceSpawnParams,
};
pub use crate::constants::BVH_MISS as MISS;
use crate::graph::{Buf, Graph, Grid};

/// A tree in device memory.
#[derive(Clone, Copy)]
pub struct Tree<'a> {
    /// Inner nodes; node 0 is the root.
    pub nodes: &'a Buf<BvhNode>,
    /// Triangles in leaf order.
    pub triangles: &'a Buf<BvhTriangle>,
}

/// Adds the pass that finds the closest hit of every ray.
pub fn closest(g: &mut Graph, tree: Tree<'_>, rays: &Buf<Ray>, hits: &mut Buf<RayHit>) {
    assert_eq!(rays.len(), hits.len(), "one hit for each ray");
    let params = TraceClosestParams { count: rays.len() };
    let bind = TraceClosestBindings { nodes: tree.nodes, triangles: tree.triangles, rays, hits };
    g.dispatch(TraceClosest, Grid::Threads(rays.len()), params, bind);
}

/// Adds the pass that writes 1 for every ray with a hit and 0 for the others.
pub fn any(g: &mut Graph, tree: Tree<'_>, rays: &Buf<Ray>, occluded: &mut Buf<u32>) {
    assert_eq!(rays.len(), occluded.len(), "one answer for each ray");
    let params = TraceAnyParams { count: rays.len() };
    let bind = TraceAnyBindings { nodes: tree.nodes, triangles: tree.triangles, rays, occluded };
    g.dispatch(TraceAny, Grid::Threads(rays.len()), params, bind);
}

/// Adds the pass that moves the origins of `rays`, whose directions are set, to the hits that they leave; rays without
/// a hit get a largest parameter of 0, which no hit satisfies.
pub fn spawn(g: &mut Graph, triangles: &Buf<BvhTriangle>, hits: &Buf<RayHit>, rays: &mut Buf<Ray>) {
    assert_eq!(rays.len(), hits.len(), "one hit for each ray");
    let params = TraceSpawnParams { count: rays.len() };
    let grid = Grid::Threads(rays.len());
    g.dispatch(TraceSpawn, grid, params, TraceSpawnBindings { triangles, hits, rays });
}

/// A ray from `origin` along `direction` (in lengths of which `t_max` counts).
pub fn ray(origin: [f32; 3], direction: [f32; 3], t_max: f32) -> Ray {
    let [x, y, z] = origin;
    let [u, v, w] = direction;
    Ray { origin: [x, y, z, t_max], direction: [u, v, w, 0.0] }
}

/// Closest hit by a loop over all triangles: the specification of the device code. `bounds` is the box of the scene,
/// [`scene_bounds`].
pub fn reference(bounds: &Aabb, triangles: &[BvhTriangle], ray: &Ray) -> RayHit {
    let mut best = Best::new(ray);
    if bounds.min[0] <= bounds.max[0] {
        let frame = Frame::new(xyz(ray.origin), xyz(ray.direction), bounds);
        (0..).zip(triangles).for_each(|(index, triangle)| best.test(&frame, corners_and_id(triangle), index));
    }
    best.hit
}

/// Box of all triangles, as the root of any tree over them has it.
pub fn scene_bounds(nodes: &[BvhNode]) -> Aabb {
    let mut bounds = Aabb::EMPTY;
    if let Some(root) = nodes.first() {
        bounds.merge(&Aabb { min: xyz(root.min0), max: xyz(root.max0) });
        bounds.merge(&Aabb { min: xyz(root.min1), max: xyz(root.max1) });
    }
    bounds
}

/// Closest hit through the tree, on the host: for tests, and for the few rays that are not worth a dispatch.
pub fn traverse(nodes: &[BvhNode], triangles: &[BvhTriangle], ray: &Ray) -> RayHit {
    traverse_by(nodes, |index| corners_and_id(&triangles[index as usize]), ray)
}

/// The same over triangles that are not packed: `triangle` gives the corners of the one at a place in leaf order, and
/// its original id.
pub fn traverse_by(nodes: &[BvhNode], triangle: impl Fn(u32) -> ([[f32; 3]; 3], u32), ray: &Ray) -> RayHit {
    let mut best = Best::new(ray);
    let bounds = scene_bounds(nodes);
    if bounds.min[0] > bounds.max[0] {
        return best.hit;
    }
    let frame = Frame::new(xyz(ray.origin), xyz(ray.direction), &bounds);
    let mut stack = vec![(0u32, 0.0f32)];
    while let Some((reference, enter)) = stack.pop() {
        if enter > best.hit.t {
            continue;
        }
        if reference & LEAF != 0 {
            let first = reference & FIRST_MASK;
            let count = (reference & !LEAF) / COUNT_ONE + 1;
            (first..first + count).for_each(|index| best.test(&frame, triangle(index), index));
            continue;
        }
        let node = &nodes[reference as usize];
        let (enter0, leave0) = frame.slab(xyz(node.min0), xyz(node.max0));
        let (enter1, leave1) = frame.slab(xyz(node.min1), xyz(node.max1));
        let (enter0, enter1) = (maximum(enter0, 0.0), maximum(enter1, 0.0));
        let child0 = (enter0 <= minimum(leave0, best.hit.t)).then_some((node.min0[3].to_bits(), enter0));
        let child1 = (enter1 <= minimum(leave1, best.hit.t)).then_some((node.max0[3].to_bits(), enter1));
        let (near, far) = if enter1 < enter0 { (child1, child0) } else { (child0, child1) };
        stack.extend(far.into_iter().chain(near));
    }
    best.hit
}

fn corners_and_id(triangle: &BvhTriangle) -> ([[f32; 3]; 3], u32) {
    ([xyz(triangle.v0), xyz(triangle.v1), xyz(triangle.v2)], triangle.v0[3].to_bits())
}

/// The best hit so far.
struct Best {
    hit: RayHit,
    id: u32,
}

impl Best {
    fn new(ray: &Ray) -> Self {
        Self { hit: RayHit { t: ray.origin[3], b1: 0.0, b2: 0.0, triangle: MISS }, id: MISS }
    }

    fn test(&mut self, frame: &Frame, (corners, id): ([[f32; 3]; 3], u32), index: u32) {
        if let Some((t, [b1, b2])) = frame.intersect(corners)
            && (t < self.hit.t || (t == self.hit.t && id < self.id))
        {
            *self = Self { hit: RayHit { t, b1, b2, triangle: index }, id };
        }
    }
}

/// Mirror of `RayFrame` of glsl/lib/intersect.glsl, where the reasons stand.
pub struct Frame {
    origin: [f32; 3],
    inverse: [f32; 3],
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    negative: [bool; 3],
    /// Axis that the permutation moves to z.
    major: usize,
    shear: [f32; 3],
}

impl Frame {
    /// A ray prepared for tests inside of the box `scene`.
    pub fn new(origin: [f32; 3], direction: [f32; 3], scene: &Aabb) -> Self {
        let size = direction.map(f32::abs);
        let major = match size {
            [x, y, z] if x > y && x > z => 0,
            [_, y, z] if y > z => 1,
            _ => 2,
        };
        let d = to_major_axis(direction, major);
        let reach: [f32; 3] =
            std::array::from_fn(|i| maximum((scene.min[i] - origin[i]).abs(), (scene.max[i] - origin[i]).abs()));
        let r = maximum(reach[0], maximum(reach[1], reach[2]));
        let pad: [f32; 3] = origin.map(|x| r * 2.0f32.powi(-19) + x.abs() * 2.0f32.powi(-23));
        let less: [f32; 3] = std::array::from_fn(|i| origin[i] - pad[i]);
        let more: [f32; 3] = std::array::from_fn(|i| origin[i] + pad[i]);
        let negative = direction.map(|x| x < 0.0);
        Self {
            origin,
            inverse: direction.map(|x| if x == 0.0 { f32::INFINITY } else { 1.0 / x }),
            near_origin: std::array::from_fn(|i| if negative[i] { less[i] } else { more[i] }),
            far_origin: std::array::from_fn(|i| if negative[i] { more[i] } else { less[i] }),
            negative,
            major,
            shear: [d[0] / d[2], d[1] / d[2], 1.0 / d[2]],
        }
    }

    /// Ray parameters where the ray enters and leaves a box; missed unless enter <= leave.
    pub fn slab(&self, low: [f32; 3], high: [f32; 3]) -> (f32, f32) {
        let pick = |first: [f32; 3], second: [f32; 3], origin: [f32; 3]| -> [f32; 3] {
            std::array::from_fn(|i| (if self.negative[i] { second[i] } else { first[i] } - origin[i]) * self.inverse[i])
        };
        let near = pick(low, high, self.near_origin);
        let far = pick(high, low, self.far_origin);
        (maximum(maximum(near[0], near[1]), near[2]), minimum(minimum(far[0], far[1]), far[2]))
    }

    /// Distance and barycentrics of v1 and v2 of a hit from either side with 0 < t.
    pub fn intersect(&self, corners: [[f32; 3]; 3]) -> Option<(f32, [f32; 2])> {
        let permuted = |v: [f32; 3]| to_major_axis(std::array::from_fn(|i| v[i] - self.origin[i]), self.major);
        let project = |v: [f32; 3]| [v[0] - self.shear[0] * v[2], v[1] - self.shear[1] * v[2]];
        let [a, b, c] = corners.map(permuted);
        let [pa, pb, pc] = [a, b, c].map(project);
        let (u, v, w) = (edge_function(pc, pb), edge_function(pa, pc), edge_function(pb, pa));
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        let det = u + v + w;
        let inverse = 1.0 / det;
        let (b0, b1, b2) = (u * inverse, v * inverse, w * inverse);
        let distance = (b0 * a[2] + b1 * b[2] + b2 * c[2]) * self.shear[2];
        let mut bounds = Aabb::EMPTY;
        corners.iter().for_each(|&corner| bounds.grow(corner));
        let t = maximum(distance, self.slab(bounds.min, bounds.max).0);
        (inside && det != 0.0 && t > 0.0).then_some((t, [b1, b2]))
    }
}

/// Mirror of `offset_ray_origin` of glsl/lib/intersect.glsl: where a ray along `direction` starts that leaves the
/// triangle at barycentrics `[b1, b2]`.
pub fn offset_ray_origin([v0, v1, v2]: [[f32; 3]; 3], [b1, b2]: [f32; 2], direction: [f32; 3]) -> [f32; 3] {
    let largest = |v: [f32; 3]| maximum(v[0].abs(), maximum(v[1].abs(), v[2].abs()));
    let e1: [f32; 3] = std::array::from_fn(|i| v1[i] - v0[i]);
    let e2: [f32; 3] = std::array::from_fn(|i| v2[i] - v0[i]);
    let p: [f32; 3] = std::array::from_fn(|i| v0[i] + (b1 * e1[i] + b2 * e2[i]));
    let m = maximum(largest(e1), largest(e2));
    let (f, g) = (e1.map(|x| x / m), e2.map(|x| x / m));
    let mut n = [f[1] * g[2] - f[2] * g[1], f[2] * g[0] - f[0] * g[2], f[0] * g[1] - f[1] * g[0]];
    if largest(n) == 0.0 {
        n = direction;
    }
    let aspect = largest(n);
    let unit = n.map(|x| x / aspect);
    let side = unit[0] * direction[0] + unit[1] * direction[1] + unit[2] * direction[2];
    let unsure = (direction[0].abs() + direction[1].abs() + direction[2].abs()) * 2.0f32.powi(-20) / aspect;
    let spread = if side.abs() <= unsure { 2.0f32.powi(-18) / minimum(aspect, 1.0) } else { 2.0f32.powi(-20) };
    let bound = p.map(|x| x.abs() * 2.0f32.powi(-22) + m * spread);
    let reach = unit[0].abs() * bound[0] + unit[1].abs() * bound[1] + unit[2].abs() * bound[2];
    let step = reach / (unit[0] * unit[0] + unit[1] * unit[1] + unit[2] * unit[2]);
    let step = if side < 0.0 { -step } else { step };
    std::array::from_fn(|i| p[i] + unit[i] * step)
}

fn xyz([x, y, z, _]: [f32; 4]) -> [f32; 3] {
    [x, y, z]
}

fn to_major_axis([x, y, z]: [f32; 3], major: usize) -> [f32; 3] {
    match major {
        0 => [y, z, x],
        1 => [z, x, y],
        _ => [x, y, z],
    }
}

/// GLSL's `max`: the first unless the second is larger.
fn maximum(a: f32, b: f32) -> f32 {
    if a < b { b } else { a }
}

/// GLSL's `min`: the first unless the second is smaller.
fn minimum(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The upper half of the digits.
fn upper_half(v: [f32; 2]) -> [f32; 2] {
    v.map(|x| {
        let c = 4097.0 * x;
        c - (c - x)
    })
}

/// `a.x b.y - a.y b.x` to about an ulp, with the exact sign.
fn edge_function(a: [f32; 2], b: [f32; 2]) -> f32 {
    let (ah, bh) = (upper_half(a), upper_half(b));
    let product = |i: usize, j: usize| {
        let (al, bl) = (a[i] - ah[i], b[j] - bh[j]);
        let product = a[i] * b[j];
        (product, ((ah[i] * bh[j] - product) + ah[i] * bl + al * bh[j]) + al * bl)
    };
    let (p, q) = (product(0, 1), product(1, 0));
    (p.0 - q.0) + (p.1 - q.1)
}
