//! Small files with animations, written by the tests.

use nephroid::Result;
use nephroid::low_level::scene::Scene;
use serde_json::{Value, json};

use super::files::{floats, glb, load_glb, set, triangle, triangle_bin};

/// A file to which keys are added.
pub struct Moving {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Moving {
    /// [`triangle`], at rest.
    pub fn triangle() -> Self {
        Self::of(triangle(), triangle_bin())
    }

    /// A file that is at rest.
    pub fn of(mut json: Value, bin: Vec<u8>) -> Self {
        json["animations"] = json!([{"channels": [], "samplers": []}]);
        Self { json, bin }
    }

    /// Adds floats, and an accessor of them; returns its index.
    pub fn accessor(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let (offset, bytes) = (self.bin.len(), floats(values));
        self.bin.extend(&bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.bin.len());
        let view = self.json["bufferViews"].as_array().map_or(0, Vec::len);
        let part = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        set(&mut self.json, "/bufferViews/-", part);
        let accessor = self.json["accessors"].as_array().map_or(0, Vec::len);
        let count = values.len() / width;
        let part = json!({"bufferView": view, "componentType": 5126, "count": count, "type": kind});
        set(&mut self.json, "/accessors/-", part);
        accessor
    }

    /// Adds keys (their interpolation, times and values of a type) for a target.
    pub fn channel(mut self, target: Value, (mode, times): (&str, &[f32]), (kind, values): (&str, &[f32])) -> Self {
        let (input, output) = (self.accessor("SCALAR", times), self.accessor(kind, values));
        let sampler = self.json["animations"][0]["samplers"].as_array().map_or(0, Vec::len);
        let keys = json!({"input": input, "output": output, "interpolation": mode});
        set(&mut self.json, "/animations/0/samplers/-", keys);
        set(&mut self.json, "/animations/0/channels/-", json!({"sampler": sampler, "target": target}));
        self
    }

    /// Keys for a property of a node, on straight lines.
    pub fn node(self, node: usize, path: &str, times: &[f32], kind: &str, values: &[f32]) -> Self {
        self.channel(json!({"node": node, "path": path}), ("LINEAR", times), (kind, values))
    }

    /// Keys for a property that a pointer names, on straight lines.
    pub fn pointer(self, pointer: &str, times: &[f32], kind: &str, values: &[f32]) -> Self {
        let target = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}});
        self.channel(target, ("LINEAR", times), (kind, values))
    }

    /// Replaces or adds a member.
    pub fn with(mut self, pointer: &str, value: Value) -> Self {
        set(&mut self.json, pointer, value);
        self
    }

    pub fn bytes(&self) -> Vec<u8> {
        glb(&self.json, &self.bin)
    }

    pub fn load(&self) -> Result<Scene> {
        load_glb(&self.json, &self.bin)
    }

    /// The scene at a time.
    pub fn at(&self, time: f64) -> Scene {
        let mut scene = self.load().unwrap();
        scene.move_to(time);
        scene.validate().unwrap();
        scene
    }
}
