//! Recording commands.

use super::buffer::{Buffer, BufferSlice, SLACK};
use super::call::failed;
use super::commands::{CommandState, Commands, MARKED_SCOPES, QUERY_CHUNK, Scope, create_query_pool};
use super::core::{Core, Sync2};
use super::limits::DeviceKind;
use super::memory::Place;
use super::pipeline::Pipeline;
use crate::error::{Error, MemoryCause, Result};
use ash::vk;
use ash::vk::Handle;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// Sets of one descriptor pool.
const SETS_PER_POOL: u32 = 64;
/// Bindings that a pool has per set on average; a set with more still fits while others have fewer.
const BINDINGS_PER_SET: u32 = 12;

pub(super) const TRANSFER: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::ALL_TRANSFER;
const HOST: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::HOST;
const INDIRECT: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::DRAW_INDIRECT;

/// A command buffer being recorded. What it records is not seen by the device before [`Recorder::finish`].
pub struct Recorder {
    pub(super) state: CommandState,
    /// Indices of the open scopes.
    open: Vec<usize>,
    /// Push-constant and binding state is complete.
    pub(super) bound: Option<Arc<Pipeline>>,
    /// Size of the picture that is being drawn.
    pub(super) drawing: Option<[u32; 2]>,
    /// The first failure of a call that cannot report it; [`Recorder::finish`] does.
    failure: Option<Error>,
}

impl Recorder {
    pub(super) fn new(core: &Arc<Core>, name: &str) -> Result<Self> {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(core.queue_family);
        // SAFETY: the family is one of the device's (VUID-vkCreateCommandPool-queueFamilyIndex-01937).
        let pool = unsafe { core.raw.create_command_pool(&info, None) }.map_err(failed("vkCreateCommandPool", name))?;
        let state = CommandState {
            core: Arc::clone(core),
            name: name.to_owned(),
            pool,
            commands: vk::CommandBuffer::null(),
            descriptor_pools: Vec::new(),
            query_pools: Vec::new(),
            scopes: Vec::new(),
            markers: None,
            buffers: BTreeMap::new(),
            images: BTreeMap::new(),
            pipelines: BTreeMap::new(),
            last: AtomicU64::new(0),
        };
        let mut recorder = Self { state, open: Vec::new(), bound: None, drawing: None, failure: None };
        recorder.begin()?;
        Ok(recorder)
    }

    fn begin(&mut self) -> Result<()> {
        let core = Arc::clone(&self.state.core);
        let name = self.state.name.clone();
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.state.pool).command_buffer_count(1);
        // SAFETY: the pool is new and used by this thread only.
        let list = unsafe { core.raw.allocate_command_buffers(&info) };
        self.state.commands = list.map_err(failed("vkAllocateCommandBuffers", &name))?[0];
        core.set_name(self.state.commands, &name);
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::SIMULTANEOUS_USE);
        // SAFETY: the command buffer is in the initial state (VUID-vkBeginCommandBuffer-commandBuffer-00049).
        unsafe { core.raw.begin_command_buffer(self.state.commands, &info) }
            .map_err(failed("vkBeginCommandBuffer", &name))?;
        core.begin_label(self.state.commands, &name);
        // Runs of a device follow each other: this one starts when what was submitted before has finished.
        self.barrier();
        if core.markers {
            let markers = Buffer::new(&core, "crash_markers", 4 * MARKED_SCOPES as u64, Place::Readback)?;
            self.fill(&markers, 0, markers.bytes(), 0);
            self.barrier();
            self.state.markers = Some(markers);
        }
        Ok(())
    }

    /// Opens a scope: a label for debuggers, an entry of [`Commands::timings`] and a crash marker at once.
    pub fn begin_scope(&mut self, name: &str) {
        let state = &mut self.state;
        state.core.begin_label(state.commands, name);
        state.scopes.push(Scope { name: name.to_owned(), depth: self.open.len() as u32 });
        self.open.push(self.state.scopes.len() - 1);
        self.timestamp(2 * (self.state.scopes.len() as u32 - 1));
    }

    /// Closes the scope opened last.
    ///
    /// # Panics
    /// Without an open scope.
    pub fn end_scope(&mut self) {
        let scope = self.open.pop().expect("end_scope without begin_scope");
        self.timestamp(2 * scope as u32 + 1);
        self.mark(scope);
        self.state.core.end_label(self.state.commands);
    }

    /// Writes the time at which everything recorded so far has finished.
    fn timestamp(&mut self, query: u32) {
        if !self.state.core.info.features.timestamps || self.failure.is_some() {
            return;
        }
        let (pool, index) = ((query / QUERY_CHUNK) as usize, query % QUERY_CHUNK);
        while self.state.query_pools.len() <= pool {
            match create_query_pool(&self.state.core, &self.state.name) {
                Ok(made) => self.add_query_pool(made),
                Err(error) => return self.failure = Some(error),
            }
        }
        let (core, commands, pool) = (&self.state.core, self.state.commands, self.state.query_pools[pool]);
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        // SAFETY: the queue has timestamps (VUID-vkCmdWriteTimestamp2-timestampValidBits-03863); the query is reset
        // when its pool is added and written once per run.
        unsafe {
            match &core.sync2 {
                Sync2::Promoted => core.raw.cmd_write_timestamp2(commands, stage, pool, index),
                Sync2::Extension(fns) => fns.cmd_write_timestamp2(commands, stage, pool, index),
            }
        }
        if core.info.kind == DeviceKind::Software {
            // Once anything was drawn, lavapipe takes a time only when it next has to finish its drawing, which may be
            // after the work that follows. A dependency on nothing makes it finish now, and orders nothing.
            self.depend(&vk::DependencyInfo::default());
        }
    }

    /// Adopts a pool of queries, which every run resets here before it writes them.
    fn add_query_pool(&mut self, pool: vk::QueryPool) {
        // SAFETY: recording, outside of render passes; all queries of a pool of this device
        // (VUID-vkCmdWriteTimestamp2-None-03864).
        unsafe { self.state.core.raw.cmd_reset_query_pool(self.state.commands, pool, 0, QUERY_CHUNK) };
        self.state.query_pools.push(pool);
    }

    /// Marks scope `index` as finished once it is. Orders only the marker after the scope, nothing else after
    /// anything: a barrier missing between passes stays missing.
    fn mark(&mut self, index: usize) {
        let Some(markers) = self.state.markers.as_ref().filter(|_| index < MARKED_SCOPES) else { return };
        let raw = markers.inner.raw;
        self.memory_barrier(
            (self.kernels() | TRANSFER, vk::AccessFlags2::NONE),
            (vk::PipelineStageFlags2::CLEAR, vk::AccessFlags2::NONE),
        );
        // SAFETY: as in `fill`; the word lies inside the buffer, which the state keeps.
        unsafe { self.state.core.raw.cmd_fill_buffer(self.state.commands, raw, 4 * index as u64, 4, 1) };
    }

    /// Chooses the kernel of the following dispatches, what its bindings refer to, and its push constants.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if a slice is longer than a binding can be, [`Error::Vulkan`] if descriptors run out.
    ///
    /// # Panics
    /// If `slices` does not name exactly the pipeline's bindings, a slice leaves its buffer or is misaligned, or `push`
    /// has another length than the pipeline's push constants.
    pub fn bind(&mut self, pipeline: &Arc<Pipeline>, slices: &[(u32, BufferSlice<'_>)], push: &[u8]) -> Result<()> {
        let name = pipeline.name();
        assert_eq!(push.len(), pipeline.push_bytes as usize, "push constants of '{name}'");
        self.check_slices(pipeline, slices)?;
        let set = self.descriptor_set(pipeline)?;
        self.write_set(set, slices);
        let state = &mut self.state;
        for (_, slice) in slices {
            state.keep(slice.buffer);
        }
        state.pipelines.insert(pipeline.raw.as_raw(), Arc::clone(pipeline));
        let (device, commands) = (&state.core.raw, state.commands);
        let point = pipeline.point();
        // SAFETY: recording; pipeline, layout and set belong to each other
        // (VUID-vkCmdBindDescriptorSets-pDescriptorSets-00358), the push range is the layout's
        // (VUID-vkCmdPushConstants-offset-01795); all are kept until the commands are freed.
        unsafe {
            device.cmd_bind_pipeline(commands, point, pipeline.raw);
            device.cmd_bind_descriptor_sets(commands, point, pipeline.layout, 0, &[set], &[]);
            if !push.is_empty() {
                device.cmd_push_constants(commands, pipeline.layout, pipeline.stages, 0, push);
            }
        }
        self.bound = Some(Arc::clone(pipeline));
        Ok(())
    }

    fn check_slices(&self, pipeline: &Pipeline, slices: &[(u32, BufferSlice<'_>)]) -> Result<()> {
        let name = pipeline.name();
        let limits = &self.state.core.info.limits;
        assert_eq!(slices.len(), pipeline.bindings.len(), "'{name}' binds {:?}", pipeline.bindings);
        for binding in &pipeline.bindings {
            assert!(slices.iter().any(|(number, _)| number == binding), "'{name}' needs binding {binding}");
        }
        for (binding, slice) in slices {
            let (buffer, offset, bytes) = (slice.buffer.name(), slice.offset, slice.bytes);
            let end = offset.checked_add(bytes);
            let fits = end.is_some_and(|end| end <= slice.buffer.bytes());
            assert!(fits, "binding {binding} of '{name}': {bytes} bytes from {offset} leave '{buffer}'");
            let aligned = offset.is_multiple_of(limits.storage_alignment);
            assert!(aligned, "binding {binding} of '{name}': offset {offset} in '{buffer}' is not aligned");
            if bytes > limits.storage_range {
                let cause = MemoryCause::BindingTooLong { longest: limits.storage_range };
                return Err(Error::OutOfMemory { object: format!("{buffer} in {name}"), bytes, cause });
            }
        }
        Ok(())
    }

    /// A descriptor set for `pipeline`, from the newest pool or a new one.
    fn descriptor_set(&mut self, pipeline: &Pipeline) -> Result<vk::DescriptorSet> {
        let state = &mut self.state;
        let layouts = [pipeline.set_layout];
        if let Some(&pool) = state.descriptor_pools.last() {
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
            // SAFETY: the pool is used by this recorder only; an exhausted one reports an error (Vulkan 1.1).
            match unsafe { state.core.raw.allocate_descriptor_sets(&info) } {
                Ok(sets) => return Ok(sets[0]),
                Err(vk::Result::ERROR_OUT_OF_POOL_MEMORY | vk::Result::ERROR_FRAGMENTED_POOL) => {}
                Err(code) => return Err(failed("vkAllocateDescriptorSets", pipeline.name())(code)),
            }
        }
        let bindings = (pipeline.bindings.len() as u32).max(BINDINGS_PER_SET) * SETS_PER_POOL;
        let size = vk::DescriptorPoolSize::default().ty(vk::DescriptorType::STORAGE_BUFFER).descriptor_count(bindings);
        let sizes = [size];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(SETS_PER_POOL).pool_sizes(&sizes);
        // SAFETY: both counts are above zero (VUID-VkDescriptorPoolSize-descriptorCount-00302).
        let pool = unsafe { state.core.raw.create_descriptor_pool(&info, None) }
            .map_err(failed("vkCreateDescriptorPool", &state.name))?;
        state.descriptor_pools.push(pool);
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: as above.
        let sets = unsafe { state.core.raw.allocate_descriptor_sets(&info) };
        sets.map(|sets| sets[0]).map_err(failed("vkAllocateDescriptorSets", pipeline.name()))
    }

    fn write_set(&self, set: vk::DescriptorSet, slices: &[(u32, BufferSlice<'_>)]) {
        let infos: Vec<_> = slices.iter().map(|(_, slice)| [descriptor(slice)]).collect();
        let writes: Vec<_> = slices
            .iter()
            .zip(&infos)
            .map(|((binding, _), info)| {
                vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(*binding)
                    .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                    .buffer_info(info)
            })
            .collect();
        // SAFETY: the set is new and not bound yet (VUID-vkUpdateDescriptorSets-None-03047); ranges were checked
        // against buffer, alignment and maxStorageBufferRange (VUID-VkWriteDescriptorSet-descriptorType-00328, -00333).
        unsafe { self.state.core.raw.update_descriptor_sets(&writes, &[]) };
    }

    /// Runs the bound kernel on `groups` workgroups; none if any of the counts is 0.
    ///
    /// # Panics
    /// Without a bound kernel or with more groups than [`super::Limits::groups`].
    pub fn dispatch(&mut self, groups: [u32; 3]) {
        let pipeline = self.bound.as_ref().expect("dispatch without bind");
        assert!(!pipeline.draws(), "'{}' is no compute kernel", pipeline.name());
        let most = self.state.core.info.limits.groups;
        let fits = groups.iter().zip(&most).all(|(count, most)| count <= most);
        assert!(fits, "'{}' on {groups:?} workgroups, the device has {most:?}", pipeline.name());
        // SAFETY: recording; a pipeline with all its sets and push constants is bound (VUID-vkCmdDispatch-None-08600,
        // -08601), counts are within limits (VUID-vkCmdDispatch-groupCountX-00386).
        unsafe { self.state.core.raw.cmd_dispatch(self.state.commands, groups[0], groups[1], groups[2]) };
    }

    /// Runs the bound kernel on as many workgroups as three u32 at byte `offset` of `arguments` say when it starts.
    ///
    /// # Panics
    /// Without a bound kernel, or if the arguments leave the buffer or are not 4-byte aligned.
    pub fn dispatch_indirect(&mut self, arguments: &Buffer, offset: u64) {
        let pipeline = self.bound.as_ref().expect("dispatch_indirect without bind");
        assert!(!pipeline.draws(), "'{}' is no compute kernel", pipeline.name());
        let fits = offset.is_multiple_of(4) && offset.checked_add(12).is_some_and(|end| end <= arguments.bytes());
        assert!(fits, "arguments of '{}' at {offset} of '{}'", pipeline.name(), arguments.name());
        self.state.keep(arguments);
        // SAFETY: as in `dispatch`; the buffer has INDIRECT usage (VUID-vkCmdDispatchIndirect-buffer-02709) and holds
        // the three words. The counts themselves are the writing kernel's duty (VkDispatchIndirectCommand).
        unsafe { self.state.core.raw.cmd_dispatch_indirect(self.state.commands, arguments.inner.raw, offset) };
    }

    /// Everything recorded so far happens before everything that follows, and is visible to it.
    pub fn barrier(&mut self) {
        let write = vk::AccessFlags2::SHADER_WRITE | vk::AccessFlags2::TRANSFER_WRITE | vk::AccessFlags2::HOST_WRITE;
        let shader = vk::AccessFlags2::SHADER_READ | vk::AccessFlags2::SHADER_WRITE;
        let transfer = vk::AccessFlags2::TRANSFER_READ | vk::AccessFlags2::TRANSFER_WRITE;
        let kernels = self.kernels();
        // The indirect stage is in the first half as well: its reads must not be overtaken by later writes.
        self.memory_barrier(
            (kernels | TRANSFER | HOST | INDIRECT, write),
            (kernels | TRANSFER | INDIRECT, shader | transfer | vk::AccessFlags2::INDIRECT_COMMAND_READ),
        );
    }

    /// The stages in which kernels run on this queue.
    fn kernels(&self) -> vk::PipelineStageFlags2 {
        let compute = vk::PipelineStageFlags2::COMPUTE_SHADER;
        match self.state.core.info.features.raster {
            true => {
                compute | vk::PipelineStageFlags2::PRE_RASTERIZATION_SHADERS | vk::PipelineStageFlags2::FRAGMENT_SHADER
            }
            false => compute,
        }
    }

    fn memory_barrier(
        &mut self,
        before: (vk::PipelineStageFlags2, vk::AccessFlags2),
        after: (vk::PipelineStageFlags2, vk::AccessFlags2),
    ) {
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(before.0)
            .src_access_mask(before.1)
            .dst_stage_mask(after.0)
            .dst_access_mask(after.1)];
        self.depend(&vk::DependencyInfo::default().memory_barriers(&barriers));
    }

    /// Records a dependency between what comes before and what follows.
    pub(super) fn depend(&mut self, info: &vk::DependencyInfo<'_>) {
        // SAFETY: recording; synchronization2 is enabled (VUID-vkCmdPipelineBarrier2-synchronization2-03848) and every
        // access belongs to one of the stages beside it (VUID-VkMemoryBarrier2-srcAccessMask-03907 and following).
        unsafe {
            match &self.state.core.sync2 {
                Sync2::Promoted => self.state.core.raw.cmd_pipeline_barrier2(self.state.commands, info),
                Sync2::Extension(fns) => fns.cmd_pipeline_barrier2(self.state.commands, info),
            }
        }
    }

    /// Copies `bytes` bytes; nothing if that is 0.
    ///
    /// # Panics
    /// If a range leaves its buffer, or both are in the same buffer and overlap.
    pub fn copy(&mut self, source: &Buffer, source_offset: u64, target: &Buffer, target_offset: u64, bytes: u64) {
        for (buffer, offset) in [(source, source_offset), (target, target_offset)] {
            let fits = offset.checked_add(bytes).is_some_and(|end| end <= buffer.bytes());
            assert!(fits, "copy of {bytes} bytes at {offset} leaves '{}'", buffer.name());
        }
        let apart = source_offset.abs_diff(target_offset) >= bytes || source.inner.raw != target.inner.raw;
        assert!(apart, "copy of {bytes} bytes inside '{}' overlaps", source.name());
        if bytes == 0 {
            return;
        }
        self.state.keep(source);
        self.state.keep(target);
        let region = [vk::BufferCopy { src_offset: source_offset, dst_offset: target_offset, size: bytes }];
        let (from, to) = (source.inner.raw, target.inner.raw);
        // SAFETY: recording; usages are set on every buffer, the ranges were checked (VUID-vkCmdCopyBuffer-size-00115,
        // -00116, -pRegions-00117), the size is not zero.
        unsafe { self.state.core.raw.cmd_copy_buffer(self.state.commands, from, to, &region) };
    }

    /// Fills `bytes` bytes from `offset` on with `word`; nothing if that is 0.
    ///
    /// # Panics
    /// If the range leaves the buffer or is not a multiple of 4.
    pub fn fill(&mut self, buffer: &Buffer, offset: u64, bytes: u64, word: u32) {
        let fits = offset.checked_add(bytes).is_some_and(|end| end <= buffer.bytes().next_multiple_of(4));
        assert!(fits, "fill of {bytes} bytes at {offset} leaves '{}'", buffer.name());
        assert!(offset.is_multiple_of(4) && bytes.is_multiple_of(4), "fill of {bytes} bytes at {offset}");
        if bytes == 0 {
            return;
        }
        self.state.keep(buffer);
        // SAFETY: recording; offset and size are multiples of 4, inside the buffer as created, which is padded
        // (VUID-vkCmdFillBuffer-dstOffset-00024, -00025, -size-00027, -00028).
        unsafe { self.state.core.raw.cmd_fill_buffer(self.state.commands, buffer.inner.raw, offset, bytes, word) };
    }

    /// Ends recording.
    ///
    /// # Errors
    /// [`Error::Vulkan`] if the driver could not record, or if something failed on the way that could not say so.
    ///
    /// # Panics
    /// If a scope is still open.
    pub fn finish(mut self) -> Result<Commands> {
        assert!(self.drawing.is_none(), "finish inside of a picture");
        assert!(self.open.is_empty(), "{} scope(s) still open", self.open.len());
        self.memory_barrier(
            (self.kernels() | TRANSFER, vk::AccessFlags2::SHADER_WRITE | vk::AccessFlags2::TRANSFER_WRITE),
            (HOST, vk::AccessFlags2::HOST_READ),
        );
        if let Some(error) = self.failure.take() {
            return Err(error);
        }
        let state = self.state;
        state.core.end_label(state.commands);
        // SAFETY: the command buffer is recording, outside of render passes and queries.
        unsafe { state.core.raw.end_command_buffer(state.commands) }
            .map_err(failed("vkEndCommandBuffer", &state.name))?;
        Ok(Commands { state: Arc::new(state) })
    }
}

impl CommandState {
    /// Holds a share of `buffer` as long as the commands exist.
    pub(super) fn keep(&mut self, buffer: &Buffer) {
        self.buffers.entry(buffer.inner.raw.as_raw()).or_insert_with(|| Arc::clone(&buffer.inner));
    }
}

/// The range of `slice`; buffers are padded so that even an empty slice at their end has some bytes to bind.
fn descriptor(slice: &BufferSlice<'_>) -> vk::DescriptorBufferInfo {
    let inner = &slice.buffer.inner;
    let range = slice.bytes.max(4);
    debug_assert!(slice.offset + range <= inner.capacity && SLACK >= 4);
    vk::DescriptorBufferInfo { buffer: inner.raw, offset: slice.offset, range }
}
