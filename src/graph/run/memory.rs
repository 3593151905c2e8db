//! Everything that a recorded plan refers to: arenas of transients, inputs, read-backs, pictures.

use std::any::Any;
use std::sync::Arc;

use super::images::Images;
use super::runtime::device_buffer;
use crate::error::{Error, Result};
use crate::graph::declare::{BufferKind, Operation, PassInfo, Use, WindowSpec};
use crate::graph::plan::Plan;
use crate::vk::{Buffer, BufferSlice, Device, Place, Recorder};

/// Everything a recorded plan refers to.
pub(super) struct Memory {
    pub arenas: Vec<Buffer>,
    /// Device buffer and staging buffer of each input, by buffer index.
    pub inputs: Vec<Option<(Buffer, Buffer)>>,
    persistents: Vec<Option<Arc<dyn Any + Send + Sync>>>,
    pub readbacks: Vec<Buffer>,
    pub images: Images,
}

impl Memory {
    pub fn new(device: &Arc<Device>, plan: &Plan) -> Result<Self> {
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

    pub fn record_inputs(&self, recorder: &mut Recorder) {
        recorder.barrier();
        for (target, staging) in self.inputs.iter().flatten() {
            recorder.copy(staging, 0, target, 0, staging.bytes());
        }
    }

    /// Fills the transients whose life begins in `phase`, if the plan is poisoned.
    pub fn record_poison(&self, recorder: &mut Recorder, plan: &Plan, phase: u32) {
        let Some(word) = plan.poison else { return };
        recorder.barrier();
        for (buffer, lifetime) in plan.lifetime.iter().enumerate() {
            if plan.placement[buffer].is_some() && lifetime.is_some_and(|(first, _)| first == phase) {
                fill(recorder, self.slice(plan, buffer as u32), word);
            }
        }
    }

    /// What the kernel of `pass` sees: whole buffers, but of those bound to the window's bindings only the window.
    pub fn bound(
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

    pub fn slice(&self, plan: &Plan, buffer: u32) -> BufferSlice<'_> {
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

/// Fills in whole words; every buffer of a graph ends on one.
pub(super) fn fill(recorder: &mut Recorder, to: BufferSlice<'_>, word: u32) {
    recorder.fill(to.buffer, to.offset, to.bytes.next_multiple_of(4), word);
}
