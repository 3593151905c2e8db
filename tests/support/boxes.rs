//! What a tree over boxes has to be, whoever built it, and boxes that stress builders.

use nephroid::low_level::kernels::generated::Aabb;
use nephroid::low_level::kernels::lbvh::{COUNTED_LEAF, END, LEAF};
use nephroid::low_level::kernels::lbvh_reference::Tree;
use nephroid::low_level::kernels::reduce;

use super::random::Random;

/// Checks a tree by what it has to be. Returns its depth in inner nodes.
pub fn check(tree: &Tree, boxes: &[Aabb], leaf_items: u32) -> Result<u32, String> {
    checked(tree, boxes, leaf_items, true)
}

/// The same of a tree whose leaves need not come in the order of their items.
pub fn check_in_any_order(tree: &Tree, boxes: &[Aabb], leaf_items: u32) -> Result<u32, String> {
    checked(tree, boxes, leaf_items, false)
}

fn checked(tree: &Tree, boxes: &[Aabb], leaf_items: u32, ordered: bool) -> Result<u32, String> {
    let valid: Vec<u32> = (0..boxes.len() as u32).filter(|&i| reduce::is_valid(&boxes[i as usize])).collect();
    let mut seen: Vec<u32> = tree.items.iter().map(|item| item & !END).collect();
    seen.sort_unstable();
    if seen != valid || tree.degenerate as usize != boxes.len() - valid.len() {
        return Err("not every valid box once".into());
    }
    let (visited, held) = (vec![false; tree.nodes.len()], vec![false; tree.items.len()]);
    let mut walk = Walk { tree, boxes, leaf_items, ordered, visited, held, items_seen: 0, deepest: 0 };
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
    /// Whether leaves come in the order of their items.
    ordered: bool,
    visited: Vec<bool>,
    /// Items that are in leaves.
    held: Vec<bool>,
    /// Where leaves come in order, this is also where the next one starts.
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
        if self.ordered && first != self.items_seen {
            return Err(format!("a leaf starts at {first}, the one before ended at {}", self.items_seen));
        }
        let rest = self.tree.items.get(first as usize..).ok_or(format!("a leaf at {first}"))?;
        let counted = (reference >> 27 & 15) as usize + 1;
        let flagged = || rest.iter().position(|item| item & END != 0).map_or(0, |last| last + 1);
        let count = if self.leaf_items > COUNTED_LEAF { flagged() } else { counted };
        if count == 0 || count > self.leaf_items as usize || count > rest.len() {
            return Err(format!("a leaf of {count} items"));
        }
        self.items_seen += count as u32;
        for held in &mut self.held[first as usize..first as usize + count] {
            if std::mem::replace(held, true) {
                return Err(format!("an item of the leaf at {first} is in another leaf"));
            }
        }
        let held: Vec<_> = rest[..count].iter().map(|item| self.boxes[(item & !END) as usize]).collect();
        Ok(reduce::reference_bounds(&held))
    }
}

/// A cube by its centre and half its edge.
pub fn cube(centre: [f32; 3], half: f32) -> Aabb {
    Aabb { min: centre.map(|x| x - half), max: centre.map(|x| x + half) }
}

/// Box sets that stress a builder.
pub fn cases(n: usize) -> Vec<(&'static str, Vec<Aabb>)> {
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
