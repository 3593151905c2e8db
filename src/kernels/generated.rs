//! What the build script emits from the kernels: layouts, parameters, bindings, constants, code.

/// Includes a file as bytes aligned for SPIR-V words.
macro_rules! include_bytes_aligned {
    ($path:expr) => {{
        #[repr(C, align(4))]
        struct Aligned<T: ?Sized>(T);
        static BYTES: &Aligned<[u8]> = &Aligned(*include_bytes!($path));
        &BYTES.0
    }};
}

include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
