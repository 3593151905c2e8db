//! Scans, reductions, compaction and sorts against their references, with awkward sizes and patterns.

use nephroid::low_level::graph::{DeviceClass, DispatchArgs, Graph};
use nephroid::low_level::kernels::generated::Aabb;
use nephroid::low_level::kernels::reduce::Op;
use nephroid::low_level::kernels::{Items, compact, reduce, scan, segmented_scan, sort};

use crate::support::harness::{Harness, POISON_WORD, SIZES, assert_same, patterns};
use crate::support::proof;
use crate::support::random::Random;

/// Runs `test` on every size and pattern, with the count from the host, and for random data also with a count on the
/// GPU, smaller and larger than the buffer.
fn for_each_case(mut test: impl FnMut(&str, &[u32], Option<u32>)) {
    for &n in SIZES {
        for (pattern, data) in patterns(n) {
            // Large sizes meet one pattern: time, and all boundaries inside of a share are met by the small ones.
            if n > 100_000 && pattern != "random" {
                continue;
            }
            test(&format!("{n} {pattern}"), &data, None);
            if pattern == "random" {
                test(&format!("{n} {pattern} counted"), &data, Some(n as u32 / 3));
                test(&format!("{n} {pattern} overcounted"), &data, Some(u32::MAX));
            }
        }
    }
}

/// Declares with [`Items::All`] or a count of the GPU.
fn with_items<R>(g: &mut Graph, count: Option<u32>, declare: impl FnOnce(&mut Graph, Items<'_>) -> R) -> R {
    let Some(count) = count else { return declare(g, Items::All) };
    let count = g.upload("count", &[count]);
    declare(g, Items::Counted(&count))
}

fn used<T>(data: &[T], count: Option<u32>) -> &[T] {
    &data[..count.map_or(data.len(), |count| (count as usize).min(data.len()))]
}

/// The reference's items, then poison up to `len`.
fn padded(mut wanted: Vec<u32>, len: usize) -> Vec<u32> {
    wanted.resize(len, POISON_WORD);
    wanted
}

#[test]
fn exclusive_scan() {
    let h = Harness::lock();
    for_each_case(|what, data, count| {
        let (input, output, total) = (h.input(data), h.output(data.len()), h.output(1));
        h.run(&[&output, &total], |g| {
            let (input, mut output, mut total) =
                (g.import_read(&input), g.import(output.memory()), g.import(total.memory()));
            with_items(g, count, |g, items| scan::exclusive(g, items, &input, &mut output, &mut total));
            g.keep(&output);
            g.keep(&total);
        });
        let (sums, all) = scan::reference(used(data, count));
        assert_same(&h.content(&output), &padded(sums, data.len()), what);
        assert_same(&h.content(&total), &[all], what);
    });
    proof::by(scan::reference, &["scan_apply", "scan_reduce", "scan_spine"]);
}

#[test]
fn segmented_exclusive_scan() {
    let h = Harness::lock();
    let mut random = Random(7);
    for_each_case(|what, data, count| {
        let n = data.len();
        let sparse: Vec<u32> = (0..n).map(|_| u32::from(random.bits().is_multiple_of(1000))).collect();
        let dense: Vec<u32> = (0..n).map(|_| (random.bits() % 3) as u32).collect();
        for (kind, heads) in [("sparse", sparse), ("dense", dense), ("none", vec![0; n]), ("all", vec![9; n])] {
            let (input, flags, output) = (h.input(data), h.input(&heads), h.output(n));
            h.run(&[&output], |g| {
                let (input, flags, mut output) =
                    (g.import_read(&input), g.import_read(&flags), g.import(output.memory()));
                with_items(g, count, |g, items| segmented_scan::exclusive(g, items, &input, &flags, &mut output));
                g.keep(&output);
            });
            let wanted = padded(segmented_scan::reference(used(data, count), used(&heads, count)), n);
            assert_same(&h.content(&output), &wanted, &format!("{what}, heads {kind}"));
        }
    });
    proof::by(segmented_scan::reference, &["segmented_scan_apply", "segmented_scan_reduce", "segmented_scan_spine"]);
}

#[test]
fn reductions_of_u32() {
    let h = Harness::lock();
    for_each_case(|what, data, count| {
        for op in [Op::Sum, Op::Min, Op::Max] {
            let (input, result) = (h.input(data), h.output(1));
            h.run(&[&result], |g| {
                let (input, mut result) = (g.import_read(&input), g.import(result.memory()));
                with_items(g, count, |g, items| reduce::u32s(g, items, op, &input, &mut result));
                g.keep(&result);
            });
            let wanted = reduce::reference_u32(op, used(data, count));
            assert_same(&h.content(&result), &[wanted], &format!("{what} {op:?}"));
        }
    });
    proof::by(reduce::reference_u32, &["reduce_u32"]);
}

/// The device adds in the stated order, so even float sums are exact against the reference, and near the sum in f64.
#[test]
fn sum_of_f32() {
    let h = Harness::lock();
    for_each_case(|what, data, count| {
        let floats: Vec<f32> = data.iter().map(|&word| word as f32 * 2f32.powi(-20) - 7.25).collect();
        for class in [DeviceClass::Cpu, DeviceClass::Gpu] {
            let (input, result) = (h.input(&floats), h.output(1));
            h.run_on(class, &[&result], |g| {
                let (input, mut result) = (g.import_read(&input), g.import(result.memory()));
                with_items(g, count, |g, items| reduce::sum_f32(g, items, &input, &mut result));
                g.keep(&result);
            });
            let wanted = reduce::reference_f32(class, used(&floats, count), floats.len() as u32);
            let got: Vec<f32> = h.content(&result);
            assert_eq!(got[0].to_bits(), wanted.to_bits(), "{what}: {} is not {wanted}", got[0]);
            assert_near_sum(wanted, used(&floats, count), what);
        }
    });
    proof::by(reduce::reference_f32, &["reduce_f32"]);
}

/// At most 4096 additions into a lane (a share of 2^20 items) and 30 in trees lie above any item.
fn assert_near_sum(sum: f32, floats: &[f32], what: &str) {
    let exact: f64 = floats.iter().map(|&x| f64::from(x)).sum();
    let size: f64 = floats.iter().map(|&x| f64::from(x.abs())).sum();
    assert!((f64::from(sum) - exact).abs() <= size * 4126.0 * f64::from(f32::EPSILON), "{what}: {sum} is not {exact}");
}

fn boxes(n: usize, seed: u64) -> Vec<Aabb> {
    let mut random = Random(seed);
    (0..n)
        .map(|i| {
            let min: [f32; 3] = std::array::from_fn(|_| random.unit() * 100.0 - 50.0);
            let max = min.map(|x| x + random.unit());
            match i % 97 {
                13 => Aabb { min: max.map(|x| x + 1e3), max: min },
                29 => Aabb { min: [f32::NAN, min[1], min[2]], max },
                61 => Aabb { min, max: [max[0], f32::INFINITY, max[2]] },
                _ => Aabb { min, max },
            }
        })
        .collect()
}

#[test]
fn union_of_boxes() {
    let h = Harness::lock();
    for &n in SIZES {
        for count in [None, Some(n as u32 / 3)] {
            let data = boxes(n, n as u64);
            let (input, result) = (h.input(&data), h.output(1));
            h.run(&[&result], |g| {
                let (input, mut result) = (g.import_read(&input), g.import(result.memory()));
                with_items(g, count, |g, items| reduce::bounds(g, items, &input, &mut result));
                g.keep(&result);
            });
            let wanted = reduce::reference_bounds(used(&data, count));
            assert_same(&h.content(&result), &[wanted], &format!("{n} boxes, {count:?}"));
        }
    }
    proof::by(reduce::reference_bounds, &["reduce_aabb"]);
}

#[test]
fn compaction() {
    let h = Harness::lock();
    let mut random = Random(3);
    for_each_case(|what, data, count| {
        let n = data.len();
        let flags: Vec<u32> = data.iter().map(|&word| if random.bits().is_multiple_of(5) { 0 } else { word }).collect();
        let (input, kept, number, args) = (h.input(&flags), h.output(n), h.output(1), h.output::<DispatchArgs>(1));
        h.run(&[&number, &args], |g| {
            let input = g.import_read(&input);
            let survivors = with_items(g, count, |g, items| compact::indices(g, items, &input, 64));
            let (mut kept, mut number, mut args) =
                (g.import(kept.memory()), g.import(number.memory()), g.import(args.memory()));
            g.copy(&survivors.indices, &mut kept);
            g.copy(&survivors.count, &mut number);
            g.copy(&survivors.args, &mut args);
            g.keep(&kept);
            g.keep(&number);
            g.keep(&args);
        });
        let wanted = compact::reference(used(&flags, count));
        assert_same(&h.content(&number), &[wanted.len() as u32], what);
        assert_same(&h.content(&kept)[..wanted.len()], &wanted, what);
        assert_same(&h.content(&args), &[compact::reference_args(wanted.len() as u32, 64)], what);
    });
    proof::by(compact::reference, &["compact_scatter"]);
}

#[test]
fn dispatch_arguments_cover_the_count() {
    let h = Harness::lock();
    for count in [0u32, 1, 63, 64, 65, 65_535 * 64, 65_535 * 64 + 1, 1 << 31, u32::MAX] {
        let result = h.output::<DispatchArgs>(1);
        h.run(&[&result], |g| {
            let count = g.upload("count", &[count]);
            let args = compact::dispatch_args(g, &count, u32::MAX, 64);
            let mut result = g.import(result.memory());
            g.copy(&args, &mut result);
            g.keep(&result);
        });
        let got = h.content(&result)[0];
        assert_eq!(got, compact::reference_args(count, 64));
        let invocations = u64::from(got.x) * u64::from(got.y) * 64;
        assert!(got.x <= 65_535 && got.y <= 65_535 && invocations >= u64::from(count), "{count}: {got:?}");
    }
    proof::by(compact::reference_args, &["dispatch_args"]);
}

/// In place with a counted sort of all bits: what lies behind the count has to survive, guard included.
#[test]
fn sort_of_keys() {
    let h = Harness::lock();
    for_each_case(|what, data, count| {
        let (input, output) = (h.input(data), h.output(data.len()));
        h.run(&[&output], |g| {
            let (input, mut memory) = (g.import_read(&input), g.import(output.memory()));
            g.copy(&input, &mut memory);
            let count = count.map_or(data.len() as u32, |count| count.min(data.len() as u32));
            let sorted = with_items(g, Some(count), |g, items| sort::keys(g, items, memory, 32));
            g.keep(&sorted);
        });
        let mut wanted = sort::reference_keys(used(data, count), 32);
        wanted.extend_from_slice(&data[wanted.len()..]);
        assert_same(&h.content(&output), &wanted, what);
    });
    proof::by(sort::reference_keys, &["sort_count", "sort_scatter_keys"]);
}

#[test]
fn sort_of_pairs() {
    let h = Harness::lock();
    for_each_case(|what, data, count| {
        if count.is_some() {
            return; // `sort_of_keys` counts; the passes are the same
        }
        for bits in [0, 1, 8, 11, 24, 32] {
            let values: Vec<u32> = (0..data.len() as u32).map(|i| i ^ 0x5555_5555).collect();
            let (keys, payload) = (h.input(data), h.input(&values));
            let (sorted_keys, sorted_values) = (h.output(data.len()), h.output(data.len()));
            h.run(&[&sorted_keys, &sorted_values], |g| {
                let (keys, payload) = (g.import_read(&keys), g.import_read(&payload));
                let mut pair = (g.buffer("keys", keys.len()), g.buffer("values", payload.len()));
                g.copy(&keys, &mut pair.0);
                g.copy(&payload, &mut pair.1);
                let sorted = sort::pairs(g, Items::All, pair.0, pair.1, bits);
                let mut target = (g.import(sorted_keys.memory()), g.import(sorted_values.memory()));
                g.copy(&sorted.0, &mut target.0);
                g.copy(&sorted.1, &mut target.1);
                g.keep(&target.0);
                g.keep(&target.1);
            });
            let pairs: Vec<_> = data.iter().copied().zip(values).collect();
            let got: Vec<_> = h.content(&sorted_keys).into_iter().zip(h.content(&sorted_values)).collect();
            assert_same(&got, &sort::reference_pairs(&pairs, bits), &format!("{what}, {bits} bits"));
        }
    });
    proof::by(sort::reference_pairs, &["sort_scatter_pairs"]);
}
