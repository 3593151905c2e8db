//! The command-graph scheduler: declare passes, plan them without a device, run the plan as often as wanted.
//!
//! ```text
//! Graph (declare) --plan()--> Plan (pure data: kept and culled passes, phases, memory)
//!                 --Runtime::prepare()--> Executable
//! ```
//! Passes run in declaration order, grouped into phases with one global barrier between two phases. Nothing on the way
//! to the command buffer iterates an unordered map: the same declarations give the same plan and the same bits.

mod declare;
mod draw;
mod dump;
mod place;
mod plan;
mod raster;
mod run;
mod trace;
mod windows;

pub use declare::{
    Access, Bindings, Buf, BufferInfo, BufferKind, DeviceClass, DispatchArgs, Graph, Grid, GridSpec, Input, Kernel,
    KernelInfo, Operation, PassInfo, Persistent, ReadBuf, Readback, Tally, Use, WindowSpec,
};
pub use draw::{DrawArgs, DrawCount, DrawSpec, RasterSpec, ShaderInfo, Spirv, Stage, StageSpec};
pub use place::Placement;
pub use plan::{Plan, PlanError};
pub use raster::{Draw, FragmentShader, GeometryShader, Instances, RasterPass, Shader, VertexShader};
pub use run::{Executable, Runtime};
pub use trace::{Timing, chrome_trace};
pub use windows::{Window, Windows};
