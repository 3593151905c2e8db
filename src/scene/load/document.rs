//! From the bytes of a .gltf or .glb file to a checked JSON document with its buffers.
//!
//! The `gltf` crate's typed JSON is used, not its readers: those panic on damaged files. Its deserialiser cuts
//! integers to 32 bits and its validation indexes accessors unchecked, so both are preceded by checks of our own.

use gltf::json::validation::{Checked, Error as Rule, Validate};
use gltf::json::{Path as Place, Root, mesh::Semantic};
use serde_json::Value;

use super::resolve::{Folder, clip};
use super::{Limits, Notes, Outcome};

/// Extensions that are read.
const SUPPORTED: [&str; 11] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    // Only carries metadata: nothing to read.
    "KHR_xmp_json_ld",
];

/// A parsed file.
pub(super) struct Document {
    /// The typed JSON.
    pub root: Root,
    /// Contents of every buffer, at least as long as its `byteLength`.
    pub buffers: Vec<Vec<u8>>,
    /// KHR_mesh_quantization is in use.
    pub quantized: bool,
}

impl Document {
    /// Parses `bytes` and reads every buffer.
    pub fn parse(bytes: &[u8], folder: &Folder, limits: &Limits, notes: &mut Notes) -> Outcome<Self> {
        let (json, blob) = if bytes.starts_with(b"glTF") { split_glb(bytes)? } else { (bytes, None) };
        if json.len() as u64 > limits.json_bytes {
            return Err(format!("{} bytes of JSON, more than the limit of {}", json.len(), limits.json_bytes));
        }
        let root = parse_json(json)?;
        check_extensions(&root, notes)?;
        validate(&root)?;
        if root.nodes.len() as u64 > limits.nodes {
            return Err(format!("{} nodes, more than the limit of {}", root.nodes.len(), limits.nodes));
        }
        if !root.animations.is_empty() {
            notes.note(format!("{} animation(s) ignored: the default pose is shown", root.animations.len()));
        }
        let buffers = read_buffers(&root, blob, folder, limits)?;
        let quantized =
            root.extensions_used.iter().chain(&root.extensions_required).any(|e| e == "KHR_mesh_quantization");
        Ok(Self { root, buffers, quantized })
    }
}

/// The JSON and BIN chunks of a binary glTF file (glTF 2.0, section 4.4).
fn split_glb(bytes: &[u8]) -> Outcome<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err("the GLB header is cut".into());
    };
    if version != 2 {
        return Err(format!("GLB version {version} is not supported, only 2"));
    }
    let length = length as usize;
    if length > bytes.len() || length < 12 {
        return Err(format!("the GLB header announces {length} bytes, the file has {}", bytes.len()));
    }
    let mut chunks = Vec::new();
    let mut at = 12;
    while at < length {
        let size = if at + 8 <= length { word(at) } else { None };
        let size = size.ok_or("a GLB chunk header is cut")? as usize;
        let end = at + 8 + size;
        if end > length {
            return Err(format!("GLB chunk {} announces {size} bytes, {} are left", chunks.len(), length - at - 8));
        }
        chunks.push((&bytes[at + 4..at + 8], &bytes[at + 8..end]));
        at = end;
    }
    match chunks.first() {
        Some((kind, json)) if *kind == b"JSON" => {
            // Chunks of unknown kind must be ignored.
            let blob = chunks[1..].iter().find(|(kind, _)| *kind == b"BIN\0").map(|(_, data)| *data);
            Ok((json, blob))
        }
        _ => Err("the first GLB chunk is not JSON".into()),
    }
}

fn parse_json(bytes: &[u8]) -> Outcome<Root> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    let mut value: Value = serde_json::from_slice(bytes).map_err(|e| format!("not valid JSON: {e}"))?;
    check_integers("", &value)?;
    // glTF lets a scene be without nodes, the typed JSON does not.
    for scene in value.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    let root: Root = serde_json::from_value(value).map_err(|e| format!("not valid glTF: {e}"))?;
    if root.asset.version.split('.').next() != Some("2") {
        return Err(format!("glTF version {} is not supported, only 2.x", clip(&root.asset.version)));
    }
    if let Some(min) = root.asset.min_version.as_deref().filter(|v| *v != "2.0") {
        return Err(format!("it needs a reader of glTF {}, this one reads 2.0", clip(min)));
    }
    Ok(root)
}

/// Refuses integers that the typed JSON would cut to 32 bits. `key` is the name of the enclosing member.
fn check_integers(key: &str, value: &Value) -> Outcome<()> {
    match value {
        Value::Object(members) => {
            members.iter().filter(|(k, _)| *k != "extras").try_for_each(|(k, v)| {
                // Members of `attributes` and of morph targets are accessor indices whatever their name.
                let key = if matches!(key, "attributes" | "targets") { key } else { k.as_str() };
                check_integers(key, v)
            })
        }
        Value::Array(items) => items.iter().try_for_each(|v| check_integers(key, v)),
        Value::Number(n) if CUT_TO_32_BITS.contains(&key) && n.as_u64().is_some_and(|n| n > u64::from(u32::MAX)) => {
            Err(format!("'{}' holds {n}, which is out of range", clip(key)))
        }
        _ => Ok(()),
    }
}

/// Members that the typed JSON reads as 64 bits and then cuts.
const CUT_TO_32_BITS: &[&str] = &[
    "accessor",
    "attributes",
    "buffer",
    "bufferView",
    "camera",
    "children",
    "componentType",
    "index",
    "indices",
    "input",
    "inverseBindMatrices",
    "joints",
    "light",
    "magFilter",
    "material",
    "mesh",
    "minFilter",
    "mode",
    "node",
    "nodes",
    "sampler",
    "scene",
    "skeleton",
    "skin",
    "source",
    "target",
    "targets",
    "wrapS",
    "wrapT",
];

fn check_extensions(root: &Root, notes: &mut Notes) -> Outcome<()> {
    let lacks = |name: &&String| !SUPPORTED.contains(&name.as_str());
    if let Some(name) = root.extensions_required.iter().find(lacks) {
        return Err(format!("it requires the extension {}, which is not supported", clip(name)));
    }
    for name in root.extensions_used.iter().filter(lacks) {
        notes.note(format!("extension {} is ignored", clip(name)));
    }
    Ok(())
}

/// The rules of the `gltf` crate's validation: every index in range, every enumerator known.
fn validate(root: &Root) -> Outcome<()> {
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            // The crate's validation indexes with this one unchecked.
            if position.is_some_and(|a| a.value() >= root.accessors.len()) {
                return Err(format!("meshes[{m}].primitives[{p}]: POSITION names an accessor that does not exist"));
            }
        }
    }
    let mut first = None;
    root.validate(root, Place::new, &mut |place, rule| {
        if first.is_none() && !forgiven(place().as_str(), rule) {
            let rule = match rule {
                Rule::IndexOutOfBounds => "index out of range",
                Rule::Missing => "is missing",
                Rule::Oversize => "is too large",
                _ => "is not valid",
            };
            first = Some(format!("{}: {rule}", clip(place().as_str())));
        }
    });
    first.map_or(Ok(()), Err)
}

/// Rules that do not matter here: extensions are checked above, bounds are computed, an accessor without a buffer view
/// holds zeros, a texture without an image is dropped with a warning.
fn forgiven(place: &str, rule: Rule) -> bool {
    let bounds = place.ends_with(".min") || place.ends_with(".max");
    let sourceless = place.starts_with("textures[") && place.ends_with("].source") && matches!(rule, Rule::Missing);
    let zeros = place.starts_with("accessors[") && place.ends_with("].bufferView") && matches!(rule, Rule::Missing);
    zeros || place.starts_with("extensionsRequired") || (bounds && !place.starts_with("animations")) || sourceless
}

fn read_buffers(root: &Root, blob: Option<&[u8]>, folder: &Folder, limits: &Limits) -> Outcome<Vec<Vec<u8>>> {
    let mut left = limits.buffer_bytes;
    let mut buffers = Vec::with_capacity(root.buffers.len());
    for (i, buffer) in root.buffers.iter().enumerate() {
        let wanted = buffer.byte_length.0;
        if wanted > left {
            return Err(format!("buffer {i}: {wanted} bytes, more than the limit of {} in all", limits.buffer_bytes));
        }
        left -= wanted;
        let mut bytes = match (&buffer.uri, blob) {
            (Some(uri), _) => folder.fetch(uri).map_err(|cause| format!("buffer {i}: {cause}"))?,
            (None, Some(blob)) if i == 0 => blob.to_vec(),
            (None, _) => return Err(format!("buffer {i} has neither a URI nor a BIN chunk")),
        };
        if (bytes.len() as u64) < wanted {
            return Err(format!("buffer {i}: {} of {wanted} bytes are missing", wanted - bytes.len() as u64));
        }
        bytes.truncate(wanted as usize);
        buffers.push(bytes);
    }
    Ok(buffers)
}
