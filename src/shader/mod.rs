//! Kernels at build time: GLSL to SPIR-V ([`Compiler`]), SPIR-V to a description ([`reflect`]), descriptions to Rust
//! ([`emit`]); constants of GLSL to constants of Rust ([`mod@constants`]). Part of the build script and of its test,
//! not of the library: GLSL is the truth for every layout that host and kernels share, and nothing generated is
//! committed.

mod compile;
pub mod constants;
mod emit;
pub mod expression;
mod reflect;
mod scene;

pub use compile::{Compiler, kernel_files};
pub use emit::emit;
pub use reflect::reflect;

/// Where a kernel runs; the file's extension says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// `.comp`
    Compute,
    /// `.vert`
    Vertex,
    /// `.geom`
    Geometry,
    /// `.frag`
    Fragment,
}

impl Stage {
    /// The stage of a file; none if it is no kernel.
    pub fn of(file: &std::path::Path) -> Option<Self> {
        match file.extension()?.to_str()? {
            "comp" => Some(Self::Compute),
            "vert" => Some(Self::Vertex),
            "geom" => Some(Self::Geometry),
            "frag" => Some(Self::Fragment),
            _ => None,
        }
    }

    /// What a kernel's name ends on, so that the stages of a draw may share the stem of their files.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::Compute => "",
            Self::Vertex => "_vert",
            Self::Geometry => "_geom",
            Self::Fragment => "_frag",
        }
    }
}

/// A type that both GLSL's scalar block layout and `repr(C)` lay out alike.
#[derive(Debug, Clone, PartialEq)]
pub enum Type {
    /// `uint`, `int`, `float`, `uint64_t` as their Rust names.
    Scalar(&'static str),
    /// Vector or fixed array: `[element; count]`.
    Array(Box<Type>, u32),
    /// A named struct.
    Struct(Struct),
}

/// A struct with the byte offsets that SPIR-V states.
#[derive(Debug, Clone, PartialEq)]
pub struct Struct {
    pub name: String,
    pub members: Vec<Member>,
}

impl Type {
    /// Size and alignment in bytes, by the rules that scalar block layout and `repr(C)` share.
    pub fn layout(&self) -> (u32, u32) {
        match self {
            Self::Scalar("u64") => (8, 8),
            Self::Scalar(_) => (4, 4),
            Self::Array(element, count) => {
                let (size, align) = element.layout();
                (size * count, align)
            }
            Self::Struct(definition) => {
                let (mut size, mut widest) = (0u32, 1);
                for member in &definition.members {
                    let (bytes, align) = member.ty.layout();
                    size = size.next_multiple_of(align) + bytes;
                    widest = widest.max(align);
                }
                (size.next_multiple_of(widest), widest)
            }
        }
    }
}

/// One member of a [`Struct`].
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    pub name: String,
    pub offset: u32,
    pub ty: Type,
}

/// A storage buffer that holds one runtime array.
#[derive(Debug, Clone, PartialEq)]
pub struct Binding {
    pub index: u32,
    pub name: String,
    pub element: Type,
    pub read_only: bool,
}

/// A specialisation constant: always 32 bits.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    pub id: u32,
    pub name: String,
    pub ty: &'static str,
    pub default_bits: u32,
}

/// All that Rust has to know of a kernel.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    /// Stem of the file, and [`Stage::suffix`].
    pub name: String,
    pub stage: Stage,
    /// Whether it includes the buffers and constants of the scene.
    pub scene: bool,
    /// Workgroup size of a compute kernel, else 0.
    pub local_size: [u32; 3],
    /// Colours that a fragment kernel writes, else 0.
    pub colours: u32,
    pub params: Option<Struct>,
    pub bindings: Vec<Binding>,
    pub constants: Vec<Constant>,
}
