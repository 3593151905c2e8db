//! What the kernels of light transport have in common: the buffers and specialisation constants of the scene, declared
//! in `lib/scene_bindings.glsl`. They become one set of buffers in Rust, and kernels are specialised by one variant.

use super::emit::{ident, rust_type};
use super::{Binding, Kernel};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The line of a kernel that makes it one of them.
const INCLUDE: &str = "#include \"lib/scene_bindings.glsl\"";

/// Bindings below this are those of the scene, others a kernel's own.
const FIRST_OWN: u32 = 16;

/// The same of specialisation constants.
const FIRST_OWN_CONSTANT: u32 = 20;

/// The camera's binding: not of the scene, because each band of pixels has a camera of its own.
const CAMERA: &str = "camera";

/// Whether a kernel with this source is one of them.
pub fn is_scene_kernel(source: &str) -> bool {
    source.lines().any(|line| line.trim() == INCLUDE)
}

/// The buffers of the scene that a kernel reads, and its own.
pub fn split(kernel: &Kernel) -> (Vec<&Binding>, Vec<&Binding>) {
    kernel.bindings.iter().partition(|binding| kernel.scene && binding.index < FIRST_OWN)
}

/// Name and type of the member that stands for the buffers of the scene.
pub fn member(scene: &[&Binding]) -> Option<(&'static str, &'static str)> {
    match scene {
        [] => None,
        _ if scene.iter().any(|binding| binding.name == CAMERA) => Some(("view", "View<'a>")),
        _ => Some(("scene", "&'a SceneBuffers")),
    }
}

/// A buffer of the scene as a borrow, given what [`member`] says.
pub fn borrow(binding: &Binding, member: &str) -> String {
    match (binding.name.as_str(), member) {
        (CAMERA, _) => format!("self.{member}.{CAMERA}"),
        (name, "view") => format!("&self.view.scene.{}", ident(name)),
        (name, _) => format!("&self.{member}.{}", ident(name)),
    }
}

/// `SceneBuffers`: every buffer of the scene that a kernel reads; and `View`, with the camera. Nothing without such
/// kernels.
pub fn write_buffers(text: &mut String, kernels: &[Kernel]) -> Result<(), String> {
    let mut buffers: BTreeMap<u32, (&Binding, &str)> = BTreeMap::new();
    for kernel in kernels {
        for binding in split(kernel).0 {
            if !binding.read_only {
                return Err(format!("{} writes {}, a buffer of the scene", kernel.name, binding.name));
            }
            let (known, other) = buffers.entry(binding.index).or_insert((binding, &kernel.name));
            if *known != binding {
                return Err(format!(
                    "binding {} is one buffer in {other} and another in {}",
                    binding.index, kernel.name
                ));
            }
        }
    }
    if buffers.is_empty() {
        return Ok(());
    }
    text.push_str(
        "/// The buffers of a scene, as the kernels of light transport read them (`glsl/lib/scene_bindings.glsl`).\n\
         #[derive(Debug)]\npub struct SceneBuffers {\n",
    );
    for (binding, _) in buffers.values().filter(|(binding, _)| binding.name != CAMERA) {
        let ty = rust_type(&binding.element);
        let _ = writeln!(
            text,
            "    #[allow(missing_docs)]\n    pub {}: crate::graph::ReadBuf<{ty}>,",
            ident(&binding.name)
        );
    }
    text.push_str("}\n");
    if let Some((camera, _)) = buffers.values().find(|(binding, _)| binding.name == CAMERA) {
        let _ = write!(
            text,
            "/// A scene, and the camera with the band of pixels to work on.\n#[derive(Debug, Clone, Copy)]\n\
             pub struct View<'a> {{\n    /// The scene.\n    pub scene: &'a SceneBuffers,\n\
             \x20   /// One entry.\n    pub camera: &'a crate::graph::Buf<{}>,\n}}\n",
            rust_type(&camera.element)
        );
    }
    Ok(())
}

/// A constructor that specialises the kernel for a scene.
pub fn write_constructor(text: &mut String, kernel: &Kernel, name: &str) {
    let scene: Vec<_> = kernel.constants.iter().filter(|c| kernel.scene && c.id < FIRST_OWN_CONSTANT).collect();
    if scene.is_empty() {
        return;
    }
    let _ = write!(
        text,
        "impl {name} {{\n    /// The kernel for a scene; constants of its own have their defaults.\n\
         \x20   pub fn of(variant: &crate::kernels::scene_data::Variant) -> Self {{\n        Self {{\n"
    );
    for constant in scene {
        let field = ident(&constant.name.to_ascii_lowercase());
        let _ = writeln!(text, "            {field}: variant.{field},");
    }
    text.push_str("            ..Self::default()\n        }\n    }\n}\n");
}
