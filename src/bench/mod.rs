//! Measurements for `nephroid bench`: each rate beside the least time that bytes or instructions allow.
//!
//! Everything is measured in one run of one process on one device, the yardsticks (a copy, a chain of multiplications)
//! included. A number is the median of several runs after one that is not counted. Times are the device's own where it
//! has timestamps.

mod blobs;
pub mod estimators;
pub mod growth;
mod host_sort;
mod maps;
mod photon_map;
mod primitives;
mod rays;
mod scene;
mod splats;
mod trees;
mod update;

pub use blobs::blobs;
pub use maps::{MapsReport, MapsRow, kinds as kinds_of_maps, maps};
pub use photon_map::{
    BuilderTimes, LEAF_SIZES, LeafTime, PERCENTILES, PhotonMapEffort, PhotonMapReport, Queries, Radii, photon_map,
};
pub use primitives::primitives;
pub use scene::{SceneReport, scene};
pub use trees::{DeformedRow, TreeRow, TreesReport, trees};
pub use update::{UpdateReport, UpdateRow, update};

use std::time::Instant;

use crate::error::Result;
use crate::graph::{DeviceClass, Graph, Plan, Runtime};
use crate::vk::DeviceKind;

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Items of scan and sort, and fragments of splats.
    pub items: u32,
    /// Runs of each measurement that count, at least 1.
    pub repeats: u32,
    /// Side of the square of primary rays, a power of two.
    pub rays: u32,
    /// Picture of the photon passes, pixels.
    pub size: [u32; 2],
}

impl Effort {
    /// 2^20 items on software devices, 2^25 on others, or what one binding shows.
    pub fn full(runtime: &Runtime) -> Self {
        let info = runtime.device().info();
        let items: u64 = if info.kind == DeviceKind::Software { 1 << 20 } else { 1 << 25 };
        Self { items: items.min(info.limits.storage_range / 8) as u32, repeats: 5, rays: 1024, size: [640, 480] }
    }

    /// Just enough to see that it runs; the numbers mean nothing.
    pub fn quick() -> Self {
        Self { items: 1 << 12, repeats: 1, rays: 32, size: [32, 24] }
    }

    /// Whether this is [`Effort::quick`].
    pub fn is_quick(&self) -> bool {
        *self == Self::quick()
    }
}

/// Least work of one item.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Floor {
    /// No bound that does not depend on the data.
    Unknown,
    /// Bytes moved, read or written.
    Bytes(f64),
    /// Instructions of one invocation.
    Instructions(f64),
}

/// What the device does at best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yardstick {
    /// Bytes a second of a copy, reading and writing counted.
    pub bytes_per_second: f64,
    /// Single-precision multiplications a second, all invocations together.
    pub instructions_per_second: f64,
}

/// One measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Rate {
    /// What was measured.
    pub name: &'static str,
    /// Items of one run.
    pub items: u64,
    /// What an item is, in the plural.
    pub unit: &'static str,
    /// Median time of a run.
    pub seconds: f64,
    /// Least work of an item.
    pub floor: Floor,
    /// What else is to be known.
    pub note: String,
}

impl Rate {
    /// Items a second.
    pub fn per_second(&self) -> f64 {
        self.items as f64 / self.seconds
    }

    /// Bytes a second, where the floor counts bytes.
    pub fn bytes_per_second(&self) -> Option<f64> {
        match self.floor {
            Floor::Bytes(bytes) => Some(bytes * self.per_second()),
            _ => None,
        }
    }

    /// Rate as a fraction of what the floor allows.
    pub fn of_floor(&self, yardstick: &Yardstick) -> Option<f64> {
        match self.floor {
            Floor::Unknown => None,
            Floor::Bytes(bytes) => Some(bytes * self.per_second() / yardstick.bytes_per_second),
            Floor::Instructions(n) => Some(n * self.per_second() / yardstick.instructions_per_second),
        }
    }
}

/// The middle of some values; of an even number the upper of the two.
///
/// # Panics
/// Without values.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Scope whose time counts in [`time`].
const MEASURED: &str = "measured";

/// Median seconds of the passes in the scope [`MEASURED`] of what `declare` declares.
fn time(runtime: &Runtime, repeats: u32, declare: impl FnOnce(&mut Graph)) -> Result<f64> {
    let mut g = Graph::new().with_device_class(device_class(runtime));
    declare(&mut g);
    time_plan(runtime, repeats, &planned(g)).map(|(seconds, _)| seconds)
}

/// The same of a plan, which can be read from afterwards.
fn time_plan(runtime: &Runtime, repeats: u32, plan: &Plan) -> Result<(f64, crate::graph::Executable)> {
    let mut executable = runtime.prepare(plan)?;
    executable.run()?; // memory is touched for the first time
    let mut seconds = Vec::new();
    for _ in 0..repeats.max(1) {
        let begin = Instant::now();
        executable.run()?;
        let whole = begin.elapsed().as_secs_f64();
        let own =
            executable.timings().iter().find(|t| t.name == MEASURED && t.depth == 0).map(|t| t.end_ns - t.start_ns);
        seconds.push(own.filter(|ns| *ns > 0).map_or(whole, |ns| ns as f64 * 1e-9));
    }
    Ok((median(seconds), executable))
}

fn planned(g: Graph) -> Plan {
    g.plan().unwrap_or_else(|error| panic!("a measurement is declared wrong: {error}"))
}

fn device_class(runtime: &Runtime) -> DeviceClass {
    runtime.device().info().kind.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_beside_their_floors() {
        let yardstick = Yardstick { bytes_per_second: 1e9, instructions_per_second: 2e9 };
        let rate = |floor| Rate { name: "", items: 1_000_000, unit: "", seconds: 0.1, floor, note: String::new() };
        assert_eq!(rate(Floor::Bytes(80.0)).of_floor(&yardstick), Some(0.8));
        assert_eq!(rate(Floor::Bytes(80.0)).bytes_per_second(), Some(8e8));
        assert_eq!(rate(Floor::Instructions(24.0)).of_floor(&yardstick), Some(0.12));
        assert_eq!(rate(Floor::Unknown).of_floor(&yardstick), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
    }
}
