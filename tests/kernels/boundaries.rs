//! Boundaries around eye hits against known distances: boards, corners, walls, posts, columns, in all sizes.

use nephroid::low_level::graph::{Graph, Grid};
use nephroid::low_level::kernels::bvh_host::{TriangleTag, build_sah, pack_triangles};
use nephroid::low_level::kernels::compact;
use nephroid::low_level::kernels::gather::reference::{BOUNDARY_FAR, lambert_hit, oct_decode};
use nephroid::low_level::kernels::generated::{
    EyeBoundaries, EyeBoundariesBindings, EyeBoundariesParams, EyeHit, Globals, Pass,
};

use crate::support::device::runtime;
use crate::support::proof;

type V3 = [f32; 3];

/// Triangles, three corners each, and how far is looked.
struct Place {
    corners: Vec<V3>,
    reach: f32,
}

impl Place {
    fn new(reach: f32) -> Self {
        Self { corners: vec![], reach }
    }

    fn quad(mut self, a: V3, b: V3, c: V3, d: V3) -> Self {
        self.corners.extend([a, b, c, a, c, d]);
        self
    }

    fn floor(self) -> Self {
        self.quad([-3.0, 0.0, -3.0], [-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0])
    }

    /// A prism upwards over a polygon of (x, z) that turns against the clock as seen from above.
    fn prism(mut self, outline: &[[f32; 2]], [low, high]: [f32; 2]) -> Self {
        let n = outline.len();
        let at = |i: usize, y: f32| [outline[i % n][0], y, outline[i % n][1]];
        for i in 0..n {
            self = self.quad(at(i, low), at(i + 1, low), at(i + 1, high), at(i, high));
            self.corners.extend([at(0, high), at(i, high), at(i + 1, high)]);
            self.corners.extend([at(0, low), at(i + 1, low), at(i, low)]);
        }
        self
    }

    fn cuboid(self, low: V3, high: V3) -> Self {
        let ([a, y, b], [c, h, d]) = (low, high);
        self.prism(&[[a, b], [a, d], [c, d], [c, b]], [y, h])
    }

    /// What the passes find around a point with this normal, in a scene `scale` times as large.
    fn around(&self, (position, normal): (V3, V3), scale: f32, passes: u32) -> Vec<Option<(V3, [f32; 4])>> {
        let positions: Vec<V3> = self.corners.iter().map(|p| p.map(|x| scale * x)).collect();
        let triangles: Vec<[u32; 3]> = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let tree = build_sah(&positions, &triangles);
        let packed = pack_triangles(&positions, &triangles, &tree.order, |_| TriangleTag::default());
        let pass = |index| Pass { index, seed: 5, radius_scale: 0.5, ..Default::default() };
        (0..passes).map(|index| self.found(&tree.nodes, &packed, &pass(index), (position, normal), scale)).collect()
    }

    fn found(
        &self,
        nodes: &[nephroid::low_level::kernels::generated::BvhNode],
        packed: &[nephroid::low_level::kernels::generated::BvhTriangle],
        pass: &Pass,
        (position, normal): (V3, V3),
        scale: f32,
    ) -> Option<(V3, [f32; 4])> {
        let mut g = Graph::new();
        let (nodes, triangles) = (g.upload("nodes", nodes), g.upload("triangles", packed));
        let globals = Globals { footprint_unit: 2.0 * scale, ..Default::default() };
        let (globals, pass) = (g.upload("globals", &[globals]), g.upload("pass", &[*pass]));
        let (list, count) = (g.upload("list", &[0u32]), g.upload("count", &[1u32]));
        let start = g.upload("start", &[lambert_hit(position.map(|x| scale * x), normal, [1.0; 3])]);
        let mut hits = g.buffer::<EyeHit>("hits", 1);
        g.copy(&start, &mut hits);
        let args = compact::dispatch_args(&mut g, &count, 1, 64);
        let bind = EyeBoundariesBindings {
            nodes: &nodes,
            triangles: &triangles,
            globals: &globals,
            pass: &pass,
            list: &list,
            count: &count,
            eye_hits: &mut hits,
        };
        // Half of two lengths, by the schedule.
        let params = EyeBoundariesParams { widest: self.reach, shrinking: 0.0, constant: 0.0 };
        g.dispatch(EyeBoundaries, Grid::Indirect(&args), params, bind);
        let hits = g.readback(&hits);
        let runtime = runtime();
        let plan = g.plan().expect("a valid plan");
        let mut executable = runtime.prepare(&plan).expect("memory");
        executable.run().expect("no validation message");
        proof::ran(&plan.dump());
        let e = executable.read(&hits)[0].e;
        if e[3] == 0 {
            return None;
        }
        let unit = f32::from_bits(e[3]);
        assert!((unit / (self.reach * scale) - 1.0).abs() < 1e-5, "{unit} for {}", self.reach * scale);
        let half = |bits: u32| f32::from_bits((bits << 13) + (112 << 23)) * self.reach;
        let reach = [e[1] & 0xffff, e[1] >> 16, e[2] & 0xffff, e[2] >> 16].map(half);
        Some((oct_decode(e[0]).map(|x| x as f32), reach))
    }

    /// Asserts that every pass finds these distances in world directions, in all sizes; others are far.
    fn assert_around(&self, at: (V3, V3), expected: &[(V3, f32)], tolerance: f32) {
        for scale in [1e-4f32, 1.0, 1e4] {
            for found in self.around(at, scale, 6) {
                let Some((across, reach)) = found else {
                    assert!(expected.is_empty(), "nothing around {at:?} at scale {scale}");
                    continue;
                };
                let n = at.1;
                let along: V3 = std::array::from_fn(|k| {
                    n[(k + 1) % 3] * across[(k + 2) % 3] - n[(k + 2) % 3] * across[(k + 1) % 3]
                });
                let mut near = 0;
                for (axis, reach) in [across, across.map(|x| -x), along, along.map(|x| -x)].into_iter().zip(reach) {
                    if reach >= self.reach * BOUNDARY_FAR {
                        continue;
                    }
                    near += 1;
                    let dot = |d: V3| (0..3).map(|k| d[k] * axis[k]).sum::<f32>();
                    let known = expected.iter().find(|(direction, _)| dot(*direction) > 0.99);
                    let (_, distance) = known.unwrap_or_else(|| panic!("{reach} along {axis:?} at scale {scale}"));
                    assert!((reach - distance).abs() <= tolerance, "{reach} for {distance} along {axis:?}");
                }
                assert_eq!(near, expected.len(), "around {at:?} at scale {scale}: {across:?} {reach:?}");
            }
        }
    }
}

const UP: V3 = [0.0, 1.0, 0.0];
const EAST: V3 = [1.0, 0.0, 0.0];
const WEST: V3 = [-1.0, 0.0, 0.0];
const SOUTH: V3 = [0.0, 0.0, 1.0];
const NORTH: V3 = [0.0, 0.0, -1.0];

#[test]
fn boundaries_are_where_surfaces_end() {
    let board = || Place::new(0.5).cuboid([-2.0, -0.05, -0.1], [2.0, 0.0, 0.1]);
    board().assert_around(([0.3, 0.0, 0.04], UP), &[(SOUTH, 0.06), (NORTH, 0.14)], 2e-3);
    board().assert_around(([1.8, 0.0, -0.02], UP), &[(SOUTH, 0.12), (NORTH, 0.08), (EAST, 0.2)], 2e-3);
    // Its underside, and its edge, which is 5 cm high.
    board().assert_around(([0.0, -0.05, 0.0], [0.0, -1.0, 0.0]), &[(SOUTH, 0.1), (NORTH, 0.1)], 2e-3);
    board().assert_around(([0.0, -0.02, 0.1], SOUTH), &[(UP, 0.02), ([0.0, -1.0, 0.0], 0.03)], 2e-3);
    // A wall that stands on a floor, and one that leans.
    let wall = |lean: f32| {
        Place::new(0.5).floor().quad([1.0, 0.0, -3.0], [1.0 + lean, 3.0, -3.0], [1.0 + lean, 3.0, 3.0], [1.0, 0.0, 3.0])
    };
    for lean in [-0.8, 0.0, 0.8] {
        wall(lean).assert_around(([0.7, 0.0, 0.0], UP), &[(EAST, 0.3)], 6e-3);
        wall(lean).assert_around(([1.2, 0.0, 0.0], UP), &[(WEST, 0.2)], 6e-3);
        wall(lean).assert_around(([0.0, 0.0, 0.0], UP), &[], 0.0);
    }
    // The corner of a room, and the floor outside of the corner of a block.
    let corner = wall(0.0).quad([-3.0, 0.0, 0.4], [3.0, 0.0, 0.4], [3.0, 3.0, 0.4], [-3.0, 3.0, 0.4]);
    corner.assert_around(([0.9, 0.0, 0.2], UP), &[(EAST, 0.1), (SOUTH, 0.2)], 2e-3);
    let block = Place::new(0.5).floor().cuboid([0.0, 0.0, 0.0], [1.0, 1.0, 1.0]);
    block.assert_around(([-0.1, 0.0, 0.9], UP), &[(EAST, 0.1)], 2e-3);
    proof::by_answer(&["eye_boundaries"]);
}

/// A column ends where its sides belong to another surface; a sheet without thickness has no side to be met.
#[test]
fn round_bodies_end_and_sheets_do_not() {
    let outline = |radius: f32| -> Vec<[f32; 2]> {
        let angle = |i: usize| -(i as f32) / 96.0 * std::f32::consts::TAU;
        (0..96).map(|i| [radius * angle(i).cos(), radius * angle(i).sin()]).collect()
    };
    let column = |radius| Place::new(0.5).prism(&outline(radius), [-2.0, 2.0]);
    column(0.1).assert_around(([0.0, 0.0, 0.1], SOUTH), &[(EAST, 0.095), (WEST, 0.095)], 0.015);
    column(2.0).assert_around(([0.0, 0.0, 2.0], SOUTH), &[], 0.0);
    let sheet = Place::new(0.5).quad([-2.0, 0.0, -0.1], [-2.0, 0.0, 0.1], [2.0, 0.0, 0.1], [2.0, 0.0, -0.1]);
    sheet.assert_around(([0.0, 0.0, 0.0], UP), &[], 0.0);
    proof::by_answer(&["eye_boundaries"]);
}

/// What is short beside its distance is a boundary in as many passes as it fills of a quarter of the horizon.
#[test]
fn a_post_is_found_by_chance() {
    let post = Place::new(0.5).floor().cuboid([0.2, 0.0, -0.03], [0.26, 1.0, 0.03]);
    let found = post.around(([0.0, 0.0, 0.0], UP), 1.0, 128);
    let part = found.iter().filter(|found| found.is_some()).count() as f32 / 128.0;
    let expected = 2.0 * (0.03f32 / 0.2).atan() / (0.5 * std::f32::consts::PI);
    assert!((part - expected).abs() < 0.1 && part > 0.0, "{part} of the passes for {expected}");
    proof::by_answer(&["eye_boundaries"]);
}
