//! Plans as text (stable, for snapshots) and as DOT (for pictures).

use std::fmt::Write;

use super::declare::{Access, BufferKind, GridSpec, Operation, PassInfo};
use super::draw::{DrawCount, RasterSpec};
use super::plan::Plan;
use crate::draw_state::Cull;

impl Plan {
    /// The plan as text: phases, passes with their buffers, culled passes, memory.
    pub fn dump(&self) -> String {
        let mut text = String::new();
        for (index, pass) in self.passes.iter().enumerate() {
            if index == 0 || self.phase[index] != self.phase[index - 1] {
                let _ = writeln!(text, "phase {}", self.phase[index]);
            }
            let _ = writeln!(text, "  {}", self.describe(pass));
        }
        if !self.culled.is_empty() {
            text.push_str("culled\n");
        }
        for pass in &self.culled {
            let _ = writeln!(text, "  {}", self.describe(pass));
        }
        text.push_str("memory\n");
        for (info, place) in self.buffers.iter().zip(&self.placement) {
            if let Some(place) = place {
                let _ = writeln!(text, "  {:>12} at {}:{} {}", info.bytes, place.arena, place.offset, info.name);
            }
        }
        for (arena, bytes) in self.arenas.iter().enumerate() {
            let _ = writeln!(text, "  arena {arena}: {bytes} bytes");
        }
        let _ = writeln!(text, "  {} bytes without aliasing", self.transient_bytes());
        text
    }

    fn describe(&self, pass: &PassInfo) -> String {
        let scopes: Vec<_> = pass.scopes.iter().map(|&scope| self.scope_names[scope as usize]).collect();
        let mut text =
            if scopes.is_empty() { pass.name.into() } else { format!("{}: {}", scopes.join("/"), pass.name) };
        match &pass.operation {
            Operation::Dispatch { grid, constants, .. } => {
                let _ = match grid {
                    GridSpec::Groups([x, y]) => write!(text, " [{x} x {y}]"),
                    GridSpec::Indirect(buffer) => write!(text, " [by {}]", self.name(*buffer)),
                };
                describe_constants(&mut text, constants);
            }
            Operation::Windows { windows, constants, .. } => {
                let sizes: Vec<_> = windows.iter().map(|window| window.count.to_string()).collect();
                let _ = write!(text, " [windows of {}]", sizes.join(" + "));
                describe_constants(&mut text, constants);
            }
            Operation::Raster(spec) => self.describe_raster(&mut text, spec),
            Operation::Fill(word) => {
                let _ = write!(text, " {word:#x}");
            }
            Operation::Copy(bytes) => {
                let _ = write!(text, " {bytes} bytes");
            }
            Operation::Readback(_) => {}
        }
        for (access, sign) in [(Access::Read, "<-"), (Access::Write, "->")] {
            let names: Vec<_> = pass.uses.iter().filter(|u| u.access == access).map(|u| self.name(u.buffer)).collect();
            if !names.is_empty() {
                let _ = write!(text, " {sign} {}", names.join(", "));
            }
        }
        text
    }

    fn describe_raster(&self, text: &mut String, spec: &RasterSpec) {
        let [width, height] = spec.extent;
        let _ = write!(text, " [{width} x {height}, colours {}", spec.outputs.len());
        if let Some(depth) = spec.depth {
            let _ = write!(text, ", depth {depth}");
        }
        text.push(']');
        for draw in &spec.draws {
            text.push_str(" {");
            for (index, stage) in draw.stages.iter().enumerate() {
                let _ = write!(text, "{}{}", if index > 0 { " + " } else { "" }, stage.shader.name);
                describe_constants(text, &stage.constants);
            }
            let _ = match draw.count {
                DrawCount::Direct { vertices, instances } => write!(text, ", {vertices} x {instances}"),
                DrawCount::Indirect(buffer) => write!(text, ", by {}", self.name(buffer)),
            };
            let state = &draw.state;
            let _ = write!(text, ", {:?}, {:?}", state.topology, state.blend);
            if state.needs_depth() {
                let write = if state.depth_write { " and write" } else { "" };
                let _ = write!(text, ", depth {:?}{write}", state.depth_test);
            }
            if state.cull != Cull::Nothing {
                let _ = write!(text, ", cull {:?}", state.cull);
            }
            text.push_str(if state.depth_clamp { ", clamp}" } else { "}" });
        }
    }

    fn name(&self, buffer: u32) -> &'static str {
        self.buffers[buffer as usize].name
    }

    /// The plan as a DOT graph: passes as boxes grouped by phase, buffers as ellipses (persistent ones doubled).
    pub fn dot(&self) -> String {
        let mut text = String::from("digraph plan {\n  rankdir=LR;\n");
        for (index, info) in self.buffers.iter().enumerate().filter(|(index, _)| self.lifetime[*index].is_some()) {
            let borders = if matches!(info.kind, BufferKind::Transient) { 1 } else { 2 };
            let _ = writeln!(
                text,
                "  b{index} [label=\"{}\\n{} bytes\", peripheries={borders}];",
                quoted(info.name),
                info.bytes
            );
        }
        for (index, pass) in self.passes.iter().enumerate() {
            let phase = self.phase[index];
            let _ = writeln!(
                text,
                "  subgraph cluster_{phase} {{ label=\"phase {phase}\"; p{index} [shape=box, label=\"{}\"]; }}",
                quoted(pass.name)
            );
            for usage in &pass.uses {
                let _ = match usage.access {
                    Access::Read => writeln!(text, "  b{} -> p{index};", usage.buffer),
                    Access::Write => writeln!(text, "  p{index} -> b{};", usage.buffer),
                };
            }
        }
        text.push_str("}\n");
        text
    }
}

fn describe_constants(text: &mut String, constants: &[(u32, u32)]) {
    for (id, bits) in constants {
        let _ = write!(text, " #{id}={bits}");
    }
}

/// `name` for the inside of a quoted DOT string.
fn quoted(name: &str) -> String {
    name.replace('\\', "\\\\").replace('"', "\\\"")
}
