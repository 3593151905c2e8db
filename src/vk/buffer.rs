//! Buffers and the memory under them.

use super::call::{failed, lock};
use super::core::Core;
use super::limits::DeviceKind;
use super::memory::{Place, allocate};
use crate::error::{Error, MemoryCause, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::{Arc, Mutex};

/// A storage buffer that can also be copied, filled and read as indirect arguments. Freed when neither this value nor
/// any recorded [`super::Commands`] uses it.
pub struct Buffer {
    pub(super) inner: Arc<BufferInner>,
}

pub(super) struct BufferInner {
    core: Arc<Core>,
    pub raw: vk::Buffer,
    pub name: String,
    /// As asked for.
    pub bytes: u64,
    /// As created: `bytes` plus [`SLACK`], so that an empty slice at the end can still be bound.
    pub capacity: u64,
    place: Place,
    /// Taken on drop only. The lock makes host access from several threads orderly.
    allocation: Mutex<Option<Allocation>>,
}

/// What a binding covers at least: Vulkan has no empty bindings.
pub(super) const SLACK: u64 = 16;

/// A part of a buffer, to be bound.
#[derive(Clone, Copy)]
pub struct BufferSlice<'a> {
    /// The buffer.
    pub buffer: &'a Buffer,
    /// First byte; a multiple of [`super::Limits::storage_alignment`].
    pub offset: u64,
    /// Length in bytes; 0 is allowed.
    pub bytes: u64,
}

impl<'a> BufferSlice<'a> {
    /// All of `buffer`.
    pub fn whole(buffer: &'a Buffer) -> Self {
        Self { buffer, offset: 0, bytes: buffer.bytes() }
    }
}

impl Buffer {
    pub(super) fn new(core: &Arc<Core>, name: &str, bytes: u64, place: Place) -> Result<Self> {
        refuse_oversize(core, name, bytes, place)?;
        let capacity = bytes.next_multiple_of(SLACK) + SLACK;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST
            | vk::BufferUsageFlags::INDIRECT_BUFFER;
        let info = vk::BufferCreateInfo::default().size(capacity).usage(usage);
        // SAFETY: the size is neither zero nor beyond maxBufferSize (VUID-VkBufferCreateInfo-size-06409).
        let raw = unsafe { core.raw.create_buffer(&info, None) }.map_err(failed("vkCreateBuffer", name))?;
        core.set_name(raw, name);
        // SAFETY: the buffer was just made by this device.
        let requirements = unsafe { core.raw.get_buffer_memory_requirements(raw) };
        let allocation = place_buffer(core, name, raw, requirements, place).inspect_err(|_| {
            // SAFETY: nobody else has seen the buffer.
            unsafe { core.raw.destroy_buffer(raw, None) };
        })?;
        lock(&core.memory).add(place, allocation.size());
        let inner = BufferInner {
            core: Arc::clone(core),
            raw,
            name: name.to_owned(),
            bytes,
            capacity,
            place,
            allocation: Mutex::new(Some(allocation)),
        };
        Ok(Self { inner: Arc::new(inner) })
    }

    /// Length in bytes, as asked for.
    pub fn bytes(&self) -> u64 {
        self.inner.bytes
    }

    /// The name it was made with.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// Copies `data` into the buffer from byte `offset` on. The device sees it in submissions made afterwards; a
    /// submission that is still running may see part of it.
    ///
    /// # Panics
    /// If the range leaves the buffer or the buffer is in [`Place::Device`].
    pub fn write(&self, offset: u64, data: &[u8]) {
        let range = self.range(offset, data.len());
        let mut allocation = lock(&self.inner.allocation);
        let memory = allocation.as_mut().and_then(Allocation::mapped_slice_mut);
        memory.expect("host-visible memory is mapped")[range].copy_from_slice(data);
    }

    /// Copies from byte `offset` on into `data`: what submissions that have been waited for wrote.
    ///
    /// # Panics
    /// If the range leaves the buffer or the buffer is in [`Place::Device`].
    pub fn read(&self, offset: u64, data: &mut [u8]) {
        let range = self.range(offset, data.len());
        let allocation = lock(&self.inner.allocation);
        let memory = allocation.as_ref().and_then(Allocation::mapped_slice);
        data.copy_from_slice(&memory.expect("host-visible memory is mapped")[range]);
    }

    fn range(&self, offset: u64, length: usize) -> std::ops::Range<usize> {
        // Some device memory is mapped as well, but a program that relies on it fails elsewhere.
        assert!(self.inner.place != Place::Device, "'{}' is in device memory, which the host cannot see", self.name());
        let end = offset.checked_add(length as u64).filter(|&end| end <= self.bytes());
        let end = end.unwrap_or_else(|| panic!("{length} bytes from {offset} leave '{}'", self.name()));
        offset as usize..end as usize
    }
}

impl Drop for BufferInner {
    fn drop(&mut self) {
        // SAFETY: commands that name the buffer hold a share of `self` until they have finished
        // (VUID-vkDestroyBuffer-buffer-00922).
        unsafe { self.core.raw.destroy_buffer(self.raw, None) };
        let allocation = self.allocation.get_mut().unwrap_or_else(std::sync::PoisonError::into_inner).take();
        if let Some(allocation) = allocation {
            lock(&self.core.memory).remove(self.place, allocation.size());
            // The only failure is a foreign allocation, which this is not.
            let _ = lock(&self.core.allocator).free(allocation);
        }
    }
}

/// Refuses what no memory type of the device can hold, before the driver (or the host's memory) is tried.
pub(super) fn refuse_oversize(core: &Core, name: &str, bytes: u64, place: Place) -> Result<()> {
    let limits = &core.info.limits;
    let refuse = |cause| Err(Error::OutOfMemory { object: name.to_owned(), bytes, cause });
    let capacity = bytes.saturating_add(2 * SLACK);
    if capacity > limits.allocation {
        return refuse(MemoryCause::BufferTooLong { longest: limits.allocation });
    }
    // A discrete GPU's staging buffers lie in the host's memory, which is not what the heap counts.
    let local = |place| place == Place::Device || core.info.kind != DeviceKind::Discrete;
    let used = if local(Place::Upload) { lock(&core.memory).all.current } else { lock(&core.memory).device };
    if local(place) && limits.heap > 0 && capacity.saturating_add(used) > limits.heap {
        return refuse(MemoryCause::DeviceFull { left: limits.heap.saturating_sub(used) });
    }
    Ok(())
}

fn place_buffer(
    core: &Core,
    name: &str,
    raw: vk::Buffer,
    requirements: vk::MemoryRequirements,
    place: Place,
) -> Result<Allocation> {
    let location = match place {
        Place::Device => MemoryLocation::GpuOnly,
        Place::Upload => MemoryLocation::CpuToGpu,
        Place::Readback => MemoryLocation::GpuToCpu,
    };
    let desc = AllocationCreateDesc {
        name,
        requirements,
        location,
        linear: true,
        allocation_scheme: AllocationScheme::GpuAllocatorManaged,
    };
    let allocation = allocate(core, &desc).map_err(|cause| Error::OutOfMemory {
        object: name.to_owned(),
        bytes: requirements.size,
        cause: MemoryCause::BufferRefused(cause),
    })?;
    let coherent = allocation.memory_properties().contains(vk::MemoryPropertyFlags::HOST_COHERENT);
    assert!(coherent || place == Place::Device, "the allocator gave incoherent memory for '{name}'");
    // SAFETY: the buffer is not bound yet, and the allocation was made from its own requirements, so type, size and
    // alignment fit (VUID-vkBindBufferMemory-memory-01035, -None-10741); the allocation outlives the buffer.
    let bound = unsafe { core.raw.bind_buffer_memory(raw, allocation.memory(), allocation.offset()) };
    match bound {
        Ok(()) => Ok(allocation),
        Err(code) => {
            let _ = lock(&core.allocator).free(allocation);
            Err(failed("vkBindBufferMemory", name)(code))
        }
    }
}
