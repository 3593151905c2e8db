//! Radix sort, least significant digit first, 8 bits a pass, stable.
//!
//! Each pass counts the digits of every worker's range, scans the table of counts in the order (digit, worker), and
//! moves every key to its place (Zagha and Blelloch 1991, "Radix sort for vector multiprocessors"). 20 bytes per pair
//! and pass, 12 per key, and the table: 256 words per worker.
//!
//! Up to 2^31 items; the count comes from the GPU if wanted.

use super::generated::{SortCount, SortCountBindings, SortCountParams};
use super::generated::{SortScatterKeys, SortScatterKeysBindings, SortScatterKeysParams};
use super::generated::{SortScatterPairs, SortScatterPairsBindings, SortScatterPairsParams};
use super::{Items, scan};
use crate::constants::{RADIX_DIGITS, RADIX_WORKERS};
use crate::graph::{Buf, Graph, Grid};

/// Items per worker when the buffers are full: many, so that the table is small beside them, yet bounded, because
/// lavapipe of Mesa 22.3.6 ends an invocation's loops after 65,535 iterations.
const ITEMS_PER_WORKER: u32 = 4096;

/// The digit of one pass.
#[derive(Clone, Copy)]
struct Digit {
    shift: u32,
    mask: u32,
}

/// Sorts by the lowest `bits` bits of the keys. The buffers are used up; the returned ones hold the result, and beyond
/// the count anything.
///
/// # Panics
/// If `bits` is over 32.
pub fn keys(g: &mut Graph, items: Items<'_>, keys: Buf<u32>, bits: u32) -> Buf<u32> {
    let capacity = keys.len();
    if bits == 0 {
        return keys;
    }
    let (mut from, mut to) = (keys, g.buffer("sort_keys", capacity));
    for_each_digit(g, items, capacity, bits, |g, count, digit| {
        let (table, groups) = count_digits(g, count, &from, digit);
        g.dispatch(
            SortScatterKeys,
            Grid::Groups([groups, 1]),
            SortScatterKeysParams { capacity, shift: digit.shift, mask: digit.mask },
            SortScatterKeysBindings { count, table: &table, keys: &from, sorted_keys: &mut to },
        );
        std::mem::swap(&mut from, &mut to);
    });
    from
}

/// Sorts pairs by the lowest `bits` bits of their keys; pairs of equal keys keep their order. The buffers are used up;
/// the returned ones hold the result, and beyond the count anything.
///
/// # Panics
/// If `bits` is over 32 or there are fewer values than keys.
pub fn pairs(g: &mut Graph, items: Items<'_>, keys: Buf<u32>, values: Buf<u32>, bits: u32) -> (Buf<u32>, Buf<u32>) {
    let capacity = keys.len();
    assert!(values.len() >= capacity, "{} values for {capacity} keys", values.len());
    if bits == 0 {
        return (keys, values);
    }
    let mut from = (keys, values);
    let mut to = (g.buffer("sort_keys", capacity), g.buffer("sort_values", capacity));
    for_each_digit(g, items, capacity, bits, |g, count, digit| {
        let (table, groups) = count_digits(g, count, &from.0, digit);
        g.dispatch(
            SortScatterPairs,
            Grid::Groups([groups, 1]),
            SortScatterPairsParams { capacity, shift: digit.shift, mask: digit.mask },
            SortScatterPairsBindings {
                count,
                table: &table,
                keys: &from.0,
                sorted_keys: &mut to.0,
                values: &from.1,
                sorted_values: &mut to.1,
            },
        );
        std::mem::swap(&mut from, &mut to);
    });
    from
}

/// Runs `pass(graph, count, digit)` for each digit, lowest first.
fn for_each_digit(
    g: &mut Graph,
    items: Items<'_>,
    capacity: u32,
    bits: u32,
    mut pass: impl FnMut(&mut Graph, &Buf<u32>, Digit),
) {
    assert!(bits <= 32, "a key has 32 bits, not {bits}");
    assert!(capacity <= 1 << 31, "{capacity} items, at most 2^31 can be sorted");
    g.scope("sort", |g| {
        let count = items.buffer(g, capacity);
        for shift in (0..bits).step_by(8) {
            pass(g, &count, Digit { shift, mask: (1 << (bits - shift).min(8)) - 1 });
        }
    });
}

/// Where each worker's keys of each digit go, and the number of workgroups.
fn count_digits(g: &mut Graph, count: &Buf<u32>, keys: &Buf<u32>, digit: Digit) -> (Buf<u32>, u32) {
    let groups = keys.len().div_ceil(RADIX_WORKERS * ITEMS_PER_WORKER).max(1);
    let entries = RADIX_DIGITS * RADIX_WORKERS * groups;
    let (mut table, mut places) = (g.buffer("sort_table", entries), g.buffer("sort_places", entries));
    g.dispatch(
        SortCount,
        Grid::Groups([groups, 1]),
        SortCountParams { capacity: keys.len(), shift: digit.shift, mask: digit.mask },
        SortCountBindings { count, keys, table: &mut table },
    );
    let mut total = g.buffer("sort_total", 1);
    scan::exclusive(g, Items::All, &table, &mut places, &mut total);
    (places, groups)
}

/// The specification of [`keys`].
pub fn reference_keys(keys: &[u32], bits: u32) -> Vec<u32> {
    let mut sorted = keys.to_vec();
    sorted.sort_by_key(|key| u64::from(*key) & ((1u64 << bits) - 1));
    sorted
}

/// The specification of [`pairs`].
pub fn reference_pairs(pairs: &[(u32, u32)], bits: u32) -> Vec<(u32, u32)> {
    let mut sorted = pairs.to_vec();
    sorted.sort_by_key(|(key, _)| u64::from(*key) & ((1u64 << bits) - 1));
    sorted
}
