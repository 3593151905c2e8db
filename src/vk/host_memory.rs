//! A program whose host has no memory left: a sentence and an exit code, where the default is an abort.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;

/// Exit code of a program without memory.
const OUT_OF_MEMORY: i32 = 4;

unsafe extern "C" {
    /// Ends the process at once: without handlers, which might allocate.
    #[link_name = "_exit"]
    safe fn end_process(code: i32) -> !;
}

/// The system's allocator for programs, not for libraries: where it has no memory, it says so on standard error and
/// ends the process with code 4. An allocation of Rust cannot be refused in another way.
#[derive(Debug, Default)]
pub struct MemoryOrExit;

impl MemoryOrExit {
    fn checked(pointer: *mut u8, bytes: usize) -> *mut u8 {
        if pointer.is_null() {
            // Standard error has no buffer, so nothing is allocated here. If it is closed, the code has to do.
            let _ = writeln!(std::io::stderr(), "nephroid: the host has no memory for {bytes} bytes more");
            end_process(OUT_OF_MEMORY);
        }
        pointer
    }
}

// SAFETY: every call goes to the system's allocator with the same arguments, and its results are returned as they are.
unsafe impl GlobalAlloc for MemoryOrExit {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the contract of this function, which is the same.
        Self::checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        Self::checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        Self::checked(unsafe { System.realloc(pointer, layout, size) }, size)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}
