//! EXT_mesh_gpu_instancing: many places of one node.

use glam::{DMat4, DVec3};

use super::Limits;
use super::accessor::{Reader, Use};
use super::document::Document;
use super::nodes::{self, Placed};
use super::notes::{Notes, Outcome};
use super::part::Part;

/// The transforms of a node's instances, before that of the node itself; `None` where it has no such extension.
pub(super) fn transforms(
    document: &Document,
    reader: &Reader,
    placed: &Placed,
    limits: &Limits,
    notes: &mut Notes,
) -> Outcome<Option<Vec<DMat4>>> {
    let node = document.nodes.part(placed.node as usize)?;
    let extension = node.extension("EXT_mesh_gpu_instancing", notes);
    let Some(attributes) = extension.and_then(|extension| extension.part("attributes", notes)) else {
        return Ok(None);
    };
    locals(&attributes, reader, limits, notes).map(Some).map_err(|cause| format!("{}: {cause}", node.place))
}

fn locals(attributes: &Part, reader: &Reader, limits: &Limits, notes: &mut Notes) -> Outcome<Vec<DMat4>> {
    let mut open = |name: &str, role| match attributes.index(name)? {
        Some(accessor) => reader.open(accessor, role, notes).map(Some),
        None => Ok(None),
    };
    let translations = open("TRANSLATION", Use::Vector)?;
    let (rotations, scales) = (open("ROTATION", Use::Rotation)?, open("SCALE", Use::Vector)?);
    let lists = [&translations, &rotations, &scales];
    let mut counts = lists.iter().filter_map(|list| list.as_ref().map(|elements| elements.count()));
    let count = counts.next().ok_or("instancing without attributes that place anything")?;
    if counts.any(|other| other != count) {
        return Err("instance attributes of different lengths".into());
    }
    if count as u64 > limits.nodes {
        return Err(format!("{count} instances, more than the limit of {}", limits.nodes));
    }
    let vectors = |elements: Option<_>, default| match elements {
        Some(elements) => reader.floats::<3>(&elements, None),
        None => Ok(vec![default; count]),
    };
    let (translations, scales) = (vectors(translations, [0.0; 3])?, vectors(scales, [1.0; 3])?);
    let rotations = match rotations {
        Some(elements) => reader.floats::<4>(&elements, None)?,
        None => vec![[0.0, 0.0, 0.0, 1.0]; count],
    };
    let vec3 = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    let transforms = translations.iter().zip(&scales).zip(&rotations).map(|((t, s), r)| {
        DMat4::from_scale_rotation_translation(vec3(*s), nodes::rotation(*r).unwrap_or_default(), vec3(*t))
    });
    Ok(transforms.collect())
}
