//! Every kernel against its reference, on the device of `NEPHROID_TEST_DEVICE` under validation.

use nephroid::graph::{DeviceClass, DispatchArgs, Graph};
use nephroid::kernels::generated::{self, Aabb};
use nephroid::kernels::reduce::Op;
use nephroid::kernels::{Items, compact, reduce, scan, segmented_scan, sort};

use crate::support::harness::{Harness, POISON_WORD, SIZES, assert_same, patterns};
use crate::support::random::Random;

/// Kernel names and the reference that its test compares with; a kernel that is missing here fails `every_kernel_...`.
const REFERENCES: &[(&str, &str)] = &[
    ("compact_scatter", "kernels::compact::reference"),
    ("dispatch_args", "kernels::compact::reference_args"),
    ("film_add", "film::exact::plus"),
    ("lbvh_boxes", "kernels::lbvh_reference::build"),
    ("lbvh_codes", "kernels::lbvh_reference::morton"),
    ("lbvh_count", "kernels::lbvh_reference::build"),
    ("lbvh_links", "kernels::lbvh_reference::build"),
    ("lbvh_pack", "kernels::lbvh_reference::build"),
    ("reduce_aabb", "kernels::reduce::reference_bounds"),
    ("reduce_f32", "kernels::reduce::reference_f32"),
    ("reduce_u32", "kernels::reduce::reference_u32"),
    ("scan_apply", "kernels::scan::reference"),
    ("scan_reduce", "kernels::scan::reference"),
    ("scan_spine", "kernels::scan::reference"),
    ("segmented_scan_apply", "kernels::segmented_scan::reference"),
    ("segmented_scan_reduce", "kernels::segmented_scan::reference"),
    ("segmented_scan_spine", "kernels::segmented_scan::reference"),
    ("sort_count", "kernels::sort::reference_keys"),
    ("sort_scatter_keys", "kernels::sort::reference_keys"),
    ("sort_scatter_pairs", "kernels::sort::reference_pairs"),
    ("gather_brute", "kernels::gather::reference::gather"),
    ("gather_bvh", "kernels::gather::reference::gather"),
    ("gather_knn", "kernels::gather::reference_knn::gather"),
    ("knn_leaves", "kernels::gather::reference_knn::gather"),
    ("knn_level", "kernels::gather::reference_knn::gather"),
    ("knn_select", "kernels::gather::reference_knn::gather"),
    ("knn_sum", "kernels::gather::reference_knn::gather"),
    ("gather_hash", "kernels::gather::reference::gather"),
    ("hash_extent", "kernels::gather::hash_reference::extent"),
    ("hash_file", "kernels::gather::hash_reference::key"),
    ("hash_insert", "kernels::gather::hash_reference::runs"),
    ("hash_levels", "kernels::gather::hash_reference::levels"),
    ("gather_tiled", "kernels::gather::reference::gather"),
    ("tiled_bounds", "kernels::gather::reference::gather"),
    ("tiled_cover", "kernels::gather::reference::gather"),
    ("tiled_fill", "kernels::gather::reference::gather"),
    ("tiled_levels", "kernels::gather::reference::gather"),
    ("tiled_mark", "kernels::gather::reference::gather"),
    ("tiled_ranges", "kernels::gather::reference::gather"),
    ("photon_differential", "kernels::differentials::reflect"),
    ("trace_any", "kernels::trace::reference"),
    ("trace_closest", "kernels::trace::reference"),
    ("trace_spawn", "kernels::trace::offset_ray_origin"),
];

/// Transport kernels have no copy on the host; each is proven by a test against an analytic answer: its file and name.
const ANALYTIC: &[(&str, &str, &str)] = &[
    ("bench_multiply", "tests/study/bench.rs", "fn "), // a yardstick: nothing depends on its result
    ("bench_splat_frag", "tests/graph/raster.rs", "fn squares_add_up_with_vertex_and_geometry_kernels"),
    ("bench_splat_geom", "tests/graph/raster.rs", "fn squares_add_up_with_vertex_and_geometry_kernels"),
    ("bench_splat_point_vert", "tests/graph/raster.rs", "fn squares_add_up_with_vertex_and_geometry_kernels"),
    ("bench_splat_vert", "tests/graph/raster.rs", "fn squares_add_up_with_vertex_and_geometry_kernels"),
    ("bounds_args", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_ball_geom", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_ball_vert", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_depth_frag", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_depths", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_point_vert", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_polygon_geom", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_polygon_vert", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_resolve", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_screen_vert", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_seen", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("bounds_splat_frag", "tests/kernels/bounds.rs", "fn bounds_hold_every_photon_that_counts"),
    ("direct_light", "tests/extremes/lambert.rs", "fn case_05_point_light_by_shadow_rays"),
    ("eye_generate", "tests/extremes/lambert.rs", "fn case_05_point_light_by_shadow_rays"),
    ("eye_shade", "tests/extremes/specular.rs", "fn case_08_slab_transmits"),
    ("gather_split", "tests/render/estimators.rs", "fn constant_radius_gives_what_brute_force_gives"),
    ("gather_unfinished", "tests/kernels/gather.rs", "fn a_million_photons_at_one_place"),
    ("hash_pack", "tests/kernels/packing.rs", "fn packed_photons_are_close"),
    ("light_append", "tests/render/light.rs", "fn light_by_way_of_a_mirror"),
    ("light_blocks", "tests/render/light.rs", "fn one_pixel_takes_a_hundred_thousand_splats"),
    ("light_connect", "tests/render/light.rs", "fn light_by_way_of_a_mirror"),
    ("light_sum", "tests/render/light.rs", "fn furnace_is_uniform"),
    ("list_select", "tests/extremes/lambert.rs", "fn case_01_furnace"),
    ("path_layers", "tests/render/path.rs", "fn layers_are_those_of_the_photons"),
    ("path_scatter", "tests/render/path.rs", "fn furnaces_have_their_answers"),
    ("photon_advance", "tests/extremes/lambert.rs", "fn case_01_furnace"),
    ("photon_append", "tests/extremes/lambert.rs", "fn case_01_furnace"),
    ("photon_bounce", "tests/extremes/specular.rs", "fn case_08_slab_transmits"),
    ("photon_fold", "tests/extremes/walls.rs", "fn a_wall_keeps_the_light_on_its_side"),
    ("photon_emit", "tests/extremes/lambert.rs", "fn case_05_point_light_by_photons"),
    ("photon_pack", "tests/kernels/packing.rs", "fn packed_photons_are_close"),
    ("photon_radii", "tests/kernels/packing.rs", "fn packed_photons_are_close"),
    ("photon_sort_records", "tests/kernels/packing.rs", "fn packed_photons_are_close"),
    ("photon_sort", "tests/extremes/lambert.rs", "fn case_04_integrating_sphere"),
    ("sampling_choose", "tests/render/sampling.rs", "fn smooth_light_is_filled_in"),
    ("sampling_fill", "tests/render/sampling.rs", "fn no_leak_across_a_step"),
    ("sampling_filter", "tests/render/sampling.rs", "fn smooth_light_is_filled_in"),
    ("tiled_pack", "tests/kernels/packing.rs", "fn packed_photons_are_close"),
    ("trace_list", "tests/extremes/lambert.rs", "fn case_01_furnace"),
];

#[test]
fn every_kernel_has_a_reference() {
    let shaders = generated::SHADERS.iter().map(|shader| shader.name);
    let names: Vec<_> = generated::ALL.iter().map(|kernel| kernel.name).chain(shaders).collect();
    for name in &names {
        let known = REFERENCES.iter().map(|(known, _)| known).chain(ANALYTIC.iter().map(|(known, ..)| known));
        assert!(known.into_iter().any(|known| known == name), "kernel {name} has no reference and test");
    }
    for (name, file, test) in ANALYTIC {
        assert!(names.contains(name), "{name} is listed but does not exist");
        let path = format!("{}/{file}", env!("CARGO_MANIFEST_DIR"));
        let source = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
        assert!(source.contains(test), "{file} has no `{test}`");
    }
    for (name, reference) in REFERENCES {
        assert!(names.contains(name), "{name} is listed but does not exist");
        // `kernels::sort::reference_keys` is the function `reference_keys` of src/kernels/sort.rs.
        let (path, function) = reference.rsplit_once("::").expect("a path");
        let file = format!("{}/src/{}.rs", env!("CARGO_MANIFEST_DIR"), path.replace("::", "/"));
        let source = std::fs::read_to_string(&file).unwrap_or_else(|e| panic!("{file}: {e}"));
        assert!(source.contains(&format!("pub fn {function}(")), "{file} has no function {function}");
    }
}

/// Runs `test` on every size and pattern, with the count from the host, and for random data also with a count on the GPU,
/// smaller and larger than the buffer.
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
}
