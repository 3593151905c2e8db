//! Kinds of memory, where it comes from, and the books of how much of it is in use.

use super::call::lock;
use super::core::Core;
use crate::injection::{Step, fails};
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc};

/// Where a buffer lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Memory of the device; the host cannot see it.
    Device,
    /// Memory that the host writes and the device reads.
    Upload,
    /// Memory that the device writes and the host reads.
    Readback,
}

/// Bytes held by buffers, as the driver counts them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryUse {
    /// Now.
    pub current: u64,
    /// The most so far.
    pub peak: u64,
}

/// The books of a device's memory.
#[derive(Default)]
pub(super) struct Accounts {
    pub all: MemoryUse,
    /// Bytes in [`Place::Device`].
    pub device: u64,
}

impl Accounts {
    pub fn add(&mut self, place: Place, bytes: u64) {
        self.all.current += bytes;
        self.all.peak = self.all.peak.max(self.all.current);
        self.device += if place == Place::Device { bytes } else { 0 };
    }

    pub fn remove(&mut self, place: Place, bytes: u64) {
        self.all.current -= bytes;
        self.device -= if place == Place::Device { bytes } else { 0 };
    }
}

/// Memory of the device; an error is the allocator's cause in words.
pub(super) fn allocate(core: &Core, desc: &AllocationCreateDesc<'_>) -> Result<Allocation, String> {
    if fails(Step::Allocate) {
        return Err(gpu_allocator::AllocationError::OutOfMemory.to_string());
    }
    lock(&core.allocator).allocate(desc).map_err(|cause| cause.to_string())
}
