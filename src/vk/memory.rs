//! Kinds of memory, and the books of how much of it is in use.

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
