//! Rates of the primitives beside their floors: `cargo test --release --test rates -- --ignored --nocapture`.

mod support;

use std::time::Instant;

use nephroid::kernels::generated::Aabb;
use nephroid::kernels::{Items, lbvh, reduce, scan, sort};
use support::{Harness, Random};

/// Shortest of five times [s].
fn shortest(mut run: impl FnMut()) -> f64 {
    let time = |_| {
        let begin = Instant::now();
        run();
        begin.elapsed().as_secs_f64()
    };
    (0..5).map(time).fold(f64::INFINITY, f64::min)
}

/// Prints items and bytes per second, and the bytes as a fraction of a copy's.
fn report(what: &str, n: usize, bytes_per_item: f64, seconds: f64, copy: f64) {
    let (items, bytes) = (n as f64 / seconds, n as f64 * bytes_per_item / seconds);
    println!(
        "{what:>24} {n:>9}: {:8.2} ms {:8.1} M/s {:6.2} GB/s {:5.1} % of a copy",
        seconds * 1e3,
        items / 1e6,
        bytes / 1e9,
        bytes / copy * 100.0
    );
}

/// Single-thread least-significant-digit sort of pairs, all histograms in one read, as good as plain code gets.
fn host_sort(pairs: &mut Vec<(u32, u32)>, spare: &mut Vec<(u32, u32)>) {
    let mut histograms = [[0u32; 256]; 4];
    for (key, _) in pairs.iter() {
        for (pass, histogram) in histograms.iter_mut().enumerate() {
            histogram[(key >> (8 * pass) & 255) as usize] += 1;
        }
    }
    for (pass, histogram) in histograms.iter().enumerate() {
        let mut sum = 0u32;
        let mut places = histogram.map(|count| {
            sum += count;
            sum - count
        });
        for &pair in pairs.iter() {
            let place = &mut places[(pair.0 >> (8 * pass) & 255) as usize];
            spare[*place as usize] = pair;
            *place += 1;
        }
        std::mem::swap(pairs, spare);
    }
}

#[test]
#[ignore = "a measurement"]
fn rates() {
    let h = Harness::lock();
    for exponent in [16, 20, 23] {
        let n = 1usize << exponent;
        let mut random = Random(5);
        let keys: Vec<u32> = (0..n).map(|_| random.next() as u32).collect();
        let input = h.input(&keys);
        let copy_time = h.time(|g| {
            let (from, mut to) = (g.import_read(&input), g.buffer("copy", n as u32));
            g.copy(&from, &mut to);
            g.keep(&to);
        });
        let copy = n as f64 * 8.0 / copy_time;
        report("copy", n, 8.0, copy_time, copy);
        let time = h.time(|g| {
            let (from, mut to, mut total) = (g.import_read(&input), g.buffer("sums", n as u32), g.buffer("total", 1));
            scan::exclusive(g, Items::All, &from, &mut to, &mut total);
            g.keep(&to);
        });
        report("scan", n, 12.0, time, copy);
        let time = h.time(|g| {
            let (from, mut sum) = (g.import_read(&input), g.buffer("sum", 1));
            reduce::u32s(g, Items::All, reduce::Op::Sum, &from, &mut sum);
            g.keep(&sum);
        });
        report("sum", n, 4.0, time, copy);
        let time = h.time(|g| {
            let (from, mut pair) = (g.import_read(&input), (g.buffer("keys", n as u32), g.buffer("values", n as u32)));
            g.copy(&from, &mut pair.0);
            g.copy(&from, &mut pair.1);
            let sorted = sort::pairs(g, Items::All, pair.0, pair.1, 32);
            g.keep(&sorted.0);
            g.keep(&sorted.1);
        });
        report("sort of pairs", n, 80.0, time - 2.0 * copy_time, copy);
        let mut host: Vec<(u32, u32)> = keys.iter().map(|&key| (key, key)).collect();
        let mut spare = host.clone();
        let time = shortest(|| host_sort(&mut host, &mut spare));
        report("sort of pairs, one thread", n, 80.0, time, copy);
        let boxes: Vec<Aabb> = (0..n / 4).map(|_| small_box(&mut random)).collect();
        let input = h.input(&boxes);
        let time = h.time(|g| {
            let boxes = g.import_read(&input);
            let options = lbvh::Options { leaf_items: 1, fences: h.fences() };
            let tree = lbvh::build(g, Items::All, &boxes, options);
            g.keep(&tree.nodes);
        });
        report("lbvh", n / 4, 340.0, time, copy);
    }
}

fn small_box(random: &mut Random) -> Aabb {
    let min: [f32; 3] = std::array::from_fn(|_| random.unit() * 100.0);
    Aabb { min, max: min.map(|x| x + 0.1) }
}
