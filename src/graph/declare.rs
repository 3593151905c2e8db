//! Declaring passes: buffers are values, accesses are borrows.

use std::any::Any;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;
use std::sync::Arc;

use bytemuck::Pod;

use super::draw::{RasterSpec, Spirv};
use crate::constants::GROUPS_OF_ROW;
pub(super) use crate::constants::MOST_GROUPS;

/// A buffer of the graph with `len` elements of `T`. Neither `Copy` nor `Clone`: the borrow checker is the first
/// hazard checker, so one buffer as input and output of one dispatch does not compile.
#[derive(Debug)]
pub struct Buf<T> {
    pub(super) id: u32,
    pub(super) len: u32,
    element: PhantomData<fn() -> T>,
}

impl<T> Buf<T> {
    fn new(id: u32, len: u32) -> Self {
        Self { id, len, element: PhantomData }
    }

    /// Number of elements.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> u32 {
        self.len
    }
}

/// A buffer that the graph may only read.
#[derive(Debug)]
pub struct ReadBuf<T>(Buf<T>);

impl<T> Deref for ReadBuf<T> {
    type Target = Buf<T>;
    fn deref(&self) -> &Buf<T> {
        &self.0
    }
}

/// Device memory that outlives a plan: scene data, film state. Made by [`super::Runtime::persistent`].
///
/// Cloning shares the memory; a graph refuses to import the same memory twice.
#[derive(Clone)]
pub struct Persistent<T> {
    pub(super) name: &'static str,
    pub(super) len: u32,
    /// The device buffer, opaque here so that declaring and planning need no device.
    pub(super) store: Arc<dyn Any + Send + Sync>,
    pub(super) element: PhantomData<fn() -> T>,
}

impl<T> Persistent<T> {
    /// Memory without a device, for planning in tests.
    pub fn detached(name: &'static str, len: u32) -> Self {
        Self { name, len, store: Arc::new(()), element: PhantomData }
    }

    /// Number of elements.
    #[allow(clippy::len_without_is_empty)]
    pub fn len(&self) -> u32 {
        self.len
    }

    /// Size in bytes.
    pub fn bytes(&self) -> u64 {
        u64::from(self.len) * size_of::<T>() as u64
    }
}

impl<T> fmt::Debug for Persistent<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Persistent({}, {} elements)", self.name, self.len)
    }
}

/// Data written by the host before each run of a plan.
#[derive(Debug, Clone, Copy)]
pub struct Input<T> {
    pub(super) id: u32,
    pub(super) len: u32,
    element: PhantomData<fn() -> T>,
}

/// Data read by the host after a run of a plan.
#[derive(Debug, Clone, Copy)]
pub struct Readback<T> {
    pub(super) index: u32,
    pub(super) len: u32,
    pub(super) element: PhantomData<fn() -> T>,
}

/// An amount of work of a kind.
#[derive(Debug, Clone, Copy)]
pub struct Tally {
    /// What it is.
    pub kind: &'static str,
    /// How much of it there is for each of `count`.
    pub times: u32,
    /// One word.
    pub count: Readback<u32>,
}

/// Group counts of an indirect dispatch (`VkDispatchIndirectCommand`).
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct DispatchArgs {
    /// Groups along x.
    pub x: u32,
    /// Groups along y.
    pub y: u32,
    /// Groups along z.
    pub z: u32,
}

/// How many invocations a pass starts.
pub enum Grid<'a> {
    /// At least this many invocations along x, in whole workgroups. Kernels address themselves by `linear_id()`,
    /// which also covers counts beyond the device's limit of groups along one axis.
    Threads(u32),
    /// Exactly these workgroups.
    Groups([u32; 2]),
    /// Group counts that an earlier pass has written.
    Indirect(&'a Buf<DispatchArgs>),
}

/// Facts of a compiled kernel.
pub struct KernelInfo {
    /// File stem of the kernel.
    pub name: &'static str,
    /// Its code.
    pub spirv: Spirv,
    /// Workgroup size.
    pub local_size: [u32; 3],
    /// Size of the push constants.
    pub push_bytes: u32,
    /// Binding numbers in set 0.
    pub bindings: &'static [u32],
}

/// A kernel with its specialisation constants; implemented by generated code.
pub trait Kernel {
    /// Push constants.
    type Params: Pod;
    /// Buffers.
    type Bindings<'a>: Bindings;
    /// Facts of the compiled module.
    fn info(&self) -> &'static KernelInfo;
    /// Specialisation constants as (id, bits).
    fn constants(&self) -> Vec<(u32, u32)>;
}

/// The buffers of one dispatch; implemented by generated code.
pub trait Bindings {
    /// One entry per binding.
    fn uses(&self) -> Vec<Use>;
}

/// Whether a pass reads a buffer or may write it (and perhaps reads it too).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Only read.
    Read,
    /// Written, or read and written.
    Write,
}

/// One buffer of one pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Use {
    /// Binding number; `u32::MAX` for dispatch arguments and transfers.
    pub binding: u32,
    /// Index into [`Graph`]'s buffers.
    pub buffer: u32,
    /// Kind of access.
    pub access: Access,
}

impl Use {
    /// [`Use::binding`] of dispatch arguments and transfers.
    pub const NO_BINDING: u32 = u32::MAX;

    /// A use that the kernel only reads.
    pub fn read<T>(binding: u32, buf: &Buf<T>) -> Self {
        Self { binding, buffer: buf.id, access: Access::Read }
    }

    /// A use that the kernel writes.
    pub fn write<T>(binding: u32, buf: &Buf<T>) -> Self {
        Self { binding, buffer: buf.id, access: Access::Write }
    }
}

/// Where a buffer's memory comes from.
#[derive(Clone)]
pub enum BufferKind {
    /// Lives inside of a run; memory is shared with others whose lifetimes do not overlap.
    Transient,
    /// Lives outside of the plan.
    Persistent(Arc<dyn Any + Send + Sync>),
    /// Written by the host before a run (index of the input slot) with an initial value.
    Input(Vec<u8>),
}

/// Facts of a declared buffer.
#[derive(Clone)]
pub struct BufferInfo {
    /// Name for messages, dumps and debuggers.
    pub name: &'static str,
    /// Size in bytes, at least 16 so that an empty buffer can be bound.
    pub bytes: u64,
    /// Number of elements.
    pub len: u32,
    /// Size of one element in bytes.
    pub stride: u64,
    /// Origin of its memory.
    pub kind: BufferKind,
    /// Imported for reading only.
    pub read_only: bool,
}

/// Grid of a pass, buffers replaced by their index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GridSpec {
    /// Workgroups.
    Groups([u32; 2]),
    /// Group counts in this buffer.
    Indirect(u32),
}

/// One dispatch of [`Operation::Windows`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WindowSpec {
    /// First item.
    pub first: u32,
    /// Number of items.
    pub count: u32,
    /// Push constants.
    pub params: Vec<u8>,
    /// Workgroups.
    pub groups: [u32; 2],
}

/// What a pass does.
#[derive(Clone)]
pub enum Operation {
    /// Runs a kernel.
    Dispatch {
        /// The kernel.
        kernel: &'static KernelInfo,
        /// Specialisation constants.
        constants: Vec<(u32, u32)>,
        /// Push constants.
        params: Vec<u8>,
        /// Workgroups.
        grid: GridSpec,
    },
    /// Runs a kernel once per window of buffers that are too long for one binding.
    Windows {
        /// The kernel.
        kernel: &'static KernelInfo,
        /// Specialisation constants.
        constants: Vec<(u32, u32)>,
        /// Bindings that show the window's elements only.
        bindings: Vec<u32>,
        /// The windows, which cover all items once.
        windows: Vec<WindowSpec>,
    },
    /// Draws pictures and copies them to buffers.
    Raster(RasterSpec),
    /// Fills a buffer with a word.
    Fill(u32),
    /// Copies the first bytes of the first use into the second.
    Copy(u64),
    /// Copies a buffer to the host (index of the read-back slot).
    Readback(u32),
}

/// A declared pass.
#[derive(Clone)]
pub struct PassInfo {
    /// Name: the kernel's, or the transfer's.
    pub name: &'static str,
    /// Path of scope indices, outermost first.
    pub scopes: Vec<u32>,
    /// What it does.
    pub operation: Operation,
    /// Buffers it touches.
    pub uses: Vec<Use>,
}

/// The class of the device that runs the passes. Graph functions may choose other kernels and grids for it; the results
/// are the same.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum DeviceClass {
    /// A CPU: barriers are slow there, and neighbouring invocations gain nothing by reading neighbouring words.
    #[default]
    Cpu,
    /// A GPU.
    Gpu,
}

/// Passes being declared.
#[derive(Default)]
pub struct Graph {
    pub(super) buffers: Vec<BufferInfo>,
    pub(super) passes: Vec<PassInfo>,
    /// Buffers whose content must survive the run.
    pub(super) kept: Vec<u32>,
    /// Scope names in order of opening.
    pub(super) scope_names: Vec<&'static str>,
    open_scopes: Vec<u32>,
    readback_count: u32,
    /// Counts of work by what it is, where they are wanted.
    tallies: Option<Vec<Tally>>,
    class: DeviceClass,
    /// Longest window in bytes, where a test wants it short.
    pub(super) window_bytes: Option<u64>,
}

impl Graph {
    /// An empty graph.
    pub fn new() -> Self {
        Self::default()
    }

    /// The same graph for a device of this class.
    pub fn with_device_class(mut self, class: DeviceClass) -> Self {
        self.class = class;
        self
    }

    /// The same graph, which brings to the host what [`Self::tally`] is told of.
    pub fn with_tallies(mut self) -> Self {
        self.tallies = Some(vec![]);
        self
    }

    /// Says how much work there is of a kind: `times` the first word of `count`. It is brought to the host where
    /// somebody wants to know ([`Self::with_tallies`]); otherwise this declares nothing.
    pub fn tally(&mut self, kind: &'static str, times: u32, count: &Buf<u32>) {
        if self.tallies.is_some() {
            let count = self.readback(count);
            self.tallies.get_or_insert_default().push(Tally { kind, times, count });
        }
    }

    /// What was told so far; kinds repeat.
    pub fn take_tallies(&mut self) -> Vec<Tally> {
        self.tallies.take().unwrap_or_default()
    }

    /// The class of device that the passes are declared for.
    pub fn device_class(&self) -> DeviceClass {
        self.class
    }

    fn declare<T>(&mut self, name: &'static str, len: u32, kind: BufferKind, read_only: bool) -> Buf<T> {
        let bytes = (u64::from(len) * size_of::<T>() as u64).max(16);
        self.buffers.push(BufferInfo { name, bytes, len, stride: size_of::<T>() as u64, kind, read_only });
        Buf::new(self.buffers.len() as u32 - 1, len)
    }

    /// A buffer that lives inside of one run; it starts undefined.
    pub fn buffer<T: Pod>(&mut self, name: &'static str, len: u32) -> Buf<T> {
        self.declare(name, len, BufferKind::Transient, false)
    }

    /// Persistent memory, for reading and writing. Panics if this memory is already imported: two handles of one
    /// memory would escape the borrow checker.
    pub fn import<T: Pod>(&mut self, owner: &Persistent<T>) -> Buf<T> {
        self.assert_new(owner);
        self.declare(owner.name, owner.len, BufferKind::Persistent(owner.store.clone()), false)
    }

    /// Persistent memory, only for reading.
    pub fn import_read<T: Pod>(&mut self, owner: &Persistent<T>) -> ReadBuf<T> {
        self.assert_new(owner);
        ReadBuf(self.declare(owner.name, owner.len, BufferKind::Persistent(owner.store.clone()), true))
    }

    fn assert_new<T>(&self, owner: &Persistent<T>) {
        let known = self.buffers.iter().any(|b| match &b.kind {
            BufferKind::Persistent(store) => Arc::ptr_eq(store, &owner.store),
            _ => false,
        });
        assert!(!known, "'{}' is imported twice into one graph", owner.name);
    }

    /// A small buffer whose content the host may change before each run; `data` is its first content.
    pub fn input<T: Pod>(&mut self, name: &'static str, data: &[T]) -> (ReadBuf<T>, Input<T>) {
        let mut bytes = bytemuck::cast_slice(data).to_vec();
        bytes.resize(bytes.len().max(16), 0);
        let buf = self.declare(name, data.len() as u32, BufferKind::Input(bytes), true);
        let input = Input { id: buf.id, len: buf.len, element: PhantomData };
        (ReadBuf(buf), input)
    }

    /// Constant data of this plan.
    pub fn upload<T: Pod>(&mut self, name: &'static str, data: &[T]) -> ReadBuf<T> {
        self.input(name, data).0
    }

    /// Runs a kernel over a grid.
    ///
    /// # Panics
    /// If [`Grid::Threads`] meets a kernel whose workgroups are not one-dimensional.
    pub fn dispatch<K: Kernel>(&mut self, kernel: K, grid: Grid<'_>, params: K::Params, bind: K::Bindings<'_>) {
        let info = kernel.info();
        let mut uses = bind.uses();
        let grid = match grid {
            Grid::Threads(count) => GridSpec::Groups(groups_of(info, count)),
            Grid::Groups(groups) => GridSpec::Groups(groups),
            Grid::Indirect(args) => {
                uses.push(Use { binding: Use::NO_BINDING, buffer: args.id, access: Access::Read });
                GridSpec::Indirect(args.id)
            }
        };
        let params = bytemuck::bytes_of(&params).to_vec();
        let operation = Operation::Dispatch { kernel: info, constants: kernel.constants(), params, grid };
        self.push(info.name, operation, uses);
    }

    /// Sets every word of a buffer.
    pub fn fill<T: Pod>(&mut self, buf: &mut Buf<T>, word: u32) {
        self.push("fill", Operation::Fill(word), vec![Use::write(Use::NO_BINDING, buf)]);
    }

    /// Copies as many elements as both buffers have.
    pub fn copy<T: Pod>(&mut self, from: &Buf<T>, to: &mut Buf<T>) {
        let bytes = u64::from(from.len.min(to.len)) * size_of::<T>() as u64;
        let uses = vec![Use::read(Use::NO_BINDING, from), Use::write(Use::NO_BINDING, to)];
        self.push("copy", Operation::Copy(bytes), uses);
    }

    /// Brings a buffer to the host: a root of the graph.
    pub fn readback<T: Pod>(&mut self, buf: &Buf<T>) -> Readback<T> {
        let index = self.readback_count;
        self.readback_count += 1;
        self.push("readback", Operation::Readback(index), vec![Use::read(Use::NO_BINDING, buf)]);
        Readback { index, len: buf.len, element: PhantomData }
    }

    /// Declares that the content of a buffer after the run matters: a root of the graph. Only persistent memory can be
    /// looked at after a run; of a transient this keeps the passes (to measure them) but not the content.
    pub fn keep<T: Pod>(&mut self, buf: &Buf<T>) {
        self.kept.push(buf.id);
    }

    /// Groups passes under a name that is debug label, timer and crash marker at once.
    pub fn scope<R>(&mut self, name: &'static str, declare: impl FnOnce(&mut Self) -> R) -> R {
        self.scope_names.push(name);
        self.open_scopes.push(self.scope_names.len() as u32 - 1);
        let result = declare(self);
        self.open_scopes.pop();
        result
    }

    pub(super) fn push(&mut self, name: &'static str, operation: Operation, uses: Vec<Use>) {
        self.passes.push(PassInfo { name, scopes: self.open_scopes.clone(), operation, uses });
    }
}

/// Groups for `count` invocations of a kernel that addresses itself by `linear_id()`.
pub(super) fn groups_of(kernel: &KernelInfo, count: u32) -> [u32; 2] {
    let [x, y, z] = kernel.local_size;
    assert!(y == 1 && z == 1, "'{}' has workgroups of {x} x {y} x {z}: give it Grid::Groups", kernel.name);
    spread(count.div_ceil(x))
}

/// Groups along x and y for a linear count: one row up to the smallest limit that Vulkan guarantees (65,535), then
/// rows of 32,768, so that the kernel's `linear_id()` stays exact.
fn spread(groups: u32) -> [u32; 2] {
    if groups <= MOST_GROUPS { [groups, 1] } else { [GROUPS_OF_ROW, groups.div_ceil(GROUPS_OF_ROW)] }
}
