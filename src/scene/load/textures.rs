//! Which image each texture shows. A texture whose image cannot be read is left out of its materials.

use super::document::Document;
use super::images::ImageSource;
use super::material::{self, UsedTexture};
use super::notes::Notes;
use super::part::Part;
use crate::scene::{Material, Scene, Texture};

/// Extensions that name another image for a texture, the first one wins; the texture's own is the fallback.
const OTHER_IMAGES: [&str; 2] = ["EXT_texture_webp", "KHR_texture_basisu"];

/// Adds textures, given by index in the file and role, and their images to a scene whose materials refer to that list.
pub(super) fn add(source: &ImageSource, used: &[UsedTexture], scene: &mut Scene, notes: &mut Notes) {
    let document = source.document;
    let chosen: Vec<Option<u32>> = used.iter().map(|(texture, _)| choose(source, *texture, notes)).collect();
    let wanted: Vec<_> = chosen.iter().zip(used).filter_map(|(image, (_, role))| Some(((*image)?, *role))).collect();
    let images = source.decode(&wanted, notes);
    let mut places: Vec<Option<u32>> = Vec::with_capacity(used.len());
    for ((texture, role), image) in used.iter().zip(chosen) {
        let slot = image.and_then(|image| images.slot(image, *role));
        let shown = slot.and_then(|slot| shown(document, *texture, slot, notes));
        if shown.is_none() {
            notes.fault(format!("texture {texture} has no image that can be read; it is ignored"));
        }
        places.push(shown.map(|shown| {
            scene.textures.push(shown);
            scene.textures.len() as u32 - 1
        }));
    }
    scene.images = images.images;
    scene.materials.iter_mut().for_each(|material| renumber(material, &places));
}

/// The first image of a texture that looks readable.
fn choose(source: &ImageSource, texture: u32, notes: &mut Notes) -> Option<u32> {
    let part = notes.or_fault(source.document.textures.part(texture as usize))?;
    let mut candidates = Vec::new();
    for name in OTHER_IMAGES {
        let extension = part.extension(name, notes);
        candidates.extend(extension.and_then(|extension| notes.or_fault(extension.index("source")).flatten()));
    }
    candidates.extend(notes.or_fault(part.index("source")).flatten());
    candidates.into_iter().find(|image| {
        let check = source.check(*image, notes);
        notes.or_fault(check).is_some()
    })
}

fn shown(document: &Document, texture: u32, image: u32, notes: &mut Notes) -> Option<Texture> {
    let part: Part = document.textures.part(texture as usize).ok()?;
    let (wrap, linear) = material::sampler(document, &part, notes);
    Some(Texture { image, wrap, linear })
}

/// Replaces references by those to the textures that are left.
fn renumber(material: &mut Material, places: &[Option<u32>]) {
    for slot in material.texture_slots() {
        *slot = slot.take().and_then(|reference| {
            let texture = places.get(reference.texture as usize).copied().flatten()?;
            Some(crate::scene::TextureRef { texture, ..reference })
        });
    }
}
