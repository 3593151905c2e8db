//! The lists of a glTF file. Their elements are looked at when something of the scene needs them, so what is unused
//! costs nothing, and what is broken takes nothing else along.

use std::path::PathBuf;

use super::buffers::{Buffers, Source};
use super::container::Container;
use super::json;
use super::notes::{Notes, Outcome, clip};
use super::part::{List, Part};
use super::resolve::Folder;
use super::{Limits, meshopt, variants};

/// Extensions that are read.
const SUPPORTED: [&str; 19] = [
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    // Only carries metadata: nothing to read.
    "KHR_xmp_json_ld",
];

/// A parsed file.
pub(super) struct Document<'a> {
    /// Index of the scene that is shown by default.
    pub scene: Option<u32>,
    pub scenes: List<'a>,
    pub nodes: List<'a>,
    pub meshes: List<'a>,
    pub skins: List<'a>,
    pub cameras: List<'a>,
    pub lights: List<'a>,
    pub accessors: List<'a>,
    pub materials: List<'a>,
    pub textures: List<'a>,
    pub samplers: List<'a>,
    pub images: List<'a>,
    pub animations: List<'a>,
    pub buffers: Buffers<'a>,
    /// KHR_mesh_quantization is in use.
    pub quantized: bool,
    /// KHR_draco_mesh_compression is required: there is nothing else to read.
    pub needs_draco: bool,
    /// Names of the variants of materials.
    pub variants: Vec<String>,
}

impl<'a> Document<'a> {
    /// The lists of the file in `container`.
    pub fn parse(
        container: &'a Container<'a>,
        source: Source<'a>,
        limits: &Limits,
        notes: &mut Notes,
    ) -> Outcome<Self> {
        let json = container.json.as_ref();
        if json.len() as u64 > limits.json_bytes {
            return Err(format!("{} bytes of JSON, more than the limit of {}", json.len(), limits.json_bytes));
        }
        let root = json::document(json).map_err(|e| format!("not JSON of glTF: {}", clip(&e.to_string())))?;
        let root = Part::new("the file".into(), root);
        check_version(&root, notes)?;
        let declared = check_extensions(&root, notes)?;
        let document = Self::lists(&root, source, declared, notes);
        if document.nodes.len() as u64 > limits.nodes {
            return Err(format!("{} nodes, more than the limit of {}", document.nodes.len(), limits.nodes));
        }
        Ok(document)
    }

    fn lists(root: &Part<'a>, source: Source<'a>, declared: Declared, notes: &mut Notes) -> Self {
        let lights = root.extension("KHR_lights_punctual", notes);
        let none = Part::new(String::new(), json::Object::default());
        let mut list = |name, what| List::of(root, name, what, notes);
        Self {
            scenes: list("scenes", "scene"),
            nodes: list("nodes", "node"),
            meshes: list("meshes", "mesh"),
            skins: list("skins", "skin"),
            cameras: list("cameras", "camera"),
            accessors: list("accessors", "accessor"),
            materials: list("materials", "material"),
            textures: list("textures", "texture"),
            samplers: list("samplers", "sampler"),
            images: list("images", "image"),
            animations: list("animations", "animation"),
            lights: List::of(lights.as_ref().unwrap_or(&none), "lights", "light", notes),
            scene: notes.or_fault(root.index("scene")).flatten(),
            buffers: Buffers::new(root, source, notes),
            variants: variants::names(root, notes),
            quantized: declared.quantized,
            needs_draco: declared.needs_draco,
        }
    }

    /// The files of buffers and images, also of those that no part of the scene uses.
    pub fn named_files(&self, folder: &Folder) -> Vec<PathBuf> {
        let quiet = &mut Notes::default();
        let images: Vec<_> =
            (0..self.images.len()).filter_map(|i| self.images.part(i).ok()?.text("uri", quiet)).collect();
        let uris = self.buffers.uris().chain(images.iter().map(AsRef::as_ref));
        let mut files: Vec<PathBuf> = uris.filter_map(|uri| folder.file_of(uri)).collect();
        files.sort_unstable();
        files.dedup();
        files
    }
}

fn check_version(root: &Part, notes: &mut Notes) -> Outcome<()> {
    let asset = root.part("asset", notes).ok_or("it has no asset and is not glTF 2.0")?;
    // Some exporters write a number.
    let text = |name| asset.get(name).map(|json| json::text(json).unwrap_or_else(|| json.get().into()));
    let version = text("version").ok_or("its asset has no version, so it is not glTF 2.0")?;
    if version.split('.').next() != Some("2") {
        return Err(format!("glTF version {} is not supported, only 2.x", clip(&version)));
    }
    match text("minVersion").filter(|version| !matches!(version.as_ref(), "2.0" | "2")) {
        Some(least) => Err(format!("it needs a reader of glTF {}, this one reads 2.0", clip(&least))),
        None => Ok(()),
    }
}

/// What the lists of extensions say about meshes.
struct Declared {
    quantized: bool,
    needs_draco: bool,
}

/// Refuses what cannot be shown without an extension that is not supported.
fn check_extensions(root: &Part, notes: &mut Notes) -> Outcome<Declared> {
    let [required, used] = ["extensionsRequired", "extensionsUsed"].map(|name| {
        let names = root.list(name, notes);
        names.into_iter().filter_map(json::text).collect::<Vec<_>>()
    });
    let lacks = |name: &&std::borrow::Cow<str>| !SUPPORTED.contains(&name.as_ref());
    if let Some(name) = required.iter().find(lacks) {
        return Err(format!("it requires the extension {}, which is not supported", clip(name)));
    }
    for name in used.iter().filter(lacks) {
        notes.note(format!("extension {} is ignored", clip(name)));
    }
    let is_used = |name: &str| required.iter().chain(&used).any(|known| known == name);
    Ok(Declared {
        // What is packed is filtered, which takes other types of components.
        quantized: is_used("KHR_mesh_quantization") || meshopt::EXTENSIONS.into_iter().any(is_used),
        needs_draco: required.iter().any(|name| name == "KHR_draco_mesh_compression"),
    })
}

/// Reads the document `text` and does something with it.
#[cfg(test)]
pub(super) fn test_document<T>(text: &str, with: impl FnOnce(&Document) -> T) -> T {
    let (notes, limits) = (&mut Notes::default(), Limits::default());
    let folder = Folder::of("x.gltf".as_ref(), 0).unwrap();
    let container = Container::split(text.as_bytes(), notes).unwrap();
    let source = Source { folder: &folder, blob: None, length: text.len() as u64, most_bytes: 0 };
    with(&Document::parse(&container, source, &limits, notes).unwrap())
}
