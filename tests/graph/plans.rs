//! Plans as text, without a device.

use insta::assert_snapshot;
use nephroid::low_level::draw_state::{Cull, DepthTest, DrawState, Topology};
use nephroid::low_level::graph::{
    Buf, DeviceClass, DispatchArgs, Draw, DrawArgs, Graph, Grid, Instances, KernelInfo, Persistent, Plan, PlanError,
    RasterPass, ShaderInfo, Stage, Window, Windows,
};
use nephroid::low_level::kernels::{Items, compact, scan};

use crate::support::fake::{self, Fake, Wires, facts, shader};

static MAKE: KernelInfo = facts("make");
static STEP: KernelInfo = facts("step");
static JOIN: KernelInfo = facts("join");

/// `to = step(from)` over all elements.
fn step(g: &mut Graph, from: &nephroid::low_level::graph::Buf<u32>, to: &mut nephroid::low_level::graph::Buf<u32>) {
    let count = to.len();
    g.dispatch(Fake(&STEP), Grid::Threads(count), 0, Wires::new().read(from).write(to));
}

/// Two branches that join: four passes, three phases.
fn diamond() -> Graph {
    let mut g = Graph::new();
    let result = Persistent::<u32>::detached("result", 1000);
    let mut result = g.import(&result);
    let (mut a, mut b, mut c) = (g.buffer("a", 1000), g.buffer("b", 1000), g.buffer("c", 1000));
    g.dispatch(Fake(&MAKE), Grid::Threads(1000), 0, Wires::new().write(&mut a));
    g.scope("left", |g| step(g, &a, &mut b));
    g.scope("right", |g| g.scope("inner", |g| step(g, &a, &mut c)));
    g.dispatch(Fake(&JOIN), Grid::Groups([4, 2]), 0, Wires::new().read(&b).read(&c).write(&mut result));
    g.keep(&result);
    g
}

#[test]
fn passes_without_conflict_share_a_phase() {
    assert_snapshot!(diamond().plan().unwrap().dump(), @r#"
    phase 0
      make [16 x 1] -> a
    phase 1
      left: step [16 x 1] <- a -> b
      right/inner: step [16 x 1] <- a -> c
    phase 2
      join [4 x 2] <- b, c -> result
    memory
              4000 at 0:0 a
              4000 at 0:4096 b
              4000 at 0:8192 c
      arena 0: 12288 bytes
      12288 bytes without aliasing
    "#);
}

#[test]
fn nothing_is_kept_without_a_root() {
    let mut g = Graph::new();
    let mut a = g.buffer("a", 10);
    g.fill(&mut a, 1);
    let outside = Persistent::<u32>::detached("outside", 10);
    let mut outside = g.import(&outside);
    g.copy(&a, &mut outside);
    let plan = g.plan().unwrap();
    assert_snapshot!(plan.dump(), @r#"
    culled
      fill 0x1 -> a
      copy 40 bytes <- a -> outside
    memory
      0 bytes without aliasing
    "#);
    assert_eq!((plan.phases(), plan.transient_bytes()), (0, 0));
}

#[test]
fn culling_follows_the_data_and_a_fill_ends_the_need() {
    let mut g = Graph::new();
    let (mut a, mut b, mut unused) = (g.buffer("a", 64), g.buffer("b", 64), g.buffer("unused", 64));
    let (source, _) = g.input("source", &[7u32; 64]);
    step(&mut g, &source, &mut a); // overwritten by the fill
    g.fill(&mut a, 5);
    step(&mut g, &source, &mut a); // writes perhaps only a part, so that the fill is needed
    step(&mut g, &a, &mut unused);
    step(&mut g, &a, &mut b);
    let result = g.readback(&b);
    step(&mut g, &a, &mut b); // too late for the read-back
    let _ = result;
    assert_snapshot!(g.plan().unwrap().dump(), @r#"
    phase 0
      fill 0x5 -> a
    phase 1
      step [1 x 1] <- source -> a
    phase 2
      step [1 x 1] <- a -> b
    phase 3
      readback <- b
    culled
      step [1 x 1] <- source -> a
      step [1 x 1] <- a -> unused
      step [1 x 1] <- a -> b
    memory
               256 at 0:0 a
               256 at 0:256 b
      arena 0: 512 bytes
      512 bytes without aliasing
    "#);
}

#[test]
fn a_chain_needs_the_memory_of_two_links() {
    let mut g = Graph::new();
    let mut last = g.buffer("link 0", 10_000);
    g.fill(&mut last, 0);
    for name in ["link 1", "link 2", "link 3", "link 4"] {
        let mut next = g.buffer(name, 10_000);
        step(&mut g, &last, &mut next);
        last = next;
    }
    g.readback(&last);
    assert_snapshot!(g.plan().unwrap().dump(), @r#"
    phase 0
      fill 0x0 -> link 0
    phase 1
      step [157 x 1] <- link 0 -> link 1
    phase 2
      step [157 x 1] <- link 1 -> link 2
    phase 3
      step [157 x 1] <- link 2 -> link 3
    phase 4
      step [157 x 1] <- link 3 -> link 4
    phase 5
      readback <- link 4
    memory
             40000 at 0:0 link 0
             40000 at 0:40192 link 1
             40000 at 0:0 link 2
             40000 at 0:40192 link 3
             40000 at 0:0 link 4
      arena 0: 80384 bytes
      200960 bytes without aliasing
    "#);
}

#[test]
fn transients_beyond_an_arena_open_another_one() {
    let mut g = Graph::new();
    let (mut a, mut b) = (g.buffer::<u32>("a", 1 << 27), g.buffer("b", 3 << 26));
    g.fill(&mut a, 0);
    g.copy(&a, &mut b);
    g.readback(&b);
    let plan = g.plan().unwrap();
    assert_eq!(plan.arenas, [1 << 29, 3 << 28]);
}

#[test]
fn indirect_arguments_order_passes_like_any_read() {
    let mut g = Graph::new().with_device_class(DeviceClass::Gpu);
    let (mut flags, mut result) = (g.buffer("flags", 5000), g.buffer::<u32>("result", 5000));
    g.fill(&mut flags, 1);
    let survivors = compact::indices(&mut g, Items::All, &flags, 64);
    let bind = Wires::new().read(&survivors.indices).write(&mut result);
    g.dispatch(Fake(&STEP), Grid::Indirect(&survivors.args), 0, bind);
    g.readback(&result);
    assert_snapshot!(g.plan().unwrap().dump(), @r#"
    phase 0
      fill 0x1 -> flags
    phase 1
      compact: scan_reduce [3 x 1] #0=1 #8=8 <- item_count, flags -> scan_partial
    phase 2
      compact: scan_spine [1 x 1] -> scan_partial, survivor_count
    phase 3
      compact: compact_scatter [3 x 1] #8=8 <- item_count, flags, scan_partial -> survivors
      compact: dispatch_args [1 x 1] #0=64 <- survivor_count -> dispatch_args
    phase 4
      step [by dispatch_args] <- survivors, dispatch_args -> result
    phase 5
      readback <- result
    memory
             20000 at 0:0 flags
             20000 at 0:0 result
                16 at 0:20224 survivor_count
             20000 at 0:20480 survivors
                16 at 0:40704 scan_partial
                16 at 0:40960 dispatch_args
      arena 0: 41216 bytes
      61440 bytes without aliasing
    "#);
}

#[test]
fn a_scan_is_three_dispatches() {
    let mut g = Graph::new().with_device_class(DeviceClass::Gpu);
    let (input, _) = g.input("input", &[1u32; 5000]);
    let (mut sums, mut total) = (g.buffer("sums", 5000), g.buffer("total", 1));
    g.scope("offsets", |g| scan::exclusive(g, Items::All, &input, &mut sums, &mut total));
    g.readback(&sums);
    assert_snapshot!(g.plan().unwrap().dump(), @r#"
    phase 0
      offsets/scan: scan_reduce [3 x 1] #0=0 #8=8 <- item_count, input -> scan_partial
    phase 1
      offsets/scan: scan_spine [1 x 1] -> scan_partial, total
    phase 2
      offsets/scan: scan_apply [3 x 1] #8=8 <- item_count, input, scan_partial -> sums
    phase 3
      readback <- sums
    memory
             20000 at 0:0 sums
                16 at 0:0 total
                16 at 0:20224 scan_partial
      arena 0: 20480 bytes
      20736 bytes without aliasing
    "#);
}

#[test]
fn windows_cover_every_item_once() {
    let mut g = Graph::new();
    g.limit_windows(4096);
    let (mut from, mut to) = (g.buffer::<u32>("from", 2500), g.buffer::<[u32; 2]>("to", 2500));
    g.fill(&mut from, 1);
    let split = Windows { items: 2500, bindings: &[0, 1] };
    let bind = Wires::new().read(&from).write(&mut to);
    g.dispatch_windows(Fake(&STEP), split, |Window { first, .. }| first, bind);
    g.readback(&to);
    assert_snapshot!(g.plan().unwrap().dump(), @r#"
    phase 0
      fill 0x1 -> from
    phase 1
      step [windows of 512 + 512 + 512 + 512 + 452] <- from -> to
    phase 2
      readback <- to
    memory
             10000 at 0:0 from
             20000 at 0:10240 to
      arena 0: 30464 bytes
      30464 bytes without aliasing
    "#);
}

#[test]
fn the_longest_window_is_what_every_device_can_bind() {
    let plan = |items: u32| {
        let mut g = Graph::new();
        let mut all = g.buffer::<[f32; 4]>("all", items);
        let split = Windows { items, bindings: &[0] };
        g.dispatch_windows(Fake(&STEP), split, |window| window.count, Wires::new().write(&mut all));
        g.keep(&all);
        g.plan().unwrap().dump()
    };
    assert!(plan(1 << 23).contains("[windows of 8388608] "), "128 MiB fit one binding: {}", plan(1 << 23));
    assert!(plan((1 << 23) + 1).contains("[windows of 8388608 + 1] "));
    assert!(plan(0).contains("[windows of 0] "));
}

#[test]
#[should_panic(expected = "has 9 elements for 10 items")]
fn windows_need_an_element_per_item() {
    let mut g = Graph::new();
    let mut short = g.buffer::<u32>("short", 9);
    let split = Windows { items: 10, bindings: &[0] };
    g.dispatch_windows(Fake(&STEP), split, |_| 0, Wires::new().write(&mut short));
}

#[test]
fn many_groups_are_spread_over_two_axes() {
    let groups = |threads: u32| {
        let mut g = Graph::new();
        let mut all = g.buffer::<u32>("all", 1);
        g.dispatch(Fake(&STEP), Grid::Threads(threads), 0, Wires::new().write(&mut all));
        g.readback(&all);
        let dump = g.plan().unwrap().dump();
        dump[dump.find('[').unwrap()..=dump.find(']').unwrap()].to_owned()
    };
    let texts = [0, 1, 64, 65, 65_535 * 64, 65_535 * 64 + 1, u32::MAX].map(groups);
    let wanted =
        ["[0 x 1]", "[1 x 1]", "[1 x 1]", "[2 x 1]", "[65535 x 1]", "[32768 x 2]", "[32768 x 2048]"].map(str::to_owned);
    assert_eq!(texts, wanted);
}

/// The mistake in what `declare` declares.
fn mistake(declare: impl FnOnce(&mut Graph)) -> PlanError {
    let mut g = Graph::new();
    declare(&mut g);
    match g.plan() {
        Ok(plan) => panic!("planned although wrong:\n{}", plan.dump()),
        Err(error) => error,
    }
}

#[test]
fn mistakes_are_named() {
    let unwritten = mistake(|g| {
        let (a, mut b) = (g.buffer("a", 8), g.buffer("b", 8));
        step(g, &a, &mut b);
    });
    assert_eq!(unwritten, PlanError::ReadBeforeWrite { pass: "step", buffer: "a" });
    assert_eq!(unwritten.to_string(), "pass 'step' reads 'a' before it is written");
    let read_back = mistake(|g| {
        let a = g.buffer::<u32>("a", 8);
        g.readback(&a);
    });
    assert_eq!(read_back, PlanError::ReadBeforeWrite { pass: "readback", buffer: "a" });
    let constant = mistake(|g| {
        let data = g.upload("data", &[1u32]);
        let bind = Wires::new().add(fake::index(&data), nephroid::low_level::graph::Access::Write);
        g.dispatch(Fake(&MAKE), Grid::Groups([1, 1]), 0, bind);
    });
    assert_eq!(constant, PlanError::WriteToReadOnly { pass: "make", buffer: "data" });
    let twice = mistake(|g| {
        let mut a = g.buffer::<u32>("a", 8);
        g.fill(&mut a, 0);
        let bind = Wires::new().read(&a).write(&mut a);
        g.dispatch(Fake(&STEP), Grid::Groups([1, 1]), 0, bind);
    });
    assert_eq!(twice, PlanError::Aliased { pass: "step", buffer: "a" });
}

#[test]
fn grids_are_checked() {
    let indirect = |len: u32, written: bool| {
        mistake(|g| {
            let (mut args, mut a) = (g.buffer::<DispatchArgs>("args", len), g.buffer::<u32>("a", 8));
            if written {
                g.fill(&mut args, 1);
            }
            g.dispatch(Fake(&MAKE), Grid::Indirect(&args), 0, Wires::new().write(&mut a));
        })
    };
    assert_eq!(indirect(1, false), PlanError::UnknownArguments { pass: "make", buffer: "args" });
    assert_eq!(indirect(0, true), PlanError::UnknownArguments { pass: "make", buffer: "args" });
    let fixed = |groups: [u32; 2]| {
        mistake(|g| {
            let mut a = g.buffer::<u32>("a", 8);
            g.dispatch(Fake(&MAKE), Grid::Groups(groups), 0, Wires::new().write(&mut a));
        })
    };
    for groups in [[65_536, 1], [1, 65_536], [65_535, 65_535]] {
        assert_eq!(fixed(groups), PlanError::Grid { pass: "make", groups });
    }
}

#[test]
#[should_panic(expected = "'shared' is imported twice")]
fn one_memory_is_imported_once() {
    let shared = Persistent::<u32>::detached("shared", 8);
    let mut g = Graph::new();
    let _ = (g.import(&shared), g.import_read(&shared.clone()));
}

#[test]
#[should_panic(expected = "give it Grid::Groups")]
fn threads_need_one_dimensional_workgroups() {
    static TILE: KernelInfo = KernelInfo { local_size: [8, 8, 1], ..facts("tile") };
    let mut g = Graph::new();
    let mut a = g.buffer::<u32>("a", 8);
    g.dispatch(Fake(&TILE), Grid::Threads(8), 0, Wires::new().write(&mut a));
}

#[test]
fn the_same_declarations_give_the_same_plan() {
    let (one, other) = (diamond().plan().unwrap(), diamond().plan().unwrap());
    assert_eq!((one.dump(), one.dot()), (other.dump(), other.dot()));
}

/// What is wrong with a DOT text, by its grammar as far as plans use it.
fn dot_fault(text: &str, plan: &Plan) -> Option<String> {
    let body = text.strip_prefix("digraph plan {\n").and_then(|rest| rest.strip_suffix("}\n"));
    let Some(body) = body else { return Some("no digraph".into()) };
    let (mut nodes, mut edges) = (Vec::new(), Vec::new());
    for line in body.lines().map(str::trim).filter(|line| *line != "rankdir=LR;") {
        if line.replace("\\\\", "").replace("\\\"", "").matches('"').count() % 2 != 0 {
            return Some(format!("open quote: {line}"));
        }
        if line.matches('{').count() != line.matches('}').count() || !line.ends_with([';', '}']) {
            return Some(format!("unbalanced: {line}"));
        }
        match line.split_once(" -> ") {
            Some((from, to)) => edges.push((from.to_owned(), to.trim_end_matches(';').to_owned())),
            None => {
                let head = &line[..line.rfind('[').unwrap_or(0)];
                nodes.push(head.trim().rsplit(' ').next().unwrap_or_default().to_owned());
            }
        }
    }
    let loose = edges.iter().find(|(from, to)| !nodes.contains(from) || !nodes.contains(to));
    let uses: usize = plan.passes.iter().map(|pass| pass.uses.len()).sum();
    match loose {
        Some((from, to)) => Some(format!("edge of an unknown node: {from} -> {to}")),
        None if edges.len() != uses => Some(format!("{} edges for {uses} uses", edges.len())),
        None => None,
    }
}

#[test]
fn dot_is_well_formed() {
    let plan = diamond().plan().unwrap();
    let text = plan.dot();
    assert_eq!(dot_fault(&text, &plan), None, "{text}");
    for (from, to) in [("b0 [", "b9 ["), ("}\n", "\n"), ("label=\"", "label="), ("  p0 -> b1;\n", "")] {
        let sabotaged = text.replacen(from, to, 1);
        assert_ne!(sabotaged, text, "nothing to sabotage at {from:?} in\n{text}");
        assert!(dot_fault(&sabotaged, &plan).is_some(), "{from:?} to {to:?} goes unnoticed");
    }
    let mut g = Graph::new();
    let mut odd = g.buffer::<u32>("an \"odd\" \\ name", 1);
    g.fill(&mut odd, 0);
    g.readback(&odd);
    let plan = g.plan().unwrap();
    assert_eq!(dot_fault(&plan.dot(), &plan), None, "{}", plan.dot());
}

static PLACE: ShaderInfo = shader("place_vert", Stage::Vertex, 0);
static SPREAD: ShaderInfo = shader("spread_geom", Stage::Geometry, 0);
static COLOUR: ShaderInfo = shader("colour_frag", Stage::Fragment, 1);
static COLOUR_TWO: ShaderInfo = shader("colour_two_frag", Stage::Fragment, 2);

const PICTURE: RasterPass = RasterPass { name: "picture", extent: [8, 4], depth: None };

fn direct(instances: u32) -> Instances<'static> {
    Instances::Direct { vertices: 3, instances }
}

#[test]
fn graphics_passes_are_passes_over_buffers() {
    let mut g = Graph::new();
    let (mut photons, mut args) = (g.buffer::<u32>("photons", 100), g.buffer::<DrawArgs>("args", 1));
    let bind = Wires::new().write(&mut photons).write(&mut args);
    g.dispatch(Fake(&MAKE), Grid::Threads(100), 0, bind);
    let (mut light, mut weight, mut other, mut unused) =
        (g.buffer("light", 32), g.buffer("weight", 32), g.buffer("other", 6), g.buffer("unused", 6));
    let depth = DrawState { depth_write: true, ..DrawState::default() };
    let far = DrawState {
        topology: Topology::Points,
        depth_test: DepthTest::Greater,
        cull: Cull::Front,
        depth_clamp: true,
        ..DrawState::default()
    };
    let draws = vec![
        Draw::new(Fake(&PLACE), direct(1), 5, Wires::new()).state(depth),
        Draw::new(Fake(&PLACE), Instances::Indirect(&args), 5, Wires::new().read(&photons))
            .fragment(Fake(&COLOUR_TWO), 5, Wires::new().read(&photons))
            .geometry(Fake(&SPREAD), 5, Wires::new())
            .state(far),
    ];
    g.raster(RasterPass { depth: Some(0.0), ..PICTURE }, draws, [&mut light, &mut weight]);
    for out in [&mut other, &mut unused] {
        let draw = Draw::new(Fake(&PLACE), direct(7), 5, Wires::new()).fragment(Fake(&COLOUR), 5, Wires::new());
        g.raster(RasterPass { extent: [3, 2], ..PICTURE }, vec![draw], [out]);
    }
    g.readback(&weight);
    g.readback(&other);
    assert_snapshot!(g.plan().unwrap().dump(), @r#"
    phase 0
      make [2 x 1] -> photons, args
    phase 1
      picture [8 x 4, colours 2, depth 0] {place_vert, 3 x 1, Triangles, Add, depth Always and write} {place_vert + spread_geom + colour_two_frag #20=7, by args, Points, Add, depth Greater, cull Front, clamp} <- photons, args -> light, weight
      picture [3 x 2, colours 1] {place_vert + colour_frag #20=7, 3 x 7, Triangles, Add} -> other
    phase 2
      readback <- weight
      readback <- other
    culled
      picture [3 x 2, colours 1] {place_vert + colour_frag #20=7, 3 x 7, Triangles, Add} -> unused
    memory
               400 at 0:0 photons
                16 at 0:512 args
               512 at 0:768 light
               512 at 0:1280 weight
                96 at 0:1792 other
      arena 0: 2048 bytes
      2048 bytes without aliasing
    "#);
}

/// A draw without a fragment kernel and buffers.
fn plain() -> Draw<'static> {
    Draw::new(Fake(&PLACE), direct(1), 5, Wires::new())
}

/// Draws over two buffers.
type DrawsOf = dyn Fn(&Buf<u32>, &Buf<u32>) -> Vec<Draw<'static>>;

#[test]
fn mistakes_in_graphics_passes_are_named() {
    let wrong = |pass: RasterPass, len: u32, draws: &DrawsOf| {
        let error = mistake(|g| {
            let (a, b) = (g.upload("a", &[1u32]), g.upload("b", &[2u32]));
            let mut out = g.buffer("out", len);
            g.raster(pass, draws(&a, &b), [&mut out]);
        });
        let text = error.to_string();
        assert!(matches!(error, PlanError::Raster { pass: "picture", .. }), "{text}");
        text.strip_prefix("graphics pass 'picture': ").expect("the pass by its name").to_owned()
    };
    let nothing = |_: &Buf<u32>, _: &Buf<u32>| vec![];
    assert_eq!(wrong(RasterPass { extent: [0, 4], ..PICTURE }, 32, &nothing), "a picture of 0 x 4 pixels");
    assert_eq!(wrong(PICTURE, 31, &nothing), "'out' holds 31 pixels, the picture has 8 x 4");
    let outside = wrong(RasterPass { depth: Some(f32::NAN), ..PICTURE }, 32, &nothing);
    assert_eq!(outside, "depths are cleared to NaN, outside of [0, 1]");
    let text = wrong(PICTURE, 32, &|_, _| {
        vec![plain().state(DrawState { depth_test: DepthTest::Less, ..DrawState::default() })]
    });
    assert_eq!(text, "'place_vert' needs depths, the pass has none");
    let text = wrong(PICTURE, 32, &|_, _| vec![plain(), plain().fragment(Fake(&COLOUR_TWO), 5, Wires::new())]);
    assert_eq!(text, "'colour_two_frag' writes 2 colours of 1: all or none");
    let text = wrong(PICTURE, 32, &|_, _| vec![plain().fragment(Fake(&COLOUR), 6, Wires::new())]);
    assert_eq!(text, "the stages of 'place_vert' get different parameters");
    let text = wrong(PICTURE, 32, &|a, b| {
        let place = Draw::new(Fake(&PLACE), direct(1), 5, Wires::new().read(a));
        vec![place.fragment(Fake(&COLOUR), 5, Wires::new().read(b))]
    });
    assert_eq!(text, "binding 0 of 'place_vert' is one buffer in one stage and another in another");
}

#[test]
fn what_draws_read_is_checked_as_elsewhere() {
    let unwritten = mistake(|g| {
        let (a, mut out) = (g.buffer::<u32>("a", 8), g.buffer("out", 32));
        let draw = Draw::new(Fake(&PLACE), direct(1), 5, Wires::new().read(&a));
        g.raster(PICTURE, vec![draw], [&mut out]);
    });
    assert_eq!(unwritten, PlanError::ReadBeforeWrite { pass: "picture", buffer: "a" });
    let arguments = mistake(|g| {
        let (args, mut out) = (g.buffer::<DrawArgs>("args", 1), g.buffer("out", 32));
        let draw = Draw::new(Fake(&PLACE), Instances::Indirect(&args), 5, Wires::new());
        g.raster(PICTURE, vec![draw], [&mut out]);
    });
    assert_eq!(arguments, PlanError::UnknownArguments { pass: "picture", buffer: "args" });
    let both = mistake(|g| {
        let mut out = g.buffer::<[f32; 4]>("out", 32);
        g.fill(&mut out, 0);
        let reads = Wires::new().read(&out);
        let draw = Draw::new(Fake(&PLACE), direct(1), 5, reads);
        g.raster(PICTURE, vec![draw], [&mut out]);
    });
    assert_eq!(both, PlanError::Aliased { pass: "picture", buffer: "out" });
}

#[test]
#[should_panic(expected = "'place_vert' writes a buffer")]
fn draws_write_no_buffers() {
    let mut g = Graph::new();
    let mut a = g.buffer::<u32>("a", 8);
    let _ = Draw::new(Fake(&PLACE), direct(1), 5, Wires::new().write(&mut a));
}
