//! The device: all Vulkan and all `unsafe` of the crate.
//!
//! Everything above this module sees six values and no Vulkan handle:
//!
//! - [`Device`]: one compute queue of one physical device, chosen by [`DeviceSelect`], described by [`DeviceInfo`].
//! - [`Buffer`]: device memory, or memory that the host writes or reads ([`Place`]).
//! - [`Pipeline`]: one compute kernel with its specialisation constants, or the kernels of a draw.
//! - [`Image`]: a colour or depth attachment of a [`Picture`]; only draws write it, only copies read it.
//! - [`Recorder`] and [`Commands`]: a command buffer while it is written, and afterwards, when it can be replayed.
//! - [`Submission`]: one run of it, to be waited for.
//!
//! ```no_run
//! # use nephroid::low_level::vk::*;
//! # fn f(words: &[u32]) -> nephroid::Result<()> {
//! let device = Device::open(&DeviceOptions::default())?;
//! let data = device.buffer("data", 4096, Place::Readback)?;
//! let desc = PipelineDesc { name: "square", spirv: words, bindings: &[0], push_bytes: 0, constants: &[] };
//! let mut recorder = device.recorder("example")?;
//! recorder.bind(&device.pipeline(&desc)?, &[(0, BufferSlice::whole(&data))], &[])?;
//! recorder.dispatch([16, 1, 1]);
//! recorder.finish()?.submit()?.wait()?;
//! # Ok(()) }
//! ```
//!
//! # What keeps it sound
//!
//! Handles are freed only when no command buffer can use them any more: [`Commands`] holds shares of the buffers and
//! pipelines it names, waits for its own last run before it is freed, and everything holds a share of the logical
//! device. All waits are finite: a device that stops answering gives [`Error::DeviceLost`], and what it may still use
//! is then leaked rather than freed under it. What this module cannot prevent is a kernel that is itself wrong (invalid
//! SPIR-V, an index outside its buffers, absurd indirect arguments): kernels are this crate's own, pass spirv-val, and
//! are tested with guard words.
//!
//! # Synchronisation
//!
//! There is one queue and one kind of barrier, [`Recorder::barrier`]: global, covering kernels (compute and graphics),
//! indirect arguments and transfers. Images have barriers of their own, inside [`Recorder::begin_picture`] and
//! [`Recorder::end_picture`]: between these two they are drawn on, afterwards copied from. Each [`Commands`] starts
//! with the global barrier, so runs follow each other in submission order, and ends with one that makes all writes
//! visible to the host. A timeline semaphore counts the submissions of a device.
//!
//! # Memory
//!
//! `gpu-allocator` carves buffers out of larger blocks. It hands out host-visible memory only from coherent types, so
//! no flush or invalidation is needed. A buffer beyond `maxMemoryAllocationSize`, the heap, or (when bound) beyond
//! `maxStorageBufferRange` is refused with [`Error::OutOfMemory`] before the driver is asked.
//!
//! # Validation
//!
//! [`DeviceOptions::validate`] or the environment variable `NEPHROID_VALIDATE=1` loads `VK_LAYER_KHRONOS_validation`
//! with synchronisation validation; its warnings and errors are collected, see [`Device::check_validation`].
//!
//! # Where things are
//!
//! | to change | go to |
//! |---|---|
//! | layers, instance extensions, messages | `instance.rs` |
//! | what is asked of a device and what it reports; the feature chains | `features.rs`, `limits.rs` |
//! | how a device is chosen | `select.rs` |
//! | queue, waiting, tear-down | `core.rs`, `device.rs` |
//! | memory: kinds and books; buffers | `memory.rs`, `buffer.rs` |
//! | pipelines | `pipeline.rs`, `raster_pipeline.rs` |
//! | which pipelines are made already; the file of the pipeline cache | `pipeline_store.rs`, `cache.rs` |
//! | recording; replay, timestamps, crash markers | `record.rs`, `commands.rs` |
//! | attachments, their formats; recording draws | `image.rs`, `image_kind.rs`, `raster.rs` |
//! | errors and strings of calls | `call.rs` |
//! | the loop-cut probe | `probe.rs` |
//!
//! [`Error::DeviceLost`]: crate::error::Error::DeviceLost
//! [`Error::OutOfMemory`]: crate::error::Error::OutOfMemory
#![allow(unsafe_code)]

mod buffer;
mod cache;
mod call;
mod commands;
mod core;
mod device;
mod features;
mod host_memory;
mod image;
mod image_kind;
mod instance;
mod limits;
mod memory;
mod pipeline;
mod pipeline_store;
mod probe;
mod raster;
mod raster_pipeline;
mod record;
mod select;

pub use buffer::{Buffer, BufferSlice};
pub use cache::default_cache_dir;
pub use commands::{Commands, ScopeTiming, Submission};
pub use device::{Device, DeviceOptions, devices};
pub use features::{Feature, Features};
pub use host_memory::MemoryOrExit;
pub use image::Image;
pub use image_kind::ImageKind;
pub use instance::ValidationLog;
pub use limits::{DeviceInfo, DeviceKind, Limits};
pub use memory::{MemoryUse, Place};
pub use pipeline::{Pipeline, PipelineDesc};
pub use raster::Picture;
pub use raster_pipeline::{RasterDesc, StageDesc};
pub use record::Recorder;
pub use select::DeviceSelect;
