//! Plans on a device under validation: replay, inputs, aliasing, windows, scopes; and that a missing barrier,
//! overlapping memory and a read of unwritten memory are noticed.
//!
//! `NEPHROID_TEST_DEVICE` chooses the device (default `cpu`).

use std::sync::LazyLock;

use nephroid::low_level::graph::{
    Buf, DispatchArgs, Executable, Graph, Grid, Operation, Plan, Runtime, Timing, Window, Windows, chrome_trace,
};
use nephroid::{Error, MemoryCause};

use crate::compiled::Compiled;
use crate::support::device::{alone, open, runtime};
use crate::support::fake::Wires;

/// Compiles `body`; its parameters are the first item, the item count and a word to add. It runs for item `i` of
/// `params.count`, the item `params.first + i` of the whole.
fn compile(name: &'static str, buffers: &str, body: &str) -> Compiled {
    let source = format!(
        "#version 460\n#extension GL_GOOGLE_include_directive : require\n\
         #extension GL_EXT_scalar_block_layout : require\nlayout(local_size_x = 64) in;\n\
         #include \"lib/linear_id.glsl\"\n\
         layout(push_constant, scalar) uniform Params {{ uint first; uint count; uint addend; }} params;\n{buffers}\n\
         void main() {{ uint i = linear_id(); if (i < params.count) {{ {body} }} }}\n"
    );
    Compiled::of(name, &source)
}

/// `target[i] = 3 * source[i] + addend`.
static STEP: LazyLock<Compiled> = LazyLock::new(|| {
    let buffers = "layout(set = 0, binding = 0, scalar) readonly buffer Source { uint source[]; };\n\
                   layout(set = 0, binding = 1, scalar) writeonly buffer Target { uint target[]; };";
    compile("step", buffers, "target[i] = 3u * source[i] + params.addend + params.first - params.first;")
});

/// `data[item] = 3 * data[item] + item + addend`.
static MIX: LazyLock<Compiled> = LazyLock::new(|| {
    let buffers = "layout(set = 0, binding = 0, scalar) buffer Data { uint data[]; };";
    compile("mix", buffers, "data[i] = 3u * data[i] + params.first + i + params.addend;")
});

/// Group counts for `addend` items in groups of 64.
static PLAN_GROUPS: LazyLock<Compiled> = LazyLock::new(|| {
    let buffers = "layout(set = 0, binding = 0, scalar) writeonly buffer Args { uvec3 args[]; };";
    compile("plan_groups", buffers, "args[params.first] = uvec3((params.addend + 63u) / 64u, 1u, 1u);")
});

fn step(g: &mut Graph, from: &Buf<u32>, to: &mut Buf<u32>, addend: u32) {
    let count = from.len().min(to.len());
    g.dispatch(*STEP, Grid::Threads(count), [0, count, addend], Wires::new().read(from).write(to));
}

/// `source` through `links` transients, of which the last is read back.
fn chain(
    links: u32,
    len: u32,
) -> (Plan, nephroid::low_level::graph::Input<u32>, nephroid::low_level::graph::Readback<u32>) {
    let mut g = Graph::new();
    let (source, input) = g.input("source", &vec![0u32; len as usize]);
    let mut last = g.buffer("link", len);
    step(&mut g, &source, &mut last, 0);
    for link in 1..links {
        let mut next = g.buffer("link", len);
        g.scope("link", |g| step(g, &last, &mut next, link));
        last = next;
    }
    let result = g.readback(&last);
    (g.plan().expect("a plan"), input, result)
}

/// What [`chain`] computes.
fn chain_reference(source: &[u32], links: u32) -> Vec<u32> {
    source.iter().map(|&x| (0..links).fold(x, |x, link| x.wrapping_mul(3).wrapping_add(link))).collect()
}

#[test]
fn replay_follows_the_inputs_and_repeats_its_bits() {
    let runtime = runtime();
    let (plan, input, result) = chain(5, 1000);
    let mut executable = runtime.prepare(&plan).unwrap();
    executable.run().unwrap();
    assert_eq!(executable.read(&result), chain_reference(&[0; 1000], 5));
    for round in 1..5u32 {
        let data: Vec<u32> = (0..1000).map(|i| i * round).collect();
        executable.write(&input, &data);
        for _ in 0..2 {
            executable.run().unwrap();
            assert_eq!(executable.read(&result), chain_reference(&data, 5), "round {round}");
        }
        let mut another = runtime.prepare(&plan).unwrap();
        another.write(&input, &data);
        another.run().unwrap();
        assert_eq!(another.read(&result), executable.read(&result));
    }
}

#[test]
fn an_input_that_only_culled_passes_read_takes_no_memory() {
    let runtime = runtime();
    let mut g = Graph::new();
    let (source, input) = g.input("source", &[1u32; 100]);
    let mut unused = g.buffer("unused", 100);
    step(&mut g, &source, &mut unused, 0);
    let mut executable = runtime.prepare(&g.plan().unwrap()).unwrap();
    assert_eq!(executable.device_bytes(), 0);
    executable.write(&input, &[2; 100]);
    executable.run().unwrap();
}

#[test]
fn persistent_memory_carries_from_run_to_run() {
    let runtime = runtime();
    let state = runtime.persistent::<u32>("state", 300).unwrap();
    let mut g = Graph::new();
    let mut data = g.import(&state);
    g.dispatch(*MIX, Grid::Threads(300), [0, 300, 7], Wires::new().write(&mut data));
    g.keep(&data);
    let mut executable = runtime.prepare(&g.plan().unwrap()).unwrap();
    let mut wanted = vec![0u32; 300];
    for _ in 0..3 {
        executable.run().unwrap();
        wanted.iter_mut().enumerate().for_each(|(i, x)| *x = 3 * *x + i as u32 + 7);
        assert_eq!(runtime.download(&state).unwrap(), wanted);
    }
}

#[test]
fn fills_copies_and_empty_buffers() {
    let runtime = runtime();
    let mut g = Graph::new();
    let (mut long, mut short, mut empty) =
        (g.buffer::<u32>("long", 10), g.buffer::<u32>("short", 4), g.buffer("empty", 0));
    g.fill(&mut long, 7);
    g.fill(&mut short, 9);
    g.fill(&mut empty, 1);
    g.copy(&short, &mut long);
    g.copy(&long, &mut empty);
    step(&mut g, &long, &mut empty, 0);
    let (long, empty) = (g.readback(&long), g.readback::<u32>(&empty));
    let mut executable = runtime.prepare(&g.plan().unwrap()).unwrap();
    executable.run().unwrap();
    assert_eq!(executable.read(&long), [9, 9, 9, 9, 7, 7, 7, 7, 7, 7]);
    assert!(executable.read(&empty).is_empty());
}

#[test]
fn group_counts_of_the_device_are_obeyed() {
    let runtime = runtime();
    let mut g = Graph::new();
    let (mut args, mut data) = (g.buffer::<DispatchArgs>("args", 1), g.buffer::<u32>("data", 1000));
    g.fill(&mut data, 0);
    g.dispatch(*PLAN_GROUPS, Grid::Groups([1, 1]), [0, 1, 300], Wires::new().write(&mut args));
    g.dispatch(*MIX, Grid::Indirect(&args), [0, 1000, 1], Wires::new().write(&mut data));
    let result = g.readback(&data);
    let mut executable = runtime.prepare(&g.plan().unwrap()).unwrap();
    executable.run().unwrap();
    let wanted: Vec<u32> = (0..1000).map(|i| if i < 320 { i + 1 } else { 0 }).collect();
    assert_eq!(executable.read(&result), wanted);
}

/// Results of [`chain`] with poison, after `sabotage`.
fn poisoned(word: u32, sabotage: impl FnOnce(&mut Plan)) -> Vec<u32> {
    let runtime = runtime();
    let (mut plan, input, result) = chain(6, 3000);
    assert!(plan.arenas[0] < plan.transient_bytes(), "nothing is aliased:\n{}", plan.dump());
    plan.poison(word);
    sabotage(&mut plan);
    let mut executable = runtime.prepare(&plan).unwrap();
    executable.write(&input, &(0..3000).collect::<Vec<u32>>());
    executable.run().unwrap();
    executable.read(&result)
}

#[test]
fn aliased_transients_do_not_disturb_each_other() {
    let wanted = chain_reference(&(0..3000).collect::<Vec<u32>>(), 6);
    for word in [0, 0xa5a5_a5a5, u32::MAX] {
        assert!(poisoned(word, |_| {}) == wanted, "poison {word:#x}");
    }
    let overlapping = |plan: &mut Plan| {
        let first = plan.placement.iter().flatten().next().copied();
        plan.placement.iter_mut().filter(|place| place.is_some()).for_each(|place| *place = first);
    };
    assert!(poisoned(0xa5a5_a5a5, overlapping) != wanted, "overlapping memory goes unnoticed");
}

#[test]
fn poison_shows_reads_of_unwritten_memory() {
    let runtime = runtime();
    let run = |word: u32| {
        let mut g = Graph::new();
        let (source, mut half, mut all) =
            (g.upload("source", &[1u32; 50]), g.buffer("half", 100), g.buffer("all", 100));
        step(&mut g, &source, &mut half, 0);
        step(&mut g, &half, &mut all, 0);
        let result = g.readback(&all);
        let mut plan = g.plan().unwrap();
        plan.poison(word);
        let mut executable: Executable = runtime.prepare(&plan).unwrap();
        executable.run().unwrap();
        executable.read(&result)
    };
    let (one, other) = (run(1), run(2));
    assert_eq!(one[..50], other[..50]);
    assert_ne!(one[50..], other[50..]);
}

#[test]
fn a_missing_barrier_is_caught() {
    let _alone = alone();
    let runtime = Runtime::new(open());
    let (mut plan, ..) = chain(3, 1000);
    runtime.prepare(&plan).unwrap().run().unwrap();
    plan.sabotage_barrier(2);
    let caught = runtime.prepare(&plan).unwrap().run().expect_err("a read after a write without a barrier");
    let Error::Validation(messages) = caught else { panic!("{caught:?}") };
    assert!(messages.iter().any(|message| message.contains("SYNC-HAZARD-READ-AFTER-WRITE")), "{messages:?}");
}

#[test]
fn a_grid_beyond_65535_groups_reaches_every_item() {
    let runtime = runtime();
    let items = 65_535 * 64 + 1000;
    let mut g = Graph::new();
    let mut data = g.buffer("data", items + 64);
    g.fill(&mut data, 0);
    g.dispatch(*MIX, Grid::Threads(items), [0, items, 5], Wires::new().write(&mut data));
    let result = g.readback(&data);
    let plan = g.plan().unwrap();
    assert!(plan.dump().contains("mix [32768 x 3]"), "{}", plan.dump());
    let mut executable = runtime.prepare(&plan).unwrap();
    executable.run().unwrap();
    let wrong = |(i, &x): (usize, &u32)| x != if i < items as usize { i as u32 + 5 } else { 0 };
    let data = executable.read(&result);
    assert_eq!(data.iter().enumerate().position(wrong), None);
}

/// Two element-wise dispatches over `items` items in windows of at most `limit` bytes, and how many windows there were.
/// `first` is what the kernel is told of a window's first item.
fn in_windows(runtime: &Runtime, items: u32, limit: Option<u64>, first: fn(Window) -> u32) -> (Vec<u32>, usize) {
    let memory = runtime.persistent::<u32>("data", items).unwrap();
    let mut g = Graph::new();
    limit.into_iter().for_each(|limit| g.limit_windows(limit));
    let mut data = g.import(&memory);
    for round in 1..3 {
        let split = Windows { items, bindings: &[0] };
        g.dispatch_windows(*MIX, split, |w| [first(w), w.count, round], Wires::new().write(&mut data));
    }
    g.keep(&data);
    let plan = g.plan().unwrap();
    let windows = match &plan.passes[0].operation {
        Operation::Windows { windows, .. } => windows.len(),
        _ => panic!("{}", plan.dump()),
    };
    runtime.prepare(&plan).unwrap().run().unwrap();
    (runtime.download(&memory).unwrap(), windows)
}

fn windows_reference(i: u32) -> u32 {
    3u32.wrapping_mul(i.wrapping_add(1)).wrapping_add(i).wrapping_add(2)
}

#[test]
fn windows_give_the_same_as_the_whole() {
    let runtime = runtime();
    for items in [0, 1, 255, 256, 257, 10_000] {
        let (whole, one) = in_windows(&runtime, items, None, |w| w.first);
        let (split, many) = in_windows(&runtime, items, Some(1024), |w| w.first);
        assert_eq!((one, many), (1, items.div_ceil(256).max(1) as usize));
        assert!(whole == split, "{items} items");
        assert!(whole.iter().zip(0..).all(|(&x, i)| x == windows_reference(i)), "{items} items");
    }
    let whole = |limit| in_windows(&runtime, 10_000, limit, |_| 0).0;
    assert!(whole(None) != whole(Some(1024)), "windows at the wrong place go unnoticed");
}

#[test]
fn a_buffer_beyond_one_binding_works_in_windows() {
    let items = 40 << 20; // 160 MiB
    let (data, windows) = in_windows(&runtime(), items, None, |w| w.first);
    assert_eq!(windows, 2);
    assert_eq!(data.iter().zip(0..).position(|(&x, i)| x != windows_reference(i)), None);
}

#[test]
fn a_buffer_beyond_one_binding_is_refused_where_all_of_it_is_needed() {
    let runtime = runtime();
    let longest = runtime.device().info().limits.storage_range;
    let items = u32::try_from(longest / 4 + 64).expect("a range of less than 16 GiB");
    let mut g = Graph::new();
    let mut photon_hits = g.buffer::<u32>("photon_hits", items);
    g.dispatch(*MIX, Grid::Threads(items), [0, items, 0], Wires::new().write(&mut photon_hits));
    g.keep(&photon_hits);
    let plan = g.plan().unwrap();
    let before = runtime.device().memory();
    let Err(refused) = runtime.prepare(&plan) else { panic!("bound beyond the device's range") };
    assert_eq!(runtime.device().memory(), before, "memory was taken before the refusal");
    let Error::OutOfMemory { object, bytes, cause } = &refused else { panic!("{refused:?}") };
    assert_eq!((object.as_str(), *bytes), ("photon_hits in mix", u64::from(items) * 4));
    assert_eq!(*cause, MemoryCause::BindingTooLong { longest });
    assert_eq!(refused.exit_code(), 4);
}

/// What is wrong with the timings of nested scopes.
fn timing_fault(timings: &[Timing]) -> Option<String> {
    let mut open: Vec<&Timing> = Vec::new();
    let mut last_start = 0;
    for timing in timings {
        open.truncate(timing.depth as usize);
        let inside = open.last().is_none_or(|outer| outer.start_ns <= timing.start_ns && timing.end_ns <= outer.end_ns);
        if timing.start_ns > timing.end_ns || timing.start_ns < last_start || !inside {
            return Some(format!("{timing:?} after {open:?}"));
        }
        if open.len() != timing.depth as usize {
            return Some(format!("{timing:?} has no enclosing scope"));
        }
        last_start = timing.start_ns;
        open.push(timing);
    }
    None
}

#[test]
fn scopes_are_timed_and_traced() {
    let runtime = runtime();
    let mut g = Graph::new();
    let (mut a, mut b) = (g.buffer("a", 100_000), g.buffer("b", 100_000));
    g.scope("frame", |g| {
        g.scope("first", |g| g.fill(&mut a, 1));
        let mut unused = g.buffer("unused", 100_000);
        g.scope("culled", |g| step(g, &a, &mut unused, 0));
        g.scope("second", |g| step(g, &a, &mut b, 0));
    });
    let mut c = g.buffer("c", 100_000);
    g.scope("after", |g| step(g, &b, &mut c, 0));
    g.readback(&c);
    let mut executable = runtime.prepare(&g.plan().unwrap()).unwrap();
    assert!(executable.timings().is_empty(), "nothing has run");
    if !runtime.device().info().features.timestamps {
        return;
    }
    let mut last_end = 0;
    for _ in 0..3 {
        executable.run().unwrap();
        let timings = executable.timings();
        let names: Vec<_> = timings.iter().map(|t| (t.name.as_str(), t.depth)).collect();
        assert_eq!(names, [("frame", 0), ("first", 1), ("second", 1), ("after", 0)]);
        assert_eq!(timing_fault(&timings), None);
        assert!(timings[0].start_ns >= last_end, "runs follow each other");
        last_end = timings[3].end_ns;
        check_trace(&timings);
        let mut sabotaged = timings.clone();
        sabotaged[1].end_ns = sabotaged[0].end_ns + 1;
        assert!(timing_fault(&sabotaged).is_some(), "a scope that leaves its parent goes unnoticed");
        sabotaged = timings;
        sabotaged.swap(0, 3);
        assert!(timing_fault(&sabotaged).is_some(), "a wrong order goes unnoticed");
    }
}

/// The trace is JSON with one complete event per scope, in microseconds from the first one.
fn check_trace(timings: &[Timing]) {
    let trace: serde_json::Value = serde_json::from_str(&chrome_trace(timings)).expect("JSON");
    let events = trace["traceEvents"].as_array().expect("events");
    assert_eq!(events.len(), timings.len());
    for (event, timing) in events.iter().zip(timings) {
        assert_eq!((event["name"].as_str(), event["ph"].as_str()), (Some(timing.name.as_str()), Some("X")));
        let at = |key: &str| event[key].as_f64().expect("a number") * 1e3;
        assert!((at("ts") - (timing.start_ns - timings[0].start_ns) as f64).abs() < 1.0, "{event}");
        assert!((at("dur") - (timing.end_ns - timing.start_ns) as f64).abs() < 1.0, "{event}");
    }
}
