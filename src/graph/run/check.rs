//! Whether a device can run a plan: found before any memory is taken.

use super::images::raster_passes;
use crate::error::{Error, MemoryCause, Result};
use crate::graph::declare::{Operation, Use};
use crate::graph::draw::Stage;
use crate::graph::plan::Plan;
use crate::vk::{Device, Feature};

/// Refuses a plan that needs more of a buffer at once than one binding can show, or draws that the device cannot do.
pub(super) fn check(device: &Device, plan: &Plan) -> Result<()> {
    check_ranges(plan, device.info().limits.storage_range)?;
    check_draws(device, plan)
}

/// Refuses a plan whose kernels need more of a buffer at once than one binding can show.
fn check_ranges(plan: &Plan, longest: u64) -> Result<()> {
    for pass in &plan.passes {
        let (kernel, windowed) = match &pass.operation {
            Operation::Dispatch { kernel, .. } => (kernel, [].as_slice()),
            Operation::Windows { kernel, bindings, .. } => (kernel, bindings.as_slice()),
            _ => continue,
        };
        for usage in pass.uses.iter().filter(|u| u.binding != Use::NO_BINDING && !windowed.contains(&u.binding)) {
            check_range(plan, usage.buffer, kernel.name, longest)?;
        }
    }
    Ok(())
}

/// Refuses to show `kernel` more than `longest` bytes of a buffer.
fn check_range(plan: &Plan, buffer: u32, kernel: &str, longest: u64) -> Result<()> {
    let info = &plan.buffers[buffer as usize];
    if info.bytes <= longest {
        return Ok(());
    }
    Err(Error::OutOfMemory {
        object: format!("{} in {kernel}", info.name),
        bytes: info.bytes,
        cause: MemoryCause::BindingTooLong { longest },
    })
}

/// Refuses a plan whose draws the device cannot do, or that need more of a buffer than one binding shows.
fn check_draws(device: &Device, plan: &Plan) -> Result<()> {
    let longest = device.info().limits.storage_range;
    for spec in raster_passes(plan) {
        device.require(&[Feature::Raster])?;
        for draw in &spec.draws {
            if draw.stage(Stage::Geometry).is_some() {
                device.require(&[Feature::GeometryShader])?;
            }
            if draw.state.depth_clamp {
                device.require(&[Feature::DepthClamp])?;
            }
            for (_, buffer) in draw.bindings() {
                check_range(plan, buffer, draw.name(), longest)?;
            }
        }
    }
    Ok(())
}
