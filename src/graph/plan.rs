//! From declarations to a plan: check, cull, group into phases, place transients. Pure: no device.

use std::fmt;

use super::declare::{Access, BufferInfo, BufferKind, Graph, GridSpec, MOST_GROUPS, Operation, PassInfo, Use};
use super::draw::{DrawCount, RasterSpec};
use super::place::{Placement, Transient, padded, place};

/// A mistake in the declarations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlanError {
    /// A transient is read before any pass has written it.
    ReadBeforeWrite {
        /// The reading pass.
        pass: &'static str,
        /// The buffer.
        buffer: &'static str,
    },
    /// A pass writes a buffer that was imported for reading.
    WriteToReadOnly {
        /// The writing pass.
        pass: &'static str,
        /// The buffer.
        buffer: &'static str,
    },
    /// An indirect dispatch or draw takes its counts from a buffer that holds none when it runs.
    UnknownArguments {
        /// The dispatch.
        pass: &'static str,
        /// The buffer.
        buffer: &'static str,
    },
    /// A dispatch has more workgroups along an axis than every device allows (65,535), or more invocations than a `u32`
    /// can number.
    Grid {
        /// The dispatch.
        pass: &'static str,
        /// Its workgroups.
        groups: [u32; 2],
    },
    /// A graphics pass is impossible on every device.
    Raster {
        /// The pass.
        pass: &'static str,
        /// What is wrong with it.
        what: String,
    },
    /// A pass uses one buffer twice, at least once for writing.
    Aliased {
        /// The pass.
        pass: &'static str,
        /// The buffer.
        buffer: &'static str,
    },
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReadBeforeWrite { pass, buffer } => write!(f, "pass '{pass}' reads '{buffer}' before it is written"),
            Self::WriteToReadOnly { pass, buffer } => write!(f, "pass '{pass}' writes '{buffer}', imported read-only"),
            Self::UnknownArguments { pass, buffer } => {
                write!(f, "pass '{pass}' takes its counts from '{buffer}', which no earlier pass has written")
            }
            Self::Grid { pass, groups: [x, y] } => {
                write!(f, "pass '{pass}' on {x} x {y} workgroups: too many along one axis, or beyond 2^32 invocations")
            }
            Self::Raster { pass, what } => write!(f, "graphics pass '{pass}': {what}"),
            Self::Aliased { pass, buffer } => write!(f, "pass '{pass}' uses '{buffer}' twice, once for writing"),
        }
    }
}

impl std::error::Error for PlanError {}

/// What will run, in which order, in which memory.
pub struct Plan {
    /// All declared buffers.
    pub buffers: Vec<BufferInfo>,
    /// Kept passes in order.
    pub passes: Vec<PassInfo>,
    /// Phase of each kept pass; a barrier stands between two phases.
    pub phase: Vec<u32>,
    /// Passes that reach no root, in order.
    pub culled: Vec<PassInfo>,
    /// First and last phase in which a buffer is used; `None` if it is unused.
    pub lifetime: Vec<Option<(u32, u32)>>,
    /// Memory of each transient that is used.
    pub placement: Vec<Option<Placement>>,
    /// Size of each arena in bytes.
    pub arenas: Vec<u64>,
    /// Names of scopes.
    pub scope_names: Vec<&'static str>,
    /// Phases whose leading barrier is left out on purpose: only to prove that the barrier is needed.
    pub(super) sabotaged: Vec<u32>,
    /// What transients hold before their first pass, if that is set.
    pub(super) poison: Option<u32>,
}

impl Graph {
    /// Plans the declared passes.
    pub fn plan(self) -> Result<Plan, PlanError> {
        self.check()?;
        let needed = self.needed();
        let (mut passes, mut culled) = (Vec::new(), Vec::new());
        for (pass, needed) in self.passes.into_iter().zip(needed) {
            if needed { passes.push(pass) } else { culled.push(pass) }
        }
        let phase = phases(&passes, self.buffers.len());
        let lifetime = lifetimes(&passes, &phase, self.buffers.len());
        let transients = self.buffers.iter().zip(&lifetime).map(|(info, lifetime)| {
            let lifetime = lifetime.filter(|_| matches!(info.kind, BufferKind::Transient))?;
            Some(Transient { bytes: info.bytes, lifetime })
        });
        let (placement, arenas) = place(transients);
        Ok(Plan {
            buffers: self.buffers,
            passes,
            phase,
            culled,
            lifetime,
            placement,
            arenas,
            scope_names: self.scope_names,
            sabotaged: Vec::new(),
            poison: None,
        })
    }

    fn check(&self) -> Result<(), PlanError> {
        let mut written: Vec<bool> = self.buffers.iter().map(|b| !matches!(b.kind, BufferKind::Transient)).collect();
        for pass in &self.passes {
            self.check_grid(pass, &written)?;
            for (i, usage) in pass.uses.iter().enumerate() {
                let info = &self.buffers[usage.buffer as usize];
                let (name, buffer) = (pass.name, info.name);
                if usage.access == Access::Write && info.read_only {
                    return Err(PlanError::WriteToReadOnly { pass: name, buffer });
                }
                if usage.access == Access::Read && !written[usage.buffer as usize] {
                    return Err(PlanError::ReadBeforeWrite { pass: name, buffer });
                }
                let writes = |other: &Use| usage.access == Access::Write || other.access == Access::Write;
                if pass.uses[..i].iter().any(|other| other.buffer == usage.buffer && writes(other)) {
                    return Err(PlanError::Aliased { pass: name, buffer });
                }
            }
            for usage in pass.uses.iter().filter(|u| u.access == Access::Write) {
                written[usage.buffer as usize] = true;
            }
        }
        Ok(())
    }

    /// Windows need no check: they are made of whole grids of at most 2^31 items.
    fn check_grid(&self, pass: &PassInfo, written: &[bool]) -> Result<(), PlanError> {
        if let Operation::Raster(spec) = &pass.operation {
            return self.check_raster(pass, spec, written);
        }
        let Operation::Dispatch { grid, kernel, .. } = &pass.operation else { return Ok(()) };
        match *grid {
            GridSpec::Groups(groups) => {
                let invocations = groups.iter().chain(&kernel.local_size).map(|&n| u128::from(n)).product::<u128>();
                if groups.iter().any(|&count| count > MOST_GROUPS) || invocations > 1 << 32 {
                    return Err(PlanError::Grid { pass: pass.name, groups });
                }
            }
            GridSpec::Indirect(buffer) => self.check_arguments(pass, buffer, written)?,
        }
        Ok(())
    }

    fn check_arguments(&self, pass: &PassInfo, buffer: u32, written: &[bool]) -> Result<(), PlanError> {
        let info = &self.buffers[buffer as usize];
        if info.len == 0 || !written[buffer as usize] {
            return Err(PlanError::UnknownArguments { pass: pass.name, buffer: info.name });
        }
        Ok(())
    }

    fn check_raster(&self, pass: &PassInfo, spec: &RasterSpec, written: &[bool]) -> Result<(), PlanError> {
        let wrong = |what: String| Err(PlanError::Raster { pass: pass.name, what });
        if let Some(what) = spec.fault() {
            return wrong(what);
        }
        let [width, height] = spec.extent;
        for info in spec.outputs.iter().map(|&buffer| &self.buffers[buffer as usize]) {
            if u64::from(info.len) < u64::from(width) * u64::from(height) {
                let (name, len) = (info.name, info.len);
                return wrong(format!("'{name}' holds {len} pixels, the picture has {width} x {height}"));
            }
        }
        for draw in &spec.draws {
            if let DrawCount::Indirect(buffer) = draw.count {
                self.check_arguments(pass, buffer, written)?;
            }
        }
        Ok(())
    }

    /// Walks backward from the roots. A write never ends a buffer's need, because it may be partial; a fill does.
    fn needed(&self) -> Vec<bool> {
        let mut live = vec![false; self.buffers.len()];
        for &buffer in &self.kept {
            live[buffer as usize] = true;
        }
        let mut needed = vec![false; self.passes.len()];
        for (index, pass) in self.passes.iter().enumerate().rev() {
            let root = matches!(pass.operation, Operation::Readback(_));
            let written = || pass.uses.iter().filter(|u| u.access == Access::Write);
            needed[index] = root || written().any(|u| live[u.buffer as usize]);
            if !needed[index] {
                continue;
            }
            let fills = matches!(pass.operation, Operation::Fill(_));
            for usage in &pass.uses {
                live[usage.buffer as usize] = !fills;
            }
        }
        needed
    }
}

impl Plan {
    /// Number of phases.
    pub fn phases(&self) -> u32 {
        self.phase.last().map_or(0, |last| last + 1)
    }

    /// Bytes that transients would need without aliasing.
    pub fn transient_bytes(&self) -> u64 {
        let used = self.buffers.iter().zip(&self.placement).filter(|(_, place)| place.is_some());
        used.map(|(info, _)| padded(info.bytes)).sum()
    }

    /// Fills every transient with `word` when its life begins. A result that depends on the word was computed from
    /// memory that no pass wrote; a result that is wrong then, from memory given to two transients at once.
    pub fn poison(&mut self, word: u32) {
        self.poison = Some(word);
    }

    /// Leaves out the barrier before `phase`. Exists to prove, in tests, that a missing barrier is noticed.
    #[doc(hidden)]
    pub fn sabotage_barrier(&mut self, phase: u32) {
        self.sabotaged.push(phase);
    }
}

/// A pass joins the current phase unless it touches a buffer that this phase writes, or writes one that it reads.
fn phases(passes: &[PassInfo], buffer_count: usize) -> Vec<u32> {
    let mut current = 0;
    let (mut read, mut written) = (vec![u32::MAX; buffer_count], vec![u32::MAX; buffer_count]);
    let mut result = Vec::with_capacity(passes.len());
    for pass in passes {
        let conflict = pass.uses.iter().any(|u| {
            let buffer = u.buffer as usize;
            written[buffer] == current || (u.access == Access::Write && read[buffer] == current)
        });
        if conflict {
            current += 1;
        }
        for usage in &pass.uses {
            let table = if usage.access == Access::Write { &mut written } else { &mut read };
            table[usage.buffer as usize] = current;
        }
        result.push(current);
    }
    result
}

fn lifetimes(passes: &[PassInfo], phase: &[u32], buffer_count: usize) -> Vec<Option<(u32, u32)>> {
    let mut lifetime: Vec<Option<(u32, u32)>> = vec![None; buffer_count];
    for (pass, &phase) in passes.iter().zip(phase) {
        for usage in &pass.uses {
            let slot = &mut lifetime[usage.buffer as usize];
            *slot = Some(slot.map_or((phase, phase), |(first, _)| (first, phase)));
        }
    }
    lifetime
}
