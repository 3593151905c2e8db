//! Scenes that are small and ask for much, made here.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::support::files::{glb, set, triangle, triangle_bin, with};

/// A scene in a folder of its own.
pub struct Scene {
    pub name: &'static str,
    /// The JSON or the whole binary file.
    pub bytes: Vec<u8>,
    /// Bytes of the file `big.bin` beside it, all of them zero.
    pub big: u64,
    /// Whether it has to be refused.
    pub refused: bool,
}

impl Scene {
    /// Writes it, and returns the path of the scene.
    pub fn write(&self, folder: &Path) -> PathBuf {
        if self.big > 0 {
            // A hole: no disc is needed for it.
            std::fs::File::create(folder.join("big.bin")).and_then(|file| file.set_len(self.big)).expect("a file");
        }
        let path = folder.join("scene.glb");
        std::fs::write(&path, &self.bytes).expect("written");
        path
    }
}

pub fn all() -> Vec<Scene> {
    [lists(), geometry(), moving(), packed(), pictures(), files()].into_iter().flatten().collect()
}

fn read(name: &'static str, bytes: Vec<u8>) -> Scene {
    Scene { name, bytes, big: 0, refused: false }
}

fn refused(name: &'static str, bytes: Vec<u8>) -> Scene {
    Scene { name, bytes, big: 0, refused: true }
}

/// Lists of nothing, two megabytes each.
fn lists() -> Vec<Scene> {
    let digits = triangle_bin().iter().map(|byte| format!("%{byte:02X}")).collect::<String>();
    let triangle = || with("/buffers/0/uri", json!(format!("data:,{digits}")));
    let empty = |name: &str, item: &str| {
        let items = vec![item; (2 << 20) / (item.len() + 1)].join(",");
        let text = triangle().to_string();
        let member = format!("\"{name}\":[{items}],\"asset\"");
        text.replacen("\"asset\"", &member, 1).into_bytes()
    };
    let deep =
        format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{}{}}}", "[".repeat(1 << 20), "]".repeat(1 << 20));
    vec![
        // The first list of a name is hidden by that of the triangle, which follows.
        read("extras of objects", empty("extras", "{\"a\":1}")),
        read("samplers", empty("samplers", "{}")),
        read("skins", empty("skins", "{}")),
        read("images", empty("images", "{}")),
        read("cameras", empty("cameras", "{}")),
        read("animations", empty("animations", "{}")),
        read("nesting without end", deep.into_bytes()),
        refused("nodes without end", nodes(1 << 21)),
        read("a million nodes", nodes(1 << 20)),
        read("materials in use", used_materials(20_000)),
        read("one name, very often", {
            let names = "\"b\":1,".repeat(300_000);
            triangle().to_string().replacen('{', &format!("{{{names}"), 1).into_bytes()
        }),
    ]
}

fn nodes(count: usize) -> Vec<u8> {
    let list = format!("[{{\"mesh\":0}}{}]", ",{}".repeat(count - 1));
    let roots: Vec<String> = (0..count).map(|i| i.to_string()).collect();
    let mut json = triangle();
    set(&mut json, "/accessors/0", zeros(3));
    set(&mut json, "/meshes/0/primitives", json!([{"attributes": {"POSITION": 0}}]));
    set(&mut json, "/nodes", "NODES".into());
    set(&mut json, "/scenes/0/nodes", "ROOTS".into());
    let json = json.to_string().replace("\"NODES\"", &list).replace("\"ROOTS\"", &format!("[{}]", roots.join(",")));
    json.into_bytes()
}

/// A triangle of each of so many materials.
fn used_materials(count: usize) -> Vec<u8> {
    let primitive = |i| json!({"attributes": {"POSITION": 0}, "indices": 1, "material": i});
    let mut json = with("/materials", vec![json!({}); count].into());
    set(&mut json, "/meshes/0/primitives", (0..count).map(primitive).collect());
    glb(&json, &triangle_bin())
}

/// An accessor of zeros.
fn zeros(count: u64) -> Value {
    json!({"componentType": 5126, "count": count, "type": "VEC3"})
}

fn geometry() -> Vec<Scene> {
    let targets = |weights: Value| {
        let mut json = with("/accessors/0", zeros(4_000_000));
        let primitive = json!({"attributes": {"POSITION": 0}, "targets": vec![json!({"POSITION": 0}); 60]});
        set(&mut json, "/meshes/0", json!({"primitives": [primitive], "weights": weights}));
        glb(&json, &triangle_bin())
    };
    let instanced = |count: u64, triangles: u64| {
        let mut json = with("/nodes/0/extensions", json!({"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": 2}}}));
        set(&mut json, "/accessors/-", zeros(count));
        set(&mut json, "/accessors/1", json!({"componentType": 5125, "count": 3 * triangles, "type": "SCALAR"}));
        glb(&json, &triangle_bin())
    };
    let many = |count: usize, accessor: Value| {
        let mut json = with("/accessors/0", accessor);
        set(&mut json, "/meshes", vec![triangle()["meshes"][0].clone(); count].into());
        set(&mut json, "/nodes", (0..count).map(|mesh| json!({"mesh": mesh})).collect());
        set(&mut json, "/scenes/0/nodes", (0..count).collect());
        glb(&json, &triangle_bin())
    };
    let sheet = |count: usize| {
        let mut json = with("/accessors/0", zeros(4_000_000));
        set(&mut json, "/meshes/0/primitives", vec![json!({"attributes": {"POSITION": 0}}); count].into());
        glb(&json, &triangle_bin())
    };
    vec![
        refused("60 morph targets of zeros", targets(json!(vec![1; 60]))),
        refused("60 morph targets without weight", targets(json!([]))),
        refused("instances without end", instanced(1 << 30, 1)),
        refused("a million instances", instanced(1 << 20, 1)),
        refused("2^25 triangles by instances", instanced(1 << 18, 129)),
        read("a list of which little is used, very often", many(5_000, zeros(4_000_000))),
        refused("a list of zeros, very often", sheet(5_000)),
    ]
}

/// Keys and what they move, in great numbers.
fn moving() -> Vec<Scene> {
    let scalars = |count: u64| json!({"componentType": 5126, "count": count, "type": "SCALAR"});
    let keys = |channels: usize, samplers: usize| {
        let mut json = with("/accessors/-", scalars(4_000_000));
        set(&mut json, "/accessors/-", zeros(4_000_000));
        let channel = |i: usize| json!({"sampler": i % samplers, "target": {"node": i, "path": "translation"}});
        let sampler = json!({"input": 2, "output": 3});
        let animation = json!({"channels": (0..channels).map(channel).collect::<Vec<_>>(),
                               "samplers": vec![sampler; samplers]});
        set(&mut json, "/animations", json!([animation]));
        set(&mut json, "/nodes", vec![json!({"mesh": 0}); channels].into());
        set(&mut json, "/scenes/0/nodes", (0..channels).collect());
        glb(&json, &triangle_bin())
    };
    let each_its_own = |count: usize| {
        let mut json = with("/accessors/-", scalars(1));
        let one = |i: usize| {
            let channel = json!({"sampler": 0, "target": {"node": i, "path": "scale"}});
            json!({"channels": [channel], "samplers": [{"input": 2, "output": 0}]})
        };
        set(&mut json, "/animations", (0..count).map(one).collect());
        set(&mut json, "/nodes", vec![json!({"mesh": 0}); count].into());
        set(&mut json, "/scenes/0/nodes", (0..count).collect());
        glb(&json, &triangle_bin())
    };
    let morphed = |nodes: usize| {
        let mut json = with("/accessors/0", zeros(300_000));
        set(&mut json, "/accessors/-", scalars(60));
        let primitive = json!({"attributes": {"POSITION": 0}, "targets": vec![json!({"POSITION": 0}); 60]});
        set(&mut json, "/meshes/0", json!({"primitives": [primitive]}));
        let channel = |i: usize| json!({"sampler": 0, "target": {"node": i, "path": "weights"}});
        let channels: Vec<Value> = (0..nodes).map(channel).collect();
        set(&mut json, "/animations", json!([{"channels": channels, "samplers": [{"input": 2, "output": 2}]}]));
        set(&mut json, "/nodes", vec![json!({"mesh": 0}); nodes].into());
        set(&mut json, "/scenes/0/nodes", (0..nodes).collect());
        glb(&json, &triangle_bin())
    };
    vec![
        read("keys of zeros, very often", keys(2_000, 2_000)),
        read("many channels of one sampler", keys(20_000, 1)),
        read("many animations", each_its_own(20_000)),
        refused("60 morph targets of many nodes, with keys", morphed(200)),
    ]
}

/// [`triangle`] with its positions in a packed view.
fn packed_view(mode: &str, count: u64, stride: u64, stream: &[u8]) -> Vec<u8> {
    let mut bin = triangle_bin();
    let view = json!({"buffer": 0, "byteOffset": 44, "byteLength": stream.len(), "byteStride": stride, "count": count,
                      "mode": mode});
    let mut json = with("/bufferViews/0/extensions", json!({"EXT_meshopt_compression": view}));
    bin.extend(stream);
    set(&mut json, "/buffers/0/byteLength", bin.len().into());
    set(&mut json, "/accessors/0/count", count.into());
    glb(&json, &bin)
}

fn packed() -> Vec<Scene> {
    let zeros = |count: u64| {
        let mut stream = vec![0xa0];
        // A block of 256 elements of twelve bytes: four bytes of modes for each byte.
        stream.resize(1 + (count as usize).div_ceil(256) * 12 * 4 + 32, 0);
        packed_view("ATTRIBUTES", count, 12, &stream)
    };
    vec![
        refused("a packed view without end", packed_view("ATTRIBUTES", u64::from(u32::MAX), 256, &[0xa0; 64])),
        refused("packed triangles without end", packed_view("TRIANGLES", 3 << 30, 4, &[0xe1; 64])),
        refused("two gigabytes of zeros, packed", zeros(170 << 20)),
        read("a packed view of zeros", zeros(5 << 20)),
    ]
}

/// A PNG of one colour.
fn plain_png(side: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::RgbImage::from_pixel(side, side, image::Rgb([9, 99, 199]));
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("in memory");
    bytes.into_inner()
}

/// A triangle of each of `count` materials with an image each; the images have the same view, or one each.
fn textured(count: usize, png: &[u8], shared: bool) -> Vec<u8> {
    let mut bin = triangle_bin();
    let mut json = triangle();
    for copy in 0..if shared { 1 } else { count } {
        set(&mut json, "/bufferViews/-", json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": png.len()}));
        bin.extend(png);
        assert!(shared || copy < count);
    }
    let image = |i: usize| json!({"bufferView": if shared { 2 } else { 2 + i }, "mimeType": "image/png"});
    let material = |i| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}});
    let primitive = |i| json!({"attributes": {"POSITION": 0}, "indices": 1, "material": i});
    set(&mut json, "/images", (0..count).map(image).collect());
    set(&mut json, "/textures", (0..count).map(|i| json!({"source": i})).collect());
    set(&mut json, "/materials", (0..count).map(material).collect());
    set(&mut json, "/meshes/0/primitives", (0..count).map(primitive).collect());
    set(&mut json, "/buffers/0/byteLength", bin.len().into());
    glb(&json, &bin)
}

fn pictures() -> Vec<Scene> {
    let large = plain_png(8192);
    vec![
        read("12,000 images of one view", textured(12_000, &plain_png(64), true)),
        read("32 large images of one view", textured(32, &large, true)),
        read("12 large images", textured(12, &large, false)),
        read("an image beyond any memory", textured(1, &plain_png(16384), false)),
    ]
}

fn files() -> Vec<Scene> {
    let named = |length: u64, count: usize| {
        let mut json = with("/buffers", vec![json!({"byteLength": length, "uri": "big.bin"}); count].into());
        set(&mut json, "/bufferViews/-", json!({"buffer": count - 1, "byteLength": 12}));
        json.to_string().into_bytes()
    };
    let spellings: Vec<Value> =
        (0..64).map(|i| json!({"byteLength": 64 << 20, "uri": format!("{}big.bin", "./".repeat(i))})).collect();
    let mut spelt = with("/buffers", spellings.clone().into());
    let view = |i| json!({"buffer": i, "byteLength": 36});
    set(&mut spelt, "/bufferViews", (0..spellings.len()).map(view).collect());
    vec![
        Scene { big: 3 << 30, ..read("60 bytes of a huge file", named(60, 6)) },
        Scene { big: 3 << 30, ..refused("more of a huge file than is read", named(3 << 30, 1)) },
        Scene { big: 64 << 20, ..read("one file under many names", spelt.to_string().into_bytes()) },
    ]
}
