//! Materials and textures, with every number brought into its valid range.

use std::collections::HashMap;

use super::document::Document;
use super::images::Role;
use super::json::Object;
use super::notes::{Notes, Outcome, clip};
use super::part::Part;
use super::pointer::TEXTURES;
use crate::scene::motion::{
    ABSORPTION, MAX_IOR, MIRROR_IOR, RADIANCE, Sources, UNIT, UvTransform, absorption, clamped,
};
use crate::scene::{Alpha, Material, TextureRef, Wrap};

/// Index of refraction of materials that do not say.
const DEFAULT_IOR: f32 = 1.5;
/// Alpha cut-off of masks that give none.
const DEFAULT_CUTOFF: f32 = 0.5;

/// Converts the materials in file order. Textures that are used are listed in `used`; the references index that list.
pub(super) struct Converter<'a> {
    document: &'a Document<'a>,
    /// Textures of the file and what they are, in the order of [`TextureRef::texture`].
    pub used: Vec<UsedTexture>,
    /// Where in `used` a texture is.
    slots: HashMap<UsedTexture, u32>,
    /// The coordinate sets of the file that the material at hand uses.
    sets: UvSets,
}

/// The two sets of texture coordinates that a material may use: which set of the file each is, `None` if it uses none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct UvSets([Option<u64>; 2]);

impl UvSets {
    /// Which of the two a set of the file is, if there is room: sets 0 and 1 in their places, if they can be.
    fn place(&mut self, set: u64) -> Option<u32> {
        let known = self.0.iter().position(|known| *known == Some(set));
        let own = (set < 2).then_some(set as usize).filter(|&own| self.0[own].is_none());
        let place = known.or(own).or_else(|| self.0.iter().position(Option::is_none))?;
        self.0[place] = Some(set);
        Some(place as u32)
    }

    /// The sets of the file, those that nothing uses as they are.
    pub fn of_file(self) -> [u64; 2] {
        [self.0[0].unwrap_or(0), self.0[1].unwrap_or(1)]
    }
}

/// A texture of the file, and what it is to materials.
pub(super) type UsedTexture = (u32, Role);

/// Brings values of one material into range and remembers whether it had to.
struct Range<'a> {
    place: &'a str,
    notes: &'a mut Notes,
}

impl Range<'_> {
    fn clamp(&mut self, what: &str, value: f32, range: [f32; 2]) -> f32 {
        let clamped = clamped(value, range);
        if clamped != value {
            self.notes.fault(format!("{}: {what} {value} was clamped to {clamped}", self.place));
        }
        clamped
    }

    fn clamp_all<const N: usize>(&mut self, what: &str, values: [f32; N], range: [f32; 2]) -> [f32; N] {
        values.map(|value| self.clamp(what, value, range))
    }
}

impl<'a> Converter<'a> {
    pub fn new(document: &'a Document<'a>) -> Self {
        Self { document, used: Vec::new(), slots: HashMap::new(), sets: UvSets::default() }
    }

    /// A material of the file, and the sets of texture coordinates that it uses.
    pub fn material(&mut self, part: &Part, notes: &mut Notes) -> (Material, UvSets) {
        self.sets = UvSets::default();
        let mut material = self.core(part, notes);
        self.extensions(&mut material, part, notes);
        material.alpha = alpha(part, notes);
        (material, self.sets)
    }

    fn core(&mut self, part: &Part, notes: &mut Notes) -> Material {
        let none = Part::new(String::new(), Object::default());
        let pbr = part.part("pbrMetallicRoughness", notes).unwrap_or(none);
        let strength = part.extension("KHR_materials_emissive_strength", notes);
        let strength = strength.and_then(|part| part.number("emissiveStrength", notes)).unwrap_or(1.0);
        let emission = part.numbers("emissiveFactor", notes).unwrap_or([0.0; 3]);
        let base_color = pbr.numbers("baseColorFactor", notes).unwrap_or([1.0; 4]);
        let mut factor = |name| pbr.number(name, notes).unwrap_or(1.0);
        let (metallic, roughness) = (factor("metallicFactor"), factor("roughnessFactor"));
        let normal = part.part("normalTexture", notes);
        let scale = normal.as_ref().and_then(|part| part.number("scale", notes)).filter(|scale| scale.is_finite());
        let mut range = Range { place: &part.place, notes };
        let strength = range.clamp("emissive strength", strength, RADIANCE);
        let emissive = range.clamp_all("emission", emission, RADIANCE);
        Material {
            base_color: range.clamp_all("base colour", base_color, UNIT),
            metallic: range.clamp("metallic factor", metallic, UNIT),
            roughness: range.clamp("roughness", roughness, UNIT),
            emissive: range.clamp_all("emission", emissive.map(|e| e * strength), RADIANCE),
            name: part.text("name", notes).unwrap_or_default().into_owned(),
            double_sided: part.flag("doubleSided", notes).unwrap_or(false),
            base_color_texture: self.texture(&pbr, ("baseColorTexture", Role::Color), notes),
            metallic_roughness_texture: self.texture(&pbr, ("metallicRoughnessTexture", Role::Data), notes),
            normal_texture: self.texture(part, ("normalTexture", Role::Normal), notes),
            normal_scale: scale.unwrap_or(1.0),
            emissive_texture: self.texture(part, ("emissiveTexture", Role::Color), notes),
            ..Material::default()
        }
    }

    fn extensions(&mut self, material: &mut Material, part: &Part, notes: &mut Notes) {
        material.unlit = part.extension("KHR_materials_unlit", notes).is_some();
        if let Some(ior) = part.extension("KHR_materials_ior", notes) {
            let ior = ior.number("ior", notes).unwrap_or(DEFAULT_IOR);
            let mut range = Range { place: &part.place, notes };
            let mut in_range = || range.clamp("index of refraction", ior, [1.0, MAX_IOR]);
            material.ior = if ior == 0.0 { MIRROR_IOR } else { in_range() };
        }
        if let Some(specular) = part.extension("KHR_materials_specular", notes) {
            let factor = specular.number("specularFactor", notes).unwrap_or(1.0);
            let color = specular.numbers("specularColorFactor", notes).unwrap_or([1.0; 3]);
            let mut range = Range { place: &part.place, notes };
            material.specular = range.clamp("specular factor", factor, UNIT);
            material.specular_color = range.clamp_all("specular colour", color, [0.0, f32::MAX]);
            material.specular_texture = self.texture(&specular, ("specularTexture", Role::Data), notes);
            if specular.has("specularColorTexture") {
                notes.note(format!("{}: the specular colour texture is ignored", part.place));
            }
        }
        if let Some(transmission) = part.extension("KHR_materials_transmission", notes) {
            let factor = transmission.number("transmissionFactor", notes).unwrap_or(0.0);
            material.transmission = Range { place: &part.place, notes }.clamp("transmission", factor, UNIT);
            material.transmission_texture = self.texture(&transmission, ("transmissionTexture", Role::Data), notes);
        }
        if let Some(volume) = part.extension("KHR_materials_volume", notes) {
            add_volume(material, (part, &volume), notes);
        }
    }

    /// The texture that member `name` uses, if there is one that can be read.
    fn texture(&mut self, part: &Part, (name, role): (&str, Role), notes: &mut Notes) -> Option<TextureRef> {
        let info = part.part(name, notes)?;
        let reference = self.reference(&info, role, notes);
        notes.or_fault(reference.map_err(|cause| format!("{}: {cause}; the texture is ignored", info.place)))
    }

    fn reference(&mut self, info: &Part, role: Role, notes: &mut Notes) -> Outcome<TextureRef> {
        let index = info.index("index")?.ok_or("it names no texture")?;
        let transform = info.extension("KHR_texture_transform", notes);
        let own_set = info.count("texCoord")?;
        let set =
            transform.as_ref().map_or(Ok(None), |transform| transform.count("texCoord"))?.or(own_set).unwrap_or(0);
        if index as usize >= self.document.textures.len() {
            return Err(format!("texture {index} does not exist"));
        }
        let matrix = transform.map_or(UvTransform::default(), |part| uv_transform(&part, notes)).matrix();
        if !matrix.iter().flatten().all(|x| x.is_finite()) {
            return Err("its transform is not finite".into());
        }
        let uv_set = self.sets.place(set).ok_or_else(|| format!("coordinate set {set} is the third of a material"))?;
        let texture = *self.slots.entry((index, role)).or_insert_with(|| {
            self.used.push((index, role));
            self.used.len() as u32 - 1
        });
        Ok(TextureRef { texture, uv_set, transform: matrix })
    }
}

/// What alpha means.
fn alpha(part: &Part, notes: &mut Notes) -> Alpha {
    match part.text("alphaMode", notes).as_deref() {
        Some("MASK") => {
            let cutoff = part.number("alphaCutoff", notes).unwrap_or(DEFAULT_CUTOFF);
            if cutoff.is_finite() {
                return Alpha::Mask(cutoff);
            }
            let place = &part.place;
            notes.fault(format!("{place}: the alpha cut-off is not finite and was set to {DEFAULT_CUTOFF}"));
            Alpha::Mask(DEFAULT_CUTOFF)
        }
        Some("BLEND") => Alpha::Blend,
        None | Some("OPAQUE") => Alpha::Opaque,
        Some(mode) => {
            notes.fault(format!("{}: the alpha mode {} is unknown; it is opaque", part.place, clip(mode)));
            Alpha::Opaque
        }
    }
}

/// KHR_materials_volume of `part`.
fn add_volume(material: &mut Material, (part, volume): (&Part, &Part), notes: &mut Notes) {
    let thickness = volume.number("thicknessFactor", notes).unwrap_or(0.0);
    let color = volume.numbers("attenuationColor", notes).unwrap_or([1.0; 3]);
    let distance = volume.number("attenuationDistance", notes).unwrap_or(f32::INFINITY);
    let mut range = Range { place: &part.place, notes };
    material.volume = range.clamp("thickness", thickness, [0.0, f32::MAX]) > 0.0;
    let color = range.clamp_all("attenuation colour", color, UNIT);
    if distance.is_nan() || distance <= 0.0 {
        range.notes.fault(format!("{}: attenuation distance {distance} was ignored", part.place));
    } else if material.volume {
        material.absorption = range.clamp_all("absorption", absorption(color, distance), ABSORPTION);
    }
}

/// What KHR_texture_transform says.
fn uv_transform(part: &Part, notes: &mut Notes) -> UvTransform {
    let none = UvTransform::default();
    UvTransform {
        offset: part.numbers("offset", notes).unwrap_or(none.offset),
        rotation: part.number("rotation", notes).unwrap_or(none.rotation),
        scale: part.numbers("scale", notes).unwrap_or(none.scale),
    }
}

/// The numbers of a material that others follow from, for one that changes. What is wrong with them was told when the
/// material was read.
pub(super) fn sources(part: &Part) -> Sources {
    let quiet = &mut Notes::default();
    let mut sources = Sources::default();
    sources.emission = part.numbers("emissiveFactor", quiet).unwrap_or(sources.emission);
    let strength = part.extension("KHR_materials_emissive_strength", quiet);
    let strength = strength.and_then(|part| part.number("emissiveStrength", quiet));
    sources.emissive_strength = strength.unwrap_or(sources.emissive_strength);
    if let Some(volume) = part.extension("KHR_materials_volume", quiet) {
        let color = volume.numbers("attenuationColor", quiet).map(|color| color.map(|c| clamped(c, UNIT)));
        sources.attenuation_color = color.unwrap_or(sources.attenuation_color);
        let distance = volume.number("attenuationDistance", quiet).filter(|distance| *distance > 0.0);
        sources.attenuation_distance = distance.unwrap_or(sources.attenuation_distance);
    }
    for (path, transform) in TEXTURES.iter().zip(&mut sources.transforms) {
        let mut at = path.first().and_then(|name| part.part(name, quiet));
        for name in &path[1..] {
            at = at.and_then(|part| part.part(name, quiet));
        }
        let texture = at.and_then(|texture| texture.extension("KHR_texture_transform", quiet));
        *transform = texture.map_or(*transform, |part| uv_transform(&part, quiet));
    }
    sources
}

/// Wrapping and filter of a texture.
pub(super) fn sampler(document: &Document, texture: &Part, notes: &mut Notes) -> ([Wrap; 2], bool) {
    let index = notes.or_fault(texture.index("sampler")).flatten();
    let sampler = index.and_then(|index| notes.or_fault(document.samplers.part(index as usize)));
    let mut code = |name| sampler.as_ref().and_then(|sampler| notes.or_fault(sampler.count(name)).flatten());
    let (s, t, magnification) = (code("wrapS"), code("wrapT"), code("magFilter"));
    let wrap = [s, t].map(|mode| match mode {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        None | Some(10497) => Wrap::Repeat,
        Some(mode) => {
            notes.fault(format!("{}: the wrapping mode {mode} is unknown; it repeats", texture.place));
            Wrap::Repeat
        }
    });
    (wrap, magnification != Some(9728))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::document::test_document;

    #[test]
    fn texture_transform_of_the_extension() {
        // The example of KHR_texture_transform: a quarter turn about the lower left corner.
        let m = UvTransform { offset: [0.0, 1.0], rotation: 1.5707964, scale: [0.5, 0.5] }.matrix();
        let at = |u: f32, v: f32| m.map(|r| r[0] * u + r[1] * v + r[2]);
        let close = |a: [f32; 2], b: [f32; 2]| assert!((a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-6, "{a:?} {b:?}");
        close(at(0.0, 0.0), [0.0, 1.0]);
        close(at(1.0, 0.0), [0.0, 0.5]);
        close(at(0.0, 1.0), [0.5, 1.0]);
    }

    fn convert(json: &str) -> (Material, Notes) {
        let mut notes = Notes::default();
        let text = format!(r#"{{"asset": {{"version": "2.0"}}, "materials": [{json}]}}"#);
        let material = test_document(&text, |document| {
            let part = document.materials.part(0).unwrap();
            Converter::new(document).material(&part, &mut notes).0
        });
        (material, notes)
    }

    #[test]
    fn values_out_of_range_are_clamped_and_reported() {
        let (m, notes) = convert(
            r#"{"pbrMetallicRoughness": {"baseColorFactor": [2, 0.5, -1, 1], "roughnessFactor": 1e300},
                "emissiveFactor": [-1, 2, 3], "extensions": {"KHR_materials_ior": {"ior": 0.5}}}"#,
        );
        assert_eq!(m.base_color, [1.0, 0.5, 0.0, 1.0]);
        assert_eq!((m.roughness, m.ior, m.emissive), (1.0, 1.0, [0.0, 2.0, 3.0]));
        assert_eq!(notes.faults(), 5);
        let (m, notes) = convert(r#"{"extensions": {"KHR_materials_ior": {"ior": 0}}}"#);
        assert_eq!(((m.ior - 1.0) / (m.ior + 1.0), notes.faults()), (1.0, 0), "an index of 0 reflects everything");
    }

    #[test]
    fn attenuation_becomes_absorption() {
        let (m, notes) = convert(
            r#"{"extensions": {"KHR_materials_volume":
                {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [0.25, 1, 0]}}}"#,
        );
        assert!(m.volume && notes.faults() == 0);
        assert!((m.absorption[0] - 4f32.ln() / 2.0).abs() < 1e-6);
        assert_eq!(m.absorption[1].to_bits(), 0);
        assert!(m.absorption[2].is_finite() && m.absorption[2] > 6.0);
        let (thin, _) = convert(
            r#"{"extensions": {"KHR_materials_volume": {"attenuationDistance": 2, "attenuationColor": [0, 0, 0]}}}"#,
        );
        assert!(!thin.volume && thin.absorption == [0.0; 3]);
    }

    #[test]
    fn a_material_has_room_for_any_two_sets() {
        let places = |sets: &[u64]| {
            let mut all = UvSets::default();
            (sets.iter().map(|&set| all.place(set)).collect::<Vec<_>>(), all.of_file())
        };
        assert_eq!(places(&[0, 1, 0]), (vec![Some(0), Some(1), Some(0)], [0, 1]));
        assert_eq!(places(&[1]), (vec![Some(1)], [0, 1]));
        assert_eq!(places(&[2, 1, 2]), (vec![Some(0), Some(1), Some(0)], [2, 1]));
        assert_eq!(places(&[5, 0]), (vec![Some(0), Some(1)], [5, 0]));
        assert_eq!(places(&[0, 1, 2]).0, [Some(0), Some(1), None]);
    }
}
