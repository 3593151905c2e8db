//! The hash grid: its filing and its table against the specification, and gathers where cells are hard to get right.

use nephroid::low_level::kernels::deposits::{COUNTERS, Deposits};
use nephroid::low_level::kernels::gather::hash::{HASH_BITS, LEVELS, NONE, Options, hash, hash_grid, slots};
use nephroid::low_level::kernels::gather::reference::{Disc, lambert_hit};
use nephroid::low_level::kernels::gather::{Weight, brute, hash_reference};
use nephroid::low_level::kernels::generated::{Aabb, EyeHit, HashLevel, HashSlot, Photon};
use nephroid::low_level::kernels::reduce;

use crate::support::gather::{Light, difference, gathered, lambert, room};
use crate::support::harness::{Harness, assert_same};
use crate::support::proof;
use crate::support::random::Random;

/// What is left of a grid after its build.
struct Built {
    keys: Vec<u32>,
    order: Vec<u32>,
    photons: Vec<Photon>,
    table: Vec<HashSlot>,
    ends: Vec<u32>,
    levels: Vec<HashLevel>,
    in_use: u32,
}

fn built(harness: &Harness, photons: &[(Photon, Aabb)], options: Options) -> Built {
    let (stored, boxes): (Vec<Photon>, Vec<Aabb>) = photons.iter().copied().unzip();
    let n = stored.len();
    let (stored, boxes) = (harness.input(&stored), harness.input(&boxes));
    let (keys, order, sorted) = (harness.output::<u32>(n), harness.output::<u32>(n), harness.output::<Photon>(n));
    let (levels, in_use) = (harness.output::<HashLevel>(LEVELS as usize), harness.output::<u32>(1));
    // Where a run's slot is and what `ends` holds elsewhere may differ between runs, so only the first run's are kept.
    let (table, ends) = (harness.output::<HashSlot>(slots(n as u32) as usize), harness.output::<u32>(n));
    let declare = |g: &mut nephroid::low_level::graph::Graph, with_table: bool| {
        let mut count = g.buffer("count", 1);
        g.fill(&mut count, n as u32);
        let mut overflow = g.buffer("overflow", 1);
        g.fill(&mut overflow, 0);
        let counters = g.buffer("counters", COUNTERS.len() as u32);
        let (photons, boxes) = (g.import(&stored), g.import(&boxes));
        let deposits = Deposits { photons, boxes, count, overflow, counters, truncated: vec![], energies: vec![] };
        let grid = hash_grid(g, &deposits, options, None);
        macro_rules! keep {
            ($($buffer:expr => $output:expr),*) => {$(
                let mut target = g.import($output.memory());
                g.copy(&$buffer, &mut target);
                g.keep(&target);
            )*};
        }
        if with_table {
            keep!(grid.table => table, grid.ends => ends);
        } else {
            keep!(grid.keys => keys, grid.order => order, grid.photons => sorted, grid.levels => levels,
                  grid.in_use => in_use);
        }
    };
    harness.run(&[&keys, &order, &sorted, &levels, &in_use], |g| declare(g, false));
    harness.run_once(|g| declare(g, true));
    Built {
        keys: harness.content(&keys),
        order: harness.content(&order),
        photons: harness.content(&sorted),
        table: harness.content(&table),
        ends: harness.content(&ends),
        levels: harness.content(&levels),
        in_use: harness.content(&in_use)[0],
    }
}

/// Discs of many sizes on both sides of the origin, some with boxes or places that are no numbers.
fn discs(count: usize) -> Vec<(Photon, Aabb)> {
    let (discs, _) = room(count, 0, |r| [1e-4f32.powf(r.unit()), 1e-4f32.powf(r.unit())]);
    let shifted = discs.iter().map(|disc| Disc { position: disc.position.map(|x| 3.0 * x - 1.5), ..*disc });
    let mut stored: Vec<_> = shifted.map(|disc| disc.stored()).collect();
    for (i, (photon, b)) in stored.iter_mut().enumerate() {
        match i % 89 {
            17 => b.min[1] = f32::NAN,
            41 => photon.a[2] = f32::INFINITY.to_bits(),
            _ => {}
        }
    }
    stored
}

#[test]
fn filing_equals_the_specification() {
    let harness = Harness::lock();
    for (count, levels, hash_bits) in [(1, LEVELS, HASH_BITS), (5000, LEVELS, HASH_BITS), (5000, 1, 9), (3000, 5, 3)] {
        let what = format!("{count} photons, {levels} levels, {hash_bits} bits");
        let photons = discs(count);
        let grid = built(&harness, &photons, Options { levels, hash_bits });
        let wanted = hash_reference::file(&photons, &grid.levels, levels, hash_bits);
        let (keys, order): (Vec<u32>, Vec<u32>) = wanted.into_iter().unzip();
        assert_same(&grid.keys, &keys, &what);
        assert_same(&grid.order, &order, &what);
        let sorted: Vec<_> = order.iter().map(|&i| photons[i as usize].0).collect();
        assert_same(&grid.photons, &sorted, &what);
        let in_use = keys.iter().filter(|key| **key != NONE).fold(0u32, |mask, key| mask | 1 << (key >> HASH_BITS));
        assert_eq!(grid.in_use, in_use, "{what}");
        check_table(&grid, &what);
        check_levels(&grid, &photons, &what);
    }
    proof::by(hash_reference::file, &["hash_extent", "hash_file", "hash_insert", "hash_levels"]);
}

/// The table has every run once, and probing finds it.
fn check_table(grid: &Built, what: &str) {
    let runs = hash_reference::runs(&grid.keys);
    let taken = grid.table.iter().filter(|slot| slot.key != NONE).count();
    assert_eq!(taken, runs.len(), "{what}");
    let mask = grid.table.len() as u32 - 1;
    for (key, first, end) in runs {
        let (mut at, mut step) = (key & mask, 0);
        while grid.table[at as usize].key != key {
            assert_ne!(grid.table[at as usize].key, NONE, "{what}: key {key:#x} is not found");
            step += 1;
            at = (at + step) & mask;
        }
        assert_eq!((grid.table[at as usize].first, grid.ends[first as usize]), (first, end), "{what}: key {key:#x}");
    }
}

/// Division may be off by 2.5 units in the last place; everything else is exact.
fn check_levels(grid: &Built, photons: &[(Photon, Aabb)], what: &str) {
    let boxes: Vec<Aabb> = photons.iter().map(|(_, b)| *b).collect();
    let largest = photons.iter().map(|(p, b)| hash_reference::extent(p, b)).fold(0f32, f32::max);
    for (got, wanted) in grid.levels.iter().zip(hash_reference::levels(largest, &reduce::reference_bounds(&boxes))) {
        assert_eq!(got.radius, wanted.radius, "{what}");
        assert!((got.scale / wanted.scale - 1.0).abs() < 4e-7, "{what}: {} is not {}", got.scale, wanted.scale);
    }
}

/// The hash grid gives what brute force gives, with cells of all kinds; returns the accepted pairs and the tested ones.
fn compare(harness: &Harness, hits: &[EyeHit], discs: &[Disc], tolerance: f64, what: &str) -> (f32, f32) {
    let program = lambert(harness, Weight::Epanechnikov);
    let all = gathered(harness, hits, discs, |g, points, deposits, target| {
        brute(g, program, points, (&deposits.photons, &deposits.count), target);
    });
    let expected: Vec<_> = all.iter().map(double).collect();
    let sum = |lights: &[Light], at: usize| lights.iter().map(|light| light[at][3]).sum::<f32>();
    let mut tested = 0.0;
    for (levels, hash_bits) in [(3, 1), (1, HASH_BITS), (LEVELS, 6), (LEVELS, HASH_BITS)] {
        let found = gathered(harness, hits, discs, |g, points, deposits, target| {
            let grid = hash_grid(g, deposits, Options { levels, hash_bits }, None);
            hash(g, program, points, (&grid, deposits), target);
        });
        let options = format!("{what}, {levels} levels, {hash_bits} bits");
        assert_eq!(difference(&found, &expected, tolerance), None, "{options}");
        // No photon counts twice, none is lost: not even those of no weight.
        assert_eq!(sum(&found, 1), sum(&all, 1), "{options}");
        tested = sum(&found, 0);
    }
    (sum(&all, 1), tested)
}

fn double(light: &Light) -> [[f64; 3]; 2] {
    light.map(|x| [0, 1, 2].map(|k| f64::from(x[k])))
}

fn disc(position: [f32; 3], radius: f32, random: &mut Random) -> Disc {
    Disc {
        position,
        normal: [0.0, 1.0, 0.0],
        radii: [radius, radius * (0.1 + 0.9 * random.unit())],
        flux: [random.unit(), random.unit(), random.unit()],
        direction: [0.0, -1.0, 0.0],
        caustic: random.unit() < 0.4,
    }
}

/// Hits at and around photons.
fn hits_around(discs: &[Disc], reach: f32, random: &mut Random) -> Vec<EyeHit> {
    let mut near = |x: f32| x + reach * (2.0 * random.unit() - 1.0);
    let one = |d: &Disc| lambert_hit([near(d.position[0]), d.position[1], near(d.position[2])], d.normal, [1.0; 3]);
    discs.iter().map(one).collect()
}

/// Case 32 of the extreme cases: extent over radius of 1e13, spread and in clusters, near the origin and far from it.
#[test]
fn case_32_extent_over_radius_of_1e13() {
    let harness = Harness::lock();
    let mut random = Random(32);
    let signed = |r: &mut Random| 2.0 * r.unit() - 1.0;
    let mut discs = Vec::new();
    for scale in [1e13f32, 1e13, 3e10, 2e7, 9e6, 4e6, 1e5] {
        let far = [0; 3].map(|_| scale * signed(&mut random));
        // Spread over the whole scale, and a crowd at one place of it.
        for _ in 0..60 {
            let place = [0; 3].map(|_| scale * signed(&mut random));
            discs.push(disc(place, 1.0, &mut random));
            let place = far.map(|x| x + 3.0 * signed(&mut random));
            discs.push(disc(place, 1.0, &mut random));
        }
    }
    for _ in 0..300 {
        let place = [4.0 * signed(&mut random), 0.0, 4.0 * signed(&mut random)];
        discs.push(disc(place, 1.0, &mut random));
    }
    let mut hits = hits_around(&discs, 0.0, &mut random);
    hits.extend(hits_around(&discs, 1.5, &mut random));
    let (accepted, tested) = compare(&harness, &hits, &discs, 1e-6, "1e13");
    assert!(accepted > 5000.0, "{accepted} pairs are too few for a comparison");
    let all = (hits.len() * discs.len()) as f32;
    assert!(tested < 0.6 * all, "{tested} of {all} pairs were tested");
}

#[test]
fn photons_on_the_borders_of_cells() {
    let harness = Harness::lock();
    let mut random = Random(5);
    let radius = 0.37f32;
    let (photon, b) = disc([0.0; 3], radius, &mut random).stored();
    let of = hash_reference::levels(hash_reference::extent(&photon, &b), &b)[0];
    let mut discs = Vec::new();
    for i in -4..4 {
        for k in -4..4 {
            let border = |k: i32, by: i32| {
                let x = k as f32 / of.scale;
                [x.next_down(), x, x.next_up()][by as usize]
            };
            for by in 0..3 {
                discs.push(disc([border(i, by), 0.0, border(k, (by + i + 4) % 3)], radius, &mut random));
            }
        }
    }
    let mut hits = hits_around(&discs, 0.0, &mut random);
    hits.extend(hits_around(&discs, radius, &mut random));
    // At the very distance at which looking ends.
    let edge = |d: &Disc| lambert_hit([d.position[0] + of.radius, 0.0, d.position[2]], d.normal, [1.0; 3]);
    hits.extend(discs.iter().map(edge));
    let (accepted, _) = compare(&harness, &hits, &discs, 1e-6, "borders");
    assert!(accepted > 500.0, "{accepted} pairs are too few for a comparison");
}

#[test]
fn crowds_sizes_and_coordinates_at_their_limits() {
    let harness = Harness::lock();
    let mut random = Random(6);
    let mut scene = |count: usize, spread: f32, radius: f32, least: f32| -> Vec<Disc> {
        let one = |_| {
            let place = [spread * (random.unit() - 0.8), 0.0, spread * (random.unit() - 0.8)];
            let size = radius * least.powf(random.unit());
            disc(place, size, &mut random)
        };
        (0..count).map(one).collect()
    };
    let scenes = [
        ("one cell", scene(700, 1e-3, 1.0, 1.0), 0.5),
        ("one place", scene(300, 0.0, 1.0, 1.0), 0.5),
        ("a million sizes", scene(600, 1.0, 0.5, 1e-6), 0.01),
        ("tiny", scene(300, 1e-12, 1e-13, 0.1), 1e-13),
        ("huge", scene(300, 1e12, 1e11, 0.1), 1e11),
        ("near the end of the floats", scene(300, 1e37, 3e36, 0.1), 1e36),
    ];
    for (what, discs, reach) in scenes {
        let mut hits = hits_around(&discs, 0.0, &mut Random(1));
        hits.extend(hits_around(&discs, reach, &mut Random(2)));
        // A sum of n floats that are not negative is off by n 2^-24 at most, in whichever order.
        let rounding = 2.0 * discs.len() as f64 * 2f64.powi(-24);
        let (accepted, _) = compare(&harness, &hits, &discs, rounding, what);
        assert!(accepted > 100.0, "{what}: {accepted} pairs are too few for a comparison");
    }
}

/// With levels, mixed sizes cost far fewer tests than in the paper's grid of one cell size.
#[test]
fn levels_save_tests() {
    let harness = Harness::lock();
    let (discs, hits) = room(3000, 200, |r| [if r.unit() < 0.01 { 0.3 } else { 0.01 }; 2]);
    let program = lambert(&harness, Weight::Epanechnikov);
    let tested = |levels: u32| -> f32 {
        let found = gathered(&harness, &hits, &discs, |g, points, deposits, target| {
            let grid = hash_grid(g, deposits, Options { levels, ..Options::default() }, None);
            hash(g, program, points, (&grid, deposits), target);
        });
        found.iter().map(|light| light[0][3]).sum()
    };
    let (one, all) = (tested(1), tested(LEVELS));
    assert!(5.0 * all < one, "{all} tests with levels, {one} without");
}
