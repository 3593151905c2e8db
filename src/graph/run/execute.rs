//! Running a plan on a device: recording and replay.

use std::sync::Arc;

use bytemuck::Pod;

use super::check::check;
use super::memory::{Memory, fill};
use super::runtime::Runtime;
use crate::error::Result;
use crate::graph::declare::{GridSpec, Input, KernelInfo, Operation, PassInfo, Readback, Use};
use crate::graph::plan::Plan;
use crate::graph::trace::Timing;
use crate::vk::{Buffer, Commands, Device, Pipeline, PipelineDesc, Recorder};

/// A plan recorded for one device; runs any number of times.
pub struct Executable {
    device: Arc<Device>,
    commands: Commands,
    memory: Memory,
}

impl Runtime {
    /// Allocates the plan's memory and records its commands.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::error::Error::OutOfMemory) if a buffer is longer than this device can bind (found
    /// before anything is allocated) or
    /// memory runs out; errors of the device.
    pub fn prepare(&self, plan: &Plan) -> Result<Executable> {
        check(&self.device, plan)?;
        let memory = Memory::new(&self.device, plan)?;
        self.warm_up(plan, &memory)?;
        let mut recorder = self.device.recorder("plan")?;
        memory.record_inputs(&mut recorder);
        let mut open: Vec<u32> = Vec::new();
        for (index, pass) in plan.passes.iter().enumerate() {
            let phase = plan.phase[index];
            if index == 0 || plan.phase[index - 1] != phase {
                memory.record_poison(&mut recorder, plan, phase);
                if !plan.sabotaged.contains(&phase) {
                    recorder.barrier();
                }
            }
            change_scopes(&mut recorder, plan, &mut open, &pass.scopes);
            self.record(&mut recorder, plan, &memory, pass)?;
        }
        change_scopes(&mut recorder, plan, &mut open, &[]);
        recorder.barrier();
        Ok(Executable { device: self.device.clone(), commands: recorder.finish()?, memory })
    }

    fn record(&self, recorder: &mut Recorder, plan: &Plan, memory: &Memory, pass: &PassInfo) -> Result<()> {
        let slice = |usage: &Use| memory.slice(plan, usage.buffer);
        match &pass.operation {
            Operation::Dispatch { kernel, constants, params, grid } => {
                let bound = memory.bound(plan, pass, None);
                recorder.bind(&self.pipeline(kernel, constants)?, &bound, params)?;
                match grid {
                    GridSpec::Groups(groups) => dispatch(recorder, *groups),
                    GridSpec::Indirect(buffer) => {
                        let args = memory.slice(plan, *buffer);
                        recorder.dispatch_indirect(args.buffer, args.offset);
                    }
                }
            }
            Operation::Windows { kernel, constants, bindings, windows } => {
                let pipeline = self.pipeline(kernel, constants)?;
                for window in windows {
                    let bound = memory.bound(plan, pass, Some((bindings, window)));
                    recorder.bind(&pipeline, &bound, &window.params)?;
                    dispatch(recorder, window.groups);
                }
            }
            Operation::Raster(spec) => self.record_raster(recorder, plan, memory, spec)?,
            Operation::Fill(word) => fill(recorder, slice(&pass.uses[0]), *word),
            Operation::Copy(bytes) => {
                let (from, to) = (slice(&pass.uses[0]), slice(&pass.uses[1]));
                recorder.copy(from.buffer, from.offset, to.buffer, to.offset, *bytes);
            }
            Operation::Readback(index) => {
                let from = slice(&pass.uses[0]);
                recorder.copy(from.buffer, from.offset, &memory.readbacks[*index as usize], 0, from.bytes);
            }
        }
        Ok(())
    }

    /// Has the driver compile every kernel now: software drivers do so at the first dispatch, even an empty one, and
    /// that time would otherwise be the first run's. Draws are left out: an empty one saves the first run nothing.
    fn warm_up(&self, plan: &Plan, memory: &Memory) -> Result<()> {
        let mut recorder = self.device.recorder("warm-up")?;
        let mut seen: Vec<*const Pipeline> = Vec::new();
        for pass in &plan.passes {
            let (kernel, constants, params, window) = match &pass.operation {
                Operation::Dispatch { kernel, constants, params, .. } => (kernel, constants, params, None),
                Operation::Windows { kernel, constants, bindings, windows } => {
                    (kernel, constants, &windows[0].params, Some((bindings.as_slice(), &windows[0])))
                }
                _ => continue,
            };
            let pipeline = self.pipeline(kernel, constants)?;
            if seen.contains(&Arc::as_ptr(&pipeline)) {
                continue;
            }
            seen.push(Arc::as_ptr(&pipeline));
            recorder.bind(&pipeline, &memory.bound(plan, pass, window), params)?;
            // An empty dispatch touches nothing, but validation counts its bindings as accesses.
            recorder.barrier();
            recorder.dispatch([0, 1, 1]);
        }
        recorder.finish()?.submit()?.wait()
    }

    fn pipeline(&self, kernel: &KernelInfo, constants: &[(u32, u32)]) -> Result<Arc<Pipeline>> {
        self.device.pipeline(&PipelineDesc {
            name: kernel.name,
            spirv: bytemuck::cast_slice(kernel.spirv.0),
            bindings: kernel.bindings,
            push_bytes: kernel.push_bytes,
            constants,
        })
    }
}

fn dispatch(recorder: &mut Recorder, [x, y]: [u32; 2]) {
    if x > 0 && y > 0 {
        recorder.dispatch([x, y, 1]);
    }
}

/// Closes and opens scopes until exactly `wanted` are open.
fn change_scopes(recorder: &mut Recorder, plan: &Plan, open: &mut Vec<u32>, wanted: &[u32]) {
    let common = open.iter().zip(wanted).take_while(|(a, b)| a == b).count();
    while open.len() > common {
        recorder.end_scope();
        open.pop();
    }
    for &scope in &wanted[common..] {
        recorder.begin_scope(plan.scope_names[scope as usize]);
        open.push(scope);
    }
}

impl Executable {
    /// Sets an input for the following runs.
    pub fn write<T: Pod>(&mut self, input: &Input<T>, data: &[T]) {
        assert_eq!(data.len(), input.len as usize, "an input keeps its length");
        // Without staging, every pass that read the input was culled.
        if let Some((_, staging)) = &self.memory.inputs[input.id as usize] {
            staging.write(0, bytemuck::cast_slice(data));
        }
    }

    /// Runs the plan once and waits for it.
    pub fn run(&mut self) -> Result<()> {
        self.commands.submit()?.wait()?;
        self.device.check_validation()
    }

    /// What the last run brought to the host.
    pub fn read<T: Pod>(&self, readback: &Readback<T>) -> Vec<T> {
        let mut data = vec![T::zeroed(); readback.len as usize];
        self.memory.readbacks[readback.index as usize].read(0, bytemuck::cast_slice_mut(&mut data));
        data
    }

    /// Times of the scopes of the last run, in order of their start.
    pub fn timings(&self) -> Vec<Timing> {
        let convert =
            |t: crate::vk::ScopeTiming| Timing { name: t.name, depth: t.depth, start_ns: t.start_ns, end_ns: t.end_ns };
        self.commands.timings().into_iter().map(convert).collect()
    }

    /// Device bytes held by this executable: arenas, inputs, pictures.
    pub fn device_bytes(&self) -> u64 {
        let inputs = self.memory.inputs.iter().flatten().map(|(target, _)| target.bytes());
        self.memory.arenas.iter().map(Buffer::bytes).sum::<u64>() + inputs.sum::<u64>() + self.memory.images.bytes()
    }
}
