//! Memory that outlives plans: making, filling and reading it.

use std::any::Any;
use std::marker::PhantomData;
use std::sync::Arc;

use bytemuck::Pod;

use crate::error::{Error, MemoryCause, Result};
use crate::graph::declare::{DeviceClass, Persistent};
use crate::vk::{Buffer, Device, DeviceKind, Place};

impl From<DeviceKind> for DeviceClass {
    fn from(kind: DeviceKind) -> Self {
        match kind {
            DeviceKind::Software => Self::Cpu,
            DeviceKind::Discrete | DeviceKind::Integrated | DeviceKind::Virtual => Self::Gpu,
        }
    }
}

/// Makes persistent memory and executables on one device.
#[derive(Clone)]
pub struct Runtime {
    pub(super) device: Arc<Device>,
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

    /// Sets persistent memory to zero, on the device.
    pub fn clear<T: Pod>(&self, persistent: &Persistent<T>) -> Result<()> {
        let target = device_buffer(&persistent.store);
        let mut recorder = self.device.recorder("clear")?;
        recorder.fill(target, 0, target.bytes().next_multiple_of(4), 0);
        recorder.finish()?.submit()?.wait()
    }

    /// Replaces the content of persistent memory from its start.
    pub fn overwrite<T: Pod>(&self, persistent: &Persistent<T>, data: &[T]) -> Result<()> {
        self.overwrite_from(persistent, 0, data)
    }

    /// Replaces the content of persistent memory from element `first` on.
    pub fn overwrite_from<T: Pod>(&self, persistent: &Persistent<T>, first: u32, data: &[T]) -> Result<()> {
        let end = first as usize + data.len();
        assert!(end <= persistent.len as usize, "'{}' is shorter than the data", persistent.name);
        let begin = u64::from(first) * size_of::<T>() as u64;
        const CHUNK: usize = 64 << 20;
        let target = device_buffer(&persistent.store);
        let bytes: &[u8] = bytemuck::cast_slice(data);
        for (index, chunk) in bytes.chunks(CHUNK).enumerate() {
            let staging = self.device.buffer("staging", chunk.len().max(16) as u64, Place::Upload)?;
            staging.write(0, chunk);
            let mut recorder = self.device.recorder("upload")?;
            recorder.copy(&staging, 0, target, begin + (index * CHUNK) as u64, chunk.len() as u64);
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
}

/// The buffer behind persistent memory.
pub(super) fn device_buffer(store: &Arc<dyn Any + Send + Sync>) -> &Buffer {
    store.downcast_ref::<Buffer>().expect("persistent memory was made by a runtime")
}
