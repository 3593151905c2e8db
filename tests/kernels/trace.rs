//! Rays against triangles: builder, traversal on host and device, and the adversarial cases.

use nephroid::low_level::graph::Graph;
use nephroid::low_level::kernels::bvh_host::{
    COUNT_ONE, FIRST_MASK, HostBvh, LEAF, MAX_DEPTH, TriangleTag, build_sah, pack_triangles,
};
use nephroid::low_level::kernels::generated::{BvhNode, BvhTriangle, Ray, RayHit};
use nephroid::low_level::kernels::trace::{self, MISS, Tree};

use crate::support::device::runtime;
use crate::support::proof;
use crate::support::random::Random;

pub type V3 = [f32; 3];

fn add_scaled(a: V3, b: V3, s: f32) -> V3 {
    std::array::from_fn(|i| a[i] + s * b[i])
}

fn sub(a: V3, b: V3) -> V3 {
    add_scaled(a, b, -1.0)
}

#[derive(Default, Clone)]
pub struct Mesh {
    pub positions: Vec<V3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn push(&mut self, corners: [V3; 3]) {
        let base = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.push([base, base + 1, base + 2]);
    }

    fn build(&self) -> Built {
        let tree = build_sah(&self.positions, &self.triangles);
        let packed = pack_triangles(&self.positions, &self.triangles, &tree.order, |_| TriangleTag::default());
        Built { tree, packed }
    }

    fn mapped(&self, f: impl Fn(V3) -> V3) -> Self {
        Self { positions: self.positions.iter().map(|&p| f(p)).collect(), triangles: self.triangles.clone() }
    }
}

struct Built {
    tree: HostBvh,
    packed: Vec<BvhTriangle>,
}

impl Built {
    fn on_host(&self, rays: &[Ray]) -> Vec<RayHit> {
        rays.iter().map(|ray| trace::traverse(&self.tree.nodes, &self.packed, ray)).collect()
    }

    fn brute_force(&self, rays: &[Ray]) -> Vec<RayHit> {
        let bounds = trace::scene_bounds(&self.tree.nodes);
        rays.iter().map(|ray| trace::reference(&bounds, &self.packed, ray)).collect()
    }

    /// Closest hits and occlusion from the device.
    fn on_device(&self, rays: &[Ray]) -> (Vec<RayHit>, Vec<u32>) {
        let mut g = Graph::new();
        let nodes = g.upload("nodes", &self.tree.nodes);
        let triangles = g.upload("triangles", &self.packed);
        let ray_buf = g.upload("rays", rays);
        let tree = Tree { nodes: &nodes, triangles: &triangles };
        let mut hits = g.buffer("hits", rays.len() as u32);
        let mut occluded = g.buffer("occluded", rays.len() as u32);
        trace::closest(&mut g, tree, &ray_buf, &mut hits);
        trace::any(&mut g, tree, &ray_buf, &mut occluded);
        let (hits, occluded) = (g.readback(&hits), g.readback(&occluded));
        run(g, |executable| (executable.read(&hits), executable.read(&occluded)))
    }

    /// Host, device and brute force agree on all of `rays`; returns the hits.
    fn assert_agree(&self, rays: &[Ray]) -> Vec<RayHit> {
        let expected = self.brute_force(rays);
        assert_same(&self.on_host(rays), &expected, "host traversal", 0);
        let (hits, occluded) = self.on_device(rays);
        assert_same(&hits, &expected, "device", device_ulps());
        for (index, (hit, occluded)) in expected.iter().zip(occluded).enumerate() {
            assert_eq!(occluded, u32::from(hit.triangle != MISS), "any hit of ray {index}");
        }
        expected
    }

    fn id(&self, hit: &RayHit) -> u32 {
        self.tree.order[hit.triangle as usize]
    }
}

fn run<R>(g: Graph, read: impl FnOnce(&nephroid::low_level::graph::Executable) -> R) -> R {
    let runtime = runtime();
    let plan = g.plan().expect("a valid plan");
    let mut executable = runtime.prepare(&plan).expect("memory");
    executable.run().expect("no validation message");
    proof::ran(&plan.dump());
    read(&executable)
}

/// Software devices divide with correct rounding, so they agree to the bit; Vulkan allows others 2.5 ulp in each
/// division.
fn device_ulps() -> u32 {
    let runtime = runtime();
    if runtime.device().info().name.contains("llvmpipe") { 0 } else { 64 }
}

fn first_difference(found: &[RayHit], expected: &[RayHit], ulps: u32) -> Option<usize> {
    let close = |a: f32, b: f32| a == b || (a - b).abs() <= ulps as f32 * f32::EPSILON * a.abs().max(b.abs());
    let same = |a: &RayHit, b: &RayHit| {
        a.triangle == b.triangle
            && match ulps {
                0 => [a.t, a.b1, a.b2].map(f32::to_bits) == [b.t, b.b1, b.b2].map(f32::to_bits),
                _ => close(a.t, b.t),
            }
    };
    (found.len() != expected.len()).then_some(0).or(found.iter().zip(expected).position(|(a, b)| !same(a, b)))
}

fn assert_same(found: &[RayHit], expected: &[RayHit], what: &str, ulps: u32) {
    if let Some(index) = first_difference(found, expected, ulps) {
        panic!("{what}, ray {index}: {:?} instead of {:?}", found[index], expected[index]);
    }
}

pub fn soup(count: u32, size: f32, seed: u64) -> Mesh {
    let mut random = Random(seed);
    let mut mesh = Mesh::default();
    for _ in 0..count {
        let (centre, scale) = (random.point(), size * random.unit());
        mesh.push(std::array::from_fn(|_| add_scaled(centre, random.point(), scale)));
    }
    mesh
}

/// Rays from inside and outside, in general and in axis-parallel directions, with and without an end.
pub fn assorted_rays(count: u32, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    let ray = |index| {
        let origin = random.point().map(|x| x * if index % 2 == 0 { 1.0 } else { 3.0 });
        let mut direction = sub(random.point(), origin);
        if index % 5 == 0 {
            direction[random.bits() as usize % 3] = if index % 10 == 0 { 0.0 } else { -0.0 };
        }
        if index % 7 == 0 {
            direction[random.bits() as usize % 3] = 0.0;
        }
        let t_max = if index % 3 == 0 { random.unit() } else { f32::INFINITY };
        trace::ray(origin, direction, t_max)
    };
    (0..count).map(ray).collect()
}

#[test]
fn random_scenes_agree_with_brute_force() {
    for (count, size, seed) in [(1, 1.0, 1), (2, 1.0, 2), (5, 1.0, 3), (64, 0.5, 4), (700, 0.1, 5), (300, 2.0, 6)] {
        let built = soup(count, size, seed).build();
        let hits = built.assert_agree(&assorted_rays(2000, seed + 100));
        assert!(hits.iter().any(|h| h.triangle != MISS), "{count} triangles are hit at all");
    }
    proof::by(trace::reference, &["trace_any", "trace_closest"]);
}

/// Planes of an integer lattice, rays that start on lattice planes and run inside of them and through lattice points.
#[test]
fn lattice_scenes_agree_with_brute_force() {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for cell in 0..32 {
            let (x, y, z) = ((cell % 4) as f32, (cell / 4 % 4) as f32, (cell / 16) as f32);
            let place = |u: f32, v: f32| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (2.0 * z, x + u, y + v);
                p
            };
            mesh.push([place(0.0, 0.0), place(1.0, 0.0), place(1.0, 1.0)]);
            mesh.push([place(0.0, 0.0), place(1.0, 1.0), place(0.0, 1.0)]);
        }
    }
    let mut random = Random(9);
    let mut rays = Vec::new();
    for _ in 0..3000 {
        let origin: V3 = std::array::from_fn(|_| (random.bits() % 13) as f32 * 0.5 - 1.0);
        let direction: V3 = std::array::from_fn(|_| (random.bits() % 5) as f32 - 2.0);
        rays.push(trace::ray(origin, direction, f32::INFINITY));
    }
    let hits = mesh.build().assert_agree(&rays);
    assert!(hits.iter().filter(|h| h.triangle != MISS).count() > 500);
}

/// A closed mesh around the origin: a cube of `n` x `n` squares a side, pushed through `shape`.
fn closed_mesh(n: u32, shape: impl Fn(V3) -> V3) -> Mesh {
    let mut mesh = Mesh::default();
    let mut known = std::collections::BTreeMap::new();
    for face in 0..6u32 {
        let axis = (face / 2) as usize;
        let mut vertex = |u: u32, v: u32| {
            let mut key = [0u32; 3];
            (key[axis], key[(axis + 1) % 3], key[(axis + 2) % 3]) = (n * (face % 2), u, v);
            *known.entry(key).or_insert_with(|| {
                mesh.positions.push(shape(key.map(|x| 2.0 * x as f32 / n as f32 - 1.0)));
                mesh.positions.len() as u32 - 1
            })
        };
        for cell in 0..n * n {
            let (u, v) = (cell % n, cell / n);
            let corners = [vertex(u, v), vertex(u + 1, v), vertex(u + 1, v + 1), vertex(u, v + 1)];
            mesh.triangles.push([corners[0], corners[1], corners[2]]);
            mesh.triangles.push([corners[0], corners[2], corners[3]]);
        }
    }
    mesh
}

/// Rays from near the centre at vertices and at points on edges.
fn rays_at_edges(mesh: &Mesh, count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    let ray = |index: usize| {
        let corners = mesh.triangles[random.bits() as usize % mesh.triangles.len()];
        let start = random.bits() as usize % 3;
        let (a, b) = (mesh.positions[corners[start] as usize], mesh.positions[corners[(start + 1) % 3] as usize]);
        let target = if index.is_multiple_of(2) { a } else { add_scaled(a, sub(b, a), random.unit()) };
        let origin = if index % 4 < 2 { [0.0; 3] } else { random.point().map(|x| 0.4 * x) };
        trace::ray(origin, sub(target, origin), f32::INFINITY)
    };
    (0..count).map(ray).collect()
}

fn sphere([x, y, z]: V3) -> V3 {
    let scale = 1.0 / (x * x + y * y + z * z).sqrt();
    [x * scale, y * scale, z * scale]
}

/// Case 34: no ray leaves a closed mesh through its vertices and edges.
#[test]
fn closed_meshes_are_watertight() {
    let shear = |[x, y, z]: V3| [x + 0.3 * y - 0.1 * z, y + 0.7 * z, 0.9 * z - 0.2 * x];
    let thin = |[x, y, z]: V3| [x, 900.0 * y, 800.0 * z];
    let meshes = [
        (closed_mesh(24, sphere), 50_000),
        (closed_mesh(16, shear), 20_000),
        (closed_mesh(16, |p| p), 20_000),
        (closed_mesh(8, thin), 20_000),
        (closed_mesh(1, thin), 20_000),
    ];
    for (index, (mesh, count)) in meshes.iter().enumerate() {
        let (built, rays) = (mesh.build(), rays_at_edges(mesh, *count, 77 + index as u64));
        let (hits, occluded) = built.on_device(&rays);
        let leaks = |hits: &[RayHit]| hits.iter().filter(|h| h.triangle == MISS).count();
        assert_eq!(leaks(&hits), 0, "leaks of mesh {index}");
        assert!(occluded.iter().all(|&o| o == 1), "any hit, mesh {index}");
        assert_same(&built.on_host(&rays), &hits, "host against device", device_ulps());
    }
    // The check sees a hole.
    let mut holed = closed_mesh(8, sphere);
    holed.triangles.remove(17);
    let rays = rays_at_edges(&closed_mesh(8, sphere), 20_000, 5);
    assert!(holed.build().on_device(&rays).0.iter().any(|h| h.triangle == MISS), "a hole is found");
}

/// Case 35: rays that leave a triangle do not hit it again, at any scale, sheared and moved.
#[test]
fn spawned_rays_do_not_hit_their_own_triangle() {
    let mut random = Random(3);
    let mut grazed = 0;
    for exponent in -8..=8 {
        let scale = 10.0f32.powi(exponent);
        let mut mesh = Mesh::default();
        for index in 0..1000 {
            let centre = random.point().map(|x| x * scale * [0.0, 1.0, 100.0][index % 3]);
            let squash = [1.0, 1.0, 0.01][index % 3];
            let shear = random.signed();
            mesh.push(std::array::from_fn(|_| {
                let [x, y, z] = random.point();
                add_scaled(centre, [x + shear * y, squash * y - shear * z, z + shear * x], scale)
            }));
        }
        let built = mesh.build();
        let (mut hits, mut rays) = (Vec::new(), Vec::new());
        for index in 0..built.packed.len() {
            let (mut b1, mut b2) = (random.unit(), random.unit());
            if b1 + b2 > 1.0 {
                (b1, b2) = (1.0 - b1, 1.0 - b2);
            }
            let at = &built.packed[index];
            let mut direction = random.point();
            if index % 4 == 0 {
                // Nearly inside of the plane.
                let edge = [at.v1[0] - at.v0[0], at.v1[1] - at.v0[1], at.v1[2] - at.v0[2]].map(|x| x / scale);
                direction = add_scaled(edge, direction, 10.0f32.powi(-((index / 4 % 7) as i32)));
                grazed += 1;
            }
            hits.push(RayHit { t: 1.0, b1, b2, triangle: index as u32 });
            rays.push(trace::ray([0.0; 3], direction, f32::INFINITY));
        }
        let spawned = spawn_on_device(&built, &hits, &rays);
        assert_own_triangles_are_missed(&built, &hits, &spawned, scale);
    }
    assert!(grazed > 1000);
    proof::by(trace::offset_ray_origin, &["trace_spawn"]);
}

fn spawn_on_device(built: &Built, hits: &[RayHit], rays: &[Ray]) -> Vec<Ray> {
    let mut g = Graph::new();
    let (triangles, hit_buf) = (g.upload("triangles", &built.packed), g.upload("hits", hits));
    let directions = g.upload("directions", rays);
    let mut ray_buf = g.buffer("rays", rays.len() as u32);
    g.copy(&directions, &mut ray_buf);
    trace::spawn(&mut g, &triangles, &hit_buf, &mut ray_buf);
    let readback = g.readback(&ray_buf);
    run(g, |executable| executable.read(&readback))
}

fn own_hit(built: &Built, hit: &RayHit, ray: &Ray) -> bool {
    // A tree of this triangle alone, so that nothing hides it.
    let bounds = trace::scene_bounds(&built.tree.nodes);
    let alone = &built.packed[hit.triangle as usize..][..1];
    trace::reference(&bounds, alone, ray).triangle != MISS
}

fn assert_own_triangles_are_missed(built: &Built, hits: &[RayHit], spawned: &[Ray], scale: f32) {
    let mut touched = 0;
    for (hit, ray) in hits.iter().zip(spawned) {
        let at = &built.packed[hit.triangle as usize];
        let corners = [at.v0, at.v1, at.v2].map(|[x, y, z, _]| [x, y, z]);
        let [u, v, w, _] = ray.direction;
        let origin = trace::offset_ray_origin(corners, [hit.b1, hit.b2], [u, v, w]);
        if device_ulps() == 0 {
            assert_eq!(ray.origin[..3], origin, "host and device origins, scale {scale}");
        }
        for sign in [1.0, -1.0] {
            let direction = [u, v, w].map(|x| sign * x);
            let origin = trace::offset_ray_origin(corners, [hit.b1, hit.b2], direction);
            let ray = trace::ray(origin, direction, f32::INFINITY);
            assert!(!own_hit(built, hit, &ray), "scale {scale}: {ray:?} hits {corners:?}");
        }
        // The same rays without the offset do hit, or this test could not fail.
        let p: V3 = std::array::from_fn(|i| {
            corners[0][i] + (hit.b1 * (corners[1][i] - corners[0][i]) + hit.b2 * (corners[2][i] - corners[0][i]))
        });
        touched += u32::from(own_hit(built, hit, &trace::ray(p, [u, v, w], f32::INFINITY)));
    }
    assert!(touched > 20, "{touched} rays without an offset hit their own triangle at scale {scale}");
}

/// Case 36: of triangles at the same distance the lowest id wins, whatever the tree; one ulp decides otherwise.
#[test]
fn ties_go_to_the_lowest_id() {
    let base = soup(40, 0.6, 12);
    let mut mesh = Mesh::default();
    for copy in 0..6 {
        for triangle in &base.triangles {
            // Copy 3 is one ulp closer to the plane z = 0 in every corner.
            let nudge = |[x, y, z]: V3| [x, y, if copy == 3 { z.next_down() } else { z }];
            mesh.push(triangle.map(|corner| nudge(base.positions[corner as usize])));
        }
    }
    let built = mesh.build();
    let rays = assorted_rays(3000, 31);
    let hits = built.assert_agree(&rays);
    for hit in hits.iter().filter(|h| h.triangle != MISS) {
        let id = built.id(hit);
        assert!(id < 40 || (120..160).contains(&id), "copy {} won", id / 40);
    }
    assert!(hits.iter().any(|h| h.triangle != MISS && built.id(h) >= 120), "one ulp nearer wins sometimes");
    let again = built.on_device(&rays).0;
    assert_same(&again, &built.on_device(&rays).0, "second run", 0);
}

#[test]
fn degenerate_input_is_skipped_and_counted() {
    let empty = Mesh::default().build();
    assert_eq!((empty.tree.nodes.len(), empty.tree.order.len()), (1, 0));
    let rays = assorted_rays(500, 1);
    assert!(empty.assert_agree(&rays).iter().all(|h| h.triangle == MISS));

    let mut mesh = Mesh::default();
    mesh.push([[f32::NAN, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    mesh.push([[0.0, 0.0, f32::INFINITY], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    mesh.push([[0.0; 3], [1.0, 1.0, 1.0], [3.0, 3.0, 3.0]]); // no area
    mesh.push([[0.25; 3]; 3]);
    mesh.push([[0.0; 3], [1e-20, 0.0, 0.0], [0.0, 1e-20, 0.0]]); // area 5e-41
    mesh.triangles.push([0, 1, 99]);
    assert_eq!(mesh.build().tree.skipped, 6);
    mesh.push([[-1.0, -1.0, 0.5], [1.0, -1.0, 0.5], [0.0, 1.0, 0.5]]);
    mesh.push([[-1.0, -1.0, 0.25], [1.0, -1.0, 0.25], [1.0, -1.0 + 1e-6, 0.25]]); // a needle is no point
    let built = mesh.build();
    assert_eq!((built.tree.skipped, built.tree.order.len()), (6, 2));
    built.assert_agree(&rays);
}

/// Rays that are no rays end, and hit nothing.
#[test]
fn degenerate_rays_hit_nothing() {
    let built = soup(200, 0.5, 8).build();
    let mut rays = Vec::new();
    for bad in [[0.0; 3], [f32::NAN; 3], [0.0, f32::NAN, 1.0]] {
        rays.push(trace::ray([0.1, 0.2, 0.3], bad, f32::INFINITY));
    }
    rays.push(trace::ray([f32::NAN; 3], [0.0, 0.0, 1.0], f32::INFINITY));
    for t_max in [0.0, -1.0, -7.0, f32::NEG_INFINITY, f32::NAN] {
        rays.push(trace::ray([0.0, 0.0, -3.0], [0.0, 0.0, 1.0], t_max));
    }
    let (hits, occluded) = built.on_device(&rays);
    assert!(hits.iter().all(|h| h.triangle == MISS), "{hits:?}");
    assert!(occluded.iter().all(|&o| o == 0));
    assert!(built.on_host(&rays).iter().all(|h| h.triangle == MISS));
}

/// Case 29: geometry times 2^k gives t times 2^k, the same triangles and the same tree, to the bit.
#[test]
fn powers_of_two_change_no_bit() {
    let mesh = soup(300, 0.3, 21);
    let rays = assorted_rays(600, 22);
    let built = mesh.build();
    let expected = built.on_host(&rays);
    for k in -20..=20 {
        let scale = 2.0f32.powi(k);
        let scaled = mesh.mapped(|p| p.map(|x| x * scale)).build();
        assert_eq!(scaled.tree.order, built.tree.order, "2^{k}");
        let scaled_rays: Vec<Ray> =
            rays.iter().map(|r| Ray { origin: r.origin.map(|x| x * scale), direction: r.direction }).collect();
        let scaled_back =
            |hits: Vec<RayHit>| -> Vec<RayHit> { hits.into_iter().map(|h| RayHit { t: h.t / scale, ..h }).collect() };
        assert_same(&scaled_back(scaled.on_host(&scaled_rays)), &expected, &format!("host 2^{k}"), 0);
        if k % 10 == 0 {
            let device = scaled_back(scaled.on_device(&scaled_rays).0);
            assert_same(&device, &built.on_device(&rays).0, &format!("device 2^{k}"), 0);
        }
    }
}

/// Every triangle lies in exactly one leaf and in all boxes above it; returns the depth.
fn check_node(built: &Built, node: u32, bounds: Option<(V3, V3)>, seen: &mut [u32]) -> u32 {
    let BvhNode { min0, max0, min1, max1 } = built.tree.nodes[node as usize];
    let inside = |low: &[f32], high: &[f32], outer: (V3, V3)| {
        (0..3).all(|i| low[i] > high[i] || (low[i] >= outer.0[i] && high[i] <= outer.1[i]))
    };
    let mut depth = 0;
    for (reference, low, high) in [(min0[3], min0, max0), (max0[3], min1, max1)] {
        let (reference, corners) = (reference.to_bits(), ([low[0], low[1], low[2]], [high[0], high[1], high[2]]));
        if low[0] > high[0] {
            continue; // absent
        }
        assert!(bounds.is_none_or(|outer| inside(&low, &high, outer)), "box of a child of node {node}");
        if reference & LEAF == 0 {
            depth = depth.max(1 + check_node(built, reference, Some(corners), seen));
            continue;
        }
        depth = depth.max(1);
        for index in 0..=(reference & !LEAF) / COUNT_ONE {
            let index = (reference & FIRST_MASK) + index;
            seen[index as usize] += 1;
            let at = &built.packed[index as usize];
            assert!([at.v0, at.v1, at.v2].iter().all(|v| inside(v, v, corners)), "triangle {index}");
        }
    }
    depth
}

#[test]
fn trees_are_complete_bounded_and_repeatable() {
    // Sizes in a geometric progression, all at one place, and more than one thread is given.
    let mut spiral = Mesh::default();
    for i in 0..4000 {
        let size = 1.5f32.powi(i % 120 - 60);
        spiral.push([[size, 0.0, 0.0], [size, size, 0.0], [size, 0.0, size * (1.0 + i as f32 * 1e-4)]]);
    }
    let mut same = Mesh::default();
    (0..500).for_each(|_| same.push([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]));
    for mesh in [spiral, same, soup(40_000, 0.05, 2), soup(3, 1.0, 1), soup(1, 1.0, 1)] {
        let built = mesh.build();
        let mut seen = vec![0; built.packed.len()];
        let depth = check_node(&built, 0, None, &mut seen);
        assert_eq!(depth, built.tree.depth);
        assert!(depth <= MAX_DEPTH, "depth {depth}");
        assert!(seen.iter().all(|&n| n == 1) && seen.len() == mesh.triangles.len());
        let again = mesh.build();
        assert_eq!(again.tree.order, built.tree.order);
        let bits = |b: &Built| bytemuck::cast_slice::<BvhNode, u32>(&b.tree.nodes).to_vec();
        assert!(bits(&again) == bits(&built), "a second build gives the same bits");
    }
}

/// The comparison of hits notices a triangle that the tree has lost and a distance that is off by one ulp.
#[test]
fn the_comparison_can_fail() {
    let mut built = soup(50, 0.8, 14).build();
    let rays = assorted_rays(1000, 15);
    let expected = built.brute_force(&rays);
    let mut off = expected.clone();
    let index = off.iter().position(|h| h.triangle != MISS).expect("a hit");
    off[index].t = off[index].t.next_up();
    assert_eq!(first_difference(&off, &expected, 0), Some(index));
    for node in &mut built.tree.nodes {
        if node.min0[3].to_bits() & LEAF != 0 {
            node.max0[..3].copy_from_slice(&[f32::NEG_INFINITY; 3]);
        }
    }
    assert!(first_difference(&built.on_device(&rays).0, &expected, 0).is_some());
}
