//! A kernel of one's own in the command graph: the prefix sums of a million numbers.
//!
//! Hillis and Steele's scan (1986, "Data parallel algorithms"): in step k each item adds the one that stands 2^k places
//! before it. Twenty dispatches read one buffer and write the other; the graph finds the barriers between them.
//! The library's own scan (`low_level::kernels::scan`) needs three.
//!
//! ```text
//! cargo run --release --example prefix_sum
//! ```

use nephroid::low_level::graph::{Bindings, Buf, Graph, Grid, Kernel, KernelInfo, Runtime, Spirv, Use};
use nephroid::{Device, DeviceOptions, Error, Result};

/// One step for `count` items.
const STEP: &str = "
#version 460
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, std430) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Target { uint target[]; };
layout(push_constant) uniform Params { uint count; uint distance; };
void main() {
    // The graph spreads many groups over x and y.
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint i = group * 64u + gl_LocalInvocationID.x;
    if (i < count) target[i] = source[i] + (i >= distance ? source[i - distance] : 0u);
}";

/// The kernel as the graph knows it. The host program must keep its code for as long as a graph uses it.
#[derive(Clone, Copy)]
struct Step(&'static KernelInfo);

/// What the step reads and writes: a shared and an exclusive borrow, so that the two cannot be the same buffer.
struct StepBindings<'a> {
    source: &'a Buf<u32>,
    target: &'a mut Buf<u32>,
}

impl Bindings for StepBindings<'_> {
    fn uses(&self) -> Vec<Use> {
        vec![Use::read(0, self.source), Use::write(1, self.target)]
    }
}

impl Kernel for Step {
    type Params = [u32; 2];
    type Bindings<'a> = StepBindings<'a>;

    fn info(&self) -> &'static KernelInfo {
        self.0
    }

    fn constants(&self) -> Vec<(u32, u32)> {
        vec![]
    }
}

impl Step {
    fn compile() -> Result<Self> {
        let failed = |cause: shaderc::Error| Error::Usage(format!("the kernel does not compile: {cause}"));
        let compiler = shaderc::Compiler::new().map_err(failed)?;
        let stage = shaderc::ShaderKind::Compute;
        let code = compiler.compile_into_spirv(STEP, stage, "step.comp", "main", None).map_err(failed)?;
        let words: &'static [u32] = code.as_binary().to_vec().leak();
        Ok(Self(Box::leak(Box::new(KernelInfo {
            name: "step",
            spirv: Spirv(bytemuck::cast_slice(words)),
            local_size: [64, 1, 1],
            push_bytes: 8,
            bindings: &[0, 1],
        }))))
    }
}

/// Adds the passes that turn `numbers` into their inclusive prefix sums, modulo 2^32.
fn prefix_sums(g: &mut Graph, step: Step, numbers: &[u32]) -> Buf<u32> {
    let count = numbers.len() as u32;
    let (mut from, mut to) = (g.buffer("even", count), g.buffer("odd", count));
    let given = g.upload("numbers", numbers);
    g.copy(&given, &mut from);
    g.scope("prefix sums", |g| {
        let mut distance = 1;
        while distance < count {
            let bindings = StepBindings { source: &from, target: &mut to };
            g.dispatch(step, Grid::Threads(count), [count, distance], bindings);
            std::mem::swap(&mut from, &mut to);
            distance *= 2;
        }
    });
    from
}

fn main() -> Result<()> {
    let numbers: Vec<u32> = (0..1_000_000u32).map(|i| i.wrapping_mul(2_654_435_761) >> 24).collect();
    let runtime = Runtime::new(Device::open(&DeviceOptions::default())?);

    // Declare, plan, run.
    let mut g = Graph::new();
    let sums = prefix_sums(&mut g, Step::compile()?, &numbers);
    let sums = g.readback(&sums);
    let plan = g.plan().map_err(|cause| Error::Usage(cause.to_string()))?;
    let mut executable = runtime.prepare(&plan)?;
    executable.run()?;

    let sums = executable.read(&sums);
    let expected = numbers.iter().scan(0u32, |sum, number| {
        *sum = sum.wrapping_add(*number);
        Some(*sum)
    });
    assert!(expected.eq(sums.iter().copied()), "the kernel's sums are those of the loop");
    println!("{} numbers, sum {}", numbers.len(), sums[sums.len() - 1]);
    for timing in executable.timings() {
        println!("{}: {:.3} ms", timing.name, (timing.end_ns - timing.start_ns) as f64 * 1e-6);
    }
    runtime.device().check_validation()
}
