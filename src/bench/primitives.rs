//! The yardsticks, scan and sort.

use std::time::Instant;

use super::host_sort::sort_pairs;
use super::{Effort, Floor, MEASURED, Rate, Yardstick, median, splats, time};
use crate::constants::MULTIPLICATIONS;
use crate::error::Result;
use crate::graph::{Grid, Persistent, Runtime};
use crate::kernels::generated::{BenchMultiply, BenchMultiplyBindings, BenchMultiplyParams};
use crate::kernels::{Items, scan, sort};

/// Bytes per item of a scan in three dispatches: read twice, written once.
const SCAN_BYTES: f64 = 12.0;
/// Bytes per pair of a sort by 32 bits: four passes, the keys read to be counted, the pairs read and written.
const SORT_BYTES: f64 = 80.0;

/// Measures a copy, multiplications, scan, sort, the sort of one thread of the CPU, and where the device draws,
/// blending. `begin` hears what comes next.
///
/// # Errors
/// Those of the device.
pub fn primitives(runtime: &Runtime, effort: Effort, begin: &mut dyn FnMut(&str)) -> Result<(Yardstick, Vec<Rate>)> {
    let n = effort.items;
    let keys: Vec<u32> = (0..n).map(|i| hash(i + 1)).collect();
    let input = runtime.persistent_from("keys", &keys)?;
    let rate =
        |name, unit, seconds, floor| Rate { name, items: u64::from(n), unit, seconds, floor, note: String::new() };
    begin("copy");
    let copy = rate("copy", "words", copy(runtime, effort, &input)?, Floor::Bytes(8.0));
    begin("multiplications");
    let multiply = multiply(runtime, effort)?;
    begin("scan");
    let scan = rate("scan", "words", scan(runtime, effort, &input)?, Floor::Bytes(SCAN_BYTES));
    begin("sort");
    let mut sort = rate("sort", "pairs", sort(runtime, effort, &input)?, Floor::Bytes(SORT_BYTES));
    begin("sort on the CPU");
    let host = rate("sort, one CPU thread", "pairs", host_sort(&keys, effort.repeats), Floor::Bytes(SORT_BYTES));
    sort.note = format!("{:.2} x the time of one CPU thread", sort.seconds / host.seconds);
    let mut rates = vec![copy, multiply, scan, sort, host];
    begin("additive blending");
    rates.extend(splats::splats(runtime, effort)?);
    let (copy, multiply) = (&rates[0], &rates[1]);
    let yardstick =
        Yardstick { bytes_per_second: 8.0 * copy.per_second(), instructions_per_second: multiply.per_second() };
    Ok((yardstick, rates))
}

/// Words without a pattern (the finaliser of MurmurHash3).
fn hash(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

fn copy(runtime: &Runtime, effort: Effort, input: &Persistent<u32>) -> Result<f64> {
    time(runtime, effort.repeats, |g| {
        let (from, mut to) = (g.import_read(input), g.buffer("copy", input.len()));
        g.scope(MEASURED, |g| g.copy(&from, &mut to));
        g.keep(&to);
    })
}

fn multiply(runtime: &Runtime, effort: Effort) -> Result<Rate> {
    let count = effort.items / 4;
    let seconds = time(runtime, effort.repeats, |g| {
        let mut products = g.buffer("products", count);
        let (params, bind) =
            (BenchMultiplyParams { count, factor: 1.000_000_1 }, BenchMultiplyBindings { products: &mut products });
        g.scope(MEASURED, |g| g.dispatch(BenchMultiply, Grid::Threads(count), params, bind));
        g.keep(&products);
    })?;
    let items = u64::from(count) * u64::from(MULTIPLICATIONS);
    Ok(Rate { name: "multiply", items, unit: "f32", seconds, floor: Floor::Instructions(1.0), note: String::new() })
}

fn scan(runtime: &Runtime, effort: Effort, input: &Persistent<u32>) -> Result<f64> {
    time(runtime, effort.repeats, |g| {
        let (from, mut to, mut total) = (g.import_read(input), g.buffer("sums", input.len()), g.buffer("total", 1));
        g.scope(MEASURED, |g| scan::exclusive(g, Items::All, &from, &mut to, &mut total));
        g.keep(&to);
    })
}

fn sort(runtime: &Runtime, effort: Effort, input: &Persistent<u32>) -> Result<f64> {
    time(runtime, effort.repeats, |g| {
        let from = g.import_read(input);
        let (mut keys, mut values) = (g.buffer("keys", input.len()), g.buffer("values", input.len()));
        g.copy(&from, &mut keys);
        g.copy(&from, &mut values);
        let sorted = g.scope(MEASURED, |g| sort::pairs(g, Items::All, keys, values, 32));
        g.keep(&sorted.0);
        g.keep(&sorted.1);
    })
}

fn host_sort(keys: &[u32], repeats: u32) -> f64 {
    let original: Vec<[u32; 2]> = keys.iter().map(|&key| [key, key]).collect();
    let (mut pairs, mut spare) = (original.clone(), original.clone());
    let mut run = || {
        pairs.copy_from_slice(&original);
        let begin = Instant::now();
        sort_pairs(&mut pairs, &mut spare);
        begin.elapsed().as_secs_f64()
    };
    run(); // memory is touched for the first time
    median((0..repeats.max(1)).map(|_| run()).collect())
}
