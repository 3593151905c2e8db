//! Random graphs: what has to hold for every plan. A reference runs the passes as declared, all of them, on symbolic
//! values (hashes of everything that went into them); the plan runs on simulated memory, with what it keeps, where it
//! puts it, and within a phase in both orders. Each check is also shown to fail on a sabotaged plan.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use nephroid::low_level::graph::{Access, Buf, BufferKind, DispatchArgs, Graph, Grid, KernelInfo, Operation, PassInfo};
use nephroid::low_level::graph::{Persistent, Plan};
use proptest::prelude::*;

use crate::support::fake::{Fake, Wires, facts, index};

static RANDOM: KernelInfo = facts("random");

/// Persistent buffers come first, then transients, then the dispatch arguments.
const PERSISTENTS: usize = 3;
const TRANSIENTS: usize = 7;

/// Raw material of one pass: kind and choices.
type Seed = (u8, [u8; 4]);

/// A graph and, for the reference, its passes.
struct Declared {
    graph: Graph,
    /// All passes in order.
    passes: Vec<Pass>,
    kept: Vec<u32>,
}

/// What the reference knows of a pass.
#[derive(Clone, Debug, PartialEq)]
struct Pass {
    action: Action,
    reads: Vec<u32>,
    writes: Vec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Hash)]
enum Action {
    /// A kernel with this push constant.
    Kernel(u32),
    Fill(u32),
    Copy,
    Readback,
}

impl Pass {
    fn of(pass: &PassInfo) -> Self {
        let buffers = |access| pass.uses.iter().filter(|u| u.access == access).map(|u| u.buffer).collect();
        let action = match &pass.operation {
            Operation::Dispatch { params, .. } => Action::Kernel(bytemuck::pod_read_unaligned(params)),
            Operation::Fill(word) => Action::Fill(*word),
            Operation::Copy(_) => Action::Copy,
            Operation::Readback(_) => Action::Readback,
            Operation::Windows { .. } | Operation::Raster(_) => panic!("no windows or draws are declared here"),
        };
        Self { action, reads: buffers(Access::Read), writes: buffers(Access::Write) }
    }

    fn touches(&self) -> impl Iterator<Item = u32> {
        self.reads.iter().chain(&self.writes).copied()
    }
}

/// Turns random bytes into a graph without mistakes.
fn declare(seeds: &[Seed], sizes: &[u32], kept_mask: u8) -> Declared {
    let mut graph = Graph::new();
    let outside: Vec<_> = (0..PERSISTENTS).map(|_| Persistent::<u32>::detached("outside", 100)).collect();
    let mut bufs: Vec<Buf<u32>> = outside.iter().map(|memory| graph.import(memory)).collect();
    bufs.extend((0..TRANSIENTS).map(|i| graph.buffer("transient", sizes[i % sizes.len()])));
    let mut args = graph.buffer::<DispatchArgs>("args", 1);
    let mut written: Vec<usize> = (0..PERSISTENTS).collect();
    let mut args_written = false;
    let mut passes = Vec::new();
    for (number, &(kind, [a, b, c, d])) in seeds.iter().enumerate() {
        let number = number as u32;
        let pick = |choice: u8| written[choice as usize % written.len()];
        let (from, to) = (pick(a), b as usize % bufs.len());
        let (action, mut reads, mut writes) = match kind % 8 {
            0 => {
                graph.fill(&mut bufs[to], number);
                (Action::Fill(number), vec![], vec![to])
            }
            1 if from != to => {
                let [source, target] = bufs.get_disjoint_mut([from, to]).expect("two buffers");
                graph.copy(source, target);
                (Action::Copy, vec![from], vec![to])
            }
            2 if c < 100 => {
                graph.readback(&bufs[from]);
                (Action::Readback, vec![from], vec![])
            }
            _ => {
                let mut writes = vec![to, d as usize % bufs.len()];
                writes.dedup();
                let reads: Vec<usize> = [from, pick(c)].into_iter().filter(|read| !writes.contains(read)).collect();
                (Action::Kernel(number), reads, writes)
            }
        };
        reads.sort_unstable();
        reads.dedup();
        writes.sort_unstable();
        let ids = |list: &[usize]| list.iter().map(|&i| index(&bufs[i])).collect::<Vec<_>>();
        let mut pass = Pass { action, reads: ids(&reads), writes: ids(&writes) };
        if matches!(action, Action::Kernel(_)) {
            let wires = pass.reads.iter().fold(Wires::new(), |wires, &id| wires.add(id, Access::Read));
            let mut wires = pass.writes.iter().fold(wires, |wires, &id| wires.add(id, Access::Write));
            let mut grid = Grid::Threads(64);
            match kind % 8 {
                3 => {
                    wires = wires.write(&mut args);
                    pass.writes.push(index(&args));
                    args_written = true;
                }
                4 if args_written => {
                    pass.reads.push(index(&args));
                    grid = Grid::Indirect(&args);
                }
                _ => {}
            }
            graph.dispatch(Fake(&RANDOM), grid, number, wires);
        }
        written.extend(&writes);
        passes.push(pass);
    }
    let kept: Vec<u32> = (0..PERSISTENTS).filter(|i| kept_mask >> i & 1 == 1).map(|i| index(&bufs[i])).collect();
    (0..PERSISTENTS).filter(|i| kept_mask >> i & 1 == 1).for_each(|i| graph.keep(&bufs[i]));
    Declared { graph, passes, kept }
}

fn hash(value: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

/// What a run shows to the outside: read-backs in order, then the kept buffers.
type Outcome = Vec<u64>;

/// Runs passes on symbolic values: `load(buffer)` and `store(buffer, value)` are the memory.
trait Memory {
    fn load(&mut self, buffer: u32) -> u64;
    fn store(&mut self, buffer: u32, value: u64);

    fn run(&mut self, pass: &Pass, readbacks: &mut Vec<u64>) {
        // All but a fill may leave parts of what they write as they were, or read it.
        let written = if matches!(pass.action, Action::Fill(_)) { &[][..] } else { &pass.writes };
        let inputs: Vec<u64> = pass.reads.iter().chain(written).map(|&buffer| self.load(buffer)).collect();
        if pass.action == Action::Readback {
            readbacks.push(inputs[0]);
        }
        for &buffer in &pass.writes {
            self.store(buffer, hash((pass.action, &inputs, buffer)));
        }
    }
}

/// Every buffer has memory of its own.
#[derive(Default)]
struct Separate(BTreeMap<u32, u64>);

impl Memory for Separate {
    fn load(&mut self, buffer: u32) -> u64 {
        *self.0.entry(buffer).or_insert_with(|| before(buffer))
    }
    fn store(&mut self, buffer: u32, value: u64) {
        self.0.insert(buffer, value);
    }
}

/// Content of a buffer before the run; transients have none that counts.
fn before(buffer: u32) -> u64 {
    if buffer < PERSISTENTS as u32 { hash(("outside", buffer)) } else { 0 }
}

fn reference(passes: &[Pass], kept: &[u32]) -> Outcome {
    let (mut memory, mut outcome) = (Separate::default(), Vec::new());
    passes.iter().for_each(|pass| memory.run(pass, &mut outcome));
    outcome.extend(kept.iter().map(|&buffer| memory.load(buffer)));
    outcome
}

/// Memory as the plan lays it out, in cells of the alignment: buffer and value last stored there.
struct Placed<'a> {
    plan: &'a Plan,
    cells: BTreeMap<(u32, u64), (u32, u64)>,
    outside: Separate,
    begun: Vec<bool>,
}

impl Placed<'_> {
    fn range(&self, buffer: u32) -> Option<impl Iterator<Item = (u32, u64)> + use<>> {
        let place = self.plan.placement[buffer as usize]?;
        let bytes = self.plan.buffers[buffer as usize].bytes;
        Some((place.offset / 256..(place.offset + bytes).div_ceil(256)).map(move |cell| (place.arena, cell)))
    }
}

impl Memory for Placed<'_> {
    fn load(&mut self, buffer: u32) -> u64 {
        let Some(range) = self.range(buffer) else { return self.outside.load(buffer) };
        if !self.begun[buffer as usize] {
            return before(buffer);
        }
        let content: Vec<_> = range.map(|cell| self.cells.get(&cell).copied()).collect();
        match content[0] {
            Some((owner, value)) if owner == buffer && content.iter().all(|cell| *cell == content[0]) => value,
            _ => hash(("damaged", content)),
        }
    }
    fn store(&mut self, buffer: u32, value: u64) {
        let Some(range) = self.range(buffer) else { return self.outside.store(buffer, value) };
        self.begun[buffer as usize] = true;
        self.cells.extend(range.map(|cell| (cell, (buffer, value))));
    }
}

/// Runs the plan, within each phase in the given or the opposite order.
fn simulate(plan: &Plan, kept: &[u32], reversed: bool) -> Outcome {
    let begun = vec![false; plan.buffers.len()];
    let mut memory = Placed { plan, cells: BTreeMap::new(), outside: Separate::default(), begun };
    let mut outcome = Vec::new();
    for phase in 0..plan.phases() {
        let mut passes: Vec<Pass> =
            (0..plan.passes.len()).filter(|&i| plan.phase[i] == phase).map(|i| Pass::of(&plan.passes[i])).collect();
        let mut readbacks = Vec::new();
        if reversed {
            passes.reverse();
        }
        passes.iter().for_each(|pass| memory.run(pass, &mut readbacks));
        if reversed {
            readbacks.reverse();
        }
        outcome.extend(readbacks);
    }
    outcome.extend(kept.iter().map(|&buffer| memory.load(buffer)));
    outcome
}

type Check = Result<(), String>;

fn check_values(plan: &Plan, passes: &[Pass], kept: &[u32]) -> Check {
    let wanted = reference(passes, kept);
    for reversed in [false, true] {
        if simulate(plan, kept, reversed) != wanted {
            return Err(format!("wrong values, reversed: {reversed}"));
        }
    }
    Ok(())
}

/// Kept and culled passes together are the declared ones, and no kept pass could be left out.
fn check_culling(plan: &Plan, passes: &[Pass], kept: &[u32]) -> Check {
    let (mut stay, mut go) = (plan.passes.iter().map(Pass::of).peekable(), plan.culled.iter().map(Pass::of).peekable());
    for pass in passes {
        let sorted = |other: &Pass| {
            let mut other = other.clone();
            other.reads.sort_unstable();
            other.writes.sort_unstable();
            other
        };
        let pass = sorted(pass);
        if stay.next_if(|next| sorted(next) == pass).is_none() && go.next_if(|next| sorted(next) == pass).is_none() {
            return Err(format!("lost: {pass:?}"));
        }
    }
    let needed: Vec<Pass> = plan.passes.iter().map(Pass::of).collect();
    let wanted = reference(&needed, kept);
    for leave_out in 0..needed.len() {
        let mut fewer = needed.clone();
        let pass = fewer.remove(leave_out);
        if reference(&fewer, kept) == wanted {
            return Err(format!("not needed: {pass:?}"));
        }
    }
    Ok(())
}

/// Every read of a transient follows a kept pass that wrote it.
fn check_reads(plan: &Plan) -> Check {
    let mut written: Vec<bool> = plan.buffers.iter().map(|b| !matches!(b.kind, BufferKind::Transient)).collect();
    for pass in plan.passes.iter().map(Pass::of) {
        if let Some(buffer) = pass.reads.iter().find(|&&buffer| !written[buffer as usize]) {
            return Err(format!("{pass:?} reads {buffer} too early"));
        }
        pass.writes.iter().for_each(|&buffer| written[buffer as usize] = true);
    }
    Ok(())
}

/// Phases count up by one, and no two passes of one conflict.
fn check_phases(plan: &Plan) -> Check {
    let steps = plan.phase.windows(2).all(|pair| pair[1] == pair[0] || pair[1] == pair[0] + 1);
    if !steps || plan.phase.first().is_some_and(|&first| first != 0) || plan.phase.len() != plan.passes.len() {
        return Err(format!("phases {:?}", plan.phase));
    }
    let passes: Vec<Pass> = plan.passes.iter().map(Pass::of).collect();
    for j in 0..passes.len() {
        for i in (0..j).filter(|&i| plan.phase[i] == plan.phase[j]) {
            let (a, b) = (&passes[i], &passes[j]);
            let clash =
                a.writes.iter().any(|&w| b.touches().any(|t| t == w)) || b.writes.iter().any(|w| a.reads.contains(w));
            if clash {
                return Err(format!("{a:?} and {b:?} share phase {}", plan.phase[i]));
            }
        }
    }
    Ok(())
}

/// Transients that live at the same time do not overlap; all lie aligned inside their arenas.
fn check_memory(plan: &Plan) -> Check {
    let mut spans: Vec<(u32, u32, u32)> = Vec::new();
    for buffer in 0..plan.buffers.len() as u32 {
        let phases = (0..plan.passes.len()).filter(|&i| Pass::of(&plan.passes[i]).touches().any(|t| t == buffer));
        let phases: Vec<u32> = phases.map(|i| plan.phase[i]).collect();
        let transient = matches!(plan.buffers[buffer as usize].kind, BufferKind::Transient);
        let place = plan.placement[buffer as usize];
        if place.is_some() != (transient && !phases.is_empty()) {
            return Err(format!("buffer {buffer} is placed at {place:?}"));
        }
        let Some(place) = place else { continue };
        let end = place.offset + plan.buffers[buffer as usize].bytes;
        if end > plan.arenas[place.arena as usize] || place.offset % 256 != 0 {
            return Err(format!("buffer {buffer} at {place:?} of {:?}", plan.arenas));
        }
        spans.push((buffer, phases[0], phases[phases.len() - 1]));
    }
    for (n, &(a, a_first, a_last)) in spans.iter().enumerate() {
        for &(b, b_first, b_last) in &spans[..n] {
            let at = |buffer: u32| {
                let place = plan.placement[buffer as usize].expect("it has a span");
                (place.arena, place.offset, place.offset + plan.buffers[buffer as usize].bytes)
            };
            let ((arena_a, from_a, to_a), (arena_b, from_b, to_b)) = (at(a), at(b));
            let apart = arena_a != arena_b || to_a <= from_b || to_b <= from_a;
            if !apart && a_first <= b_last && b_first <= a_last {
                return Err(format!("buffers {a} and {b} overlap"));
            }
        }
    }
    Ok(())
}

fn check_all(plan: &Plan, passes: &[Pass], kept: &[u32]) -> Check {
    check_reads(plan)?;
    check_phases(plan)?;
    check_memory(plan)?;
    check_culling(plan, passes, kept)?;
    check_values(plan, passes, kept)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn every_plan_is_sound(
        seeds in proptest::collection::vec(any::<Seed>(), 0..40),
        sizes in proptest::collection::vec(1u32..2000, 1..8),
        kept in any::<u8>(),
    ) {
        let declared = declare(&seeds, &sizes, kept);
        let plan = declared.graph.plan().expect("a graph without mistakes");
        prop_assert_eq!(check_all(&plan, &declared.passes, &declared.kept), Ok(()), "{}", plan.dump());
    }
}

/// A chain of kernels with everything in it: transients that share memory, one that lives through, a pass to cull.
fn chain() -> Declared {
    let kernel = |from: u8, to: u8| (7u8, [from, to, from, to]);
    let mut seeds: Vec<Seed> = vec![(0, [0, 3, 0, 0]), kernel(0, 3), (0, [0, 9, 0, 0])];
    // Choices of a source are now [0, 1, 2, 3, 3, 9]; each kernel appends its target.
    for (step, to) in (4..9u8).enumerate() {
        let last_written = if step == 0 { 4 } else { 6 + step as u8 - 1 };
        seeds.push((7, [last_written, to, last_written, to]));
    }
    seeds.extend([(2, [10, 0, 0, 0]), (7, [4, 0, 10, 0])]);
    declare(&seeds, &[500], 1)
}

#[test]
fn the_chain_is_sound_and_rich_enough_to_sabotage() {
    let declared = chain();
    let plan = declared.graph.plan().unwrap();
    assert_eq!(check_all(&plan, &declared.passes, &declared.kept), Ok(()), "{}", plan.dump());
    assert!(!plan.culled.is_empty() && plan.phases() >= 5, "{}", plan.dump());
    assert!(plan.arenas[0] < plan.transient_bytes(), "nothing is aliased:\n{}", plan.dump());
}

/// The chain's plan after `sabotage`, with its passes.
fn sabotaged(sabotage: impl FnOnce(&mut Plan)) -> (Plan, Vec<Pass>, Vec<u32>) {
    let declared = chain();
    let mut plan = declared.graph.plan().unwrap();
    sabotage(&mut plan);
    (plan, declared.passes, declared.kept)
}

#[test]
fn overlapping_transients_are_noticed() {
    let (plan, passes, kept) = sabotaged(|plan| {
        let first = plan.placement.iter().flatten().next().copied();
        plan.placement.iter_mut().filter(|place| place.is_some()).for_each(|place| *place = first);
    });
    assert!(check_memory(&plan).unwrap_err().contains("overlap"));
    assert!(check_values(&plan, &passes, &kept).is_err());
}

#[test]
fn transients_outside_of_their_arena_are_noticed() {
    let (plan, ..) = sabotaged(|plan| plan.arenas[0] -= 256);
    assert!(check_memory(&plan).is_err());
}

#[test]
fn merged_phases_are_noticed() {
    let (plan, passes, kept) =
        sabotaged(|plan| plan.phase.iter_mut().for_each(|phase| *phase = phase.saturating_sub(1)));
    assert!(check_phases(&plan).unwrap_err().contains("share phase"));
    assert!(check_values(&plan, &passes, &kept).is_err());
}

#[test]
fn every_missing_pass_is_noticed() {
    let count = chain().graph.plan().unwrap().passes.len();
    for missing in 0..count {
        let (plan, passes, kept) = sabotaged(|plan| {
            plan.phase.remove(missing);
            let pass = plan.passes.remove(missing);
            plan.culled.push(pass);
        });
        assert!(check_values(&plan, &passes, &kept).is_err(), "pass {missing}:\n{}", plan.dump());
    }
    let (plan, ..) = sabotaged(|plan| {
        plan.passes.remove(2);
        plan.phase.remove(2);
    });
    assert!(check_reads(&plan).is_err(), "{}", plan.dump());
}

#[test]
fn a_needless_pass_is_noticed() {
    let (plan, passes, kept) = sabotaged(|plan| {
        let pass = plan.culled.remove(0);
        plan.passes.insert(0, pass);
        plan.phase.insert(0, 0);
    });
    assert!(check_culling(&plan, &passes, &kept).is_err());
}

#[test]
fn a_lost_pass_is_noticed() {
    let (plan, passes, kept) = sabotaged(|plan| drop(plan.culled.remove(0)));
    assert!(check_culling(&plan, &passes, &kept).unwrap_err().contains("lost"));
}
