//! KHR_materials_variants: which material a primitive has under the chosen variant.

use super::document::Document;
use super::json;
use super::notes::{Notes, Outcome, clip};
use super::part::Part;

const EXTENSION: &str = "KHR_materials_variants";

/// The variant that is shown; none is the materials that primitives name themselves.
#[derive(Default)]
pub(super) struct Chosen(Option<u64>);

/// The names of the variants in the file.
pub(super) fn names(root: &Part, notes: &mut Notes) -> Vec<String> {
    let Some(extension) = root.extension(EXTENSION, notes) else { return Vec::new() };
    let mut names = Vec::new();
    for (i, json) in extension.list("variants", notes).into_iter().enumerate() {
        let part = notes.or_fault(Part::of(format!("variant {i}"), json));
        names.push(part.and_then(|part| part.text("name", notes)).unwrap_or_default().into_owned());
    }
    names
}

impl Chosen {
    /// The variant with this name, otherwise with this number from 0.
    pub fn of(wanted: Option<&str>, names: &[String]) -> Outcome<Self> {
        Ok(Self(choose("variant", wanted, names)?.map(|index| index as u64)))
    }

    /// The material of a primitive, if it names one that exists.
    pub fn material(&self, document: &Document, part: &Part, notes: &mut Notes) -> Option<u32> {
        let own = part.index("material").map(|own| self.mapped(part, notes).or(own));
        let material = notes.or_fault(own).flatten()?;
        if material as usize >= document.materials.len() {
            notes.fault(format!("{}: material {material} does not exist", part.place));
            return None;
        }
        Some(material)
    }

    /// What the extension maps the variant to.
    fn mapped(&self, part: &Part, notes: &mut Notes) -> Option<u32> {
        let variant = self.0?;
        let extension = part.extension(EXTENSION, notes)?;
        for json in extension.list("mappings", notes) {
            let mapping = notes.or_fault(Part::of(format!("{}: mapping", extension.place), json));
            let Some(mapping) = mapping else { continue };
            if mapping.list("variants", notes).into_iter().any(|json| json::whole(json) == Some(variant)) {
                return notes.or_fault(mapping.index("material")).flatten();
            }
        }
        None
    }
}

/// Which of the names is wanted, otherwise which number from 0; fails if there is neither.
pub(super) fn choose(what: &str, wanted: Option<&str>, names: &[String]) -> Outcome<Option<usize>> {
    let Some(wanted) = wanted else { return Ok(None) };
    let number = || wanted.parse::<usize>().ok().filter(|number| *number < names.len());
    match names.iter().position(|name| name == wanted).or_else(number) {
        Some(index) => Ok(Some(index)),
        None if names.is_empty() => Err(format!("no {what} '{}': the scene has none", clip(wanted))),
        None => {
            let list: Vec<String> = names.iter().take(MOST_NAMES).map(|name| format!("'{}'", clip(name))).collect();
            Err(format!("no {what} '{}'; the scene has {}", clip(wanted), list.join(", ")))
        }
    }
}

/// Names that an error lists.
const MOST_NAMES: usize = 20;
