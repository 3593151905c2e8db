//! SPIR-V to the description that [`super::emit`] turns into Rust.

use super::{Binding, Constant, Kernel, Member, Stage, Struct, Type};
use spirq::prelude::*;
use spirq::ty::{ScalarType, StructType};
use std::path::Path;

/// Reads back what the compiled kernel really uses.
pub fn reflect(file: &Path, words: &[u32]) -> Result<Kernel, String> {
    let stage = Stage::of(file).ok_or_else(|| format!("{}: not a kernel", file.display()))?;
    let name = file.file_stem().and_then(|s| s.to_str()).unwrap_or_default().to_owned() + stage.suffix();
    let fail = |what: String| format!("{}: {what}", file.display());
    // All resources: by itself the crate overlooks a buffer of which only the length is used.
    let entry_points =
        ReflectConfig::new().spv(without_logic(words)).ref_all_rscs(true).reflect().map_err(|e| fail(e.to_string()))?;
    let entry = entry_points.first().ok_or_else(|| fail("no entry point".into()))?;
    let local_size = if stage == Stage::Compute { local_size(words).map_err(&fail)? } else { [0; 3] };
    let source = std::fs::read_to_string(file).map_err(|e| fail(e.to_string()))?;
    let scene = super::scene::is_scene_kernel(&source);
    let (bindings, constants) = (vec![], vec![]);
    let mut kernel = Kernel { name, stage, scene, local_size, colours: 0, params: None, bindings, constants };
    for var in &entry.vars {
        match var {
            Variable::Descriptor { desc_bind, ty, .. } => {
                if desc_bind.set() != 0 {
                    return Err(fail(format!("binding {} is outside of set 0", desc_bind.bind())));
                }
                let binding = binding(desc_bind.bind(), ty).map_err(&fail)?;
                if stage != Stage::Compute && !binding.read_only {
                    return Err(fail(format!("{}: a draw writes no buffers: say readonly", binding.name)));
                }
                kernel.bindings.push(binding);
            }
            Variable::Input { .. } if stage == Stage::Vertex => {
                return Err(fail("vertices have no attributes here: read them from buffers by gl_VertexIndex".into()));
            }
            Variable::Output { location, .. } if stage == Stage::Fragment => {
                kernel.colours = kernel.colours.max(location.loc() + 1);
            }
            Variable::PushConstant { ty, .. } => {
                let Some(block) = ty.as_struct() else { return Err(fail("push constants are not a block".into())) };
                let mut params = structure(block).map_err(&fail)?;
                params.name = "Params".into();
                kernel.params = Some(params);
            }
            Variable::SpecConstant { name, spec_id, ty, .. } => {
                let name = name.clone().ok_or_else(|| fail(format!("constant {spec_id} has lost its name")))?;
                kernel.constants.push(constant(words, *spec_id, name, ty).map_err(&fail)?);
            }
            _ => {}
        }
    }
    kernel.bindings.sort_by_key(|b| b.index);
    kernel.bindings.dedup();
    kernel.constants.sort_by_key(|c| c.id);
    kernel.constants.dedup();
    if let Some(pair) = kernel.bindings.windows(2).find(|pair| pair[0].index == pair[1].index) {
        return Err(fail(format!("binding {} is both {} and {}", pair[0].index, pair[0].name, pair[1].name)));
    }
    Ok(kernel)
}

/// Operation codes with their operands. The reflection crate leaves out workgroup sizes and untyped defaults.
fn instructions(words: &[u32]) -> impl Iterator<Item = (u32, &[u32])> {
    let mut rest = words.get(5..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (length, op) = rest.first().map(|word| ((word >> 16).max(1) as usize, word & 0xffff))?;
        let (now, after) = rest.split_at(length.min(rest.len()));
        rest = after;
        Some((op, &now[1..]))
    })
}

/// The module with every logical operation on specialisation constants replaced by `true` and every choice by 0: the
/// reflection crate cannot evaluate them, and no layout depends on them.
fn without_logic(words: &[u32]) -> Vec<u32> {
    const OP_CONSTANT_TRUE: u32 = 41;
    const OP_CONSTANT: u32 = 43;
    const OP_SPEC_CONSTANT_OP: u32 = 52;
    const SELECT: u32 = 169;
    // Logic and comparisons: OpLogicalEqual to OpFUnordGreaterThanEqual without OpSelect.
    let truth = |operation: u32| operation != SELECT && (164..=191).contains(&operation);
    let mut plain = words[..words.len().min(5)].to_vec();
    for (op, operands) in instructions(words) {
        let head = ((operands.len() as u32 + 1) << 16) | op;
        match operands {
            [ty, result, operation, ..] if op == OP_SPEC_CONSTANT_OP && truth(*operation) => {
                plain.extend([(3 << 16) | OP_CONSTANT_TRUE, *ty, *result]);
            }
            [ty, result, SELECT, ..] if op == OP_SPEC_CONSTANT_OP => {
                plain.extend([(4 << 16) | OP_CONSTANT, *ty, *result, 0]);
            }
            _ => plain.extend(std::iter::once(head).chain(operands.iter().copied())),
        }
    }
    plain
}

/// The workgroup size, which has to be a literal: the graph computes grids from it.
fn local_size(words: &[u32]) -> Result<[u32; 3], String> {
    const OP_EXECUTION_MODE: u32 = 16;
    const LOCAL_SIZE: u32 = 17;
    const OP_SPEC_CONSTANT_COMPOSITE: u32 = 51;
    const OP_DECORATE: u32 = 71;
    const BUILT_IN: u32 = 11;
    const WORKGROUP_SIZE: u32 = 25;
    let specialised = |id: u32| {
        instructions(words).any(|(op, operands)| op == OP_SPEC_CONSTANT_COMPOSITE && operands.get(1) == Some(&id))
    };
    if instructions(words).any(|(op, operands)| match operands {
        [id, BUILT_IN, WORKGROUP_SIZE] if op == OP_DECORATE => specialised(*id),
        _ => false,
    }) {
        return Err("the workgroup size is a specialisation constant".into());
    }
    let size = instructions(words).find_map(|(op, operands)| match operands {
        [_, LOCAL_SIZE, x, y, z] if op == OP_EXECUTION_MODE => Some([*x, *y, *z]),
        _ => None,
    });
    size.ok_or_else(|| "the workgroup size is not stated".into())
}

fn binding(index: u32, ty: &spirq::ty::Type) -> Result<Binding, String> {
    let block = ty.as_struct().ok_or_else(|| format!("binding {index} is not a storage block"))?;
    let [member] = block.members.as_slice() else {
        return Err(format!("binding {index}: a storage block holds exactly one runtime array"));
    };
    let name = member.name.clone().ok_or_else(|| format!("binding {index} has lost its name"))?;
    let array = member.ty.as_array().ok_or_else(|| format!("{name}: a storage block holds one runtime array"))?;
    if array.nelement.is_some() {
        return Err(format!("{name}: the array has a fixed length"));
    }
    let element = element(array.stride, &array.element_ty, &name)?;
    Ok(Binding { index, name, element, read_only: member.access_ty == AccessType::ReadOnly })
}

fn structure(block: &StructType) -> Result<Struct, String> {
    let name = block.name.clone().ok_or("a struct has lost its name")?;
    let mut members = Vec::new();
    for member in &block.members {
        let member_name = member.name.clone().ok_or_else(|| format!("{name}: a member has lost its name"))?;
        let offset = member.offset.ok_or_else(|| format!("{name}.{member_name} has no offset"))? as u32;
        members.push(Member { name: member_name, offset, ty: convert(&member.ty)? });
    }
    Ok(Struct { name, members })
}

fn convert(ty: &spirq::ty::Type) -> Result<Type, String> {
    use spirq::ty::Type as S;
    match ty {
        S::Scalar(scalar) => Ok(Type::Scalar(scalar_name(scalar)?)),
        S::Vector(v) => Ok(Type::Array(Box::new(Type::Scalar(scalar_name(&v.scalar_ty)?)), v.nscalar)),
        S::Array(a) => {
            let count = a.nelement.ok_or("a runtime array inside of a struct")?;
            Ok(Type::Array(Box::new(element(a.stride, &a.element_ty, "a member")?), count))
        }
        S::Struct(s) => Ok(Type::Struct(structure(s)?)),
        other => Err(format!("type {other} cannot be shared with the host")),
    }
}

/// An array's element, whose stride has to be that of Rust: std430 for one puts 16 bytes between `vec3`s.
fn element(stride: Option<usize>, ty: &spirq::ty::Type, array: &str) -> Result<Type, String> {
    let element = convert(ty)?;
    let (size, _) = element.layout();
    match stride {
        Some(stride) if stride != size as usize => {
            Err(format!("{array}: elements of {size} bytes lie {stride} bytes apart; the block needs layout(scalar)"))
        }
        _ => Ok(element),
    }
}

fn scalar_name(scalar: &ScalarType) -> Result<&'static str, String> {
    match scalar {
        ScalarType::Integer { bits: 32, is_signed: false } => Ok("u32"),
        ScalarType::Integer { bits: 32, is_signed: true } => Ok("i32"),
        ScalarType::Integer { bits: 64, is_signed: false } => Ok("u64"),
        ScalarType::Float { bits: 32 } => Ok("f32"),
        other => Err(format!("scalar {other} cannot be shared with the host")),
    }
}

/// Type and default of a specialisation constant.
fn constant(words: &[u32], id: u32, name: String, ty: &spirq::ty::Type) -> Result<Constant, String> {
    const OP_DECORATE: u32 = 71;
    const DECORATION_SPEC_ID: u32 = 1;
    const OP_SPEC_CONSTANT_TRUE: u32 = 48;
    const OP_SPEC_CONSTANT_FALSE: u32 = 49;
    const OP_SPEC_CONSTANT: u32 = 50;
    let ty = match ty.as_scalar() {
        Some(ScalarType::Boolean) => "bool",
        Some(scalar) => scalar_name(scalar)?,
        None => return Err(format!("constant {name} is not a scalar")),
    };
    let target = instructions(words).find_map(|(op, operands)| match operands {
        [of, DECORATION_SPEC_ID, spec] if op == OP_DECORATE && *spec == id => Some(*of),
        _ => None,
    });
    let default_bits = instructions(words).find_map(|(op, operands)| match (op, operands) {
        (OP_SPEC_CONSTANT_TRUE, [_, of]) if Some(*of) == target => Some(1),
        (OP_SPEC_CONSTANT_FALSE, [_, of]) if Some(*of) == target => Some(0),
        (OP_SPEC_CONSTANT, [_, of, bits]) if Some(*of) == target => Some(*bits),
        _ => None,
    });
    let default_bits = default_bits.ok_or_else(|| format!("constant {name} has no default"))?;
    Ok(Constant { id, name, ty, default_bits })
}
