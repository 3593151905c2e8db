//! Where the memory of scene and film comes from.

use bytemuck::Pod;

use crate::error::Result;
use crate::graph::{DeviceClass, Persistent, Runtime};
use crate::kernels::generated::Photon;

/// Where buffers come from: a device, or nowhere for plans that are looked at and never run.
#[derive(Clone, Copy)]
pub enum Memory<'a> {
    /// Memory of a device.
    Device(&'a Runtime),
    /// Sizes only, as if there were a device of this class.
    Nowhere(DeviceClass),
}

impl Memory<'_> {
    /// Zeroed memory.
    pub fn zeroed<T: Pod>(&self, name: &'static str, len: u32) -> Result<Persistent<T>> {
        match self {
            Self::Device(runtime) => runtime.persistent(name, len),
            Self::Nowhere(_) => Ok(Persistent::detached(name, len)),
        }
    }

    /// Memory with this content; one zeroed element if there is none, because nothing empty can be bound.
    pub fn filled<T: Pod>(&self, name: &'static str, data: &[T]) -> Result<Persistent<T>> {
        match self {
            Self::Device(runtime) if !data.is_empty() => runtime.persistent_from(name, data),
            _ => self.zeroed(name, data.len().max(1) as u32),
        }
    }

    /// Replaces elements of memory from `first` on.
    pub fn overwrite<T: Pod>(&self, persistent: &Persistent<T>, first: u32, data: &[T]) -> Result<()> {
        match self {
            Self::Device(runtime) if !data.is_empty() => runtime.overwrite_from(persistent, first, data),
            _ => Ok(()),
        }
    }

    /// Longest range that a kernel sees of a buffer, in bytes.
    pub fn longest_binding(&self) -> u64 {
        match self {
            Self::Device(runtime) => runtime.device().info().limits.storage_range,
            Self::Nowhere(_) => u64::MAX,
        }
    }

    /// Photons that a pass can store. A kernel sees all deposits in one binding, and no other record of a photon is
    /// longer than a deposit. The shortest binding that Vulkan allows, 128 MiB, holds two million photons. More than
    /// sixteen million are never stored: more passes then serve a render better.
    pub fn most_deposits(&self) -> u32 {
        (self.longest_binding() / size_of::<Photon>() as u64).min(1 << 24) as u32 - 1
    }

    /// Loop iterations that the driver runs in an invocation, if it ends loops.
    pub fn loop_limit(&self) -> Option<u32> {
        match self {
            Self::Device(runtime) => runtime.device().loop_limit(),
            Self::Nowhere(_) => None,
        }
    }

    /// The class of device that runs the plans.
    pub fn device_class(&self) -> DeviceClass {
        match self {
            Self::Device(runtime) => runtime.device().info().kind.into(),
            Self::Nowhere(device_class) => *device_class,
        }
    }
}
