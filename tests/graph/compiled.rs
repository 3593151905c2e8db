//! Compute kernels that a test writes itself.

use nephroid::low_level::graph::{Kernel, KernelInfo, Spirv};

use crate::shader;
use crate::support::fake::Wires;
use crate::support::repository;

/// A kernel compiled here. Its push constants are three words.
#[derive(Clone, Copy)]
pub struct Compiled(&'static KernelInfo);

impl Kernel for Compiled {
    type Params = [u32; 3];
    type Bindings<'a> = Wires;
    fn info(&self) -> &'static KernelInfo {
        self.0
    }
    fn constants(&self) -> Vec<(u32, u32)> {
        Vec::new()
    }
}

impl Compiled {
    /// Compiles `source`, which may include what stands in the folder `glsl`.
    pub fn of(name: &'static str, source: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join(format!("{name}.comp"));
        std::fs::write(&file, source).expect("a kernel");
        let root = repository("glsl");
        let words = shader::Compiler::new(&root).and_then(|compiler| compiler.compile(&file)).expect("a sound kernel");
        let kernel = shader::reflect(&file, &words).expect("a description");
        let bindings: Vec<u32> = kernel.bindings.iter().map(|binding| binding.index).collect();
        Self(Box::leak(Box::new(KernelInfo {
            name,
            spirv: Spirv(bytemuck::cast_slice(words.leak())),
            local_size: kernel.local_size,
            push_bytes: kernel.params.map_or(0, |params| shader::Type::Struct(params).layout().0),
            bindings: bindings.leak(),
        })))
    }
}
