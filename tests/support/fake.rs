//! Kernels for tests of the graph that need no device: any number of buffers, no code.

use nephroid::low_level::graph::{
    Access, Bindings, Buf, FragmentShader, GeometryShader, Kernel, KernelInfo, Shader, ShaderInfo,
};
use nephroid::low_level::graph::{Spirv, Stage, Use, VertexShader};

/// A kernel by its facts alone, with one word of push constants.
#[derive(Clone, Copy)]
pub struct Fake<T: 'static = KernelInfo>(pub &'static T);

/// Buffers of a [`Fake`], bound in the order of listing.
#[derive(Default)]
pub struct Wires(pub Vec<Use>);

impl Kernel for Fake {
    type Params = u32;
    type Bindings<'a> = Wires;
    fn info(&self) -> &'static KernelInfo {
        self.0
    }
    fn constants(&self) -> Vec<(u32, u32)> {
        Vec::new()
    }
}

impl Shader for Fake<ShaderInfo> {
    type Params = u32;
    type Bindings<'a> = Wires;
    fn info(&self) -> &'static ShaderInfo {
        self.0
    }
    fn constants(&self) -> Vec<(u32, u32)> {
        if self.0.stage == Stage::Fragment { vec![(20, 7)] } else { Vec::new() }
    }
}

impl VertexShader for Fake<ShaderInfo> {}
impl GeometryShader for Fake<ShaderInfo> {}
impl FragmentShader for Fake<ShaderInfo> {}

impl Bindings for Wires {
    fn uses(&self) -> Vec<Use> {
        self.0.clone()
    }
}

impl Wires {
    /// No buffers yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a buffer to read.
    pub fn read<T>(self, buf: &Buf<T>) -> Self {
        self.add(Use::read(0, buf).buffer, Access::Read)
    }

    /// Adds a buffer to write.
    pub fn write<T>(self, buf: &mut Buf<T>) -> Self {
        self.add(Use::write(0, buf).buffer, Access::Write)
    }

    /// Adds a buffer by its index.
    pub fn add(mut self, buffer: u32, access: Access) -> Self {
        self.0.push(Use { binding: self.0.len() as u32, buffer, access });
        self
    }
}

/// Facts of a kernel without code, 64 invocations to a group.
pub const fn facts(name: &'static str) -> KernelInfo {
    KernelInfo { name, spirv: Spirv(&[]), local_size: [64, 1, 1], push_bytes: 4, bindings: &[0, 1, 2, 3] }
}

/// Facts of a graphics kernel without code.
pub const fn shader(name: &'static str, stage: Stage, colours: u32) -> ShaderInfo {
    ShaderInfo { name, stage, colours, spirv: Spirv(&[]), push_bytes: 4, bindings: &[] }
}

/// Index of a buffer in its graph.
pub fn index<T>(buf: &Buf<T>) -> u32 {
    Use::read(0, buf).buffer
}
