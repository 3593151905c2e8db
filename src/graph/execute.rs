//! Running a plan on a device: memory, recording, replay.

use std::any::Any;
use std::marker::PhantomData;
use std::sync::Arc;

use bytemuck::Pod;

use super::declare::{
    BufferKind, GridSpec, Input, KernelInfo, Operation, PassInfo, Persistent, Readback, Use, WindowSpec,
};
use super::execute_raster::{self, Images};
use super::plan::Plan;
use super::trace::Timing;
use crate::error::{Error, MemoryCause, Result};
use crate::vk::{Buffer, BufferSlice, Commands, Device, Pipeline, PipelineDesc, Place, Recorder};

/// Makes persistent memory and executables on one device.
#[derive(Clone)]
pub struct Runtime {
    pub(super) device: Arc<Device>,
}

/// A plan recorded for one device; runs any number of times.
pub struct Executable {
    device: Arc<Device>,
    commands: Commands,
    memory: Memory,
}

/// Everything a recorded plan refers to.
pub(super) struct Memory {
    arenas: Vec<Buffer>,
    /// Device buffer and staging buffer of each input, by buffer index.
    inputs: Vec<Option<(Buffer, Buffer)>>,
    persistents: Vec<Option<Arc<dyn Any + Send + Sync>>>,
    readbacks: Vec<Buffer>,
    pub(super) images: Images,
}

impl Runtime {
    /// A runtime on `device`.
    pub fn new(device: Arc<Device>) -> Self {
        Self { device }
    }

    /// The device.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Zeroed memory of `len` elements that outlives plans.
    pub fn persistent<T: Pod>(&self, name: &'static str, len: u32) -> Result<Persistent<T>> {
        let bytes = (u64::from(len) * size_of::<T>() as u64).max(16);
        let buffer = self.device.buffer(name, bytes.next_multiple_of(4), Place::Device)?;
        let mut recorder = self.device.recorder("clear")?;
        recorder.fill(&buffer, 0, bytes.next_multiple_of(4), 0);
        recorder.finish()?.submit()?.wait()?;
        Ok(Persistent { name, len, store: Arc::new(buffer), element: PhantomData })
    }

    /// Persistent memory with a first content.
    pub fn persistent_from<T: Pod>(&self, name: &'static str, data: &[T]) -> Result<Persistent<T>> {
        let len = u32::try_from(data.len()).map_err(|_| Error::OutOfMemory {
            object: name.into(),
            bytes: std::mem::size_of_val(data) as u64,
            cause: MemoryCause::TooManyElements,
        })?;
        let persistent = self.persistent(name, len)?;
        self.overwrite(&persistent, data)?;
        Ok(persistent)
    }

    /// Replaces the content of persistent memory from its start.
    pub fn overwrite<T: Pod>(&self, persistent: &Persistent<T>, data: &[T]) -> Result<()> {
        assert!(data.len() <= persistent.len as usize, "'{}' is shorter than the data", persistent.name);
        const CHUNK: usize = 64 << 20;
        let target = device_buffer(&persistent.store);
        let bytes: &[u8] = bytemuck::cast_slice(data);
        for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
            let staging = self.device.buffer("staging", chunk.len().max(16) as u64, Place::Upload)?;
            staging.write(0, chunk);
            let mut recorder = self.device.recorder("upload")?;
            recorder.copy(&staging, 0, target, (index * CHUNK) as u64, chunk.len() as u64);
            recorder.finish()?.submit()?.wait()?;
        }
        Ok(())
    }

    /// Content of persistent memory.
    pub fn download<T: Pod>(&self, persistent: &Persistent<T>) -> Result<Vec<T>> {
        let mut data = vec![T::zeroed(); persistent.len as usize];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut data);
        const CHUNK: usize = 64 << 20;
        for (index, chunk) in bytes.chunks_mut(CHUNK).enumerate() {
            let staging = self.device.buffer("staging", chunk.len().max(16) as u64, Place::Readback)?;
            let mut recorder = self.device.recorder("download")?;
            let source = device_buffer(&persistent.store);
            recorder.copy(source, (index * CHUNK) as u64, &staging, 0, chunk.len() as u64);
            recorder.finish()?.submit()?.wait()?;
            staging.read(0, chunk);
        }
        Ok(data)
    }

    /// Allocates the plan's memory and records its commands.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if a buffer is longer than this device can bind (found before anything is allocated) or
    /// memory runs out; errors of the device.
    pub fn prepare(&self, plan: &Plan) -> Result<Executable> {
        check_ranges(plan, self.device.info().limits.storage_range)?;
        execute_raster::check(&self.device, plan)?;
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

/// Refuses a plan whose kernels need more of a buffer at once than one binding can show.
fn check_ranges(plan: &Plan, longest: u64) -> Result<()> {
    for pass in &plan.passes {
        let (kernel, windowed) = match &pass.operation {
            Operation::Dispatch { kernel, .. } => (kernel, [].as_slice()),
            Operation::Windows { kernel, bindings, .. } => (kernel, bindings.as_slice()),
            _ => continue,
        };
        for usage in pass.uses.iter().filter(|u| u.binding != Use::NO_BINDING && !windowed.contains(&u.binding)) {
            check_range(plan, usage.buffer, kernel.name, longest)?;
        }
    }
    Ok(())
}

/// Refuses to show `kernel` more than `longest` bytes of a buffer.
pub(super) fn check_range(plan: &Plan, buffer: u32, kernel: &str, longest: u64) -> Result<()> {
    let info = &plan.buffers[buffer as usize];
    if info.bytes <= longest {
        return Ok(());
    }
    Err(Error::OutOfMemory {
        object: format!("{} in {kernel}", info.name),
        bytes: info.bytes,
        cause: MemoryCause::BindingTooLong { longest },
    })
}

fn dispatch(recorder: &mut Recorder, [x, y]: [u32; 2]) {
    if x > 0 && y > 0 {
        recorder.dispatch([x, y, 1]);
    }
}

/// Fills in whole words; every buffer of a graph ends on one.
fn fill(recorder: &mut Recorder, to: BufferSlice<'_>, word: u32) {
    recorder.fill(to.buffer, to.offset, to.bytes.next_multiple_of(4), word);
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

fn device_buffer(store: &Arc<dyn Any + Send + Sync>) -> &Buffer {
    store.downcast_ref::<Buffer>().expect("persistent memory was made by a runtime")
}

impl Memory {
    fn new(device: &Arc<Device>, plan: &Plan) -> Result<Self> {
        let arenas = (0..plan.arenas.len()).map(|arena| make_arena(device, plan, arena)).collect::<Result<_>>()?;
        let mut memory =
            Self { arenas, inputs: vec![], persistents: vec![], readbacks: vec![], images: Images::new(device, plan)? };
        for (info, lifetime) in plan.buffers.iter().zip(&plan.lifetime) {
            let (mut input, mut persistent) = (None, None);
            match &info.kind {
                BufferKind::Input(content) if lifetime.is_some() => {
                    let bytes = content.len() as u64;
                    let staging = device.buffer(info.name, bytes, Place::Upload)?;
                    staging.write(0, content);
                    input = Some((device.buffer(info.name, bytes, Place::Device)?, staging));
                }
                BufferKind::Persistent(store) => persistent = Some(store.clone()),
                _ => {}
            }
            memory.inputs.push(input);
            memory.persistents.push(persistent);
        }
        let readbacks = plan.passes.iter().filter(|p| matches!(p.operation, Operation::Readback(_)));
        for pass in readbacks {
            let info = &plan.buffers[pass.uses[0].buffer as usize];
            memory.readbacks.push(device.buffer(info.name, info.bytes, Place::Readback)?);
        }
        Ok(memory)
    }

    fn record_inputs(&self, recorder: &mut Recorder) {
        recorder.barrier();
        for (target, staging) in self.inputs.iter().flatten() {
            recorder.copy(staging, 0, target, 0, staging.bytes());
        }
    }

    /// Fills the transients whose life begins in `phase`, if the plan is poisoned.
    fn record_poison(&self, recorder: &mut Recorder, plan: &Plan, phase: u32) {
        let Some(word) = plan.poison else { return };
        recorder.barrier();
        for (buffer, lifetime) in plan.lifetime.iter().enumerate() {
            if plan.placement[buffer].is_some() && lifetime.is_some_and(|(first, _)| first == phase) {
                fill(recorder, self.slice(plan, buffer as u32), word);
            }
        }
    }

    /// What the kernel of `pass` sees: whole buffers, but of those bound to the window's bindings only the window.
    fn bound(
        &self,
        plan: &Plan,
        pass: &PassInfo,
        window: Option<(&[u32], &WindowSpec)>,
    ) -> Vec<(u32, BufferSlice<'_>)> {
        let bound = pass.uses.iter().filter(|u| u.binding != Use::NO_BINDING).map(|usage| {
            let mut slice = self.slice(plan, usage.buffer);
            if let Some((_, window)) = window.filter(|(bindings, _)| bindings.contains(&usage.binding)) {
                let stride = plan.buffers[usage.buffer as usize].stride;
                slice.offset += u64::from(window.first) * stride;
                slice.bytes = u64::from(window.count) * stride;
            }
            (usage.binding, slice)
        });
        bound.collect()
    }

    pub(super) fn slice(&self, plan: &Plan, buffer: u32) -> BufferSlice<'_> {
        let index = buffer as usize;
        let bytes = plan.buffers[index].bytes;
        if let Some(place) = plan.placement[index] {
            return BufferSlice { buffer: &self.arenas[place.arena as usize], offset: place.offset, bytes };
        }
        let buffer = match (&self.inputs[index], &self.persistents[index]) {
            (Some((target, _)), _) => target,
            (_, Some(store)) => device_buffer(store),
            _ => unreachable!("a used buffer has memory: '{}'", plan.buffers[index].name),
        };
        BufferSlice { buffer, offset: 0, bytes }
    }
}

/// Memory of one arena; where it does not fit, the largest transient in it is what the user may be able to reduce.
fn make_arena(device: &Arc<Device>, plan: &Plan, arena: usize) -> Result<Buffer> {
    device.buffer("arena", plan.arenas[arena], Place::Device).map_err(|error| {
        let inside = plan.buffers.iter().zip(&plan.placement);
        let inside = inside.filter(|(_, place)| place.is_some_and(|place| place.arena as usize == arena));
        let largest = inside.max_by_key(|(info, _)| info.bytes).map_or("none", |(info, _)| info.name);
        match error {
            Error::OutOfMemory { bytes, cause, .. } => {
                Error::OutOfMemory { object: format!("transient memory, mostly {largest}"), bytes, cause }
            }
            other => other,
        }
    })
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
