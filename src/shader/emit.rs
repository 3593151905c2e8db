//! Descriptions to Rust: structs with offset assertions, and for every kernel its parameters, bindings and constants.

use super::{Kernel, Stage, Struct, Type, scene};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Structs that the graph itself has to know: counts of an indirect dispatch and of an indirect draw, laid out by
/// Vulkan.
const INDIRECT: [&str; 2] = ["DispatchArgs", "DrawArgs"];

/// What the name of a struct ends on that is another view of the struct named before: `BvhNodeRows` are the words of a
/// `BvhNode`, in parts that single lanes load. The host knows the struct only.
const ROWS: &str = "Rows";

/// The text of the generated file. Two kernels that use a struct of one name must agree on its layout.
pub fn emit(kernels: &[Kernel]) -> Result<String, String> {
    let mut structs = BTreeMap::new();
    let mut names = BTreeSet::new();
    let mut rows = BTreeSet::new();
    for kernel in kernels {
        if !names.insert(kernel.name.as_str()) {
            return Err(format!("two kernels are named {}: a file name must be unique in all folders", kernel.name));
        }
        for binding in &kernel.bindings {
            collect(&binding.element, &kernel.name, &mut structs)?;
            if let Type::Struct(Struct { name, .. }) = &binding.element
                && name.ends_with(ROWS)
            {
                rows.insert((rust_type(&binding.element), binding.element.layout().0));
            }
        }
        for member in kernel.params.iter().flat_map(|params| &params.members) {
            collect(&member.ty, &kernel.name, &mut structs)?;
        }
    }
    let mut text = String::new();
    for (definition, _) in structs.values() {
        if INDIRECT.contains(&definition.name.as_str()) {
            write_offsets(&mut text, &format!("crate::graph::{}", definition.name), definition);
        } else {
            write_struct(&mut text, &definition.name, definition, "Layout shared with the kernels.");
        }
    }
    for (name, size) in rows {
        let _ =
            writeln!(text, "const _: () = assert!(size_of::<{name}>() == {size}, \"{name}{ROWS} has its size\");\n");
    }
    scene::write_buffers(&mut text, kernels)?;
    for kernel in kernels {
        write_kernel(&mut text, kernel);
    }
    let names = |draws: bool| -> String {
        let wanted = kernels.iter().filter(|k| (k.stage != Stage::Compute) == draws);
        wanted.map(|k| format!("    &{},\n", info_name(k))).collect()
    };
    let _ = write!(
        text,
        "/// Every compute kernel of this build.\npub static ALL: &[&crate::graph::KernelInfo] = &[\n{}];\n\
         /// Every graphics kernel of this build.\npub static SHADERS: &[&crate::graph::ShaderInfo] = &[\n{}];\n",
        names(false),
        names(true)
    );
    Ok(text)
}

fn collect(ty: &Type, kernel: &str, structs: &mut BTreeMap<String, (Struct, String)>) -> Result<(), String> {
    match ty {
        Type::Scalar(_) => Ok(()),
        Type::Array(element, _) => collect(element, kernel, structs),
        Type::Struct(definition) if definition.name.ends_with(ROWS) => Ok(()),
        Type::Struct(definition) => {
            for member in &definition.members {
                collect(&member.ty, kernel, structs)?;
            }
            let known = structs.entry(definition.name.clone()).or_insert_with(|| (definition.clone(), kernel.into()));
            if known.0 != *definition {
                let other = &known.1;
                return Err(format!("struct {} has one layout in {other} and another in {kernel}", definition.name));
            }
            Ok(())
        }
    }
}

pub(super) fn rust_type(ty: &Type) -> String {
    match ty {
        Type::Scalar(name) => (*name).to_owned(),
        Type::Array(element, count) => format!("[{}; {count}]", rust_type(element)),
        Type::Struct(definition) if INDIRECT.contains(&definition.name.as_str()) => {
            format!("crate::graph::{}", definition.name)
        }
        Type::Struct(definition) => definition.name.trim_end_matches(ROWS).to_owned(),
    }
}

fn write_struct(text: &mut String, name: &str, definition: &Struct, doc: &str) {
    let _ = write!(
        text,
        "/// {doc}\n#[repr(C)]\n#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]\n\
         pub struct {name} {{\n"
    );
    for member in &definition.members {
        let _ =
            writeln!(text, "    #[allow(missing_docs)]\n    pub {}: {},", ident(&member.name), rust_type(&member.ty));
    }
    text.push_str("}\n");
    write_offsets(text, name, definition);
}

/// Assertions that Rust lays `name` out as the kernels do.
fn write_offsets(text: &mut String, name: &str, definition: &Struct) {
    for member in &definition.members {
        let _ = writeln!(
            text,
            "const _: () = assert!(std::mem::offset_of!({name}, {}) == {});",
            ident(&member.name),
            member.offset
        );
    }
    let (size, _) = Type::Struct(definition.clone()).layout();
    let _ = writeln!(text, "const _: () = assert!(size_of::<{name}>() == {size});\n");
}

/// A GLSL name as a Rust identifier.
pub(super) fn ident(name: &str) -> String {
    const RESERVED: &[&str] = &[
        "abstract", "as", "async", "await", "become", "box", "dyn", "enum", "extern", "final", "fn", "impl", "let",
        "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "static", "trait", "try",
        "type", "typeof", "unsafe", "unsized", "use", "virtual", "where", "yield",
    ];
    if RESERVED.contains(&name) { format!("r#{name}") } else { name.to_owned() }
}

/// `scan_reduce` to `ScanReduce`.
fn camel(name: &str) -> String {
    name.split('_')
        .map(|word| {
            let mut letters = word.chars();
            letters.next().map_or_else(String::new, |first| first.to_ascii_uppercase().to_string() + letters.as_str())
        })
        .collect()
}

fn info_name(kernel: &Kernel) -> String {
    format!("{}_INFO", kernel.name.to_ascii_uppercase())
}

fn write_kernel(text: &mut String, kernel: &Kernel) {
    let name = camel(&kernel.name);
    if let Some(params) = &kernel.params {
        write_struct(text, &format!("{name}Params"), params, &format!("Push constants of `{}`.", kernel.name));
    }
    write_info(text, kernel);
    write_constants(text, kernel, &name);
    scene::write_constructor(text, kernel, &name);
    write_bindings(text, kernel, &name);
    let params = if kernel.params.is_some() { format!("{name}Params") } else { "()".into() };
    let (kind, info, marker) = match kernel.stage {
        Stage::Compute => ("Kernel", "KernelInfo", String::new()),
        stage => ("Shader", "ShaderInfo", format!("impl crate::graph::{stage:?}Shader for {name} {{}}\n")),
    };
    let _ = write!(
        text,
        "{marker}impl crate::graph::{kind} for {name} {{\n    type Params = {params};\n\
         \x20   type Bindings<'a> = {name}Bindings<'a>;\n\
         \x20   fn info(&self) -> &'static crate::graph::{info} {{ &{} }}\n\
         \x20   fn constants(&self) -> Vec<(u32, u32)> {{ vec![{}] }}\n}}\n\n",
        info_name(kernel),
        kernel
            .constants
            .iter()
            .map(|c| format!("({}, {})", c.id, bits_of(c.ty, &c.name)))
            .collect::<Vec<_>>()
            .join(", ")
    );
}

fn bits_of(ty: &str, name: &str) -> String {
    let field = ident(&name.to_ascii_lowercase());
    match ty {
        "f32" => format!("self.{field}.to_bits()"),
        _ => format!("self.{field} as u32"),
    }
}

fn write_info(text: &mut String, kernel: &Kernel) {
    let [x, y, z] = kernel.local_size;
    let (info, own) = match kernel.stage {
        Stage::Compute => ("KernelInfo", format!("local_size: [{x}, {y}, {z}]")),
        stage => ("ShaderInfo", format!("stage: crate::graph::Stage::{stage:?}, colours: {}", kernel.colours)),
    };
    let _ = write!(
        text,
        "/// Facts of `{0}`.\npub static {1}: crate::graph::{info} = crate::graph::{info} {{\n    name: \"{0}\",\n\
         \x20   spirv: crate::graph::Spirv(include_bytes_aligned!(concat!(env!(\"OUT_DIR\"), \"/spirv/{0}.spv\"))),\n\
         \x20   {own},\n    push_bytes: {2},\n    bindings: &[{3}],\n}};\n",
        kernel.name,
        info_name(kernel),
        if kernel.params.is_some() { format!("size_of::<{}Params>() as u32", camel(&kernel.name)) } else { "0".into() },
        kernel.bindings.iter().map(|b| b.index.to_string()).collect::<Vec<_>>().join(", ")
    );
}

fn write_constants(text: &mut String, kernel: &Kernel, name: &str) {
    let derive = "#[derive(Debug, Clone, Copy, PartialEq)]";
    let _ = writeln!(text, "/// Kernel `{}` with its specialisation constants.\n{derive}", kernel.name);
    if kernel.constants.is_empty() {
        let _ = writeln!(text, "pub struct {name};");
        return;
    }
    let _ = writeln!(text, "pub struct {name} {{");
    for constant in &kernel.constants {
        let field = ident(&constant.name.to_ascii_lowercase());
        let _ = writeln!(text, "    #[allow(missing_docs)]\n    pub {field}: {},", constant.ty);
    }
    let _ = writeln!(text, "}}\nimpl Default for {name} {{\n    fn default() -> Self {{\n        Self {{");
    for constant in &kernel.constants {
        let value = match constant.ty {
            "f32" => format!("f32::from_bits({})", constant.default_bits),
            "bool" => (constant.default_bits != 0).to_string(),
            "i32" => (constant.default_bits as i32).to_string(),
            _ => constant.default_bits.to_string(),
        };
        let _ = writeln!(text, "            {}: {value},", ident(&constant.name.to_ascii_lowercase()));
    }
    text.push_str("        }\n    }\n}\n");
}

fn write_bindings(text: &mut String, kernel: &Kernel, name: &str) {
    let _ = writeln!(text, "/// Buffers of `{}`: shared borrows are read, exclusive ones written.", kernel.name);
    let _ = writeln!(text, "pub struct {name}Bindings<'a> {{");
    let (of_scene, own) = scene::split(kernel);
    let member = scene::member(&of_scene);
    if let Some((member, ty)) = member {
        let _ = writeln!(text, "    #[allow(missing_docs)]\n    pub {member}: {ty},");
    }
    for b in own {
        let exclusive = if b.read_only { "" } else { "mut " };
        let _ = writeln!(
            text,
            "    #[allow(missing_docs)]\n    pub {}: &'a {exclusive}crate::graph::Buf<{}>,",
            ident(&b.name),
            rust_type(&b.element)
        );
    }
    if kernel.bindings.is_empty() {
        let _ = writeln!(text, "    #[allow(missing_docs)]\n    pub none: std::marker::PhantomData<&'a ()>,");
    }
    let _ = write!(
        text,
        "}}\nimpl crate::graph::Bindings for {name}Bindings<'_> {{\n    fn uses(&self) -> \
         Vec<crate::graph::Use> {{\n        vec![\n"
    );
    for b in &kernel.bindings {
        let call = if b.read_only { "read" } else { "write" };
        let of_scene = member.filter(|_| of_scene.contains(&b));
        let buffer = of_scene.map_or_else(|| format!("self.{}", ident(&b.name)), |(m, _)| scene::borrow(b, m));
        let _ = writeln!(text, "            crate::graph::Use::{call}({}, {buffer}),", b.index);
    }
    text.push_str("        ]\n    }\n}\n");
    if kernel.bindings.is_empty() {
        return;
    }
    let _ = writeln!(text, "impl {name}Bindings<'_> {{");
    for b in &kernel.bindings {
        let constant = b.name.to_ascii_uppercase();
        let _ = writeln!(text, "    /// Binding number of `{}`.\n    pub const {constant}: u32 = {};", b.name, b.index);
    }
    text.push_str("}\n");
}
