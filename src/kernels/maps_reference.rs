//! Environment maps on the host: the specification of the kernels in glsl/kernels/maps, and maps by rays for tests.

use super::generated::{BvhNode, BvhTriangle, MapTexel};
use super::maps::{MAP_FACES, Search, Shape};
use super::trace::{MISS, ray, traverse};

type V3 = [f32; 3];

fn sub(a: V3, b: V3) -> V3 {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: V3, b: V3) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: V3, b: V3) -> V3 {
    std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
}

fn length(a: V3) -> f32 {
    dot(a, a).sqrt()
}

fn along(origin: V3, d: V3, t: f32) -> V3 {
    std::array::from_fn(|k| origin[k] + t * d[k])
}

fn xyz(v: [f32; 4]) -> V3 {
    [v[0], v[1], v[2]]
}

/// In place of the ratio where a ray begins, which is on a surface.
const BEGIN: f32 = 0.0;

/// The texel in which a direction lies, counted from the first one of its map.
pub fn texel(d: V3, resolution: u32) -> u32 {
    let size = d.map(f32::abs);
    let axis = if size[0] >= size[1] && size[0] >= size[2] {
        0
    } else if size[1] >= size[2] {
        1
    } else {
        2
    };
    let turned: V3 = std::array::from_fn(|k| d[(axis + k) % 3]);
    let face = 2 * axis as u32 + u32::from(turned[0] < 0.0);
    let at = |x: f32| ((x / turned[0].abs() * 0.5 + 0.5).clamp(0.0, 1.0) * resolution as f32) as u32;
    let [x, y] = [turned[1], turned[2]].map(|x| at(x).min(resolution - 1));
    (face * resolution + y) * resolution + x
}

/// The direction through the middle of a texel, of length one along the axis of its face.
pub fn direction(texel: u32, resolution: u32) -> V3 {
    let (x, row) = (texel % resolution, texel / resolution);
    let (face, y) = (row / resolution, row % resolution);
    let at = |x: u32| (x as f32 + 0.5) * (2.0 / resolution as f32) - 1.0;
    let turned = [if face & 1 != 0 { -1.0 } else { 1.0 }, at(x), at(y)];
    let axis = (face >> 1) as usize;
    std::array::from_fn(|k| turned[(k + 3 - axis) % 3])
}

/// The place that a texel names.
pub fn place(texel: &MapTexel, triangles: &[BvhTriangle]) -> V3 {
    let t = &triangles[texel.triangle as usize];
    let [v0, v1, v2] = [t.v0, t.v1, t.v2].map(xyz);
    std::array::from_fn(|k| v0[k] + texel.b1 * (v1[k] - v0[k]) + texel.b2 * (v2[k] - v0[k]))
}

/// The map of a centre by a ray through each texel.
pub fn by_rays((nodes, triangles): (&[BvhNode], &[BvhTriangle]), centre: V3, resolution: u32) -> Vec<MapTexel> {
    let count = MAP_FACES * resolution * resolution;
    let hit = |i: u32| {
        let d = direction(i, resolution);
        let hit = traverse(nodes, triangles, &ray(centre, d, f32::INFINITY));
        let distance = if hit.triangle == MISS { f32::INFINITY } else { hit.t * length(d) };
        MapTexel { distance, triangle: hit.triangle, b1: hit.b1, b2: hit.b2 }
    };
    (0..count).map(hit).collect()
}

/// What a map says of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Index of the texel.
    pub texel: u32,
    /// Distance from the ray's origin.
    pub t: f32,
    /// One less the cosine between its direction and the ray's.
    pub error: f32,
}

/// A map to search: its texels, their triangles, its centre.
#[derive(Clone, Copy)]
pub struct Map<'a> {
    /// Texels of one layer.
    pub texels: &'a [MapTexel],
    /// All triangles.
    pub triangles: &'a [BvhTriangle],
    /// Where it was taken.
    pub centre: V3,
    /// Texels along a side of a face.
    pub resolution: u32,
}

impl Map<'_> {
    /// The distance of what the map shows in a direction: of the texel's middle with the paper's search, of the
    /// triangle's plane with steps.
    fn shown(&self, to: V3, search: Search) -> f32 {
        let texel = &self.texels[texel(to, self.resolution) as usize];
        if search.steps == 0 || texel.triangle == MISS {
            return texel.distance;
        }
        let t = &self.triangles[texel.triangle as usize];
        let [v0, v1, v2] = [t.v0, t.v1, t.v2].map(xyz);
        let normal = cross(sub(v1, v0), sub(v2, v0));
        let plane = dot(sub(v0, self.centre), normal) / dot(to, normal) * length(to);
        if plane > 0.5 * texel.distance && plane < 2.0 * texel.distance { plane } else { texel.distance }
    }

    fn point(&self, (origin, d): (V3, V3), at: V3, search: Search) -> Option<Found> {
        let texel = texel(at, self.resolution);
        let seen = &self.texels[texel as usize];
        if seen.triangle == MISS {
            return None;
        }
        let to = sub(sub(place(seen, self.triangles), self.centre), origin);
        let t = length(to);
        let middle = Found { texel, t, error: if t > 0.0 { 1.0 - dot(to, d) / t } else { 2.0 } };
        let met = (search.steps > 0).then(|| self.meets(seen.triangle, (origin, d))).flatten();
        Some(met.map_or(middle, |t| Found { texel, t, error: 0.0 }))
    }

    /// The distance at which a ray meets a triangle, if it does.
    fn meets(&self, triangle: u32, (origin, d): (V3, V3)) -> Option<f32> {
        let t = &self.triangles[triangle as usize];
        let [v0, v1, v2] = [t.v0, t.v1, t.v2].map(xyz);
        let (e1, e2, to) = (sub(v1, v0), sub(v2, v0), sub(origin, sub(v0, self.centre)));
        let (across, beside) = (cross(d, e2), cross(to, e1));
        let determinant = dot(e1, across);
        let [at, u, v] = [dot(e2, beside), dot(to, across), dot(d, beside)].map(|x| x / determinant);
        (at > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(at)
    }

    /// False position between a place before the surface and one behind it, `None` as long as none is known.
    fn refine(
        &self,
        (origin, d): (V3, V3),
        mut before: (f32, f32),
        mut behind: Option<(f32, f32)>,
        (mut at, search): (f32, Search),
    ) -> f32 {
        for _ in 0..search.iterations {
            let place = along(origin, d, at);
            let shown = self.shown(place, search);
            let ratio = length(place) / shown;
            if (ratio - 1.0).abs() < 0.001 {
                break;
            }
            if ratio < 1.0 {
                before = (at, ratio);
            } else {
                behind = Some((at, ratio));
            }
            match behind {
                None if shown.is_infinite() => break,
                None => at += shown * (1.0 - ratio),
                Some(behind) => {
                    let part = (1.0 - before.1) / (behind.1 - before.1);
                    at = before.0 * (1.0 - part) + behind.0 * part;
                }
            }
        }
        at
    }

    fn guess(&self, (origin, d): (V3, V3), search: Search) -> Option<Found> {
        let shown = self.shown(d, search);
        if shown.is_infinite() {
            return None;
        }
        let at = (shown - dot(origin, d)).max(0.0);
        let at = self.refine((origin, d), (0.0, BEGIN), None, (at, search));
        self.point((origin, d), along(origin, d, at), search)
    }

    fn march(&self, (origin, d): (V3, V3), search: Search) -> Option<Found> {
        let from = length(origin);
        let angle = dot(origin.map(|x| x / from.max(1e-30)), d).clamp(-1.0, 1.0).acos();
        let mut best: Option<Found> = None;
        let mut before = (0.0, BEGIN);
        let mut in_front = true;
        let steps = ((angle / std::f32::consts::PI * search.steps as f32).ceil() as u32).max(2);
        for k in 1..=steps {
            let part = (k as f32 / steps as f32).min(0.999);
            let at = from * (part * angle).sin() / ((1.0 - part) * angle).sin().max(1e-6);
            let place = along(origin, d, at);
            let ratio = length(place) / self.shown(place, search);
            if ratio > 1.001 && in_front {
                let part = ((1.0 - before.1) / (ratio - before.1)).clamp(0.0, 1.0);
                let middle = before.0 * (1.0 - part) + at * part;
                let found = self.refine((origin, d), before, Some((at, ratio)), (middle, search));
                let point = self.point((origin, d), along(origin, d, found), search);
                if point.is_some_and(|p| p.error <= search.tolerance) {
                    return point;
                }
                if point.is_some_and(|p| p.error < best.map_or(2.0, |b| b.error)) {
                    best = point;
                }
            }
            in_front = ratio <= 1.001;
            if in_front {
                before = (at, ratio);
            }
        }
        best
    }

    /// What the map says of the ray from `origin` along the unit vector `d`; `None`: nothing is there.
    pub fn find(&self, origin: V3, d: V3, search: Search) -> Option<Found> {
        let from = sub(origin, self.centre);
        if search.steps == 0 { self.guess((from, d), search) } else { self.march((from, d), search) }
    }
}

/// The nearest accepted result of all maps: index of the map, and what it found.
pub fn nearest(
    (texels, shape): (&[MapTexel], Shape),
    triangles: &[BvhTriangle],
    centres: &[V3],
    (origin, d, search): (V3, V3, Search),
) -> Option<(usize, Found)> {
    let of_map = shape.texels_of_map() as usize;
    let found = texels.chunks(of_map).enumerate().filter_map(|(map, texels)| {
        let centre = centres[map % centres.len()];
        let found = Map { texels, triangles, centre, resolution: shape.resolution }.find(origin, d, search)?;
        (found.error <= search.tolerance).then_some((map, found))
    });
    found.reduce(|best, next| if next.1.t < best.1.t { next } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_texels_belong_together() {
        for resolution in [1, 2, 5, 32] {
            for i in 0..MAP_FACES * resolution * resolution {
                assert_eq!(texel(direction(i, resolution), resolution), i, "texel {i} of {resolution}");
            }
        }
        assert_eq!([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(|d| texel(d, 1)), [0, 1, 2]);
        assert_eq!([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]].map(|d| texel(d, 1)), [3, 4, 5]);
    }
}
