//! Graphics passes as data: what a declaration leaves for planning and running.

use crate::draw_state::DrawState;

/// SPIR-V words, aligned.
pub struct Spirv(pub &'static [u8]);

/// Where a graphics kernel runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Once per vertex.
    Vertex,
    /// Once per primitive, of which it makes others.
    Geometry,
    /// Once per fragment: a pixel of a primitive.
    Fragment,
}

/// Facts of a compiled graphics kernel.
pub struct ShaderInfo {
    /// File stem of the kernel, and its stage.
    pub name: &'static str,
    /// Its code.
    pub spirv: Spirv,
    /// Where it runs.
    pub stage: Stage,
    /// Colours that a fragment kernel writes.
    pub colours: u32,
    /// Size of the push constants.
    pub push_bytes: u32,
    /// Binding numbers in set 0.
    pub bindings: &'static [u32],
}

/// Counts of an indirect draw (`VkDrawIndirectCommand`).
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct DrawArgs {
    /// Vertices of each instance.
    pub vertices: u32,
    /// Instances.
    pub instances: u32,
    /// Has to be 0.
    pub first_vertex: u32,
    /// Has to be 0: not every device has another.
    pub first_instance: u32,
}

/// How much a draw draws, buffers replaced by their index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DrawCount {
    /// So much.
    Direct {
        /// Vertices of each instance.
        vertices: u32,
        /// Instances.
        instances: u32,
    },
    /// What [`DrawArgs`] in this buffer say.
    Indirect(u32),
}

/// One kernel of a draw.
#[derive(Clone)]
pub struct StageSpec {
    /// The kernel.
    pub shader: &'static ShaderInfo,
    /// Specialisation constants.
    pub constants: Vec<(u32, u32)>,
    /// Push constants.
    pub params: Vec<u8>,
    /// Buffers, which it reads: binding number, index.
    pub bindings: Vec<(u32, u32)>,
}

/// One draw.
#[derive(Clone)]
pub struct DrawSpec {
    /// Its kernels, one or none of each stage, in the order of stages.
    pub stages: Vec<StageSpec>,
    /// Everything between the kernels.
    pub state: DrawState,
    /// How much is drawn.
    pub count: DrawCount,
}

/// A graphics pass.
#[derive(Clone)]
pub struct RasterSpec {
    /// Width and height of the picture.
    pub extent: [u32; 2],
    /// What depths are cleared to, if the pass has any.
    pub depth: Option<f32>,
    /// The draws, in order.
    pub draws: Vec<DrawSpec>,
    /// The buffer that gets each colour.
    pub outputs: Vec<u32>,
}

impl DrawSpec {
    /// Name for messages: that of the vertex kernel.
    pub fn name(&self) -> &'static str {
        self.stages[0].shader.name
    }

    /// The kernel of a stage.
    pub fn stage(&self, stage: Stage) -> Option<&StageSpec> {
        self.stages.iter().find(|spec| spec.shader.stage == stage)
    }

    /// Whether the draw changes colours.
    pub fn writes_colour(&self) -> bool {
        self.stage(Stage::Fragment).is_some_and(|fragment| fragment.shader.colours > 0)
    }

    /// Buffers of all stages by ascending binding number, each once.
    pub fn bindings(&self) -> Vec<(u32, u32)> {
        let mut all: Vec<_> = self.stages.iter().flat_map(|stage| stage.bindings.iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Push constants of all stages: the longest, of which the others are the start.
    pub fn params(&self) -> &[u8] {
        self.stages.iter().map(|stage| stage.params.as_slice()).max_by_key(|params| params.len()).unwrap_or_default()
    }

    fn fault(&self, colours: usize, has_depth: bool) -> Option<String> {
        let name = self.name();
        if let Some(pair) = self.bindings().windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Some(format!(
                "binding {} of '{name}' is one buffer in one stage and another in another",
                pair[0].0
            ));
        }
        let params = self.params();
        if self.stages.iter().any(|stage| !params.starts_with(&stage.params)) {
            return Some(format!("the stages of '{name}' get different parameters"));
        }
        if let Some(fragment) = self.stage(Stage::Fragment).map(|stage| stage.shader)
            && self.writes_colour()
            && fragment.colours as usize != colours
        {
            return Some(format!("'{}' writes {} colours of {colours}: all or none", fragment.name, fragment.colours));
        }
        if self.state.needs_depth() && !has_depth {
            return Some(format!("'{name}' needs depths, the pass has none"));
        }
        None
    }
}

impl RasterSpec {
    /// What no device could do, apart from what depends on buffers.
    pub fn fault(&self) -> Option<String> {
        let [width, height] = self.extent;
        if width == 0 || height == 0 {
            return Some(format!("a picture of {width} x {height} pixels"));
        }
        if let Some(depth) = self.depth.filter(|depth| !(0.0..=1.0).contains(depth)) {
            return Some(format!("depths are cleared to {depth}, outside of [0, 1]"));
        }
        self.draws.iter().find_map(|draw| draw.fault(self.outputs.len(), self.depth.is_some()))
    }
}
