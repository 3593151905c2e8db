//! Loading glTF 2.0 scenes (.gltf and .glb) into a [`Scene`].
//!
//! A scene file is untrusted: every index, size and number is checked before use, only files inside the scene's
//! folder are read, and what would cost more than [`Limits`] allow is refused. Damage that cannot be read around is
//! an error; values out of range are clamped, and unusable parts skipped, with a warning each.
//!
//! Normals where a file has none are flat, as the standard asks. Tangents where a file has none are the area-weighted
//! derivatives of the texture coordinates rather than MikkTSpace: equal on smooth unmirrored charts, different where
//! charts of opposite handedness share vertices.

mod accessor;
mod deform;
mod document;
mod images;
mod lights;
mod material;
mod mesh;
mod nodes;
mod resolve;
mod unit;

use std::path::{Path, PathBuf};

use glam::DMat4;

use self::document::Document;
use self::images::{Images, Role};
use self::material::Converter;
use self::resolve::{Folder, read_limited};
use self::unit::Unit;
use crate::error::{Error, Result};

use crate::scene::{EnvironmentFile, Material, Scene, World};

/// Upper bounds on what a scene may cost, so that a small file cannot ask for the whole machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of any one file.
    pub file_bytes: u64,
    /// Bytes of JSON, embedded data URIs included: parsed JSON takes many times its bytes.
    pub json_bytes: u64,
    /// Bytes of all buffers together.
    pub buffer_bytes: u64,
    /// Accessor elements read in all.
    pub elements: u64,
    /// Triangles after instancing.
    pub triangles: u64,
    /// Nodes in the file, and instances of meshes; each primitive of a mesh counts as one.
    pub nodes: u64,
    /// Levels of the node hierarchy.
    pub depth: u32,
    /// Texels along one side of an image.
    pub image_side: u32,
    /// Bytes of one decoded image.
    pub image_decode_bytes: u64,
    /// Bytes of all textures together (RGBA8); images are halved to fit.
    pub image_bytes: u64,
    /// Damage that would be clamped or skipped with a warning is an error instead.
    pub strict: bool,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            file_bytes: 2 << 30,
            json_bytes: 128 << 20,
            buffer_bytes: 2 << 30,
            elements: 1 << 28,
            triangles: 1 << 25,
            nodes: 1 << 20,
            depth: 1024,
            image_side: 16384,
            image_decode_bytes: 512 << 20,
            image_bytes: 128 << 20,
            strict: false,
        }
    }
}

/// Why something could not be read; the file is added by [`load`].
type Outcome<T> = std::result::Result<T, String>;

/// Warnings collected while loading.
#[derive(Debug, Clone, Default)]
pub(super) struct Notes {
    /// What the user should know; no sentence twice.
    list: Vec<String>,
    /// Sentences beyond the first few.
    more: u64,
    first_fault: Option<String>,
    faults: u64,
}

impl Notes {
    /// Warnings kept; a damaged file could cause millions.
    const MOST: usize = 100;

    /// Something ignored or chosen: worth knowing, not wrong.
    fn note(&mut self, text: String) {
        if self.list.len() >= Self::MOST {
            self.more += 1;
        } else if !self.list.contains(&text) {
            self.list.push(text);
        }
    }

    /// Something wrong in the file that was clamped or skipped.
    fn fault(&mut self, text: String) {
        self.faults += 1;
        self.first_fault.get_or_insert_with(|| text.clone());
        self.note(text);
    }

    /// Tells of normals that had no direction, if there were any.
    fn replaced_normals(&mut self, any: bool) {
        if any {
            self.fault("normals without a direction were replaced by those of the triangles".into());
        }
    }

    #[cfg(test)]
    fn faults(&self) -> u64 {
        self.faults
    }

    fn finish(mut self, limits: &Limits) -> Outcome<Vec<String>> {
        if let Some(fault) = self.first_fault.filter(|_| limits.strict) {
            return Err(fault);
        }
        if self.more > 0 {
            self.list.push(format!("{} more warnings of this kind", self.more));
        }
        Ok(self.list)
    }
}

impl Scene {
    /// [`load`] with the default [`Limits`].
    ///
    /// # Errors
    /// Those of [`load`].
    pub fn load(path: &Path) -> Result<Self> {
        load(path, &Limits::default())
    }
}

/// Loads a scene. One without light gets the default sky, one without a camera a camera that frames it, both with a
/// warning.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, [`Error::Scene`] if it is damaged, beyond `limits`, or requires an
/// extension that is not supported.
pub fn load(path: &Path, limits: &Limits) -> Result<Scene> {
    load_with_environment(path, None, limits)
}

/// Like [`load`], lit by the environment map `environment` if there is one.
///
/// # Errors
/// As [`load`], for either file.
pub fn load_with_environment(path: &Path, environment: Option<&EnvironmentFile>, limits: &Limits) -> Result<Scene> {
    let (mut scene, dim) = read(path, limits)?;
    if let Some(file) = environment {
        let (map, warnings) = file.load(limits)?;
        scene.files.push(file.path.clone());
        scene.environment = Some(map);
        scene.warnings.extend(warnings);
    } else {
        scene.warnings.extend(dim);
    }
    scene.ensure_light();
    scene.ensure_camera();
    Ok(scene)
}

/// A scene that may lack light and camera, and what to tell of its light if there is no other.
fn read(path: &Path, limits: &Limits) -> Result<(Scene, Option<String>)> {
    let metadata = std::fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
    if !metadata.is_file() {
        return Err(Error::scene(path, "is not a regular file"));
    }
    let bytes = read_limited(path, limits.file_bytes).map_err(|cause| Error::scene(path, cause))?;
    let scene = Folder::of(path, limits.file_bytes).and_then(|folder| assemble(&bytes, &folder, limits));
    scene.map(|(scene, dim)| (Scene { path: path.to_owned(), ..scene }, dim)).map_err(|cause| Error::scene(path, cause))
}

/// The same from the bytes of the file.
fn assemble(bytes: &[u8], folder: &Folder, limits: &Limits) -> Outcome<(Scene, Option<String>)> {
    let mut notes = Notes::default();
    let document = Document::parse(bytes, folder, limits, &mut notes)?;
    let root = &document.root;
    let mut first = notes.clone();
    let (mut scene, mut textures) = placed(&document, DMat4::IDENTITY, limits, &mut first)?;
    if let Some(unit) = Unit::needed(&scene) {
        (scene, textures) = placed(&document, unit.root(), limits, &mut notes)?;
        unit.apply(&mut scene)?;
        notes.note(unit.note());
    } else {
        notes = first;
    }
    scene.files = named_files(root, folder);
    let world = World::of(&scene);
    scene.skipped.add(world.skipped);
    notes.replaced_normals(world.replaced_normals);
    let wanted = wanted_images(&document, &textures);
    let Images { images, places } = images::images(&document, folder, &wanted, limits, &mut notes)?;
    scene.images = images;
    let image = |texture| wanted.binary_search(&image_of(&document, texture)).map_or(0, |at| places[at]);
    scene.textures = textures.iter().map(|&t| material::sampler(root, t.0, image(t))).collect();
    count_skipped(&scene, &mut notes);
    scene.warnings = notes.finish(limits)?;
    let dim = scene.dim_light(&world);
    Ok((scene, dim))
}

/// The files of buffers and images, also of those that no part of the scene uses.
fn named_files(root: &gltf::json::Root, folder: &Folder) -> Vec<PathBuf> {
    let buffers = root.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    let images = root.images.iter().filter_map(|image| image.uri.as_deref());
    let mut files: Vec<PathBuf> = buffers.chain(images).filter_map(|uri| folder.file_of(uri)).collect();
    files.sort_unstable();
    files.dedup();
    files
}

/// What the document places in the world, with `start` before all of it, and the textures in use.
fn placed(document: &Document, start: DMat4, limits: &Limits, notes: &mut Notes) -> Outcome<(Scene, Vec<UsedTexture>)> {
    let root = &document.root;
    let hierarchy = nodes::walk(root, start, limits, notes)?;
    let used = mesh::used_materials(root, &hierarchy);
    let (materials, textures) = materials(document, &used, notes);
    let mut scene = Scene {
        lights: lights::lights(root, &hierarchy.placed, notes)?,
        cameras: lights::cameras(root, &hierarchy.placed, notes)?,
        materials,
        ..Scene::default()
    };
    mesh::MeshReader::new(document, limits, &used).add_all(&hierarchy, &mut scene, notes)?;
    Ok((scene, textures))
}

/// A texture of the file, and what it is to materials.
type UsedTexture = (usize, Role);

/// The materials in use, never none, and the textures they use.
fn materials(document: &Document, used: &[Option<usize>], notes: &mut Notes) -> (Vec<Material>, Vec<UsedTexture>) {
    let mut converter = Converter::new(&document.root);
    let mut materials: Vec<Material> = used
        .iter()
        .map(|index| match index.and_then(|i| Some((i, document.root.materials.get(i)?))) {
            Some((i, json)) => converter.material(i, json, notes),
            None => Material::default(),
        })
        .collect();
    if materials.is_empty() {
        materials.push(Material::default());
    }
    (materials, converter.used)
}

/// The images of the textures in use and what they are, each once, in ascending order.
fn wanted_images(document: &Document, textures: &[UsedTexture]) -> Vec<(usize, Role)> {
    let mut wanted: Vec<_> = textures.iter().map(|&texture| image_of(document, texture)).collect();
    wanted.sort_unstable();
    wanted.dedup();
    wanted
}

fn image_of(document: &Document, (texture, role): UsedTexture) -> (usize, Role) {
    (document.root.textures[texture].source.value(), role)
}

fn count_skipped(scene: &Scene, notes: &mut Notes) {
    let skipped = scene.skipped;
    if skipped.degenerate_triangles > 0 {
        notes.fault(format!("{} triangle(s) without area were skipped", skipped.degenerate_triangles));
    }
    if skipped.non_finite_triangles > 0 {
        notes.fault(format!(
            "{} triangle(s) with coordinates that are not finite were skipped",
            skipped.non_finite_triangles
        ));
    }
    if skipped.non_triangle_primitives > 0 {
        notes.note(format!("{} primitive(s) of points or lines were skipped", skipped.non_triangle_primitives));
    }
}
