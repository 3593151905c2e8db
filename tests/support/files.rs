//! Small glTF files written by the tests.

use std::path::PathBuf;

use nephroid::Result;
use nephroid::low_level::scene::{Limits, Scene, load};
use serde_json::{Value, json};

/// Little-endian bytes of floats.
pub fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// The binary part of [`triangle`]: three positions, then three u16 indices, padded to 44 bytes.
pub fn triangle_bin() -> Vec<u8> {
    let mut bin = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    bin.extend([0, 0, 1, 0, 2, 0, 0, 0]);
    bin
}

/// A valid document: one triangle in the xy plane, indexed, at one node.
pub fn triangle() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 44}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}
        ],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0
    })
}

/// [`triangle`] with one member replaced or added; `pointer` is a JSON pointer whose parent exists.
pub fn with(pointer: &str, value: Value) -> Value {
    let mut json = triangle();
    set(&mut json, pointer, value);
    json
}

/// Replaces or adds a member.
pub fn set(json: &mut Value, pointer: &str, value: Value) {
    let (parent, name) = pointer.rsplit_once('/').unwrap();
    match json.pointer_mut(parent).unwrap() {
        Value::Object(members) => {
            members.insert(name.into(), value);
        }
        Value::Array(items) if name == "-" => items.push(value),
        Value::Array(items) => items[name.parse::<usize>().unwrap()] = value,
        _ => unreachable!("{pointer} has no parent"),
    }
}

/// A binary glTF file.
pub fn glb(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut file = b"glTF\x02\x00\x00\x00".to_vec();
    file.extend((12 + 8 + json.len() as u32 + 8 + bin.len() as u32).to_le_bytes());
    for (kind, data) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        file.extend((data.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(data);
    }
    file
}

/// A folder with files of the test, removed at the end.
pub struct Files {
    folder: tempfile::TempDir,
}

impl Files {
    /// An empty folder `scene` in a temporary one.
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("scene")).unwrap();
        Self { folder }
    }

    /// Writes a file beside the scene.
    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.folder.path().join("scene").join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// Loads a file written now.
    pub fn load(&self, name: &str, bytes: &[u8]) -> Result<Scene> {
        load(&self.write(name, bytes), &Limits::default())
    }
}

/// Loads a binary glTF file.
pub fn load_glb(json: &Value, bin: &[u8]) -> Result<Scene> {
    Files::new().load("scene.glb", &glb(json, bin))
}
