//! The device's LBVH: the same bits as its specification, and a valid tree by properties that do not use it.

mod support;

use nephroid::kernels::generated::{Aabb, BvhNode};
use nephroid::kernels::lbvh::{self, COUNTED_LEAF, END, LEAF, MAX_DEPTH};
use nephroid::kernels::lbvh_reference::{self, Tree};
use nephroid::kernels::{Items, reduce};
use support::{Harness, Random, assert_same};

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

/// Checks a tree by what it has to be. Returns its depth in inner nodes.
fn check(tree: &Tree, boxes: &[Aabb], leaf_items: u32) -> Result<u32, String> {
    let valid: Vec<u32> = (0..boxes.len() as u32).filter(|&i| reduce::is_valid(&boxes[i as usize])).collect();
    let mut seen: Vec<u32> = tree.items.iter().map(|item| item & !END).collect();
    seen.sort_unstable();
    if seen != valid || tree.degenerate as usize != boxes.len() - valid.len() {
        return Err("not every valid box once".into());
    }
    let mut walk = Walk { tree, boxes, leaf_items, visited: vec![false; tree.nodes.len()], items_seen: 0, deepest: 0 };
    walk.node(0, 1)?;
    if walk.visited.contains(&false) {
        return Err("a node that nobody refers to".into());
    }
    if walk.items_seen != tree.items.len() as u32 {
        return Err(format!("leaves hold {} of {} items", walk.items_seen, tree.items.len()));
    }
    Ok(walk.deepest)
}

struct Walk<'a> {
    tree: &'a Tree,
    boxes: &'a [Aabb],
    leaf_items: u32,
    visited: Vec<bool>,
    /// Leaves come in the order of their items, so this is also where the next one starts.
    items_seen: u32,
    deepest: u32,
}

impl Walk<'_> {
    fn node(&mut self, index: u32, depth: u32) -> Result<Aabb, String> {
        let node = self.tree.nodes.get(index as usize).ok_or(format!("node {index} does not exist"))?;
        if std::mem::replace(&mut self.visited[index as usize], true) {
            return Err(format!("node {index} has two parents"));
        }
        self.deepest = self.deepest.max(depth);
        let corner = |v: [f32; 4]| [v[0], v[1], v[2]];
        let children = [
            (node.min0[3].to_bits(), Aabb { min: corner(node.min0), max: corner(node.max0) }),
            (node.max0[3].to_bits(), Aabb { min: corner(node.min1), max: corner(node.max1) }),
        ];
        let mut union = Vec::new();
        for (reference, stated) in children {
            let covered = if reference & LEAF == 0 {
                self.node(reference, depth + 1)?
            } else if stated.min[0] > stated.max[0] {
                reduce::reference_bounds(&[]) // an absent child
            } else {
                self.leaf(reference)?
            };
            if covered != stated {
                return Err(format!("node {index}: box {stated:?} is not that of its items, {covered:?}"));
            }
            union.push(covered);
        }
        Ok(reduce::reference_bounds(&union))
    }

    fn leaf(&mut self, reference: u32) -> Result<Aabb, String> {
        let first = reference & 0x07ff_ffff;
        if first != self.items_seen {
            return Err(format!("a leaf starts at {first}, the one before ended at {}", self.items_seen));
        }
        let rest = &self.tree.items[first as usize..];
        let counted = (reference >> 27 & 15) as usize + 1;
        let flagged = || rest.iter().position(|item| item & END != 0).map_or(0, |last| last + 1);
        let count = if self.leaf_items > COUNTED_LEAF { flagged() } else { counted };
        if count == 0 || count > self.leaf_items as usize || count > rest.len() {
            return Err(format!("a leaf of {count} items"));
        }
        self.items_seen += count as u32;
        let held: Vec<_> = rest[..count].iter().map(|item| self.boxes[(item & !END) as usize]).collect();
        Ok(reduce::reference_bounds(&held))
    }
}

fn cube(centre: [f32; 3], half: f32) -> Aabb {
    Aabb { min: centre.map(|x| x - half), max: centre.map(|x| x + half) }
}

/// Box sets that stress a builder.
fn cases(n: usize) -> Vec<(&'static str, Vec<Aabb>)> {
    let mut random = Random(n as u64 + 99);
    let mut point = |scale: f32| -> [f32; 3] { std::array::from_fn(|_| (random.unit() - 0.5) * scale) };
    let uniform: Vec<_> = (0..n).map(|_| cube(point(100.0), 0.2)).collect();
    let mixed = (0..n).map(|i| match i % 5 {
        1 => Aabb { min: [1.0, 0.0, 0.0], max: [0.0, 1.0, 1.0] },
        3 => Aabb { min: [f32::NAN; 3], max: [0.0; 3] },
        _ => cube(point(10.0), 0.1),
    });
    let mixed: Vec<_> = mixed.collect();
    let huge = (0..n).map(|_| cube(point(3.4e38).map(|x| x * 2.0), 0.0)).collect();
    let tiny = (0..n).map(|_| cube(point(1e-37), 0.0)).collect();
    // Each next point is half as far from the corner: the longest paths that codes can make.
    let nested = (0..n).map(|i| cube([2f32.powi(-((i % 40) as i32)); 3], 0.0)).collect();
    let far = (0..n).map(|_| cube(point(1.0).map(|x| x + 1e6), 0.0)).collect();
    vec![
        ("uniform", uniform),
        ("mixed with degenerate", mixed),
        ("all degenerate", vec![Aabb { min: [2.0; 3], max: [1.0; 3] }; n]),
        ("all equal", vec![cube([3.0; 3], 1.0); n]),
        ("huge", huge),
        ("tiny", tiny),
        ("nested", nested),
        ("on a line", (0..n).map(|i| cube([i as f32, 0.0, 0.0], 0.5)).collect()),
        ("far from the origin", far),
    ]
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
