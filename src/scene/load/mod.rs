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
mod animation;
mod buffers;
mod container;
mod deform;
mod document;
#[cfg(feature = "draco")]
mod draco;
#[cfg(not(feature = "draco"))]
#[path = "draco_absent.rs"]
mod draco;
mod images;
mod instancing;
mod json;
mod ktx;
mod lights;
mod material;
mod mesh;
mod meshopt;
mod moving;
mod nodes;
mod notes;
mod part;
mod pointer;
mod primitive;
mod resolve;
mod textures;
mod unit;
mod variants;

use std::path::Path;
use std::sync::Arc;

use glam::DMat4;

use self::animation::{Animations, Owner};
use self::buffers::Source;
use self::container::Container;
use self::document::Document;
use self::images::ImageSource;
use self::material::{Converter, UsedTexture, UvSets};
use self::notes::{Notes, Outcome};
use self::resolve::{Folder, read_limited};
use self::unit::Unit;
use self::variants::Chosen;
use super::world;
use crate::error::{Error, Result};
use crate::scene::motion::{Moving, MovingSurface};
use crate::scene::{EnvironmentFile, Material, MaterialId, Scene};

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

/// What is chosen when a scene is loaded.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Choices {
    /// The map that lights the scene instead of its sky.
    pub environment: Option<EnvironmentFile>,
    /// The variant of the materials by name, otherwise by index from 0; none is the materials as they are.
    pub variant: Option<String>,
    /// The animation by name, otherwise by index from 0; none is every animation that moves nothing which an earlier
    /// one of the file moves.
    pub animation: Option<String>,
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
    load_with(path, &Choices { environment: environment.cloned(), ..Choices::default() }, limits)
}

/// Like [`load`], with choices.
///
/// # Errors
/// As [`load`], for either file; [`Error::Scene`] if there is no such variant or animation.
pub fn load_with(path: &Path, choices: &Choices, limits: &Limits) -> Result<Scene> {
    let (mut scene, dim) = read(path, choices, limits)?;
    if let Some(file) = &choices.environment {
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
fn read(path: &Path, choices: &Choices, limits: &Limits) -> Result<(Scene, Option<String>)> {
    let metadata = std::fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
    if !metadata.is_file() {
        return Err(Error::scene(path, "is not a regular file"));
    }
    let bytes = read_limited(path, limits.file_bytes).map_err(|cause| Error::scene(path, cause))?;
    let folder = Folder::of(path, limits.file_bytes);
    let scene = folder.and_then(|folder| assemble(&bytes, &folder, choices, limits));
    scene.map(|(scene, dim)| (Scene { path: path.to_owned(), ..scene }, dim)).map_err(|cause| Error::scene(path, cause))
}

/// The same from the bytes of the file.
fn assemble(bytes: &[u8], folder: &Folder, choices: &Choices, limits: &Limits) -> Outcome<(Scene, Option<String>)> {
    let mut notes = Notes::default();
    let container = Container::split(bytes, &mut notes)?;
    let source = Source { folder, blob: container.blob, length: bytes.len() as u64, most_bytes: limits.buffer_bytes };
    let document = Document::parse(&container, source, limits, &mut notes)?;
    let chosen = Choice { variant: Chosen::of(choices.variant.as_deref(), &document.variants)?, choices };
    let source = ImageSource { document: &document, folder, limits };
    let mut first = notes.clone();
    let mut scene = placed(&source, DMat4::IDENTITY, &chosen, &mut first)?;
    if let Some(unit) = Unit::needed(&scene) {
        drop(scene);
        document.buffers.start_again();
        scene = placed(&source, unit.root(), &chosen, &mut notes)?;
        unit.apply(&mut scene)?;
        if let Some(motion) = &mut scene.motion {
            Arc::make_mut(motion).set_unit(unit.scale());
        }
        notes.note(unit.note());
    } else {
        notes = first;
    }
    scene.variants.clone_from(&document.variants);
    scene.files = document.named_files(folder);
    let survey = world::survey(&scene);
    scene.skipped.add(survey.skipped);
    notes.replaced_normals(survey.replaced_normals);
    count_skipped(&scene, &mut notes);
    scene.warnings = notes.finish(limits)?;
    let dim = scene.dim_light(&survey);
    Ok((scene, dim))
}

/// What is shown of a file that has several of it.
struct Choice<'a> {
    variant: Chosen,
    choices: &'a Choices,
}

/// What the document places in the world, with `start` before all of it. Fails if all of it is lost.
fn placed(source: &ImageSource, start: DMat4, chosen: &Choice, notes: &mut Notes) -> Outcome<Scene> {
    let ImageSource { document, limits, .. } = *source;
    let animations = Animations::read(document, chosen.choices.animation.as_deref(), limits, notes)?;
    let moved = (document, &animations);
    let hierarchy = nodes::walk(moved, start, limits, notes)?;
    let used = mesh::used_materials(document, &hierarchy, &chosen.variant);
    let Materials { materials, uv_sets, textures, moving } = materials(moved, &used, notes);
    let mut moving = Moving { surfaces: moving, ..Moving::default() };
    let mut scene = Scene {
        lights: lights::lights(moved, &hierarchy.placed, &mut moving, notes),
        cameras: lights::cameras(moved, &hierarchy.placed, &mut moving, notes),
        materials,
        ..Scene::default()
    };
    textures::add(source, &textures, &mut scene, notes);
    let mut meshes = mesh::MeshReader::new(moved, limits, (&used, &uv_sets), &chosen.variant);
    meshes.add_all(&hierarchy, &mut scene, notes)?;
    (moving.instances, moving.shapes) = (meshes.moving.instances, meshes.moving.shapes);
    scene.motion = animations.motion(start, hierarchy, moving);
    match notes.first_loss().filter(|_| scene.instances.is_empty()) {
        Some(loss) => Err(loss.to_owned()),
        None => Ok(scene),
    }
}

/// The materials in use, never none, with the sets of texture coordinates and the textures that they use.
struct Materials {
    materials: Vec<Material>,
    uv_sets: Vec<UvSets>,
    textures: Vec<UsedTexture>,
    moving: Vec<MovingSurface>,
}

fn materials((document, animations): (&Document, &Animations), used: &[Option<u32>], notes: &mut Notes) -> Materials {
    let mut converter = Converter::new(document);
    let mut materials = Vec::with_capacity(used.len().max(1));
    let mut uv_sets = Vec::with_capacity(used.len());
    let mut moving = Vec::new();
    for index in used {
        let part = index.and_then(|index| notes.or_fault(document.materials.part(index as usize)));
        let (material, sets) = part.as_ref().map_or_else(Default::default, |part| converter.material(part, notes));
        if let (Some(of), Some(part)) = (*index, &part)
            && animations.change(Owner::Material(of))
        {
            let (id, rest, sources) = (MaterialId::at(materials.len()), material.clone(), material::sources(part));
            moving.push(MovingSurface { material: id, of, rest, sources });
        }
        materials.push(material);
        uv_sets.push(sets);
    }
    if materials.is_empty() {
        materials.push(Material::default());
    }
    Materials { materials, uv_sets, textures: converter.used, moving }
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
