//! Declaring graphics passes: draws on pictures that live inside of one pass and leave it as buffers.
//!
//! A pass clears its pictures, runs its draws one after the other, and copies each picture row by row, pixel (0, 0)
//! first, into a buffer of `[f32; 4]`. The graph sees a pass that reads and writes buffers, like any other.

use std::marker::PhantomData;

use bytemuck::Pod;

use super::declare::{Access, Bindings, Buf, Graph, Operation, Use};
use super::draw::{DrawArgs, DrawCount, DrawSpec, RasterSpec, ShaderInfo, StageSpec};
use crate::draw_state::DrawState;

/// Colours of one pass that every device allows (the least value of `maxColorAttachments`).
const MOST_COLOURS: usize = 4;

/// A graphics kernel with its specialisation constants; implemented by generated code.
pub trait Shader {
    /// Push constants. Where several stages of a draw have some, they are given the same bytes; one block may continue
    /// where another ends.
    type Params: Pod;
    /// Buffers, all of them only read. A binding number means the same buffer in all stages of a draw.
    type Bindings<'a>: Bindings;
    /// Facts of the compiled module.
    fn info(&self) -> &'static ShaderInfo;
    /// Specialisation constants as (id, bits).
    fn constants(&self) -> Vec<(u32, u32)>;
}

/// A kernel that places vertices.
pub trait VertexShader: Shader {}

/// A kernel that makes primitives out of primitives. Not every device runs them.
pub trait GeometryShader: Shader {}

/// A kernel that colours fragments.
pub trait FragmentShader: Shader {}

/// How much a draw draws.
pub enum Instances<'a> {
    /// So much.
    Direct {
        /// Vertices of each instance.
        vertices: u32,
        /// Instances.
        instances: u32,
    },
    /// What an earlier pass has written.
    Indirect(&'a Buf<DrawArgs>),
}

/// One draw of [`Graph::raster`]: a vertex kernel, and what else it is given. It holds on to its buffers as borrowed.
///
/// Without a fragment kernel it only leaves depths.
pub struct Draw<'a> {
    spec: DrawSpec,
    buffers: PhantomData<&'a ()>,
}

impl<'a> Draw<'a> {
    /// A draw by its vertex kernel, with the default [`DrawState`].
    pub fn new<V: VertexShader>(vertex: V, count: Instances<'a>, params: V::Params, bind: V::Bindings<'a>) -> Self {
        let count = match count {
            Instances::Direct { vertices, instances } => DrawCount::Direct { vertices, instances },
            Instances::Indirect(args) => DrawCount::Indirect(args.id),
        };
        let stages = vec![stage(&vertex, params, bind)];
        Self { spec: DrawSpec { stages, state: DrawState::default(), count }, buffers: PhantomData }
    }

    /// Adds a geometry kernel.
    pub fn geometry<G: GeometryShader>(self, geometry: G, params: G::Params, bind: G::Bindings<'a>) -> Self {
        self.with(stage(&geometry, params, bind))
    }

    /// Adds a fragment kernel.
    pub fn fragment<F: FragmentShader>(self, fragment: F, params: F::Params, bind: F::Bindings<'a>) -> Self {
        self.with(stage(&fragment, params, bind))
    }

    /// Sets everything between the kernels.
    pub fn state(mut self, state: DrawState) -> Self {
        self.spec.state = state;
        self
    }

    /// Adds a stage, in place of another of its kind.
    fn with(mut self, stage: StageSpec) -> Self {
        self.spec.stages.retain(|known| known.shader.stage != stage.shader.stage);
        self.spec.stages.push(stage);
        self.spec.stages.sort_by_key(|stage| stage.shader.stage);
        self
    }
}

fn stage<S: Shader>(shader: &S, params: S::Params, bind: S::Bindings<'_>) -> StageSpec {
    let info = shader.info();
    let uses = bind.uses();
    assert!(uses.iter().all(|usage| usage.access == Access::Read), "'{}' writes a buffer", info.name);
    let params = bytemuck::bytes_of(&params).to_vec();
    assert_eq!(params.len(), info.push_bytes as usize, "push constants of '{}'", info.name);
    StageSpec {
        shader: info,
        constants: shader.constants(),
        params,
        bindings: uses.iter().map(|usage| (usage.binding, usage.buffer)).collect(),
    }
}

/// The pictures of [`Graph::raster`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RasterPass {
    /// Name for messages and dumps.
    pub name: &'static str,
    /// Width and height in pixels.
    pub extent: [u32; 2],
    /// What the depths are cleared to, in [0, 1]; without, draws neither test nor leave depths. 1 suits
    /// [`DepthTest::Less`](crate::draw_state::DepthTest::Less), 0 suits `Greater`.
    pub depth: Option<f32>,
}

impl Graph {
    /// Clears one picture per output to 0, draws on all of them at once (colour `i` of a fragment kernel goes to
    /// picture `i`), and copies each into its output. Elements of an output beyond the picture keep what they were.
    ///
    /// Needs a device with [`Feature::Raster`](crate::vk::Feature::Raster): on another the plan is fine, but
    /// [`super::Runtime::prepare`] refuses it.
    pub fn raster<const N: usize>(&mut self, pass: RasterPass, draws: Vec<Draw<'_>>, outputs: [&mut Buf<[f32; 4]>; N]) {
        const { assert!(N >= 1 && N <= MOST_COLOURS, "one to four colours") };
        let draws: Vec<DrawSpec> = draws.into_iter().map(|draw| draw.spec).collect();
        let mut reads: Vec<u32> = Vec::new();
        for draw in &draws {
            let arguments = match draw.count {
                DrawCount::Indirect(buffer) => Some(buffer),
                DrawCount::Direct { .. } => None,
            };
            for buffer in draw.bindings().into_iter().map(|(_, buffer)| buffer).chain(arguments) {
                if !reads.contains(&buffer) {
                    reads.push(buffer);
                }
            }
        }
        let binding = Use::NO_BINDING;
        let mut uses: Vec<_> = reads.into_iter().map(|buffer| Use { binding, buffer, access: Access::Read }).collect();
        uses.extend(outputs.iter().map(|output| Use::write(binding, output)));
        let outputs = outputs.iter().map(|output| output.id).collect();
        let spec = RasterSpec { extent: pass.extent, depth: pass.depth, draws, outputs };
        self.push(pass.name, Operation::Raster(spec), uses);
    }
}
