//! Runs graphs on a device under validation: outputs start poisoned, words behind them must survive, two runs must give
//! the same bits.

use std::fmt::Debug;

use bytemuck::Pod;
use nephroid::low_level::graph::{BufferKind, DeviceClass, Graph, Operation, Persistent, Plan, Runtime};
use nephroid::low_level::vk::DeviceKind;

use super::random::Random;
use super::{device, proof, skip};

/// Byte that fills outputs before a run.
const POISON: u8 = 0xa5;
/// Four of them.
pub const POISON_WORD: u32 = 0xa5a5_a5a5;
/// Elements behind every output that no kernel may touch.
const GUARD: u32 = 64;

/// A device for tests; one at a time uses it.
pub struct Harness {
    runtime: device::Shared,
}

/// Memory for a result: `len` elements and a guard.
pub struct Output<T> {
    memory: Persistent<T>,
    len: usize,
}

/// An [`Output`] of any type.
pub trait Poisoned {
    /// Fills it with poison.
    fn poison(&self, runtime: &Runtime);
    /// Its bytes without the guard, which is checked.
    fn bytes(&self, runtime: &Runtime) -> Vec<u8>;
}

impl Harness {
    /// Waits for the device of this program.
    pub fn lock() -> Self {
        Self { runtime: device::runtime() }
    }

    /// Whether kernels may use memory barriers where invocations diverge
    /// ([`nephroid::low_level::kernels::lbvh::Options`]).
    pub fn fences(&self) -> bool {
        self.runtime.device().loop_limit().is_none()
    }

    /// Whether the driver dies when it draws: lavapipe of Mesa 22.3.6 with subgroups of 16, in LLVM.
    pub fn fails_to_draw(&self) -> bool {
        let info = self.runtime.device().info();
        info.kind == DeviceKind::Software && info.limits.subgroup_size > 8 && self.loop_limit().is_some()
    }

    /// The same for tests that have nothing else to do: says that they are skipped, and why.
    pub fn skips_drawing() -> bool {
        let fails = Self::lock().fails_to_draw();
        if fails {
            skip("what draws, as this driver ends the program when it draws with subgroups of 16 (Mesa 22.3.6)");
        }
        fails
    }

    /// Loop iterations that the driver runs in an invocation, if it ends loops.
    pub fn loop_limit(&self) -> Option<u32> {
        self.runtime.device().loop_limit()
    }

    /// Memory with content.
    pub fn input<T: Pod>(&self, data: &[T]) -> Persistent<T> {
        self.runtime.persistent_from("test input", data).expect("memory for an input")
    }

    /// Memory for a result.
    pub fn output<T: Pod>(&self, len: usize) -> Output<T> {
        let memory = self.runtime.persistent("test output", len as u32 + GUARD).expect("memory for an output");
        Output { memory, len }
    }

    /// Runs what `declare` declares twice for each class of device, with poisoned outputs each time: always the same
    /// bits. Where both classes get the same commands, these run twice and not four times.
    pub fn run(&self, outputs: &[&dyn Poisoned], declare: impl Fn(&mut Graph)) {
        let first = self.run_on(DeviceClass::Cpu, outputs, &declare);
        if !same_commands(&declare) {
            assert!(first == self.run_on(DeviceClass::Gpu, outputs, &declare), "classes of device differ");
        }
    }

    /// Runs what `declare` declares for one class of device twice.
    pub fn run_on(&self, class: DeviceClass, outputs: &[&dyn Poisoned], declare: impl Fn(&mut Graph)) -> Vec<Vec<u8>> {
        let plan = plan(class, declare);
        let mut executable = self.runtime.prepare(&plan).expect("memory and commands");
        let mut run = || {
            outputs.iter().for_each(|output| output.poison(&self.runtime));
            executable.run().expect("a run without validation messages");
            outputs.iter().map(|output| output.bytes(&self.runtime)).collect::<Vec<_>>()
        };
        let (first, second) = (run(), run());
        proof::ran(&plan.dump());
        assert!(first == second, "two runs differ");
        second
    }

    /// Runs what `declare` declares once: for results of which every run may make others.
    pub fn run_once(&self, declare: impl Fn(&mut Graph)) {
        let plan = plan(DeviceClass::Cpu, declare);
        self.runtime.prepare(&plan).expect("memory and commands").run().expect("a run without validation messages");
        proof::ran(&plan.dump());
    }

    /// Result of the last run.
    pub fn content<T: Pod>(&self, output: &Output<T>) -> Vec<T> {
        let mut data = self.runtime.download(&output.memory).expect("a result");
        data.truncate(output.len);
        data
    }
}

impl<T> Output<T> {
    /// The memory, longer by the guard than asked for.
    pub fn memory(&self) -> &Persistent<T> {
        &self.memory
    }
}

impl<T: Pod> Poisoned for Output<T> {
    fn poison(&self, runtime: &Runtime) {
        let bytes = vec![POISON; self.memory.bytes() as usize];
        runtime.overwrite(&self.memory, &bytemuck::pod_collect_to_vec::<u8, T>(&bytes)).expect("poison");
    }

    fn bytes(&self, runtime: &Runtime) -> Vec<u8> {
        let data = runtime.download(&self.memory).expect("a result");
        let guard: &[u8] = bytemuck::cast_slice(&data[self.len..]);
        assert!(guard.iter().all(|&byte| byte == POISON), "a kernel wrote behind its output of {} items", self.len);
        bytemuck::cast_slice(&data[..self.len]).to_vec()
    }
}

/// Whether both classes of device get the same commands.
pub fn same_commands(declare: impl Fn(&mut Graph)) -> bool {
    let [cpu, gpu] = [DeviceClass::Cpu, DeviceClass::Gpu].map(|class| plan(class, &declare));
    commands(&cpu) == commands(&gpu)
}

fn plan(class: DeviceClass, declare: impl Fn(&mut Graph)) -> Plan {
    let mut graph = Graph::new().with_device_class(class);
    declare(&mut graph);
    graph.plan().expect("a plan")
}

/// All that a plan tells a device: its text, the push constants, what the host writes before a run.
fn commands(plan: &Plan) -> (String, Vec<&[u8]>) {
    let params = plan.passes.iter().flat_map(|pass| match &pass.operation {
        Operation::Dispatch { params, .. } => vec![&params[..]],
        Operation::Windows { windows, .. } => windows.iter().map(|window| &window.params[..]).collect(),
        Operation::Raster(spec) => spec.draws.iter().flat_map(|draw| &draw.stages).map(|s| &s.params[..]).collect(),
        Operation::Fill(_) | Operation::Copy(_) | Operation::Readback(_) => vec![],
    });
    let inputs = plan.buffers.iter().filter_map(|buffer| match &buffer.kind {
        BufferKind::Input(bytes) => Some(&bytes[..]),
        BufferKind::Transient | BufferKind::Persistent(_) => None,
    });
    (plan.dump(), params.chain(inputs).collect())
}

/// Item counts around every boundary: workgroups of 256, tiles of 2048, shares of several tiles.
pub const SIZES: &[usize] = &[0, 1, 255, 256, 257, 2047, 2048, 2049, 65_537, 1_000_003];

/// Adversarial inputs of `n` words: zeros, maxima, equal, sorted, reversed, random.
pub fn patterns(n: usize) -> Vec<(&'static str, Vec<u32>)> {
    let mut random = Random(n as u64 + 1);
    vec![
        ("zeros", vec![0; n]),
        ("maxima", vec![u32::MAX; n]),
        ("equal", vec![0x1234_5678; n]),
        ("sorted", (0..n as u32).map(|i| i * 3).collect()),
        ("reversed", (0..n as u32).rev().map(|i| i << 8).collect()),
        ("random", (0..n).map(|_| random.bits() as u32).collect()),
    ]
}

/// Fails with the first place where two results differ.
pub fn assert_same<T: PartialEq + Debug>(got: &[T], wanted: &[T], what: &str) {
    assert_eq!(got.len(), wanted.len(), "{what}: length");
    if let Some(i) = (0..got.len()).find(|&i| got[i] != wanted[i]) {
        panic!("{what}: item {i} of {} is {:?}, not {:?}", got.len(), got[i], wanted[i]);
    }
}
