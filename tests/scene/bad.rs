//! Broken files: an error of one sentence each, never a panic, and nothing read outside the scene's folder.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::LazyLock;

use nephroid::low_level::scene::{Environment, Limits, World, load};
use proptest::prelude::{ProptestConfig, any, prop};
use serde_json::{Value, json};

use crate::support::files::{Files, floats, glb, load_glb, set, triangle, triangle_bin, with};

/// A name, the bytes of the file, and a part of the message.
type Case = (&'static str, Vec<u8>, &'static str);

/// Loads every case under the name `scene.glb` or, where it is not binary, `scene.gltf`.
fn all_fail(files: &Files, cases: &[Case]) {
    for (name, bytes, expected) in cases {
        let file = if bytes.starts_with(b"glTF") { "scene.glb" } else { "scene.gltf" };
        let result = catch_unwind(AssertUnwindSafe(|| files.load(file, bytes)));
        let result = result.unwrap_or_else(|_| panic!("{name}: panics"));
        let error = result.map(|_| ()).expect_err(name);
        let message = error.to_string();
        assert_eq!(error.exit_code(), 2, "{name}: {message}");
        assert!(message.contains(expected), "{name}: {message}");
        assert!(!message.contains('\n') && message.len() < 400, "{name}: {message}");
    }
}

/// Loads every case and finds its warning; under [`Limits::strict`] it fails.
fn all_warn(files: &Files, cases: &[Case]) {
    for (name, bytes, expected) in cases {
        let file = if bytes.starts_with(b"glTF") { "scene.glb" } else { "scene.gltf" };
        let scene = files.load(file, bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
        scene.validate().unwrap_or_else(|fault| panic!("{name}: {fault}"));
        assert_eq!(scene.instances.len(), 1, "{name}");
        assert!(scene.warnings.iter().any(|warning| warning.contains(expected)), "{name}: {:?}", scene.warnings);
        let strict = Limits { strict: true, ..Limits::default() };
        let error = load(&files.write(file, bytes), &strict).map(|_| ()).expect_err(name);
        assert_eq!(error.exit_code(), 2, "{name}");
    }
}

/// A binary file with one member of the valid document changed.
fn changed(pointer: &str, value: Value) -> Vec<u8> {
    glb(&with(pointer, value), &triangle_bin())
}

#[test]
fn the_file_that_the_cases_break_is_valid() {
    let scene = load_glb(&triangle(), &triangle_bin()).unwrap();
    assert_eq!(World::of(&scene).triangles, [[0, 1, 2]]);
}

#[test]
fn containers() {
    let whole = glb(&triangle(), &triangle_bin());
    let patched = |at: usize, bytes: &[u8]| {
        let mut file = whole.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        file
    };
    let json_length = u32::from_le_bytes([whole[12], whole[13], whole[14], whole[15]]) as usize;
    let bin_header = 20 + json_length;
    let random: Vec<u8> = (0..4096u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let cases: Vec<Case> = vec![
        ("empty", Vec::new(), "JSON"),
        ("random bytes", random, "JSON"),
        ("header only in part", whole[..7].to_vec(), "header is cut"),
        ("header only", whole[..12].to_vec(), "announces"),
        ("header only, as it says", [&whole[..8], &[12, 0, 0, 0]].concat(), "not JSON"),
        ("cut in JSON", whole[..60].to_vec(), "announces"),
        ("cut in BIN", whole[..whole.len() - 4].to_vec(), "announces"),
        ("version 1", patched(4, &[1]), "version 1"),
        ("JSON chunk too long", patched(12, &[255, 255, 255, 127]), "chunk 0"),
        ("BIN chunk too long", patched(bin_header, &[255, 255, 0, 0]), "chunk 1"),
        ("BIN comes first", patched(16, b"BIN\0"), "not JSON"),
        ("a name that is not UTF-8", patched(24, &[0xFF]), "accessor 0 does not exist"),
        ("nested without end", vec![b'['; 100_000], "JSON"),
        ("only a number", b"1".to_vec(), "glTF"),
        ("number too large", b"{\"asset\": 1e999}".to_vec(), "asset"),
        ("no asset", b"{}".to_vec(), "asset"),
    ];
    all_fail(&Files::new(), &cases);
    let cut = (bin_header as u32 + 3).to_le_bytes();
    all_warn(
        &Files::new(),
        &[
            ("length below the header", patched(8, &[3, 0, 0, 0]), "announces 3 bytes"),
            ("huge length", patched(8, &[255; 4]), "announces 4294967295"),
            ("length inside of a chunk header", patched(8, &cut), "announces"),
            ("NUL after the JSON", [triangle_with_data().to_string().as_bytes(), b"\0\0 \0"].concat(), "NUL"),
            ("a name in Latin-1", named_in_latin_1(), "not UTF-8"),
        ],
    );
}

/// [`triangle`] with its buffer as a data URI.
fn triangle_with_data() -> Value {
    let digits = triangle_bin().iter().map(|byte| format!("%{byte:02X}")).collect::<String>();
    with("/buffers/0/uri", json!(format!("data:,{digits}")))
}

fn named_in_latin_1() -> Vec<u8> {
    let mut json = triangle_with_data();
    set(&mut json, "/nodes/0/name", json!("K?se"));
    let mut bytes = json.to_string().into_bytes();
    let at = bytes.windows(4).position(|name| name == b"K?se").unwrap();
    bytes[at + 1] = 0xE4;
    bytes
}

#[test]
fn structure() {
    let cases: Vec<Case> = vec![
        ("version 3", changed("/asset/version", json!("3.0")), "version 3.0"),
        ("newer reader needed", changed("/asset/minVersion", json!("2.1")), "2.1"),
        ("required extension", changed("/extensionsRequired", json!(["ACME_shapes"])), "ACME_shapes"),
        ("node out of range", changed("/scenes/0/nodes", json!([9])), "node 9 does not exist"),
        ("mesh out of range", changed("/nodes/0/mesh", json!(1)), "mesh 1 does not exist"),
        ("index that wraps to 0", changed("/nodes/0/mesh", json!(4_294_967_296u64)), "not an index"),
        ("negative index", changed("/nodes/0/mesh", json!(-1)), "not an index"),
        ("unknown mode", changed("/meshes/0/primitives/0/mode", json!(9)), "mode"),
        ("no POSITION", changed("/meshes/0/primitives/0/attributes", json!({})), "POSITION"),
        ("POSITION out of range", changed("/meshes/0/primitives/0/attributes/POSITION", json!(77)), "accessor 77"),
        ("a mesh that is a number", changed("/meshes/0", json!(7)), "mesh 0 is not an object"),
    ];
    all_fail(&Files::new(), &cases);
}

/// [`triangle`] with further members.
fn and(members: &[(&str, Value)]) -> Vec<u8> {
    let mut json = triangle();
    members.iter().for_each(|(pointer, value)| set(&mut json, pointer, value.clone()));
    glb(&json, &triangle_bin())
}

#[test]
fn one_broken_part_does_not_stop_the_others() {
    let mesh = json!({"mesh": 0});
    let punctual = |index: u32| json!({"KHR_lights_punctual": {"light": index}});
    let lamp = |light: Value, expected: &'static str| {
        let lights = json!({"KHR_lights_punctual": {"lights": [light]}});
        (expected, and(&[("/extensions", lights), ("/nodes/0/extensions", punctual(0))]), expected)
    };
    let spot = |spot: Value| json!({"type": "spot", "spot": spot});
    let material = |member: &str, value: Value| changed(&format!("/materials/0/{member}"), value);
    let cases: Vec<Case> = vec![
        ("scene out of range", changed("/scene", json!(7)), "scene 7 does not exist"),
        ("node is its own child", changed("/nodes/0/children", json!([0])), "listed twice"),
        ("node twice in a scene", changed("/scenes/0/nodes", json!([0, 0])), "node 0 is listed twice"),
        ("a node that is missing", changed("/scenes/0/nodes", json!([0, 9])), "node 9 does not exist"),
        ("a node that is a text", and(&[("/nodes", json!([mesh, "x"])), ("/scenes/0/nodes", json!([0, 1]))]), "node 1"),
        ("children that are none", changed("/nodes/0/children", json!([-1, "a"])), "not an index"),
        ("short matrix", changed("/nodes/0/matrix", json!([1, 2, 3])), "16 numbers"),
        (
            "projective matrix",
            changed("/nodes/0/matrix", json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])),
            "last row",
        ),
        ("a translation of two", changed("/nodes/0/translation", json!([1, 2])), "3 numbers"),
        ("skin out of range", changed("/nodes/0/skin", json!(4)), "skin 4 is ignored"),
        ("camera out of range", changed("/nodes/0/camera", json!(4)), "camera 4 does not exist"),
        ("material out of range", changed("/meshes/0/primitives/0/material", json!(5)), "material 5 does not exist"),
        ("unknown attribute", changed("/meshes/0/primitives/0/attributes/FOO", json!(0)), "FOO is unknown"),
        ("morph target that is a number", changed("/meshes/0/primitives/0/targets", json!([3])), "targets[0]"),
        ("light out of range", changed("/nodes/0/extensions", punctual(3)), "light 3 does not exist"),
        lamp(json!({"type": "candle"}), "the type candle is unknown"),
        lamp(json!({}), "the type none is unknown"),
        lamp(spot(json!({"innerConeAngle": 1.0, "outerConeAngle": 0.5})), "spot angles 1 and 0.5"),
        lamp(spot(json!({"innerConeAngle": 0.6, "outerConeAngle": 0.6})), "spot angles 0.6 and 0.6"),
        lamp(spot(json!({"innerConeAngle": -1, "outerConeAngle": 0.6})), "spot angles -1"),
        lamp(spot(json!({"outerConeAngle": 1.6})), "spot angles 0 and 1.6"),
        lamp(spot(json!({"outerConeAngle": 0})), "a spot angle of 0"),
        lamp(json!({"type": "spot"}), "without 'spot'"),
        (
            "camera without projection",
            and(&[("/cameras", json!([{"type": "perspective"}])), ("/nodes/0/camera", json!(0))]),
            "the camera was skipped",
        ),
        ("a roughness in words", material("pbrMetallicRoughness", json!({"roughnessFactor": "0.5"})), "not a number"),
        ("unknown alpha mode", material("alphaMode", json!("FADE")), "alpha mode FADE"),
        ("texture out of range", material("normalTexture", json!({"index": 3})), "texture 3 does not exist"),
        ("texture without index", material("emissiveTexture", json!({})), "names no texture"),
        ("a buffer from nowhere", changed("/buffers/-", json!({"byteLength": 8})), "buffer 1: it has neither"),
        ("a buffer that is a number", changed("/buffers/-", json!(8)), "buffer 1 is not an object"),
    ];
    all_warn(&Files::new(), &cases);
}

#[test]
fn what_is_valid_makes_no_warning() {
    let animation = json!([{"channels": [{"target": {"path": "pointer"}}], "samplers": 7}]);
    let cases: [(&str, Vec<u8>); 8] = [
        ("numbers with a fraction of zero", {
            let text = triangle().to_string().replace("36", "3.6e1").replace("\"count\":3", "\"count\":3.0");
            glb(&serde_json::from_str(&text).unwrap(), &triangle_bin())
        }),
        ("members that are null", changed("/nodes/0/skin", Value::Null)),
        ("a channel without a target", changed("/animations", animation)),
        ("nodes that nothing shows", changed("/nodes", json!([{"mesh": 0}, {"children": [2]}, {"children": [1]}]))),
        ("a root with a parent", changed("/nodes", json!([{"mesh": 0}, {"children": [0]}]))),
        ("an attribute of an application", changed("/meshes/0/primitives/0/attributes/_ID", json!(99))),
        ("extras of any kind", changed("/extras", json!([{"mesh": -1}, "x", null]))),
        ("a version that is a number", changed("/asset", json!({"version": 2.0}))),
    ];
    for (name, bytes) in cases {
        let scene = Files::new().load("scene.glb", &bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(World::of(&scene).triangles.len(), 1, "{name}");
        // About the missing light and camera, and animations.
        let others = scene.warnings.iter().filter(|w| !w.contains("the scene has no") && !w.contains("animation"));
        assert_eq!(others.count(), 0, "{name}: {:?}", scene.warnings);
    }
}

/// A sparse list of positions, its indices of this type.
fn sparse_list(count: u64, kind: u64) -> Value {
    json!({"count": count, "indices": {"bufferView": 1, "componentType": kind}, "values": {"bufferView": 0}})
}

#[test]
fn accessors() {
    let huge = json!(u64::MAX);
    let bad_index = {
        let mut bin = triangle_bin();
        bin[40] = 200;
        glb(&triangle(), &bin)
    };
    let fewer_normals = {
        let mut json = triangle();
        set(&mut json, "/accessors/-", json!({"bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3"}));
        set(&mut json, "/meshes/0/primitives/0/attributes/NORMAL", json!(2));
        glb(&json, &triangle_bin())
    };
    let sparse = |sparse: Value| changed("/accessors/0/sparse", sparse);
    let cases: Vec<Case> = vec![
        ("count 0", changed("/accessors/0/count", json!(0)), "no elements"),
        ("count near 2^64", changed("/accessors/0/count", huge.clone()), "limit"),
        ("count that overflows", changed("/accessors/0/count", json!(1_537_228_672_809_129_302u64)), "limit"),
        ("offset near 2^64", changed("/accessors/0/byteOffset", huge.clone()), "missing"),
        (
            "zeros without end",
            {
                let mut json = with("/accessors/0/count", json!(200_000_000));
                json.pointer_mut("/accessors/0").unwrap().as_object_mut().unwrap().remove("bufferView");
                glb(&json, &triangle_bin())
            },
            "limit",
        ),
        ("POSITION as SCALAR", changed("/accessors/0/type", json!("SCALAR")), "cannot be read as Position"),
        ("unknown component type", changed("/accessors/0/componentType", json!(5124)), "componentType"),
        ("unknown type", changed("/accessors/0/type", json!("VEC5")), "type"),
        ("signed indices", changed("/accessors/1/componentType", json!(5122)), "cannot be read as Index"),
        ("vector indices", changed("/meshes/0/primitives/0/indices", json!(0)), "cannot be read as Index"),
        ("vertex index out of range", bad_index, "index 200 is out of range"),
    ];
    all_fail(&Files::new(), &cases);
    all_warn(
        &Files::new(),
        &[
            ("one too many", changed("/accessors/0/count", json!(4)), "12 bytes are missing"),
            ("POSITION as bytes", changed("/accessors/0/componentType", json!(5121)), "is not meant for Position"),
            ("fewer normals than vertices", fewer_normals, "2 elements of Normal for 3 vertices"),
            ("sparse count above count", sparse(sparse_list(4, 5123)), "sparse"),
            ("sparse indices cut", sparse(sparse_list(3, 5125)), "missing"),
            (
                "indices as normals",
                changed("/meshes/0/primitives/0/attributes/NORMAL", json!(1)),
                "cannot be read as Normal",
            ),
        ],
    );
}

#[test]
fn views_and_buffers() {
    let huge = json!(u64::MAX);
    let cases: Vec<Case> = vec![
        ("stride below the element", changed("/bufferViews/0/byteStride", json!(8)), "stride"),
        ("view offset near 2^64", changed("/bufferViews/0/byteOffset", huge.clone()), "beyond its buffer"),
        ("view of no buffer", changed("/bufferViews/0/buffer", json!(3)), "buffer 3 does not exist"),
        ("accessor of no view", changed("/accessors/0/bufferView", json!(9)), "buffer view 9 does not exist"),
    ];
    all_fail(&Files::new(), &cases);
    all_warn(
        &Files::new(),
        &[
            ("stride of 0", changed("/bufferViews/0/byteStride", json!(0)), "a stride of 0"),
            ("view beyond buffer", changed("/bufferViews/0/byteLength", json!(45)), "beyond its buffer"),
            ("buffer longer than BIN", changed("/buffers/0/byteLength", json!(4000)), "missing"),
            ("buffer of 2^63 bytes", changed("/buffers/0/byteLength", json!(9_223_372_036_854_775_808u64)), "missing"),
        ],
    );
}

#[test]
fn sparse_index_out_of_range() {
    // A byte of the positions: 128.
    let indices = json!({"bufferView": 0, "byteOffset": 14, "componentType": 5121});
    let sparse = json!({"count": 1, "indices": indices, "values": {"bufferView": 0}});
    all_warn(&Files::new(), &[("sparse index", changed("/accessors/0/sparse", sparse), "sparse index 128")]);
}

/// The document with its buffer at `uri`.
fn buffer_at(uri: &str) -> Vec<u8> {
    with("/buffers/0/uri", json!(uri)).to_string().into_bytes()
}

#[test]
fn paths_that_escape() {
    let files = Files::new();
    let inside = files.write("data.bin", &triangle_bin());
    let outside = inside.parent().unwrap().with_file_name("secret.bin");
    std::fs::write(&outside, triangle_bin()).unwrap();
    let absolute = outside.to_str().unwrap().to_owned();
    assert!(files.load("scene.gltf", &buffer_at("data.bin")).is_ok());
    let mut cases: Vec<Case> = vec![
        ("parent", buffer_at("../secret.bin"), "outside"),
        ("parent of a folder", buffer_at("x/../../secret.bin"), "outside"),
        ("encoded parent", buffer_at("%2E%2E%2Fsecret.bin"), "outside"),
        ("absolute", buffer_at(&absolute), "outside"),
        ("inside, but absolute", buffer_at(inside.to_str().unwrap()), "outside"),
        ("file URI", buffer_at(&format!("file://{absolute}")), "refused"),
        ("web", buffer_at("https://example.org/data.bin"), "refused"),
        ("backslash", buffer_at("..\\secret.bin"), "outside"),
        ("NUL", buffer_at("data.bin%00"), "not a file name"),
        ("not UTF-8", buffer_at("%FF"), "UTF-8"),
        ("cut percent", buffer_at("data.bin%2"), "percent"),
        ("folder", buffer_at("."), "regular file"),
        ("empty", buffer_at(""), "not a file name"),
        ("missing", buffer_at("nothing.bin"), "cannot be read"),
        ("data URI without comma", buffer_at("data:application/octet-stream;base64"), "comma"),
        ("bad base64", buffer_at("data:;base64,AAA!"), "base64"),
        ("cut base64", buffer_at("data:;base64,AAAAA"), "base64"),
        ("short data URI", buffer_at("data:;base64,AAAA"), "bytes are missing"),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&outside, inside.with_file_name("link.bin")).unwrap();
        cases.push(("symbolic link", buffer_at("link.bin"), "leads outside"));
    }
    all_fail(&files, &cases);
}

#[cfg(unix)]
#[test]
fn devices_and_folders_are_no_scenes() {
    for path in ["/dev/zero", "/", "/nonexistent/scene.gltf"] {
        let error = load(path.as_ref(), &Limits::default()).unwrap_err();
        assert_eq!(error.exit_code(), 2);
    }
}

#[test]
fn images() {
    let files = Files::new();
    let textured = |image: Value| {
        let mut json = with("/images", json!([image]));
        set(&mut json, "/textures", json!([{"source": 0}]));
        set(&mut json, "/materials/0/pbrMetallicRoughness/baseColorTexture", json!({"index": 0}));
        json
    };
    let png = |width: u32, height: u32| {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
        bytes.extend(width.to_be_bytes().iter().chain(&height.to_be_bytes()).chain(&[8, 6, 0, 0, 0]));
        let crc = crc(&bytes[12..]);
        bytes.extend(crc.to_be_bytes());
        bytes
    };
    files.write("huge.png", &png(1 << 30, 1 << 30));
    files.write("flat.png", &png(0, 1));
    files.write("cut.png", &png(4, 4));
    files.write("cut.jpg", b"\xFF\xD8\xFF\xE0\0\x10JFIF\0\x01");
    let cases: Vec<Case> = vec![
        ("huge image", with_bin(&textured(json!({"uri": "huge.png"}))), "image 0"),
        ("image without width", with_bin(&textured(json!({"uri": "flat.png"}))), "image 0"),
        ("cut PNG", with_bin(&textured(json!({"uri": "cut.png"}))), "image 0"),
        ("cut JPEG", with_bin(&textured(json!({"uri": "cut.jpg"}))), "image 0"),
        (
            "text as image",
            with_bin(&textured(json!({"uri": "data:image/png;base64,AAAA"}))),
            "neither PNG, JPEG, WebP nor KTX 2",
        ),
        ("missing image", with_bin(&textured(json!({"uri": "none.png"}))), "cannot be read"),
        ("escaping image", with_bin(&textured(json!({"uri": "../x.png"}))), "outside"),
        ("no contents", with_bin(&textured(json!({}))), "neither"),
        (
            "view out of range",
            with_bin(&textured(json!({"bufferView": 8, "mimeType": "image/png"}))),
            "buffer view 8 does not exist",
        ),
        ("geometry as image", with_bin(&textured(json!({"bufferView": 0, "mimeType": "image/png"}))), "neither"),
    ];
    all_warn(&files, &cases);
    all_fail(&files, &[("no buffer", textured(json!({"uri": "huge.png"})).to_string().into_bytes(), "buffer 0")]);
}

fn with_bin(json: &Value) -> Vec<u8> {
    glb(json, &triangle_bin())
}

/// CRC-32 of PNG chunks.
fn crc(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _: u32| if crc & 1 == 1 { 0xEDB8_8320 ^ (crc >> 1) } else { crc >> 1 };
    !bytes.iter().fold(!0u32, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step))
}

#[test]
fn small_limits_refuse() {
    let files = Files::new();
    let path = files.write("scene.glb", &glb(&triangle(), &triangle_bin()));
    let limits = Limits::default();
    for limits in [
        Limits { file_bytes: 100, ..limits },
        Limits { json_bytes: 100, ..limits },
        Limits { buffer_bytes: 43, ..limits },
        Limits { elements: 5, ..limits },
        Limits { triangles: 0, ..limits },
        Limits { nodes: 0, ..limits },
    ] {
        let error = load(&path, &limits).unwrap_err();
        assert!(error.to_string().contains("limit") || error.to_string().contains("more than"), "{error}");
    }
    let chain: Vec<Value> = (0..20).map(|i| if i < 19 { json!({"children": [i + 1]}) } else { json!({}) }).collect();
    let path = files.write("chain.glb", &glb(&with("/nodes", json!(chain)), &triangle_bin()));
    assert!(load(&path, &limits).is_ok());
    let error = load(&path, &Limits { depth: 10, ..limits }).unwrap_err();
    assert!(error.to_string().contains("deeper"), "{error}");
}

#[test]
fn damage_that_can_be_read_around_is_a_warning_and_strict_makes_it_an_error() {
    let positions = |values: &[f32]| {
        let mut bin = floats(values);
        bin.extend([0, 0, 1, 0, 2, 0, 0, 0]);
        bin
    };
    let good = triangle_bin();
    let cases = [
        ("NaN position", triangle(), positions(&[f32::NAN, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0])),
        ("no area", triangle(), positions(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0])),
        ("needle", triangle(), positions(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.5, 1e-8, 0.0])),
        ("singular", with("/nodes/0/scale", json!([1, 0, 0])), good.clone()),
        ("overflow", with("/nodes/0/translation", json!([1e300, 0, 0])), good.clone()),
        ("zero rotation", with("/nodes/0/rotation", json!([0, 0, 0, 0])), good.clone()),
        ("albedo", with("/materials/0/pbrMetallicRoughness/baseColorFactor", json!([2, 1, 1, 1])), good.clone()),
        ("emission", with("/materials/0/emissiveFactor", json!([-1, 0, 0])), good.clone()),
    ];
    for (name, json, bin) in cases {
        let files = Files::new();
        let path = files.write("scene.glb", &glb(&json, &bin));
        let scene = load(&path, &Limits::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(World::of(&scene).positions.iter().flatten().all(|x| x.is_finite()), "{name}");
        // Two more are about the missing light and camera.
        assert_eq!(scene.warnings.len(), 3, "{name}: {:?}", scene.warnings);
        let strict = load(&path, &Limits { strict: true, ..Limits::default() }).expect_err(name);
        assert!(strict.to_string().ends_with(&scene.warnings[0]), "{name}: {strict}");
    }
}

#[test]
fn skipped_triangles_are_counted() {
    let mut bin = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, f32::INFINITY, 0.0, 0.0]);
    bin.extend([0, 1, 2, 0, 1, 1, 1, 2, 3, 0, 0, 0].iter().flat_map(|i: &u16| i.to_le_bytes()));
    let mut json = triangle();
    set(&mut json, "/buffers/0/byteLength", json!(72));
    set(&mut json, "/bufferViews/0/byteLength", json!(48));
    set(&mut json, "/bufferViews/1", json!({"buffer": 0, "byteOffset": 48, "byteLength": 24}));
    set(&mut json, "/accessors/0/count", json!(4));
    set(&mut json, "/accessors/1/count", json!(12));
    set(&mut json, "/meshes/0/primitives/-", json!({"attributes": {"POSITION": 0}, "mode": 0}));
    let scene = load_glb(&json, &bin).unwrap();
    assert_eq!(World::of(&scene).triangles.len(), 1);
    let skipped = scene.skipped;
    assert_eq!((skipped.degenerate_triangles, skipped.non_finite_triangles), (2, 1));
    assert_eq!(skipped.non_triangle_primitives, 1);
}

/// A document that uses most of what is read: textures, lights, a camera, a skin, morphs, sparse and instancing.
fn rich() -> Vec<u8> {
    let mut json = triangle();
    set(
        &mut json,
        "/extensionsUsed",
        json!(["KHR_lights_punctual", "EXT_mesh_gpu_instancing", "KHR_materials_volume"]),
    );
    set(&mut json, "/extensions", json!({"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 3}]}}));
    set(&mut json, "/cameras", json!([{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}]));
    set(&mut json, "/skins", json!([{"joints": [1]}]));
    set(&mut json, "/meshes/0/primitives/0/targets", json!([{"POSITION": 0}]));
    set(&mut json, "/meshes/0/weights", json!([0.5]));
    let sparse = json!({"count": 2, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}});
    set(&mut json, "/accessors/0/sparse", sparse);
    let instanced = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}});
    let nodes = json!([
        {"mesh": 0, "children": [1, 2], "scale": [1, -2, 3]},
        {"camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"mesh": 0, "extensions": instanced, "rotation": [0, 0, 0.7, 0.7]}
    ]);
    set(&mut json, "/nodes", nodes);
    let volume = json!({"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.5, 1, 1]});
    set(&mut json, "/materials/0/extensions", json!({"KHR_materials_volume": volume}));
    glb(&json, &triangle_bin())
}

#[test]
fn the_rich_file_is_valid() {
    let scene = Files::new().load("scene.glb", &rich()).unwrap();
    assert_eq!((World::of(&scene).triangles.len(), scene.lights.len(), scene.cameras.len()), (4, 1, 1));
}

/// Loads mutated bytes; only the absence of panics and of invalid scenes is asserted.
fn survives(bytes: &[u8]) {
    if let Ok(scene) = Files::new().load("scene.glb", bytes) {
        scene.validate_references().expect("a loaded scene is whole");
        let world = World::of(&scene);
        let count = world.positions.len();
        assert_eq!(world.normals.len(), count);
        assert!(world.triangles.iter().flatten().all(|&i| (i as usize) < count));
        assert!(world.positions.iter().chain(&world.normals).flatten().all(|x| x.is_finite()));
    }
}

static MAPS: LazyLock<Vec<Vec<u8>>> = LazyLock::new(maps);

/// Small environment maps: OpenEXR in every lossless compression, and Radiance HDR with run-length coding.
fn maps() -> Vec<Vec<u8>> {
    use exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage};
    let codings =
        [Encoding::UNCOMPRESSED, Encoding::FAST_LOSSLESS, Encoding::SMALL_LOSSLESS, Encoding::SMALL_FAST_LOSSLESS];
    let mut maps: Vec<Vec<u8>> = codings
        .into_iter()
        .map(|encoding| {
            let channels = SpecificChannels::rgb(|at: Vec2<usize>| (at.x() as f32, at.y() as f32, 0.5f32));
            let layer = Layer::new((16, 8), LayerAttributes::named("map"), encoding, channels);
            let mut bytes = std::io::Cursor::new(Vec::new());
            Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
            bytes.into_inner()
        })
        .collect();
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n".to_vec();
    for _ in 0..8 {
        // Each scan line: a marker with the width, then four channels as one run each.
        hdr.extend([2, 2, 0, 16, 144, 10, 144, 20, 144, 30, 144, 129]);
    }
    maps.push(hdr);
    maps
}

#[test]
fn the_maps_that_are_broken_are_valid() {
    for map in MAPS.iter() {
        let files = Files::new();
        let (map, _) = Environment::load(&files.write("map", map), &Limits::default()).unwrap();
        assert_eq!(map.radiance.len(), 128);
    }
}

proptest::proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutated_bytes_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8)) {
        let mut bytes = rich();
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        survives(&bytes);
    }

    /// Digits stay digits, so that the file stays JSON and the checks behind the parser are reached.
    #[test]
    fn mutated_numbers_never_panic(edits in prop::collection::vec((any::<prop::sample::Index>(), b'0'..=b'9'), 1..6)) {
        let mut bytes = rich();
        let digits: Vec<usize> = (20..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
        for (at, value) in edits {
            bytes[digits[at.index(digits.len())]] = value;
        }
        survives(&bytes);
    }

    #[test]
    fn mutated_maps_never_panic(
        which in 0..5usize,
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5),
    ) {
        let mut bytes = MAPS[which].clone();
        for (at, value) in edits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok((map, _)) = Environment::load(&Files::new().write("map", &bytes), &Limits::default()) {
            assert_eq!(map.radiance.len(), map.width as usize * map.height as usize);
            assert!(map.radiance.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
        }
    }
}
