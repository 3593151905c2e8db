//! GLSL to optimised SPIR-V 1.5 (Vulkan 1.2).

use super::Stage;
use std::fs;
use std::path::{Path, PathBuf};

/// Compiles kernels below one root folder; includes are relative to that root.
pub struct Compiler {
    root: PathBuf,
    compiler: shaderc::Compiler,
}

/// Every kernel below `root/kernels`, in a stable order.
pub fn kernel_files(root: &Path) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    let mut folders = vec![root.join("kernels")];
    while let Some(folder) = folders.pop() {
        let entries = fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        for entry in entries {
            let path = entry.map_err(|e| format!("{}: {e}", folder.display()))?.path();
            if path.is_dir() {
                folders.push(path);
            } else if Stage::of(&path).is_some() {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

impl Compiler {
    /// A compiler for the sources below `root`.
    pub fn new(root: &Path) -> Result<Self, String> {
        let compiler = shaderc::Compiler::new().map_err(|e| format!("cannot start the GLSL compiler: {e}"))?;
        Ok(Self { root: root.to_owned(), compiler })
    }

    /// Compiles one file; an error names file and line and shows the line's text.
    pub fn compile(&self, file: &Path) -> Result<Vec<u32>, String> {
        let source = fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
        let name = file.strip_prefix(&self.root).unwrap_or(file).to_string_lossy().into_owned();
        let kind = match Stage::of(file) {
            Some(Stage::Compute) => shaderc::ShaderKind::Compute,
            Some(Stage::Vertex) => shaderc::ShaderKind::Vertex,
            Some(Stage::Geometry) => shaderc::ShaderKind::Geometry,
            Some(Stage::Fragment) => shaderc::ShaderKind::Fragment,
            None => return Err(format!("{}: a kernel ends on .comp, .vert, .geom or .frag", file.display())),
        };
        let artifact = self
            .compiler
            .compile_into_spirv(&source, kind, &name, "main", Some(&self.options()?))
            .map_err(|e| self.explain(&e.to_string()))?;
        if artifact.get_num_warnings() > 0 {
            return Err(self.explain(&artifact.get_warning_messages()));
        }
        Ok(artifact.as_binary().to_vec())
    }

    fn options(&self) -> Result<shaderc::CompileOptions<'_>, String> {
        let mut options =
            shaderc::CompileOptions::new().map_err(|e| format!("cannot set GLSL compiler options: {e}"))?;
        options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
        options.set_target_spirv(shaderc::SpirvVersion::V1_5);
        options.set_optimization_level(shaderc::OptimizationLevel::Performance);
        // Keeps the names through optimisation, so that one compilation serves both execution and reflection.
        options.set_generate_debug_info();
        options.set_include_callback(|requested, _, _, _| {
            let path = self.root.join(requested);
            let content = fs::read_to_string(&path).map_err(|e| format!("{requested}: {e}"))?;
            Ok(shaderc::ResolvedInclude { resolved_name: requested.to_owned(), content })
        });
        Ok(options)
    }

    /// Puts the text of the line below every message of the form `file:line: ...`.
    fn explain(&self, messages: &str) -> String {
        let mut text = String::new();
        for message in messages.lines().filter(|line| !line.trim().is_empty()) {
            text.push_str(message);
            text.push('\n');
            let mut parts = message.splitn(3, ':');
            let (file, line) = (parts.next().unwrap_or(""), parts.next().and_then(|n| n.trim().parse::<usize>().ok()));
            if let (Some(line), Ok(source)) = (line, fs::read_to_string(self.root.join(file)))
                && let Some(code) = source.lines().nth(line.wrapping_sub(1))
            {
                text.push_str(&format!("  {line:4} | {code}\n"));
            }
        }
        text
    }
}
