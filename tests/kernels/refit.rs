//! Refitted trees: the boxes of the specification, the hits of a new tree, and the surface-area cost.

use nephroid::low_level::graph::DeviceClass;
use nephroid::low_level::kernels::bvh_host::build_sah;
use nephroid::low_level::kernels::generated::{Aabb, BvhNode, BvhTriangle, RayHit};
use nephroid::low_level::kernels::lbvh::Lbvh;
use nephroid::low_level::kernels::lbvh_reference::Tree;
use nephroid::low_level::kernels::triangles::Builder;
use nephroid::low_level::kernels::{collapse, reduce, refit, trace, triangles};

use crate::device_trees::{damaged, hits_by_sah, meshes, reference, tag, words};
use crate::support::boxes::check_in_any_order;
use crate::support::harness::{Harness, assert_same};
use crate::support::proof;
use crate::support::random::Random;
use crate::trace::{Mesh, assorted_rays, soup};

/// Trees over a mesh by both kinds of builder.
fn trees(mesh: &Mesh) -> [(&'static str, Tree); 2] {
    let boxes = triangles::reference_boxes(&mesh.positions, &mesh.triangles);
    let sah = build_sah(&mesh.positions, &mesh.triangles);
    let sah = Tree { nodes: sah.nodes, items: sah.order, degenerate: sah.skipped };
    [("sah", sah), ("hploc", reference(&boxes, Builder::Hploc))]
}

fn counts(tree: &Tree) -> [u32; 3] {
    [tree.items.len() as u32, tree.degenerate, tree.nodes.len() as u32]
}

/// Refits `tree` on the device for the triangles of `mesh`; what rays hit in it, by id.
fn refitted(h: &Harness, tree: &Tree, mesh: &Mesh) -> (Vec<BvhNode>, Vec<[u32; 4]>) {
    let rays = assorted_rays(800, 6);
    let (n, triangle_count) = (tree.nodes.len(), mesh.triangles.len());
    let (nodes, hits) = (h.output::<BvhNode>(n), h.output::<RayHit>(rays.len()));
    let tags: Vec<_> = (0..triangle_count as u32).map(tag).collect();
    h.run(&[&nodes, &hits], |g| {
        let (positions, corners) = (g.upload("positions", &mesh.positions), g.upload("corners", &mesh.triangles));
        let (tags, rays) = (g.upload("tags", &tags), g.upload("rays", &rays));
        let mesh = triangles::Mesh { positions: &positions, triangles: &corners, tags: &tags };
        let boxes = triangles::boxes(g, mesh);
        let former = g.upload("former", &tree.nodes);
        let mut own = Lbvh {
            nodes: g.buffer("nodes", n as u32),
            items: g.buffer("items", triangle_count as u32),
            counts: g.buffer("counts", 3),
        };
        g.copy(&former, &mut own.nodes);
        let (items, counts) = (g.upload("tree items", &tree.items), g.upload("tree counts", &counts(tree)));
        g.copy(&items, &mut own.items);
        g.copy(&counts, &mut own.counts);
        let target = refit::Target { nodes: &mut own.nodes, items: &own.items, counts: &own.counts };
        refit::boxes(g, target, &boxes, h.fences());
        let mut packed = g.buffer::<BvhTriangle>("packed", triangle_count as u32);
        let held = triangles::Leaves { items: &own.items, counts: &own.counts };
        triangles::pack(g, mesh, &boxes, held, &mut packed);
        let mut found = g.buffer("found", rays.len());
        trace::closest(g, trace::Tree { nodes: &own.nodes, triangles: &packed }, &rays, &mut found);
        let (mut to, mut more) = (g.import(nodes.memory()), g.import(hits.memory()));
        g.copy(&own.nodes, &mut to);
        g.copy(&found, &mut more);
        g.keep(&to);
        g.keep(&more);
    });
    let id = |hit: &RayHit| if hit.triangle == trace::MISS { trace::MISS } else { tree.items[hit.triangle as usize] };
    let hit = |hit: &RayHit| [id(hit), hit.t.to_bits(), hit.b1.to_bits(), hit.b2.to_bits()];
    (h.content(&nodes), h.content(&hits).iter().map(hit).collect())
}

/// The mesh with corners elsewhere, each a little.
fn moved(mesh: &Mesh, by: f32) -> Mesh {
    let mut random = Random(31);
    let mut shift = |p: &[f32; 3]| std::array::from_fn(|k| p[k] + by * random.signed());
    Mesh { positions: mesh.positions.iter().map(&mut shift).collect(), triangles: mesh.triangles.clone() }
}

#[test]
fn refitted_trees_have_the_hits_of_new_ones() {
    let h = Harness::lock();
    for (name, mesh) in meshes() {
        // What does not move stays as it is; and no triangle of these comes to life.
        for by in if name.contains("damaged") { vec![0.0] } else { vec![0.0, 0.01, 0.5] } {
            let after = moved(&mesh, by);
            let boxes = triangles::reference_boxes(&after.positions, &after.triangles);
            for (builder, tree) in trees(&mesh) {
                let what = format!("{name}, {builder}, moved by {by}");
                let (nodes, hits) = refitted(&h, &tree, &after);
                let mut wanted = tree.nodes.clone();
                refit::reference_boxes(&mut wanted, &tree.items, &boxes);
                assert_same(&words(&nodes), &words(&wanted), &what);
                if by == 0.0 {
                    assert_same(&words(&nodes), &words(&tree.nodes), &format!("{what}: nothing has moved"));
                }
                assert_same(&hits, &hits_by_sah(&after, &assorted_rays(800, 6)), &what);
                let whole = Tree { nodes, ..tree };
                let checked = check_in_any_order(&whole, &boxes, collapse::LEAF_ITEMS);
                checked.unwrap_or_else(|problem| panic!("{what}: {problem}"));
            }
        }
    }
    proof::by(refit::reference_boxes, &["refit_boxes", "refit_links"]);
}

/// Triangles that lose their area, or their numbers, are hit no more.
#[test]
fn triangles_die_in_their_places() {
    let h = Harness::lock();
    let mesh = soup(300, 0.4, 8);
    let mut after = mesh.clone();
    for (at, value) in [(0, f32::NAN), (150, f32::INFINITY), (600, f32::NEG_INFINITY)] {
        after.positions[at][1] = value;
    }
    (100..130).for_each(|triangle| after.triangles[triangle][2] = after.triangles[triangle][1]);
    for (builder, tree) in trees(&mesh) {
        let (nodes, hits) = refitted(&h, &tree, &after);
        let boxes = triangles::reference_boxes(&after.positions, &after.triangles);
        let mut wanted = tree.nodes.clone();
        refit::reference_boxes(&mut wanted, &tree.items, &boxes);
        assert_same(&words(&nodes), &words(&wanted), builder);
        assert_same(&hits, &hits_by_sah(&after, &assorted_rays(800, 6)), builder);
    }
}

/// The device's cost, and what each node adds to it.
fn costs(h: &Harness, class: DeviceClass, tree: &Tree) -> f32 {
    let cost = h.output::<f32>(1);
    h.run_on(class, &[&cost], |g| {
        let (nodes, counts) = (g.upload("nodes", &tree.nodes), g.upload("counts", &counts(tree)));
        let mut sum = g.import(cost.memory());
        refit::cost(g, &nodes, &counts, &mut sum);
        g.keep(&sum);
    });
    h.content(&cost)[0]
}

#[test]
fn the_cost_is_that_of_the_specification() {
    let h = Harness::lock();
    for (name, mesh) in meshes() {
        for (builder, tree) in trees(&mesh) {
            let each = refit::reference_costs(&tree.nodes, tree.items.len() as u32);
            for class in [DeviceClass::Cpu, DeviceClass::Gpu] {
                let (found, wanted) = (costs(&h, class, &tree), reduce::reference_f32(class, &each, each.len() as u32));
                // A division may be wrong by 2.5 ulp.
                assert!((found - wanted).abs() <= 1e-6 * wanted, "{name}, {builder}: {found}, not {wanted}");
                assert!(wanted > 0.0 || tree.items.is_empty(), "{name}: {wanted}");
            }
        }
    }
    // One triangle in a leaf of its own: a visit of the root and a test.
    let one = trees(&soup(1, 1.0, 1)).map(|(_, tree)| costs(&h, DeviceClass::Cpu, &tree));
    assert_eq!(one, [3.0; 2]);
    proof::by(refit::reference_costs, &["tree_cost"]);
}

/// A refit with a stale box, and a cost with another topology, are noticed.
#[test]
fn the_comparisons_can_fail() {
    let h = Harness::lock();
    let mesh = soup(300, 0.4, 8);
    let [(_, tree), (_, other)] = trees(&mesh);
    let boxes: Vec<Aabb> = triangles::reference_boxes(&mesh.positions, &mesh.triangles);
    let mut wanted = tree.nodes.clone();
    let mut stale = boxes.clone();
    stale[7].min[0] -= 1.0;
    refit::reference_boxes(&mut wanted, &tree.items, &stale);
    assert!(words(&refitted(&h, &tree, &mesh).0) != words(&wanted));
    let costs = [&tree, &other].map(|tree| costs(&h, DeviceClass::Cpu, tree));
    assert!((costs[0] - costs[1]).abs() > 1e-3 * costs[0], "{costs:?}");
    let (after, rays) = (damaged(300), assorted_rays(800, 6));
    assert!(hits_by_sah(&after, &rays) != hits_by_sah(&moved(&after, 0.01), &rays));
}
