//! The voxel volume heuristic's tree: valid on every set of boxes, the cheapest split in every node, better than the
//! linear builder's.

use nephroid::low_level::kernels::generated::Aabb;
use nephroid::low_level::kernels::lbvh::{COUNTED_LEAF, LEAF, MAX_DEPTH};
use nephroid::low_level::kernels::lbvh_reference::{self, Tree};
use nephroid::low_level::kernels::vvh::{Work, build, children, expected_work};
use proptest::prelude::*;

use crate::support::boxes::{cases, check, cube};
use crate::support::random::Random;

fn checked(what: &str, boxes: &[Aabb], leaf_items: u32) -> Tree {
    let tree = build(boxes, leaf_items);
    let depth = check(&tree, boxes, leaf_items).unwrap_or_else(|problem| panic!("{what}: {problem}"));
    assert!(depth <= MAX_DEPTH, "{what}: depth {depth}");
    tree
}

#[test]
fn every_item_once_in_boxes_that_hold_it() {
    for n in [0, 1, 2, 3, 16, 17, 255, 1000] {
        for (name, boxes) in cases(n) {
            for leaf_items in [1, 2, 5, COUNTED_LEAF] {
                checked(&format!("{name}, {n} boxes, leaves of {leaf_items}"), &boxes, leaf_items);
            }
        }
    }
}

/// Volumes that shrink quickly from one box to the next make the cheapest splits as unbalanced as they can be.
#[test]
fn paths_end_where_the_stack_does() {
    let depth = |boxes: &[Aabb]| check(&build(boxes, 1), boxes, 1).expect("a valid tree");
    let onion: Vec<_> = (0..40).map(|i| cube([0.0; 3], 2f32.powi(120 - 6 * i))).collect();
    assert_eq!(depth(&onion), 39, "one box is cut off at a time");
    let onion = |n: i32| (0..n).map(|i| cube([0.0; 3], 2f32.powi(100 - i % 220))).collect::<Vec<_>>();
    assert_eq!(depth(&onion(220)), MAX_DEPTH, "until the levels are used up");
    assert!(depth(&onion(20_000)) <= MAX_DEPTH);
}

#[test]
fn equal_boxes_give_a_balanced_tree() {
    for (half, name) in [(1.0, "cubes"), (0.0, "points"), (1e-30, "specks"), (1e38, "giants")] {
        let boxes = vec![cube([0.3; 3], half); 4096];
        assert_eq!(check(&build(&boxes, 1), &boxes, 1), Ok(12), "{name}");
    }
    let flat = vec![Aabb { min: [0.0, 1.0, 0.0], max: [3.0, 1.0, 2.0] }; 1024];
    assert_eq!(check(&build(&flat, 8), &flat, 8), Ok(7));
}

/// Points have no volume in a plane and no area on a line; they are to be told apart all the same.
#[test]
fn flat_sets_are_split_by_area_and_lines_by_length() {
    let mut random = Random(5);
    let clusters = |axes: usize, random: &mut Random| -> Vec<Aabb> {
        let point = |i: usize, random: &mut Random| {
            let at = if i.is_multiple_of(4) { 10.0 } else { 0.0 };
            std::array::from_fn(|k| if k < axes { at + random.unit() } else { 7.0 })
        };
        (0..64).map(|i| cube(point(i, random), 0.0)).collect()
    };
    for axes in [1, 2, 3] {
        let boxes = clusters(axes, &mut random);
        let tree = checked("clusters", &boxes, 1);
        let first = children(&tree.nodes[0]).map(|(_, bounds)| bounds);
        assert!(first[0].max[0] <= 1.0 && first[1].min[0] >= 10.0, "in {axes} axes the clusters are parted: {first:?}");
    }
}

/// Counts and boxes below each node, by node; leaves are left out.
fn volume(b: &Aabb) -> f64 {
    (0..3).map(|k| f64::from(b.max[k]) - f64::from(b.min[k])).product()
}

fn union(boxes: &[Aabb], items: &[u32]) -> Aabb {
    let empty = Aabb { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };
    items.iter().map(|&i| boxes[i as usize]).fold(empty, |a, b| Aabb {
        min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
        max: std::array::from_fn(|k| a.max[k].max(b.max[k])),
    })
}

fn cost(boxes: &[Aabb], items: &[u32], middle: usize) -> f64 {
    let side = |part: &[u32]| part.len() as f64 * volume(&union(boxes, part));
    side(&items[..middle]) + side(&items[middle..])
}

/// The least of eq. 14 over all planes through the sorted centres, by trying each from scratch.
fn least_cost(boxes: &[Aabb], items: &[u32]) -> f64 {
    let mut least = f64::INFINITY;
    for axis in 0..3 {
        let mut order = items.to_vec();
        let centre = |i: u32| 0.5 * boxes[i as usize].min[axis] + 0.5 * boxes[i as usize].max[axis];
        order.sort_by(|&a, &b| centre(a).total_cmp(&centre(b)).then(a.cmp(&b)));
        least = (1..items.len()).map(|middle| cost(boxes, &order, middle)).fold(least, f64::min);
    }
    least
}

/// Items below a reference; compares the cost of every node on the way with the least.
fn walk(tree: &Tree, boxes: &[Aabb], reference: u32) -> Result<Vec<u32>, String> {
    if reference & LEAF != 0 {
        let first = (reference & 0x07ff_ffff) as usize;
        return Ok(tree.items[first..][..(reference >> 27 & 15) as usize + 1].to_vec());
    }
    let [left, right] = children(&tree.nodes[reference as usize]).map(|(child, _)| walk(tree, boxes, child));
    let (mut items, right) = (left?, right?);
    let middle = items.len();
    items.extend(right);
    let (got, least) = (cost(boxes, &items, middle), least_cost(boxes, &items));
    // Volumes are rounded to 24 bits.
    if got > least * (1.0 + 1e-6) {
        return Err(format!("a split of {} items costs {got}, another {least}", items.len()));
    }
    Ok(items)
}

#[test]
fn every_split_is_the_cheapest() {
    let mut random = Random(11);
    let mut unit = || random.unit();
    let boxes: Vec<Aabb> = (0..90)
        .map(|_| {
            let (centre, half): ([f32; 3], [f32; 3]) = ([unit(), unit(), unit()], [unit(), unit(), unit()]);
            Aabb {
                min: std::array::from_fn(|k| centre[k] - 0.1 * half[k]),
                max: std::array::from_fn(|k| centre[k] + 0.1 * half[k]),
            }
        })
        .collect();
    walk(&build(&boxes, 3), &boxes, 0).unwrap_or_else(|problem| panic!("{problem}"));
    // The linear builder's splits are others, and the check finds that.
    assert!(walk(&lbvh_reference::build(&boxes, 3), &boxes, 0).is_err());
}

/// Boxes as photons have them: clusters of very different sizes over surfaces.
fn clustered(n: usize, seed: u64) -> Vec<Aabb> {
    let mut random = Random(seed);
    let mut boxes = Vec::with_capacity(n);
    while boxes.len() < n {
        let centre: [f32; 3] = std::array::from_fn(|_| random.unit());
        let (spread, half) = (0.3 * random.unit().powi(3), 0.02 * random.unit().powi(2) + 1e-4);
        for _ in 0..1 + (random.bits() % 200) {
            let mut at = centre.map(|x| x + spread * (random.unit() - 0.5));
            at[2] = if random.unit() < 0.7 { centre[2] } else { at[2] };
            boxes.push(cube(at, half * (0.5 + random.unit())));
        }
    }
    boxes.truncate(n);
    boxes
}

#[test]
fn costs_less_than_the_linear_build() {
    // A node costs two box tests.
    let cost = |tree: &Tree| {
        let work = expected_work(tree);
        2.0 * work.nodes + work.photons
    };
    for seed in 0..6 {
        for n in [500, 5000] {
            for (name, boxes) in [("clustered", clustered(n, seed)), ("uniform", cases(n).swap_remove(0).1)] {
                for leaf_items in [1, 4, 16] {
                    let (ours, theirs) =
                        (cost(&build(&boxes, leaf_items)), cost(&lbvh_reference::build(&boxes, leaf_items)));
                    assert!(ours <= theirs, "{name}, {n} boxes, leaves of {leaf_items}: {ours} against {theirs}");
                }
            }
        }
    }
}

#[test]
fn work_of_trees_that_can_be_counted() {
    let work = |boxes: &[Aabb], leaf_items| {
        let Work { nodes, photons } = expected_work(&build(boxes, leaf_items));
        [nodes, photons].map(|x| (x * 1000.0).round() as i32)
    };
    // Unit cubes in a box of ten.
    let [a, b, c] = [0.0, 1.0, 9.0].map(|x| cube([x, 0.0, 0.0], 0.5));
    assert_eq!(work(&[a, c], 1), [1000, 200]);
    assert_eq!(work(&[a, c], 2), [1000, 2000]);
    assert_eq!(work(&[a, c, b], 1), [1200, 300]);
}

fn some_box() -> impl Strategy<Value = Aabb> {
    // Few distinct values, so that ties, flat boxes and equal centres are common; some boxes are not valid.
    let number = prop_oneof![8 => (-4i8..4).prop_map(f32::from), 1 => Just(f32::NAN), 4 => -1e3f32..1e3f32];
    let corner = || [number.clone(), number.clone(), number.clone()];
    (corner(), corner(), 0..4u8).prop_map(|(a, b, kind)| match kind {
        0 => Aabb { min: a, max: a },
        1 => Aabb { min: a, max: b },
        _ => Aabb { min: std::array::from_fn(|k| a[k].min(b[k])), max: std::array::from_fn(|k| a[k].max(b[k])) },
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn any_boxes_give_a_valid_tree_and_always_the_same(
        boxes in proptest::collection::vec(some_box(), 0..200),
        leaf_items in 1..=COUNTED_LEAF,
    ) {
        let tree = checked("random", &boxes, leaf_items);
        let words = |tree: &Tree| tree.nodes.iter().map(|n| bytemuck::cast::<_, [u32; 16]>(*n)).collect::<Vec<_>>();
        let again = build(&boxes, leaf_items);
        prop_assert_eq!((words(&again), again.items), (words(&tree), tree.items.clone()));
    }
}
