//! The build script's compiler, reflection and emission, on small kernels written here.

use std::fs;
use std::path::PathBuf;

use crate::shader::constants::{self, HostConstant};
use crate::shader::expression::Value;
use crate::shader::{Compiler, Constant, Kernel, Stage, Type, emit, kernel_files, reflect};

/// A folder of GLSL like the one of the crate.
struct Sources(tempfile::TempDir);

impl Sources {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("folders");
            fs::write(path, text).expect("a source file");
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn compile(&self, name: &str) -> Result<Vec<u32>, String> {
        Compiler::new(self.0.path())?.compile(&self.path(name))
    }

    fn reflect(&self, name: &str) -> Result<Kernel, String> {
        reflect(&self.path(name), &self.compile(name)?)
    }
}

const HEAD: &str = "#version 460\n#extension GL_GOOGLE_include_directive : require\n\
                    #extension GL_EXT_scalar_block_layout : require\nlayout(local_size_x = 64) in;\n";

/// What comes of one kernel with this text after [`HEAD`].
fn kernel(text: &str) -> Result<Kernel, String> {
    Sources::new(&[("kernels/it.comp", &format!("{HEAD}{text}"))]).reflect("kernels/it.comp")
}

#[test]
fn an_error_shows_file_line_and_text() {
    let text = format!("{HEAD}void main() {{\n    uint x = 1u;\n    x = undeclared_name;\n}}\n");
    let sources = Sources::new(&[("kernels/broken.comp", &text)]);
    let message = sources.compile("kernels/broken.comp").expect_err("it is broken");
    assert!(message.contains("kernels/broken.comp:7: error"), "{message}");
    assert!(message.contains("     7 |     x = undeclared_name;"), "{message}");
}

#[test]
fn an_error_inside_of_an_include_shows_the_included_file() {
    let text = format!("{HEAD}#include \"lib/part.glsl\"\nvoid main() {{ half_of(1.0); }}\n");
    let part = "// Half.\nfloat half_of(float x) {\n    return x * missing_factor;\n}\n";
    let sources = Sources::new(&[("kernels/outer.comp", &text), ("lib/part.glsl", part)]);
    let message = sources.compile("kernels/outer.comp").expect_err("its include is broken");
    assert!(message.contains("lib/part.glsl:3: error"), "{message}");
    assert!(message.contains("     3 |     return x * missing_factor;"), "{message}");
    assert!(!message.contains("outer.comp:3"), "{message}");
}

#[test]
fn a_missing_include_is_named() {
    let text = format!("{HEAD}#include \"lib/nowhere.glsl\"\nvoid main() {{}}\n");
    let message =
        Sources::new(&[("kernels/it.comp", &text)]).compile("kernels/it.comp").expect_err("nothing to include");
    assert!(message.contains("kernels/it.comp:5") && message.contains("lib/nowhere.glsl"), "{message}");
}

#[test]
fn kernels_are_found_in_all_folders_in_a_stable_order() {
    let files =
        [("kernels/b/two.frag", ""), ("kernels/a/one.comp", ""), ("kernels/a/readme.md", ""), ("lib/x.comp", "")];
    let sources = Sources::new(&files);
    let found = kernel_files(sources.0.path()).unwrap();
    assert_eq!(found, [sources.path("kernels/a/one.comp"), sources.path("kernels/b/two.frag")]);
}

#[test]
fn access_bindings_parameters_and_constants_are_reflected() {
    let kernel = kernel(
        "#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
         struct Item { vec3 position; uint tags[2]; uint64_t id; };
         layout(constant_id = 3) const uint MODE = 7u;
         layout(constant_id = 1) const float SCALE = 0.5;
         layout(constant_id = 2) const bool EXACT = true;
         layout(constant_id = 0) const int SHIFT = -4;
         layout(push_constant, scalar) uniform Params { uint count; vec3 origin; } params;
         layout(set = 0, binding = 5, scalar) readonly buffer In { Item items[]; };
         layout(set = 0, binding = 2, scalar) writeonly buffer Out { float results[]; };
         layout(set = 0, binding = 0, scalar) buffer State { ivec2 state[]; };
         layout(set = 0, binding = 9, scalar) readonly buffer Unused { uint unused[]; };
         void main() {
             uint i = gl_GlobalInvocationID.x;
             if (i >= params.count) return;
             float x = items[i].position.x * SCALE + params.origin.y + float(items[i].tags[1]) + float(items[i].id);
             state[i] += ivec2(int(MODE), SHIFT);
             if (EXACT) results[i] = x;
         }",
    )
    .expect("a sound kernel");
    assert_eq!((kernel.name.as_str(), kernel.local_size), ("it", [64, 1, 1]));
    let bindings: Vec<_> = kernel.bindings.iter().map(|b| (b.index, b.name.as_str(), b.read_only)).collect();
    assert_eq!(bindings, [(0, "state", false), (2, "results", false), (5, "items", true)]);
    let Type::Struct(item) = &kernel.bindings[2].element else { panic!("{:?}", kernel.bindings[2]) };
    let members: Vec<_> = item.members.iter().map(|m| (m.name.as_str(), m.offset)).collect();
    assert_eq!((item.name.as_str(), members), ("Item", vec![("position", 0), ("tags", 12), ("id", 24)]));
    assert_eq!(kernel.bindings[2].element.layout(), (32, 8));
    let params = kernel.params.expect("push constants");
    let members: Vec<_> = params.members.iter().map(|m| (m.name.as_str(), m.offset)).collect();
    assert_eq!(members, [("count", 0), ("origin", 4)]);
    let constant = |id, name: &str, ty, default_bits| Constant { id, name: name.into(), ty, default_bits };
    let wanted = [
        constant(0, "SHIFT", "i32", -4i32 as u32),
        constant(1, "SCALE", "f32", 0.5f32.to_bits()),
        constant(2, "EXACT", "bool", 1),
        constant(3, "MODE", "u32", 7),
    ];
    assert_eq!(kernel.constants, wanted);
}

#[test]
fn a_buffer_is_bound_although_only_its_length_is_used() {
    let kernel = kernel(
        "layout(set = 0, binding = 0, scalar) readonly buffer Source { uint source[]; };
         layout(set = 0, binding = 1, scalar) writeonly buffer Target { uint target[]; };
         void main() { target[0] = uint(source.length()); }",
    );
    let names: Vec<_> = kernel.expect("a sound kernel").bindings.into_iter().map(|binding| binding.name).collect();
    assert_eq!(names, ["source", "target"]);
}

#[test]
fn workgroup_sizes_are_literals() {
    let sized = |layout: &str| {
        let text = format!(
            "#version 460\n#extension GL_EXT_scalar_block_layout : require\n{layout}\n\
             layout(set = 0, binding = 0, scalar) buffer Data {{ uint data[]; }};\n\
             void main() {{ data[gl_LocalInvocationIndex] = gl_WorkGroupSize.x; }}"
        );
        Sources::new(&[("it.comp", &text)]).reflect("it.comp")
    };
    assert_eq!(
        sized("layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;").unwrap().local_size,
        [8, 4, 2]
    );
    let refused = sized("layout(local_size_x_id = 0) in;").expect_err("its size is not known before it is specialised");
    assert!(refused.contains("workgroup size is a specialisation constant"), "{refused}");
}

/// Each of these could not be shared with the host.
#[test]
fn layouts_that_rust_cannot_repeat_are_refused() {
    let buffer = |declaration: &str, body: &str| kernel(&format!("{declaration}\nvoid main() {{ {body} }}"));
    let cases = [
        (
            buffer("layout(set = 0, binding = 0, std430) buffer B { vec3 points[]; };", "points[0].x = 1.0;"),
            "points: elements of 12 bytes lie 16 bytes apart",
        ),
        (
            buffer("layout(set = 0, binding = 0, scalar) buffer B { uint head; uint tail[]; };", "tail[0] = head;"),
            "a storage block holds exactly one runtime array",
        ),
        (
            buffer("layout(set = 0, binding = 0, scalar) buffer B { uint few[4]; };", "few[0] = 1u;"),
            "few: the array has a fixed length",
        ),
        (
            buffer("layout(set = 0, binding = 0, scalar) buffer B { mat3 turns[]; };", "turns[0][0].x = 1.0;"),
            "cannot be shared with the host",
        ),
        (
            buffer("layout(set = 1, binding = 0, scalar) buffer B { uint data[]; };", "data[0] = 1u;"),
            "outside of set 0",
        ),
        (
            buffer(
                "layout(set = 0, binding = 0, scalar) buffer A { uint one[]; };\n\
                 layout(set = 0, binding = 0, scalar) buffer B { float other[]; };",
                "other[0] = float(one[0]);",
            ),
            "binding 0 is both",
        ),
    ];
    for (result, wanted) in cases {
        let message = result.expect_err(wanted);
        assert!(message.contains("it.comp") && message.contains(wanted), "{message} instead of {wanted}");
    }
}

/// A kernel that uses `struct Shared` of this definition.
fn sharing(name: &str, definition: &str) -> Kernel {
    let text = format!(
        "{HEAD}{definition}\nlayout(set = 0, binding = 0, scalar) buffer Data {{ Shared data[]; }};\n\
         void main() {{ data[0].a = data[1].a; }}"
    );
    let file = format!("kernels/{name}.comp");
    Sources::new(&[(&file, &text)]).reflect(&file).expect("a sound kernel")
}

#[test]
fn one_name_has_one_layout() {
    let definition = "struct Shared { uint a; uint b; };";
    let (one, same) = (sharing("one", definition), sharing("same", definition));
    let text = emit(&[one.clone(), same]).expect("equal layouts");
    assert_eq!(text.matches("pub struct Shared {").count(), 1);
    for other in
        ["struct Shared { uint a; float b; };", "struct Shared { uint b; uint a; };", "struct Shared { uint a; };"]
    {
        let message = emit(&[one.clone(), sharing("other", other)]).expect_err(other);
        assert_eq!(message, "struct Shared has one layout in one and another in other");
    }
    let message = emit(&[one.clone(), one]).expect_err("a file name used twice");
    assert!(message.contains("two kernels are named one"), "{message}");
}

#[test]
fn emitted_rust_asserts_layouts_and_states_accesses() {
    let text = format!(
        "{HEAD}struct Pair {{ uint first; vec3 type; }};\n\
         layout(constant_id = 0) const float LIMIT = 1.5;\n\
         layout(push_constant, scalar) uniform Params {{ uint count; }} params;\n\
         layout(set = 0, binding = 0, scalar) readonly buffer Source {{ Pair source[]; }};\n\
         layout(set = 0, binding = 1, scalar) writeonly buffer Target {{ uint move[]; }};\n\
         void main() {{ if (source[0].type.x < LIMIT) move[0] = params.count + source[1].first; }}"
    );
    let sources = Sources::new(&[("kernels/pair_pick.comp", &text)]);
    let emitted = emit(&[sources.reflect("kernels/pair_pick.comp").expect("a sound kernel")]).expect("Rust");
    for wanted in [
        "#[repr(C)]",
        "const _: () = assert!(std::mem::offset_of!(Pair, first) == 0);",
        "const _: () = assert!(std::mem::offset_of!(Pair, r#type) == 4);",
        "const _: () = assert!(size_of::<Pair>() == 16);",
        "const _: () = assert!(std::mem::offset_of!(PairPickParams, count) == 0);",
        "pub limit: f32,",
        "limit: f32::from_bits(1069547520),",
        "pub source: &'a crate::graph::Buf<Pair>,",
        "pub r#move: &'a mut crate::graph::Buf<u32>,",
        "crate::graph::Use::read(0, self.source),",
        "crate::graph::Use::write(1, self.r#move),",
        "pub const SOURCE: u32 = 0;",
        "local_size: [64, 1, 1],",
        "vec![(0, self.limit.to_bits())]",
    ] {
        assert!(emitted.contains(wanted), "{wanted} is missing in\n{emitted}");
    }
}

#[test]
fn group_counts_use_the_type_of_the_graph_and_are_checked_against_it() {
    let text = format!(
        "{HEAD}struct DispatchArgs {{ uint x; uint y; uint z; }};\n\
         layout(set = 0, binding = 0, scalar) writeonly buffer Args {{ DispatchArgs args[]; }};\n\
         void main() {{ args[0] = DispatchArgs(1u, 1u, 1u); }}"
    );
    let sources = Sources::new(&[("kernels/args.comp", &text)]);
    let emitted = emit(&[sources.reflect("kernels/args.comp").expect("a sound kernel")]).expect("Rust");
    assert!(!emitted.contains("pub struct DispatchArgs {"), "{emitted}");
    assert!(emitted.contains("&'a mut crate::graph::Buf<crate::graph::DispatchArgs>"), "{emitted}");
    assert!(emitted.contains("assert!(std::mem::offset_of!(crate::graph::DispatchArgs, z) == 8);"), "{emitted}");
}

const DRAW_HEAD: &str = "#version 460\n#extension GL_EXT_scalar_block_layout : require\n";

/// What comes of one graphics kernel in the file `name`.
fn drawing(name: &str, text: &str) -> Result<Kernel, String> {
    Sources::new(&[(name, &format!("{DRAW_HEAD}{text}"))]).reflect(name)
}

const TRIO: [(&str, &str); 3] = [
    (
        "spot.vert",
        "layout(push_constant, scalar) uniform Params { vec2 extent; } params;
         layout(set = 0, binding = 0, scalar) readonly buffer Spots { vec4 spots[]; };
         layout(location = 0) out vec2 place;
         layout(location = 1) flat out uint spot;
         void main() {
             place = spots[gl_InstanceIndex].xy / params.extent;
             spot = uint(gl_VertexIndex);
             gl_Position = vec4(place, 0.0, 1.0);
         }",
    ),
    (
        "spot.geom",
        "layout(points) in;
         layout(points, max_vertices = 1) out;
         layout(location = 0) in vec2 place[];
         layout(location = 1) flat in uint spot[];
         layout(location = 0) out vec2 around;
         void main() { around = place[0] + float(spot[0]); gl_Position = gl_in[0].gl_Position; EmitVertex(); }",
    ),
    (
        "spot.frag",
        "layout(constant_id = 20) const float SCALE = 1.5;
         layout(set = 0, binding = 4, scalar) readonly buffer Tints { float tints[]; };
         layout(location = 0) in vec2 around;
         layout(location = 0) out vec4 light;
         layout(location = 1) out vec4 weight;
         void main() { light = vec4(around, tints[0], SCALE); weight = gl_FragCoord; gl_FragDepth = around.x; }",
    ),
];

#[test]
fn stages_of_a_draw_are_reflected_without_what_passes_between_them() {
    let kernels: Vec<_> = TRIO.iter().map(|(name, text)| drawing(name, text).expect("a sound kernel")).collect();
    let facts = |k: &Kernel| {
        let bindings: Vec<u32> = k.bindings.iter().map(|b| b.index).collect();
        (k.name.clone(), k.stage, k.colours, bindings, k.params.is_some(), k.constants.len())
    };
    let wanted = [
        ("spot_vert".to_owned(), Stage::Vertex, 0, vec![0], true, 0),
        ("spot_geom".to_owned(), Stage::Geometry, 0, vec![], false, 0),
        ("spot_frag".to_owned(), Stage::Fragment, 2, vec![4], false, 1),
    ];
    assert_eq!(kernels.iter().map(facts).collect::<Vec<_>>(), wanted);
    let text = emit(&kernels).expect("Rust");
    for wanted in [
        "impl crate::graph::VertexShader for SpotVert {}",
        "impl crate::graph::GeometryShader for SpotGeom {}",
        "impl crate::graph::Shader for SpotFrag {",
        "stage: crate::graph::Stage::Fragment, colours: 2,",
        "pub spots: &'a crate::graph::Buf<[f32; 4]>,",
        "pub static ALL: &[&crate::graph::KernelInfo] = &[\n];",
        "pub static SHADERS: &[&crate::graph::ShaderInfo] = &[\n    \
         &SPOT_VERT_INFO,\n    &SPOT_GEOM_INFO,\n    &SPOT_FRAG_INFO,\n];",
    ] {
        assert!(text.contains(wanted), "{wanted} is missing in\n{text}");
    }
}

#[test]
fn draws_read_buffers_and_nothing_else() {
    let written = drawing(
        "it.frag",
        "layout(set = 0, binding = 0, scalar) buffer Counts { uint counts[]; };
         void main() { counts[0] = 1u; }",
    );
    assert!(written.expect_err("it writes a buffer").contains("counts: a draw writes no buffers"));
    let attribute = drawing("it.vert", "layout(location = 0) in vec4 place;\nvoid main() { gl_Position = place; }");
    assert!(attribute.expect_err("it has an attribute").contains("vertices have no attributes here"));
    let counts = drawing(
        "it.vert",
        "struct DrawArgs { uint vertices; uint instances; uint first_vertex; uint first_instance; };
         layout(set = 0, binding = 0, scalar) readonly buffer Args { DrawArgs args[]; };
         void main() { gl_Position = vec4(args[0].instances); }",
    );
    let text = emit(&[counts.expect("a sound kernel")]).expect("Rust");
    assert!(text.contains("crate::graph::Buf<crate::graph::DrawArgs>") && !text.contains("pub struct DrawArgs {"));
    assert!(text.contains("offset_of!(crate::graph::DrawArgs, first_instance) == 12"), "{text}");
}

/// The constants for the host of files with these texts.
fn host_constants(files: &[(&str, &str)]) -> Result<Vec<HostConstant>, String> {
    constants::read(Sources::new(files).0.path())
}

/// Value of the expression of a shared constant.
fn value_of(ty: &str, expression: &str) -> Result<Value, String> {
    let text = format!("const uint EIGHT = 8u;\nconst {ty} IT = {expression};\n");
    host_constants(&[("shared/a.glsl", &text)]).map(|found| found[1].value)
}

#[test]
fn constants_are_evaluated() {
    for (expression, value) in [
        ("0x80000000u", 1 << 31),
        ("1u << 24", 1 << 24),
        ("256u * EIGHT + 1u", 2049),
        ("(1u + 2u) * 3u - 4u / 2u", 7),
        ("~0u >> 4u & 0xffu | 0x100u", 0x1ff),
        ("EIGHT - 2u - 1u", 5),
    ] {
        assert_eq!(value_of("uint", expression), Ok(Value::Uint(value)), "{expression}");
    }
    assert_eq!(value_of("int", "-4 * (2 - 5)"), Ok(Value::Int(12)));
    // In single precision, as the device has it.
    assert_eq!(value_of("float", "1.0 / 256.0"), Ok(Value::Float(1.0 / 256.0)));
    assert_eq!(value_of("float", "0.1"), Ok(Value::Float(0.1)));
    assert_eq!(value_of("float", "-7.888609052210118e-31 * 2.0"), Ok(Value::Float(-(2f32.powi(-99)))));
}

#[test]
fn a_constant_that_cannot_be_evaluated_is_refused() {
    for (ty, expression, why) in [
        ("uint", "1", "is no uint"),
        ("float", "1u", "is no float"),
        ("uint", "1u + 1.0", "mixed types"),
        ("uint", "0u - 1u", "leaves their range"),
        ("uint", "1u << 32", "leaves their range"),
        ("uint", "3u << 31", "leaves their range"),
        ("uint", "1u / 0u", "leaves their range"),
        ("float", "1.0 / 0.0", "is no float"),
        ("uint", "OTHER + 1u", "`OTHER` is not a known constant"),
        ("uint", "(1u", "not closed"),
        ("uint", "1u 2u", "`2u` is not expected"),
        ("uint", "", "ends too early"),
        ("uint", "4294967296u", "is no number"),
        ("uint", "floatBitsToUint(1.0)", "not a known constant"),
        ("vec3", "1.0", "type vec3"),
        ("uint", "1u ? 2u", "`?` is not expected"),
    ] {
        let message = value_of(ty, expression).expect_err(expression);
        assert!(message.contains("shared/a.glsl:2") && message.contains(why), "{expression}: {message}");
    }
    for line in ["const uint LIST[2] = uint[](1u, 2u);", "const uint OPEN = 1u", "const uint A = 1u, B = 2u;"] {
        let message = host_constants(&[("shared/a.glsl", line)]).expect_err(line);
        assert!(message.contains("shared/a.glsl:1") && message.contains(line), "{message}");
    }
}

#[test]
fn the_host_gets_what_is_shared_or_marked() {
    let found = host_constants(&[
        ("lib/b.glsl", "// Own.\nconst float OWN = 2.0;\nconst uint MARKED = BASE * 2u; /// Twice the base.\n"),
        (
            "kernels/c.comp",
            "/// From the\n/// kernel.\nconst uint LAST = BASE;\nvoid main() {\n    const uint x = 1u;\n}\n",
        ),
        ("shared/a.glsl", "// Of all.\nconst uint BASE = 3u;\n\n// A group.\n\nconst uint BARE = 4u;\n"),
    ])
    .expect("sound constants");
    let facts: Vec<_> = found.iter().map(|c| (c.name.as_str(), c.doc.as_str(), c.file.as_str())).collect();
    let wanted = [
        ("BASE", "Of all.", "shared/a.glsl"),
        ("BARE", "", "shared/a.glsl"),
        ("LAST", "From the kernel.", "kernels/c.comp"),
        ("MARKED", "Twice the base.", "lib/b.glsl"),
    ];
    assert_eq!(facts, wanted);
    assert_eq!(found[3].value, Value::Uint(6));
    let text = constants::emit(&found);
    assert!(text.starts_with("/// Of all. From `glsl/shared/a.glsl`.\npub const BASE: u32 = 3;\n"), "{text}");
    // An array that nobody marked is no matter of the host, in its own file or another; two constants of one name are.
    assert_eq!(host_constants(&[("lib/a.glsl", "const uint LIST[1] = uint[](1u);\n")]), Ok(vec![]));
    let twice = [("shared/a.glsl", "const uint A = 1u;\n"), ("lib/a.glsl", "const uint A = 1u; /// Again.\n")];
    let message = host_constants(&twice).expect_err("one name twice");
    assert!(message.contains("shared/a.glsl") && message.contains("lib/a.glsl"), "{message}");
}

/// What a kernel reads of the scene comes as one set of buffers, and the scene's constants from one variant.
#[test]
fn kernels_of_a_scene_share_its_buffers() {
    let bindings = "struct Camera { uint width; };
        layout(set = 0, binding = 1, scalar) readonly buffer Texels { uint texels[]; };
        layout(set = 0, binding = 4, scalar) readonly buffer Areas { float areas[]; };
        layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
        layout(constant_id = 3) const bool GLASS = true;";
    let seen = "layout(constant_id = 20) const uint DEPTH = 5;
        layout(set = 0, binding = 16, scalar) writeonly buffer Out { uint results[]; };
        void main() { results[0] = camera[0].width + texels[0] + (GLASS ? DEPTH : 0u); }";
    let unseen = "layout(set = 0, binding = 16, scalar) writeonly buffer Out { float results[]; };
        void main() { results[0] = areas[0]; }";
    let alone = "layout(set = 0, binding = 1, scalar) buffer Own { uint own[]; };
        void main() { own[0] = 1u; }";
    let include = "#include \"lib/scene_bindings.glsl\"\n";
    let sources = Sources::new(&[
        ("lib/scene_bindings.glsl", bindings),
        ("kernels/seen.comp", &format!("{HEAD}{include}{seen}")),
        ("kernels/unseen.comp", &format!("{HEAD}{include}{unseen}")),
        ("kernels/alone.comp", &format!("{HEAD}{alone}")),
    ]);
    let kernels = ["seen", "unseen", "alone"].map(|name| sources.reflect(&format!("kernels/{name}.comp")).expect(name));
    let text = emit(&kernels).expect("kernels that agree");
    for part in [
        "pub texels: crate::graph::ReadBuf<u32>,\n    #[allow(missing_docs)]\n    \
         pub areas: crate::graph::ReadBuf<f32>,\n}",
        "pub struct View<'a> {\n    /// The scene.\n    pub scene: &'a SceneBuffers,\n    /// One entry.\n    \
         pub camera: &'a crate::graph::Buf<Camera>,\n}",
        "pub struct SeenBindings<'a> {\n    #[allow(missing_docs)]\n    pub view: View<'a>,\n    \
         #[allow(missing_docs)]\n    pub results:",
        "Use::read(1, &self.view.scene.texels),",
        "Use::read(11, self.view.camera),",
        "Use::write(16, self.results),",
        "glass: variant.glass,\n            ..Self::default()",
        "pub scene: &'a SceneBuffers,\n    #[allow(missing_docs)]\n    pub results: &'a mut crate::graph::Buf<f32>,",
        "Use::read(4, &self.scene.areas),",
        "pub own: &'a mut crate::graph::Buf<u32>,",
    ] {
        assert!(text.contains(part), "{part}\nis not in\n{text}");
    }
    assert!(!text.contains("depth: variant") && !text.contains("impl Unseen {"), "{text}");
    let writes = format!(
        "{HEAD}{include}layout(set = 0, binding = 2, scalar) buffer W {{ uint w[]; }};\nvoid main() {{ w[0] = 1u; }}"
    );
    let sources = Sources::new(&[("lib/scene_bindings.glsl", bindings), ("kernels/writes.comp", &writes)]);
    let message = emit(&[sources.reflect("kernels/writes.comp").expect("a kernel")]).expect_err("it writes the scene");
    assert!(message.contains("writes w, a buffer of the scene"), "{message}");
}
