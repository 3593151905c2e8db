//! Trees over triangles that the device builds: the same hits as by the tree of the host.

use nephroid::low_level::graph::Graph;
use nephroid::low_level::kernels::bvh_host::{TriangleTag, build_sah, pack_triangles};
use nephroid::low_level::kernels::generated::{Aabb, BvhNode, BvhTriangle, Ray, RayHit};
use nephroid::low_level::kernels::lbvh::Lbvh;
use nephroid::low_level::kernels::lbvh_reference::{self, Tree};
use nephroid::low_level::kernels::trace::{self, MISS};
use nephroid::low_level::kernels::triangles::Builder;
use nephroid::low_level::kernels::{collapse, hploc, hploc_reference, reduce, triangles};
use nephroid::low_level::scene::World;

use crate::support::boxes::{cases, check_in_any_order, cube};
use crate::support::harness::{Harness, assert_same};
use crate::support::lab::asset;
use crate::support::proof;
use crate::support::random::Random;
use crate::trace::{Mesh, V3, assorted_rays, soup};

/// A tree as the device has built it, and what its rays hit.
pub struct OnDevice {
    pub tree: Tree,
    pub boxes: Vec<Aabb>,
    pub packed: Vec<BvhTriangle>,
    hits: Vec<RayHit>,
}

/// A flag and a material that tell triangles apart.
pub fn tag(id: u32) -> [u32; 2] {
    [id % 3 * 2, id / 2]
}

/// Builds on the device by `builder`, packs the triangles and traces the rays.
pub fn build(
    h: &Harness,
    mesh: &Mesh,
    rays: &[Ray],
    builder: impl Fn(&mut Graph, &triangles::Mesh<'_>) -> Lbvh,
) -> OnDevice {
    let n = mesh.triangles.len();
    let (nodes, items, counts) = (h.output::<BvhNode>(n.max(2)), h.output::<u32>(n), h.output::<u32>(3));
    let (boxes, packed, hits) = (h.output::<Aabb>(n), h.output::<BvhTriangle>(n), h.output::<RayHit>(rays.len()));
    let tags: Vec<_> = (0..n as u32).map(tag).collect();
    let inputs = (h.input(&mesh.positions), h.input(&mesh.triangles), h.input(&tags), h.input(rays));
    h.run(&[&counts, &boxes, &hits], |g| {
        let (positions, corners) = (g.import_read(&inputs.0), g.import_read(&inputs.1));
        let (tags, rays) = (g.import_read(&inputs.2), g.import_read(&inputs.3));
        let on_device = triangles::Mesh { positions: &positions, triangles: &corners, tags: &tags };
        let tree = builder(g, &on_device);
        let all_boxes = triangles::boxes(g, on_device);
        let mut leaves = g.buffer("leaves", n as u32);
        let held = triangles::Leaves { items: &tree.items, counts: &tree.counts };
        triangles::pack(g, on_device, &all_boxes, held, &mut leaves);
        let mut found = g.buffer("found", rays.len());
        trace::closest(g, trace::Tree { nodes: &tree.nodes, triangles: &leaves }, &rays, &mut found);
        let mut to = (g.import(nodes.memory()), g.import(items.memory()), g.import(counts.memory()));
        let mut more = (g.import(boxes.memory()), g.import(packed.memory()), g.import(hits.memory()));
        g.copy(&tree.nodes, &mut to.0);
        g.copy(&tree.items, &mut to.1);
        g.copy(&tree.counts, &mut to.2);
        g.copy(&all_boxes, &mut more.0);
        g.copy(&leaves, &mut more.1);
        g.copy(&found, &mut more.2);
        g.keep(&to.0);
        g.keep(&to.1);
        g.keep(&to.2);
        g.keep(&more.0);
        g.keep(&more.1);
        g.keep(&more.2);
    });
    let counts = h.content(&counts);
    let (mut nodes, mut items, mut packed) = (h.content(&nodes), h.content(&items), h.content(&packed));
    items.truncate(counts[0] as usize);
    packed.truncate(counts[0] as usize);
    nodes.truncate(counts[2] as usize);
    let tree = Tree { nodes, items, degenerate: counts[1] };
    OnDevice { tree, boxes: h.content(&boxes), packed, hits: h.content(&hits) }
}

/// A hit by the id of its triangle, in bits.
fn by_id(hit: &RayHit, order: &[u32]) -> [u32; 4] {
    let id = if hit.triangle == MISS { MISS } else { order[hit.triangle as usize] };
    [id, hit.t.to_bits(), hit.b1.to_bits(), hit.b2.to_bits()]
}

/// The hits that the host finds by its own tree.
pub fn hits_by_sah(mesh: &Mesh, rays: &[Ray]) -> Vec<[u32; 4]> {
    let sah = build_sah(&mesh.positions, &mesh.triangles);
    let packed = pack_triangles(&mesh.positions, &mesh.triangles, &sah.order, |_| TriangleTag::default());
    rays.iter().map(|ray| by_id(&trace::traverse(&sah.nodes, &packed, ray), &sah.order)).collect()
}

impl OnDevice {
    /// The hits that the device has found.
    pub fn hits(&self) -> Vec<[u32; 4]> {
        self.hits.iter().map(|hit| by_id(hit, &self.tree.items)).collect()
    }

    /// Compares boxes, packed triangles and hits with what the host has; the tree holds what the host's tree holds.
    pub fn assert_right(&self, mesh: &Mesh, rays: &[Ray], what: &str) {
        let boxes = triangles::reference_boxes(&mesh.positions, &mesh.triangles);
        assert_same(&words(&self.boxes), &words(&boxes), what);
        let tags: Vec<_> = (0..mesh.triangles.len() as u32).map(tag).collect();
        let scene = (&mesh.positions[..], &mesh.triangles[..]);
        let packed = triangles::reference_pack(scene, &tags, &boxes, &self.tree.items);
        assert_same(&words(&self.packed), &words(&packed), what);
        let mut held = self.tree.items.clone();
        held.sort_unstable();
        let mut expected = build_sah(&mesh.positions, &mesh.triangles).order;
        expected.sort_unstable();
        assert_same(&held, &expected, &format!("{what}: triangles in the tree"));
        assert_same(&self.hits(), &hits_by_sah(mesh, rays), &format!("{what}: hits"));
    }
}

/// Everything as words: references and ids are bits, not floats.
pub fn words<T: bytemuck::Pod>(data: &[T]) -> Vec<u32> {
    bytemuck::cast_slice(data).to_vec()
}

/// Triangles that no ray can hit, between others that rays can.
pub fn damaged(count: u32) -> Mesh {
    let mut mesh = soup(count, 0.4, 17);
    let bad = [
        [[f32::NAN, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, f32::INFINITY], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        [[0.0; 3], [1.0; 3], [3.0; 3]],
        [[0.1, 0.2, 0.3], [0.2, 0.4, 0.6], [0.4, 0.8, 1.2]],
        [[0.25; 3]; 3],
        [[0.0; 3], [1e-20, 0.0, 0.0], [0.0, 1e-20, 0.0]],
        [[-3e38, 0.0, 0.0], [3e38, 0.0, 0.0], [3e38, 0.0, 0.0]],
    ];
    for (at, corners) in bad.into_iter().enumerate() {
        mesh.push(corners);
        let last = mesh.triangles.len() - 1;
        mesh.triangles.swap(at * 3 % last.max(1), last);
    }
    mesh.triangles.push([0, 1, u32::MAX]);
    // A needle is no point.
    mesh.push([[-1.0, -1.0, 0.25], [1.0, -1.0, 0.25], [1.0, -1.0 + 1e-6, 0.25]]);
    mesh
}

fn tree_by(builder: Builder, fences: bool) -> impl Fn(&mut Graph, &triangles::Mesh<'_>) -> Lbvh {
    move |g, mesh| {
        let boxes = triangles::boxes(g, *mesh);
        triangles::tree(g, &boxes, builder, fences)
    }
}

/// Soups, and triangles that no ray can hit.
pub fn meshes() -> Vec<(String, Mesh)> {
    let soups = [(0, 1.0), (1, 1.0), (2, 1.0), (5, 0.5), (17, 0.5), (257, 0.2), (3000, 0.1), (700, 2.0)];
    let soups = soups.map(|(count, size)| (format!("soup of {count}"), soup(count, size, u64::from(count) + 3)));
    let alone = Mesh { triangles: damaged(0).triangles[..6].to_vec(), ..damaged(0) };
    let mut copies = soup(40, 0.6, 12);
    copies.triangles = (0..8).flat_map(|_| copies.triangles.clone()).collect();
    let damaged = [("damaged", damaged(300)), ("only damaged", alone), ("copies of triangles", copies)];
    soups.into_iter().chain(damaged.map(|(name, mesh)| (name.to_owned(), mesh))).collect()
}

/// The specified tree.
pub fn reference(boxes: &[Aabb], builder: Builder) -> Tree {
    let (nodes, items) = match builder {
        Builder::Lbvh => {
            let tree = lbvh_reference::build_by(lbvh_reference::morton_of_place, boxes, 1);
            (tree.nodes.into_iter().map(Some).collect(), tree.items)
        }
        Builder::Hploc => hploc_reference::binary(boxes),
    };
    collapse::reference(&nodes, &items, boxes)
}

#[test]
fn trees_over_triangles_have_the_hits_of_the_sah_tree() {
    let h = Harness::lock();
    let rays = assorted_rays(1000, 5);
    for (name, mesh) in meshes() {
        for builder in [Builder::Lbvh, Builder::Hploc] {
            let what = format!("{name}, {builder:?}");
            let built = build(&h, &mesh, &rays, tree_by(builder, h.fences()));
            built.assert_right(&mesh, &rays, &what);
            let wanted = reference(&built.boxes, builder);
            assert_same(&built.tree.items, &wanted.items, &what);
            assert_same(&words(&built.tree.nodes), &words(&wanted.nodes), &what);
            let depth = check_in_any_order(&built.tree, &built.boxes, collapse::LEAF_ITEMS);
            let depth = depth.unwrap_or_else(|problem| panic!("{what}: {problem}"));
            assert!(depth <= hploc::MAX_DEPTH, "{what}: depth {depth}");
        }
    }
    proof::by(triangles::reference_boxes, &["triangle_boxes"]);
}

/// The triangles of a file, and rays within their box.
pub fn file(name: &str, count: u32) -> (Mesh, Vec<Ray>) {
    let world = World::of(&asset(name));
    let bounds = world.bounds().expect("triangles");
    let (center, radius) = (bounds.center(), bounds.radius());
    let mut random = Random(7);
    let mut point = || -> V3 {
        let p = random.point();
        std::array::from_fn(|k| center[k] + radius * p[k])
    };
    let rays = (0..count).map(|_| {
        let (from, to) = (point(), point());
        trace::ray(from, std::array::from_fn(|k| to[k] - from[k]), f32::INFINITY)
    });
    let rays = rays.collect();
    (Mesh { positions: world.positions, triangles: world.triangles }, rays)
}

#[test]
fn trees_over_assets_have_the_hits_of_the_sah_tree() {
    let h = Harness::lock();
    for name in ["chess", "coffee-cup", "ring"] {
        let (mesh, rays) = file(name, 1000);
        for builder in [Builder::Lbvh, Builder::Hploc] {
            let built = build(&h, &mesh, &rays, tree_by(builder, h.fences()));
            built.assert_right(&mesh, &rays, name);
            assert!(built.hits().iter().filter(|hit| hit[0] != MISS).count() > 100, "{name} is hit");
        }
    }
    proof::by(triangles::reference_pack, &["triangle_pack"]);
}

/// Builds over boxes alone.
fn over_boxes(h: &Harness, boxes: &[Aabb], builder: Builder) -> Tree {
    let n = boxes.len();
    let (nodes, items, counts) = (h.output::<BvhNode>(n.max(2)), h.output::<u32>(n), h.output::<u32>(3));
    let input = h.input(boxes);
    h.run(&[&counts], |g| {
        let boxes = g.import_read(&input);
        let tree = triangles::tree(g, &boxes, builder, h.fences());
        let mut to = (g.import(nodes.memory()), g.import(items.memory()), g.import(counts.memory()));
        g.copy(&tree.nodes, &mut to.0);
        g.copy(&tree.items, &mut to.1);
        g.copy(&tree.counts, &mut to.2);
        g.keep(&to.0);
        g.keep(&to.1);
        g.keep(&to.2);
    });
    let counts = h.content(&counts);
    let (mut nodes, mut items) = (h.content(&nodes), h.content(&items));
    items.truncate(counts[0] as usize);
    nodes.truncate(counts[2] as usize);
    Tree { nodes, items, degenerate: counts[1] }
}

/// Compares with the specification; returns the depth.
fn compare_with_reference(h: &Harness, name: &str, boxes: &[Aabb], builder: Builder) -> u32 {
    let what = format!("{name}, {} boxes, {builder:?}", boxes.len());
    let (got, wanted) = (over_boxes(h, boxes, builder), reference(boxes, builder));
    assert_same(&got.items, &wanted.items, &what);
    assert_same(&words(&got.nodes), &words(&wanted.nodes), &what);
    let depth = check_in_any_order(&got, boxes, collapse::LEAF_ITEMS);
    let depth = depth.unwrap_or_else(|problem| panic!("{what}: {problem}"));
    assert!(depth <= hploc::MAX_DEPTH, "{what}: depth {depth}");
    depth
}

/// Of cubes around each other only the two smallest are each other's nearest, so clusters would be strings that no
/// traversal has a stack for: their heights are bounded.
#[test]
fn strings_of_clusters_stay_within_the_stack() {
    let h = Harness::lock();
    let boxes: Vec<_> = (0..4096).map(|i| cube([0.0; 3], 1.003f32.powi(i))).collect();
    let depth = compare_with_reference(&h, "cubes around cubes", &boxes, Builder::Hploc);
    assert!(depth > 40, "the bound is put to the test: {depth}");
}

#[test]
fn the_device_builds_the_specified_trees() {
    let h = Harness::lock();
    for n in [0, 1, 2, 3, 4, 5, 16, 17, 18, 33, 255, 257, 2049] {
        for (name, boxes) in cases(n) {
            compare_with_reference(&h, name, &boxes, Builder::Lbvh);
            compare_with_reference(&h, name, &boxes, Builder::Hploc);
        }
    }
    proof::by(
        collapse::reference,
        &["collapse_fuse", "collapse_inside", "collapse_weigh", "collapse_write", "lbvh_places"],
    );
}

#[test]
fn hploc_merges_as_specified() {
    let h = Harness::lock();
    for (name, boxes) in cases(20_011) {
        compare_with_reference(&h, name, &boxes, Builder::Hploc);
    }
    proof::by(hploc_reference::binary, &["hploc_merge", "hploc_ranges"]);
}

/// The comparisons notice a triangle that has moved by one ulp, one that the tree has lost, and a wrong box.
#[test]
fn the_comparisons_can_fail() {
    let h = Harness::lock();
    let (mesh, rays) = (soup(200, 0.5, 4), assorted_rays(1000, 5));
    let fails = |built: &OnDevice, mesh: &Mesh| {
        let right = std::panic::AssertUnwindSafe(|| built.assert_right(mesh, &rays, "sabotaged"));
        std::panic::catch_unwind(right).is_err()
    };
    let mut built = build(&h, &mesh, &rays, tree_by(Builder::Hploc, h.fences()));
    assert!(!fails(&built, &mesh));
    let mut moved = mesh.clone();
    moved.positions[5][1] = moved.positions[5][1].next_up();
    assert!(fails(&built, &moved));
    let lost = built.tree.items.swap_remove(3);
    assert!(fails(&built, &mesh), "triangle {lost} is missing");
    let empty = reduce::reference_bounds(&[]);
    let spoiled = build(&h, &mesh, &rays, |g, mesh| {
        let boxes: Vec<_> = (0..mesh.triangles.len()).map(|_| empty).collect();
        let boxes = g.upload("no boxes", &boxes);
        triangles::tree(g, &boxes, Builder::Hploc, h.fences())
    });
    assert!(fails(&spoiled, &mesh), "a tree over nothing");
}
