//! Graphics passes on a device under validation: pictures compared with sums made here, whose numbers are small enough
//! to be exact; and that a missing barrier is noticed.
//!
//! `NEPHROID_TEST_DEVICE` chooses the device (default `cpu`).

use std::sync::LazyLock;

use nephroid::Error;
use nephroid::low_level::draw_state::{Blend, Cull, DepthTest, DrawState, Topology};
use nephroid::low_level::graph::{Buf, Draw, DrawArgs, Graph, Grid, Instances, Plan, RasterPass, Readback, Runtime};
use nephroid::low_level::kernels::generated::{
    BenchSplatFrag, BenchSplatFragBindings, BenchSplatFragParams, BenchSplatGeom, BenchSplatGeomBindings,
    BenchSplatGeomParams, BenchSplatPointVert, BenchSplatPointVertBindings, BenchSplatVert, BenchSplatVertBindings,
    BenchSplatVertParams, Splat,
};
use nephroid::low_level::vk::Feature;

use crate::compiled::Compiled;
use crate::support::device::{alone, open, runtime};
use crate::support::fake::Wires;
use crate::support::proof;

type Pixels = Vec<[f32; 4]>;

const EXTENT: [u32; 2] = [67, 45];
const FACTOR: f32 = 2.0;
const SCALE: f32 = 3.0;

/// Squares at whole pixels, some of them partly outside of the picture, and their colours.
fn splats(count: u32, [width, height]: [u32; 2]) -> (Vec<Splat>, Pixels) {
    let splat = |i: u32| Splat {
        centre: [(i * 29 % (width + 8)) as f32 - 4.0, (i * 37 % (height + 8)) as f32 - 4.0],
        half_side: (1 + i % 6) as f32,
        depth: (i % 7) as f32 / 8.0 + 0.0625,
    };
    let colour = |i: u32| [i % 5, i % 3 + 1, i % 11, 1].map(|x| x as f32);
    ((0..count).map(splat).collect(), (0..count).map(colour).collect())
}

/// What a fragment of square `i` leaves at a pixel.
fn fragment(splats: &[Splat], colours: &[[f32; 4]], i: usize, [x, y]: [u32; 2]) -> [[f32; 4]; 2] {
    let place = [x as f32 + 0.5, y as f32 + 0.5, splats[i].half_side, 1.0];
    [colours[i].map(|c| c * (SCALE * FACTOR)), place]
}

/// Whether square `s` covers the middle of a pixel.
fn covers(s: &Splat, [x, y]: [u32; 2]) -> bool {
    let inside = |at: u32, centre: f32| (at as f32 + 0.5 - centre).abs() < s.half_side;
    inside(x, s.centre[0]) && inside(y, s.centre[1])
}

/// Both pictures of squares for which `passes(square, pixel)`, added up.
fn sums(
    extent: [u32; 2],
    (splats, colours): (&[Splat], &[[f32; 4]]),
    passes: fn(&Splat, [u32; 2]) -> bool,
) -> [Pixels; 2] {
    let mut pictures = [(); 2].map(|()| vec![[0.0f32; 4]; (extent[0] * extent[1]) as usize]);
    for (y, x) in (0..extent[1]).flat_map(|y| (0..extent[0]).map(move |x| (y, x))) {
        for (i, _) in splats.iter().enumerate().filter(|(_, s)| covers(s, [x, y]) && passes(s, [x, y])) {
            for (picture, value) in pictures.iter_mut().zip(fragment(splats, colours, i, [x, y])) {
                let pixel = &mut picture[(y * extent[0] + x) as usize];
                (0..4).for_each(|c| pixel[c] += value[c]);
            }
        }
    }
    pictures
}

/// Which kernel makes squares out of instances.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Amplify {
    Vertex,
    Geometry,
}

/// A draw of `splats` in `colours`.
fn draw<'a>(
    amplify: Amplify,
    count: Instances<'a>,
    (splats, colours): (&'a Buf<Splat>, &'a Buf<[f32; 4]>),
    extent: [u32; 2],
) -> Draw<'a> {
    let extent = extent.map(|side| side as f32);
    let draw = match amplify {
        Amplify::Vertex => {
            let (params, bind) = (BenchSplatVertParams { extent }, BenchSplatVertBindings { splats });
            Draw::new(BenchSplatVert, count, params, bind)
        }
        Amplify::Geometry => {
            let (params, bind) = (BenchSplatGeomParams { extent }, BenchSplatGeomBindings { splats });
            Draw::new(BenchSplatPointVert, count, (), BenchSplatPointVertBindings { none: Default::default() })
                .geometry(BenchSplatGeom, params, bind)
        }
    };
    let params = BenchSplatFragParams { extent, factor: FACTOR };
    draw.fragment(BenchSplatFrag { scale: SCALE }, params, BenchSplatFragBindings { splats, colours })
        .state(state(amplify))
}

fn state(amplify: Amplify) -> DrawState {
    let topology = if amplify == Amplify::Vertex { Topology::TriangleStrip } else { Topology::Points };
    DrawState { topology, ..DrawState::default() }
}

/// Vertices of an instance.
fn vertices(amplify: Amplify) -> u32 {
    if amplify == Amplify::Vertex { 4 } else { 1 }
}

fn pass(extent: [u32; 2], depth: Option<f32>) -> RasterPass {
    RasterPass { name: "splat", extent, depth }
}

/// A graphics pass over data of the host, and read-backs of both pictures.
fn declare(
    g: &mut Graph,
    pass: RasterPass,
    (splats, colours): (&[Splat], &[[f32; 4]]),
    draws: impl for<'a> Fn(&'a Buf<Splat>, &'a Buf<[f32; 4]>) -> Vec<Draw<'a>>,
) -> [Readback<[f32; 4]>; 2] {
    let pixels = pass.extent[0] * pass.extent[1];
    let (splats, colours) = (g.upload("splats", splats), g.upload("colours", colours));
    let (mut sum, mut place) = (g.buffer("sum", pixels), g.buffer("place", pixels));
    g.raster(pass, draws(&splats, &colours), [&mut sum, &mut place]);
    [g.readback(&sum), g.readback(&place)]
}

/// Runs one pass of one kind of draw with another state.
fn drawn(runtime: &Runtime, depth: Option<f32>, data: (&[Splat], &[[f32; 4]]), state: DrawState) -> [Pixels; 2] {
    let mut g = Graph::new();
    let instances = data.0.len() as u32;
    let results = declare(&mut g, pass(EXTENT, depth), data, |splats, colours| {
        let count = Instances::Direct { vertices: 4, instances };
        vec![draw(Amplify::Vertex, count, (splats, colours), EXTENT).state(state)]
    });
    let mut executable = runtime.prepare(&g.plan().unwrap()).unwrap();
    executable.run().unwrap();
    results.map(|result| executable.read(&result))
}

/// Says where two pictures differ.
fn assert_same(got: &[Pixels; 2], wanted: &[Pixels; 2], what: &str) {
    for (index, (got, wanted)) in got.iter().zip(wanted).enumerate() {
        assert_eq!(got.len(), wanted.len());
        let at = got.iter().zip(wanted).position(|(a, b)| a != b);
        if let Some(at) = at {
            panic!("{what}: picture {index}, pixel {at}: {:?} instead of {:?}", got[at], wanted[at]);
        }
    }
}

const AMPLIFIERS: [Amplify; 2] = [Amplify::Vertex, Amplify::Geometry];

#[test]
fn squares_add_up_with_vertex_and_geometry_kernels() {
    let runtime = runtime();
    let (splats, colours) = splats(500, EXTENT);
    let wanted = sums(EXTENT, (&splats, &colours), |_, _| true);
    assert!(wanted[1].iter().any(|pixel| pixel[3] > 8.0), "hardly anything overlaps");
    for amplify in AMPLIFIERS {
        let mut g = Graph::new();
        let results = declare(&mut g, pass(EXTENT, None), (&splats, &colours), |splats, colours| {
            let count = Instances::Direct { vertices: vertices(amplify), instances: 500 };
            vec![draw(amplify, count, (splats, colours), EXTENT)]
        });
        let mut plan = g.plan().unwrap();
        plan.poison(0x7fc0_0000);
        let mut executable = runtime.prepare(&plan).unwrap();
        assert!(executable.device_bytes() >= 2 * 2 * 16 * u64::from(EXTENT[0] * EXTENT[1]), "pictures count as memory");
        for _ in 0..3 {
            executable.run().unwrap();
            let got = results.map(|result| executable.read(&result));
            assert_same(&got, &wanted, &format!("{amplify:?}"));
        }
        proof::ran(&plan.dump());
    }
    let mut other = splats.clone();
    other[77].centre[0] += 1.0;
    assert!(sums(EXTENT, (&other, &colours), |_, _| true) != wanted, "one square moved by a pixel goes unnoticed");
    proof::by_answer(&["bench_splat_frag", "bench_splat_geom", "bench_splat_point_vert", "bench_splat_vert"]);
}

/// A compute kernel; its parameters are the items, and the vertices and instances to draw.
fn compile(name: &'static str, text: &str) -> Compiled {
    let head = "#version 460\n#extension GL_EXT_scalar_block_layout : require\nlayout(local_size_x = 64) in;\n\
                layout(push_constant, scalar) uniform Params { uint items; uint vertices; uint instances; } params;\n";
    Compiled::of(name, &format!("{head}{text}"))
}

/// Copies squares and writes how many of them are drawn.
static MAKE: LazyLock<Compiled> = LazyLock::new(|| {
    compile(
        "make_splats",
        "layout(set = 0, binding = 0, scalar) readonly buffer Source { vec4 source[]; };
         layout(set = 0, binding = 1, scalar) writeonly buffer Target { vec4 target[]; };
         layout(set = 0, binding = 2, scalar) writeonly buffer Args { uvec4 args[]; };
         void main() {
             uint i = gl_GlobalInvocationID.x;
             if (i < params.items) target[i] = source[i];
             if (i == 0u) args[0] = uvec4(params.vertices, params.instances, 0u, 0u);
         }",
    )
});

/// `target[i] += source[i]`.
static ADD: LazyLock<Compiled> = LazyLock::new(|| {
    compile(
        "add_pictures",
        "layout(set = 0, binding = 0, scalar) readonly buffer Source { vec4 source[]; };
         layout(set = 0, binding = 1, scalar) buffer Target { vec4 target[]; };
         void main() {
             uint i = gl_GlobalInvocationID.x;
             if (i < params.items) target[i] += source[i];
         }",
    )
});

/// Compute, draws by counts of the device, compute: what the kernels write the draws read, and the other way round.
fn mixed(amplify: Amplify, all: (&[Splat], &[[f32; 4]]), drawn: u32) -> (Plan, Readback<[f32; 4]>) {
    let (items, pixels) = (all.0.len() as u32, EXTENT[0] * EXTENT[1]);
    let mut g = Graph::new();
    let (source, colours) = (g.upload("source", all.0), g.upload("colours", all.1));
    let (mut splats, mut args) = (g.buffer("splats", items), g.buffer::<DrawArgs>("args", 1));
    let wires = Wires::new().read(&source).write(&mut splats).write(&mut args);
    g.dispatch(*MAKE, Grid::Threads(items), [items, vertices(amplify), drawn], wires);
    let (mut sum, mut place) = (g.buffer("sum", pixels), g.buffer("place", pixels));
    let count = Instances::Indirect(&args);
    let draws = vec![draw(amplify, count, (&splats, &colours), EXTENT)];
    g.raster(pass(EXTENT, None), draws, [&mut sum, &mut place]);
    g.dispatch(*ADD, Grid::Threads(pixels), [pixels, 0, 0], Wires::new().read(&place).write(&mut sum));
    let result = g.readback(&sum);
    (g.plan().expect("a plan"), result)
}

#[test]
fn counts_and_squares_of_the_device_are_obeyed() {
    let runtime = runtime();
    let (splats, colours) = splats(300, EXTENT);
    for (amplify, drawn) in AMPLIFIERS.into_iter().flat_map(|amplify| [(amplify, 211), (amplify, 0)]) {
        let (plan, result) = mixed(amplify, (&splats, &colours), drawn);
        let mut executable = runtime.prepare(&plan).unwrap();
        executable.run().unwrap();
        let some = drawn as usize;
        let [mut wanted, place] = sums(EXTENT, (&splats[..some], &colours[..some]), |_, _| true);
        wanted.iter_mut().zip(&place).for_each(|(sum, place)| (0..4).for_each(|c| sum[c] += place[c]));
        assert!(executable.read(&result) == wanted, "{amplify:?}, {drawn} squares");
    }
}

#[test]
fn a_missing_barrier_is_caught() {
    let (splats, colours) = splats(100, EXTENT);
    let _alone = alone();
    let device = Runtime::new(open());
    let (plan, _) = mixed(Amplify::Vertex, (&splats, &colours), 100);
    assert_eq!(plan.phases(), 4, "{}", plan.dump());
    device.prepare(&plan).unwrap().run().unwrap();
    // Before the draws, and between their pictures and the next kernel.
    for phase in [1, 2] {
        let runtime = Runtime::new(open());
        let (mut plan, _) = mixed(Amplify::Vertex, (&splats, &colours), 100);
        plan.sabotage_barrier(phase);
        let caught = runtime.prepare(&plan).and_then(|mut executable| executable.run());
        let Err(Error::Validation(messages)) = caught else { panic!("phase {phase}: {caught:?}") };
        assert!(messages.iter().any(|message| message.contains("SYNC-HAZARD-READ-AFTER-WRITE")), "{messages:?}");
    }
}

#[test]
fn depths_are_tested_and_left() {
    let runtime = runtime();
    let (mut splats, colours) = splats(200, EXTENT);
    // The first one is a wall in the left part of the picture, drawn without a fragment kernel.
    splats[0] = Splat { centre: [0.0, 20.0], half_side: 30.0, depth: 0.5 };
    let wanted_less = |s: &Splat, [x, y]: [u32; 2]| s.depth < if x < 30 && y < 50 { 0.5 } else { 1.0 };
    let wanted_greater = |s: &Splat, [x, y]: [u32; 2]| s.depth > if x < 30 && y < 50 { 0.5 } else { 0.0 };
    let cases = [
        (1.0, DepthTest::Less, wanted_less as fn(&Splat, [u32; 2]) -> bool),
        (0.0, DepthTest::Greater, wanted_greater),
    ];
    for (clear, depth_test, passes) in cases {
        let mut g = Graph::new();
        let results = declare(&mut g, pass(EXTENT, Some(clear)), (&splats, &colours), |splats, colours| {
            let all =
                draw(Amplify::Vertex, Instances::Direct { vertices: 4, instances: 200 }, (splats, colours), EXTENT);
            vec![wall(splats), all.state(DrawState { depth_test, ..state(Amplify::Vertex) })]
        });
        let mut executable = runtime.prepare(&g.plan().unwrap()).unwrap();
        executable.run().unwrap();
        let got = results.map(|result| executable.read(&result));
        assert_same(&got, &sums(EXTENT, (&splats, &colours), passes), &format!("{depth_test:?}"));
    }
}

/// The first square of the buffer, by its depth alone.
fn wall(splats: &Buf<Splat>) -> Draw<'_> {
    let state = DrawState { depth_write: true, ..state(Amplify::Vertex) };
    let params = BenchSplatVertParams { extent: EXTENT.map(|side| side as f32) };
    let count = Instances::Direct { vertices: 4, instances: 1 };
    Draw::new(BenchSplatVert, count, params, BenchSplatVertBindings { splats }).state(state)
}

#[test]
fn the_nearest_square_wins_with_depth_writes_and_replacement() {
    let runtime = runtime();
    let (splats, colours) = splats(150, EXTENT);
    let strip = state(Amplify::Vertex);
    let nearest = DrawState { blend: Blend::Replace, depth_test: DepthTest::Less, depth_write: true, ..strip };
    let last = DrawState { blend: Blend::Replace, ..strip };
    let choose = |better: fn(&Splat, &Splat) -> bool| {
        let mut pictures = [(); 2].map(|()| vec![[0.0f32; 4]; (EXTENT[0] * EXTENT[1]) as usize]);
        for (y, x) in (0..EXTENT[1]).flat_map(|y| (0..EXTENT[0]).map(move |x| (y, x))) {
            let covering = (0..150).filter(|&i| covers(&splats[i], [x, y]));
            let best = covering.reduce(|best, i| if better(&splats[i], &splats[best]) { i } else { best });
            if let Some(i) = best {
                let values = fragment(&splats, &colours, i, [x, y]);
                (0..2).for_each(|p| pictures[p][(y * EXTENT[0] + x) as usize] = values[p]);
            }
        }
        pictures
    };
    let data = (&splats[..], &colours[..]);
    assert_same(&drawn(&runtime, Some(1.0), data, nearest), &choose(|a, b| a.depth < b.depth), "nearest");
    assert_same(&drawn(&runtime, None, data, last), &choose(|_, _| true), "last");
}

#[test]
fn sides_are_culled_and_depths_clamped() {
    let runtime = runtime();
    let (mut splats, colours) = splats(100, EXTENT);
    let strip = state(Amplify::Vertex);
    let all = sums(EXTENT, (&splats, &colours), |_, _| true);
    let none = sums(EXTENT, (&[], &[]), |_, _| true);
    let cull = |cull| drawn(&runtime, None, (&splats, &colours), DrawState { cull, ..strip });
    assert_same(&cull(Cull::Back), &all, "fronts");
    assert_same(&cull(Cull::Front), &none, "backs");
    splats.iter_mut().for_each(|s| s.depth -= 2.0);
    assert_same(&drawn(&runtime, None, (&splats, &colours), strip), &none, "before the near plane");
    if runtime.device().require(&[Feature::DepthClamp]).is_ok() {
        let clamped = DrawState { depth_clamp: true, ..strip };
        assert_same(&drawn(&runtime, None, (&splats, &colours), clamped), &all, "clamped");
        // Clamped to 0, which is less than what the pass begins with.
        let nearer = DrawState { depth_test: DepthTest::Less, ..clamped };
        assert_same(&drawn(&runtime, Some(0.25), (&splats, &colours), nearer), &all, "clamped and tested");
    }
}

#[test]
fn passes_of_one_plan_share_pictures_of_their_extent() {
    let runtime = runtime();
    let extents = [EXTENT, [16, 128], EXTENT, [1, 1]];
    let data: Vec<_> = extents.iter().zip([90, 120, 60, 3]).map(|(&extent, count)| splats(count, extent)).collect();
    let mut g = Graph::new();
    let mut results = Vec::new();
    for ((splats, colours), extent) in data.iter().zip(extents) {
        let instances = splats.len() as u32;
        results.push(declare(&mut g, pass(extent, None), (splats, colours), |splats, colours| {
            let count = Instances::Direct { vertices: 4, instances };
            vec![draw(Amplify::Vertex, count, (splats, colours), extent)]
        }));
    }
    let plan = g.plan().unwrap();
    let mut executable = runtime.prepare(&plan).unwrap();
    for _ in 0..2 {
        executable.run().unwrap();
        for (((splats, colours), extent), results) in data.iter().zip(extents).zip(&results) {
            let got = [executable.read(&results[0]), executable.read(&results[1])];
            assert_same(&got, &sums(extent, (splats, colours), |_, _| true), &format!("{extent:?}"));
        }
    }
}

#[test]
fn pixels_beyond_the_picture_keep_what_they_were() {
    let runtime = runtime();
    let mut g = Graph::new();
    let (mut sum, mut place) = (g.buffer::<[f32; 4]>("sum", 20), g.buffer("place", 12));
    g.fill(&mut sum, 7);
    g.raster(pass([4, 3], None), vec![], [&mut sum, &mut place]);
    let (sum, place) = (g.readback(&sum), g.readback(&place));
    let mut executable = runtime.prepare(&g.plan().unwrap()).unwrap();
    executable.run().unwrap();
    let sum: Vec<[u32; 4]> = bytemuck::cast_vec(executable.read(&sum));
    assert_eq!(sum[..12], [[0; 4]; 12]);
    assert_eq!(sum[12..], [[7; 4]; 8]);
    assert_eq!(executable.read(&place), [[0.0; 4]; 12]);
}

#[test]
fn a_picture_beyond_the_device_is_refused() {
    let runtime = runtime();
    let side = runtime.device().info().limits.image_side + 1;
    let mut g = Graph::new();
    let mut wide = g.buffer("wide", side);
    g.raster(pass([side, 1], None), vec![], [&mut wide]);
    g.keep(&wide);
    let Err(refused) = runtime.prepare(&g.plan().unwrap()) else { panic!("a picture {side} wide") };
    let Error::MissingFeature { feature, .. } = &refused else { panic!("{refused:?}") };
    assert!(feature.contains(&format!("{side} x 1")), "{feature}");
}
