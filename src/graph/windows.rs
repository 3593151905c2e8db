//! Element-wise dispatches over buffers that are longer than one binding may be.

use super::declare::{Bindings, Graph, Kernel, Operation, WindowSpec, groups_of};

/// Longest window in bytes: the least `maxStorageBufferRange` that Vulkan guarantees. Devices with more could take
/// longer windows, but then the plan would depend on the device.
const WINDOW_BYTES: u64 = 1 << 27;

/// Windows start at multiples of this many items, and so, whatever an item's size, at multiples of 256 bytes: the
/// largest alignment that a device may ask of a binding.
const WINDOW_STEP: u64 = 256;

/// How [`Graph::dispatch_windows`] may split a dispatch.
#[derive(Debug, Clone, Copy)]
pub struct Windows<'a> {
    /// Items, and invocations, of the whole.
    pub items: u32,
    /// Bindings with one element per item. The kernel sees element `first + i` of the buffer as element `i`; all other
    /// bindings it sees whole.
    pub bindings: &'a [u32],
}

/// A run of consecutive items.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// First item.
    pub first: u32,
    /// Number of items.
    pub count: u32,
}

impl Graph {
    /// Runs an element-wise kernel over any number of items: in one dispatch if every buffer fits a binding, else once
    /// per window, with the bindings of `split` moved along. Item `first + i` of the whole is invocation `i` of its
    /// window, so a kernel that needs the item's number takes `first` as a parameter.
    ///
    /// # Panics
    /// If a binding of `split` is not bound, or its buffer has fewer elements than there are items.
    pub fn dispatch_windows<K: Kernel>(
        &mut self,
        kernel: K,
        split: Windows<'_>,
        params: impl Fn(Window) -> K::Params,
        bind: K::Bindings<'_>,
    ) {
        let (info, uses) = (kernel.info(), bind.uses());
        let longest = split.bindings.iter().map(|binding| {
            let usage = uses.iter().find(|usage| usage.binding == *binding);
            let usage = usage.unwrap_or_else(|| panic!("'{}' has no binding {binding}", info.name));
            let buffer = &self.buffers[usage.buffer as usize];
            let (len, items) = (buffer.len, split.items);
            assert!(len >= items, "'{}' has {len} elements for {items} items", buffer.name);
            buffer.stride
        });
        let step = self.window_items(longest.max().unwrap_or(0));
        let specs: Vec<_> = windows(split.items, step)
            .map(|window| WindowSpec {
                first: window.first,
                count: window.count,
                params: bytemuck::bytes_of(&params(window)).to_vec(),
                groups: groups_of(info, window.count),
            })
            .collect();
        let (kernel, constants, bindings) = (info, kernel.constants(), split.bindings.to_vec());
        self.push(info.name, Operation::Windows { kernel, constants, bindings, windows: specs }, uses);
    }

    /// Makes windows shorter than devices need, to test that the split gives the same result as the whole.
    #[doc(hidden)]
    pub fn limit_windows(&mut self, bytes: u64) {
        self.window_bytes = Some(bytes);
    }

    /// Items of a window of elements of `stride` bytes.
    fn window_items(&self, stride: u64) -> u32 {
        let items = self.window_bytes.unwrap_or(WINDOW_BYTES) / stride.max(1);
        (items / WINDOW_STEP * WINDOW_STEP).clamp(WINDOW_STEP, 1 << 31) as u32
    }
}

/// All items in windows of `step`; one empty window if there are none.
fn windows(items: u32, step: u32) -> impl Iterator<Item = Window> {
    (0..items.div_ceil(step).max(1)).map(move |index| {
        let first = index * step;
        Window { first, count: step.min(items - first) }
    })
}
