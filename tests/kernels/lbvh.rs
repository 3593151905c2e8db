//! The device's LBVH: the same bits as its specification, and a valid tree by properties that do not use it.

use nephroid::low_level::kernels::Items;
use nephroid::low_level::kernels::generated::{Aabb, BvhNode};
use nephroid::low_level::kernels::lbvh::{self, MAX_DEPTH};
use nephroid::low_level::kernels::lbvh_reference::{self, Tree};

use crate::support::boxes::{cases, check};
use crate::support::harness::{Harness, assert_same};
use crate::support::proof;

/// Builds on the device, twice.
fn build(h: &Harness, boxes: &[Aabb], count: Option<u32>, leaf_items: u32) -> Tree {
    let n = boxes.len();
    let (nodes, items, counts) = (h.output::<BvhNode>(n.max(2) - 1), h.output::<u32>(n), h.output::<u32>(3));
    let input = h.input(boxes);
    // Only what the counts name is defined; the rest of nodes and items differs from run to run.
    h.run(&[&counts], |g| {
        let boxes = g.import_read(&input);
        let used = g.upload("count", &[count.unwrap_or(n as u32)]);
        let selected = if count.is_some() { Items::Counted(&used) } else { Items::All };
        let tree = lbvh::build(g, selected, &boxes, lbvh::Options { leaf_items, fences: h.fences() });
        let mut targets = (g.import(nodes.memory()), g.import(items.memory()), g.import(counts.memory()));
        g.copy(&tree.nodes, &mut targets.0);
        g.copy(&tree.items, &mut targets.1);
        g.copy(&tree.counts, &mut targets.2);
        g.keep(&targets.0);
        g.keep(&targets.1);
        g.keep(&targets.2);
    });
    let counts = h.content(&counts);
    let (mut nodes, mut items) = (h.content(&nodes), h.content(&items));
    items.truncate(counts[0] as usize);
    nodes.truncate(counts[2] as usize);
    Tree { nodes, items, degenerate: counts[1] }
}

/// The words of a node: references are bits, not floats.
fn words(nodes: &[BvhNode]) -> Vec<[u32; 16]> {
    nodes.iter().map(|node| bytemuck::cast(*node)).collect()
}

fn compare(h: &Harness, what: &str, boxes: &[Aabb], count: Option<u32>, leaf_items: u32) {
    let used = &boxes[..count.map_or(boxes.len(), |count| (count as usize).min(boxes.len()))];
    let what = format!("{what}, {} of {} boxes, leaves of {leaf_items}", used.len(), boxes.len());
    let got = build(h, boxes, count, leaf_items);
    let depth = check(&got, used, leaf_items).unwrap_or_else(|problem| panic!("{what}: {problem}"));
    assert!(depth <= MAX_DEPTH, "{what}: depth {depth}");
    let wanted = lbvh_reference::build(used, leaf_items);
    assert_same(&got.items, &wanted.items, &what);
    assert_same(&words(&got.nodes), &words(&wanted.nodes), &what);
    assert_eq!(got.degenerate, wanted.degenerate, "{what}");
}

#[test]
fn device_builds_the_specified_tree() {
    let h = Harness::lock();
    for n in [0, 1, 2, 3, 16, 17, 255, 256, 257, 2049] {
        for (name, boxes) in cases(n) {
            for leaf_items in [1, 4, 16, 40] {
                compare(&h, name, &boxes, None, leaf_items);
            }
        }
    }
    for (name, boxes) in cases(65_537) {
        compare(&h, name, &boxes, None, 1);
    }
}

#[test]
fn counts_come_from_the_device() {
    let h = Harness::lock();
    for count in [0, 1, 2, 700, 1000, u32::MAX] {
        let (name, boxes) = cases(1000).swap_remove(1);
        compare(&h, name, &boxes, Some(count), 4);
    }
    proof::by(lbvh_reference::build, &["lbvh_boxes", "lbvh_codes", "lbvh_count", "lbvh_links", "lbvh_pack"]);
}

/// Many climbers on two threads, repeatedly: a lost or torn box of a sibling would show as a wrong box.
#[test]
fn a_million_boxes() {
    let h = Harness::lock();
    let (_, boxes) = cases(1_000_003).swap_remove(0);
    let first = build(&h, &boxes, None, 1);
    let depth = check(&first, &boxes, 1).unwrap_or_else(|problem| panic!("{problem}"));
    assert!(depth <= MAX_DEPTH);
    for _ in 0..4 {
        let again = build(&h, &boxes, None, 1);
        assert!(words(&again.nodes) == words(&first.nodes) && again.items == first.items, "a run differs");
    }
}

#[test]
fn the_check_finds_damage() {
    let (_, boxes) = cases(300).swap_remove(0);
    for leaf_items in [4, 40] {
        let good = lbvh_reference::build(&boxes, leaf_items);
        assert!(check(&good, &boxes, leaf_items).is_ok());
        let damage: [fn(&mut Tree); 6] = [
            |tree| tree.items[7] = tree.items[8],
            |tree| tree.nodes[3].max0[1] += 0.5,
            |tree| tree.nodes[3].min1[2] -= 1e-5,
            |tree| tree.nodes[0].min0[3] = tree.nodes[0].max0[3],
            |tree| tree.nodes.push(tree.nodes[1]),
            |tree| tree.degenerate = 1,
        ];
        for (index, spoil) in damage.iter().enumerate() {
            let mut bad = good.clone();
            spoil(&mut bad);
            assert!(check(&bad, &boxes, leaf_items).is_err(), "damage {index} went unnoticed");
        }
    }
}
