//! Recorded commands: replay, waiting, timestamps, crash markers.

use super::buffer::{Buffer, BufferInner};
use super::call::failed;
use super::core::Core;
use super::image::ImageInner;
use super::pipeline::Pipeline;
use crate::error::{Error, Result};
use ash::vk;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Queries of one pool; a scope takes two, and more pools are made as needed.
pub(super) const QUERY_CHUNK: u32 = 256;

/// Scopes that get a crash marker; later ones of the same commands get none.
pub(super) const MARKED_SCOPES: usize = 1024;

/// When a scope of the commands ran.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScopeTiming {
    /// The scope's name.
    pub name: String,
    /// How many scopes enclose it.
    pub depth: u32,
    /// When everything before it had finished, in nanoseconds of the device's clock (arbitrary origin, common to all
    /// commands of a device).
    pub start_ns: u64,
    /// When its last command had finished, on the same clock.
    pub end_ns: u64,
}

/// A scope while recording and afterwards.
pub(super) struct Scope {
    pub name: String,
    pub depth: u32,
}

/// A command buffer and everything it uses.
pub(super) struct CommandState {
    pub core: Arc<Core>,
    pub name: String,
    pub pool: vk::CommandPool,
    pub commands: vk::CommandBuffer,
    pub descriptor_pools: Vec<vk::DescriptorPool>,
    /// Scope `i` has queries `2 i` and `2 i + 1`, counted through all pools.
    pub query_pools: Vec<vk::QueryPool>,
    pub scopes: Vec<Scope>,
    /// One word per scope, 1 once it has finished.
    pub markers: Option<Buffer>,
    /// Shares that keep what the commands name alive. Keyed by handle, so that each is held once.
    pub buffers: BTreeMap<u64, Arc<BufferInner>>,
    pub images: BTreeMap<u64, Arc<ImageInner>>,
    pub pipelines: BTreeMap<u64, Arc<Pipeline>>,
    /// Timeline value of the last submission; 0 before the first.
    pub last: AtomicU64,
}

/// Commands that can be submitted any number of times, also while an earlier submission still runs: submissions of a
/// device follow each other.
pub struct Commands {
    pub(super) state: Arc<CommandState>,
}

/// One run of some [`Commands`]. Dropping it without waiting is fine: memory stays alive until the device is done.
pub struct Submission {
    state: Arc<CommandState>,
    value: u64,
}

impl Commands {
    /// Hands the commands to the device and returns at once.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], or [`Error::Vulkan`] if the driver refuses.
    pub fn submit(&self) -> Result<Submission> {
        let state = &self.state;
        let value = state.core.submit(state.commands, &state.name)?;
        state.last.fetch_max(value, Ordering::Relaxed);
        Ok(Submission { state: Arc::clone(state), value })
    }

    /// When each scope ran, in the order in which they were opened, from the last run. Empty before the first run has
    /// finished, while one is running, and on devices without timestamps.
    pub fn timings(&self) -> Vec<ScopeTiming> {
        let state = &self.state;
        let last = state.last.load(Ordering::Relaxed);
        if last == 0 || !state.core.reached(last).unwrap_or(false) {
            return Vec::new();
        }
        let ticks: Option<Vec<u64>> = state.ticks().into_iter().collect();
        ticks.map(|ticks| state.timings(&ticks)).unwrap_or_default()
    }
}

impl Submission {
    /// Waits until the run has finished; what it wrote can then be read.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] with the last scope known to have finished, also if the device does not answer within
    /// [`super::DeviceOptions::wait_limit`].
    pub fn wait(&self) -> Result<()> {
        let state = &self.state;
        if state.core.wait(self.value, &state.name)? {
            return Ok(());
        }
        Err(Error::DeviceLost { last_finished_scope: state.last_finished() })
    }

    /// Whether the run has finished, without waiting.
    ///
    /// # Errors
    /// [`Error::DeviceLost`] or [`Error::Vulkan`] if the driver cannot tell.
    pub fn is_done(&self) -> Result<bool> {
        self.state.core.reached(self.value)
    }
}

impl CommandState {
    /// The timestamps of all scopes, none where not (yet) written.
    fn ticks(&self) -> Vec<Option<u64>> {
        let wanted = 2 * self.scopes.len();
        let mut ticks = Vec::with_capacity(wanted);
        for &pool in &self.query_pools {
            let count = (wanted - ticks.len()).min(QUERY_CHUNK as usize);
            // Value and availability of each query.
            let mut values = vec![[0u64; 2]; count];
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
            // SAFETY: the pool belongs to this device, `count` queries of it are used, and they have been reset by the
            // commands, which were submitted (VUID-vkGetQueryPoolResults-None-09401); the stride is that of `values`.
            let done = unsafe { self.core.raw.get_query_pool_results(pool, 0, &mut values, flags) };
            let known = done.is_ok() || done == Err(vk::Result::NOT_READY);
            ticks.extend(values.iter().map(|&[value, available]| (known && available != 0).then_some(value)));
        }
        ticks
    }

    fn timings(&self, ticks: &[u64]) -> Vec<ScopeTiming> {
        let limits = &self.core.info.limits;
        let clock = Clock::new(ticks.first().copied().unwrap_or(0), limits.timestamp_bits, limits.timestamp_period_ns);
        let pairs = self.scopes.iter().zip(ticks.chunks_exact(2));
        pairs
            .map(|(scope, pair)| ScopeTiming {
                name: scope.name.clone(),
                depth: scope.depth,
                start_ns: clock.ns(pair[0]),
                end_ns: clock.ns(pair[1]),
            })
            .collect()
    }

    /// The scope that finished last before the device was lost, by the markers or else by the timestamps.
    pub(super) fn last_finished(&self) -> String {
        let finished: Vec<bool> = match &self.markers {
            Some(markers) => {
                let mut bytes = vec![0; markers.bytes() as usize];
                markers.read(0, &mut bytes);
                bytes.chunks_exact(4).map(|word| word != [0; 4]).take(self.scopes.len()).collect()
            }
            None => self.ticks().chunks(2).map(|pair| pair.iter().all(Option::is_some)).collect(),
        };
        format!("{} of '{}'", last_finished(&self.scopes, &finished), self.name)
    }
}

impl Drop for CommandState {
    fn drop(&mut self) {
        let last = self.last.load(Ordering::Relaxed);
        if last > 0 && !matches!(self.core.wait(last, &self.name), Ok(true)) && !self.core.is_lost() {
            // Still running without end: leak all it may use.
            std::mem::forget(std::mem::take(&mut self.buffers));
            std::mem::forget(std::mem::take(&mut self.images));
            std::mem::forget(std::mem::take(&mut self.pipelines));
            std::mem::forget(self.markers.take());
            return;
        }
        // SAFETY: the last submission has finished or the device is lost, and this is the only owner
        // (VUID-vkDestroyCommandPool-commandPool-00041 and its like for the other pools).
        unsafe {
            let device = &self.core.raw;
            device.destroy_command_pool(self.pool, None);
            self.descriptor_pools.iter().for_each(|&pool| device.destroy_descriptor_pool(pool, None));
            self.query_pools.iter().for_each(|&pool| device.destroy_query_pool(pool, None));
        }
    }
}

/// Of the finished scopes the one that ended last. Scopes end in the order of their last command; an enclosing scope
/// ends after those inside, which follow it in the list.
fn last_finished(scopes: &[Scope], finished: &[bool]) -> String {
    let mut best: Option<usize> = None;
    for (index, _) in finished.iter().enumerate().filter(|&(_, &done)| done) {
        let inside = best.is_some_and(|outer| encloses(scopes, outer, index));
        if !inside {
            best = Some(index);
        }
    }
    best.map_or_else(|| "none".to_owned(), |index| format!("'{}'", scopes[index].name))
}

/// Whether scope `inner` (later in the list) lies inside scope `outer`.
fn encloses(scopes: &[Scope], outer: usize, inner: usize) -> bool {
    scopes[outer + 1..=inner].iter().all(|scope| scope.depth > scopes[outer].depth)
}

/// Turns ticks, which may wrap around, into nanoseconds.
struct Clock {
    first: u64,
    mask: u64,
    period_ns: f64,
}

impl Clock {
    fn new(first: u64, bits: u32, period_ns: f32) -> Self {
        let mask = if bits >= 64 { u64::MAX } else { (1 << bits) - 1 };
        Self { first: first & mask, mask, period_ns: period_ns.into() }
    }

    /// Differences are taken before the conversion, so that they keep all bits.
    fn ns(&self, ticks: u64) -> u64 {
        let since = ticks.wrapping_sub(self.first) & self.mask;
        ((self.first as f64 * self.period_ns) as u64).wrapping_add((since as f64 * self.period_ns).round() as u64)
    }
}

/// Makes a pool of timestamp queries.
pub(super) fn create_query_pool(core: &Core, name: &str) -> Result<vk::QueryPool> {
    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(QUERY_CHUNK);
    // SAFETY: the count is not zero (VUID-VkQueryPoolCreateInfo-queryCount-02763).
    unsafe { core.raw.create_query_pool(&info, None) }.map_err(failed("vkCreateQueryPool", name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scopes() -> Vec<Scope> {
        let scope = |name: &str, depth| Scope { name: name.into(), depth };
        vec![scope("frame", 0), scope("eye", 1), scope("trace", 2), scope("photons", 1), scope("film", 0)]
    }

    #[test]
    fn the_last_finished_scope_is_the_one_that_ended_last() {
        let name = |finished: [bool; 5]| last_finished(&scopes(), &finished);
        assert_eq!(name([false; 5]), "none");
        assert_eq!(name([false, false, true, false, false]), "'trace'");
        assert_eq!(name([false, true, true, false, false]), "'eye'");
        assert_eq!(name([false, true, true, true, false]), "'photons'");
        assert_eq!(name([true, true, true, true, false]), "'frame'");
        assert_eq!(name([true; 5]), "'film'");
    }

    #[test]
    fn clocks_survive_a_wrap_around_and_large_counts() {
        let clock = Clock::new((1 << 36) - 10, 36, 2.0);
        assert_eq!(clock.ns(5) - clock.ns((1 << 36) - 10), 30);
        let clock = Clock::new(u64::MAX - 1, 64, 1.0);
        assert_eq!(clock.ns(3).wrapping_sub(clock.ns(u64::MAX - 1)), 5);
    }
}
