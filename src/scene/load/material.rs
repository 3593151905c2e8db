//! Materials and textures, with every number brought into its valid range.

use std::collections::HashMap;

use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::{AlphaMode, Material as JsonMaterial, NormalTexture};
use gltf::json::texture::{Info, MagFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

use super::Notes;
use super::images::Role;
use crate::scene::{Alpha, Material, Texture, TextureRef, Wrap};

/// Largest index of refraction that is read. An ior of 0 stands for "reflects everything" in KHR_materials_ior.
const MAX_IOR: f32 = 100.0;
/// Least transmission colour of a volume: -ln of it is the largest optical depth at the attenuation distance.
const DARKEST_ATTENUATION: f32 = 1e-6;
/// Alpha cut-off of masks that give none.
const DEFAULT_CUTOFF: f32 = 0.5;

/// Converts the materials in file order. Textures that are used are listed in `used`; the references index that list.
pub(super) struct Converter<'a> {
    root: &'a Root,
    /// Textures of the file and what they are, in the order of [`TextureRef::texture`].
    pub used: Vec<(usize, Role)>,
    /// Where in `used` a texture is.
    slots: HashMap<(usize, Role), u32>,
}

/// Brings values of one material into range and remembers whether it had to.
struct Range<'a> {
    index: usize,
    notes: &'a mut Notes,
}

impl Range<'_> {
    fn clamp(&mut self, what: &str, value: f32, [low, high]: [f32; 2]) -> f32 {
        // NaN becomes the lower end.
        let clamped = if value >= low { value.min(high) } else { low };
        if clamped != value {
            self.notes.fault(format!("material {}: {what} {value} was clamped to {clamped}", self.index));
        }
        clamped
    }

    fn clamp_all<const N: usize>(&mut self, what: &str, values: [f32; N], range: [f32; 2]) -> [f32; N] {
        values.map(|value| self.clamp(what, value, range))
    }
}

const UNIT: [f32; 2] = [0.0, 1.0];
/// Far above any light, far below overflow when multiplied by areas and counts.
const RADIANCE: [f32; 2] = [0.0, 1e20];

impl<'a> Converter<'a> {
    pub fn new(root: &'a Root) -> Self {
        Self { root, used: Vec::new(), slots: HashMap::new() }
    }

    /// Material `index` of the file.
    pub fn material(&mut self, index: usize, json: &JsonMaterial, notes: &mut Notes) -> Material {
        let mut material = self.core(index, json, notes);
        self.extensions(&mut material, index, json, notes);
        material.alpha = match &json.alpha_mode {
            Checked::Valid(AlphaMode::Mask) => Alpha::Mask(json.alpha_cutoff.map_or(DEFAULT_CUTOFF, |c| c.0)),
            Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
            _ => Alpha::Opaque,
        };
        if matches!(material.alpha, Alpha::Mask(cutoff) if !cutoff.is_finite()) {
            notes.fault(format!("material {index}: the alpha cut-off is not finite and was set to {DEFAULT_CUTOFF}"));
            material.alpha = Alpha::Mask(DEFAULT_CUTOFF);
        }
        material
    }

    fn core(&mut self, index: usize, json: &JsonMaterial, notes: &mut Notes) -> Material {
        let pbr = &json.pbr_metallic_roughness;
        let strength =
            json.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |s| s.emissive_strength.0);
        let mut range = Range { index, notes };
        let strength = range.clamp("emissive strength", strength, RADIANCE);
        let emissive = range.clamp_all("emission", json.emissive_factor.0, RADIANCE);
        Material {
            name: json.name.clone().unwrap_or_default(),
            base_color: range.clamp_all("base colour", pbr.base_color_factor.0, UNIT),
            metallic: range.clamp("metallic factor", pbr.metallic_factor.0, UNIT),
            roughness: range.clamp("roughness", pbr.roughness_factor.0, UNIT),
            emissive: range.clamp_all("emission", emissive.map(|e| e * strength), RADIANCE),
            double_sided: json.double_sided,
            base_color_texture: self.texture(pbr.base_color_texture.as_ref(), Role::Color, range.notes),
            metallic_roughness_texture: self.texture(pbr.metallic_roughness_texture.as_ref(), Role::Data, range.notes),
            normal_texture: json.normal_texture.as_ref().and_then(|t| self.normal_texture(t, range.notes)),
            normal_scale: json.normal_texture.as_ref().map_or(1.0, |t| if t.scale.is_finite() { t.scale } else { 1.0 }),
            emissive_texture: self.texture(json.emissive_texture.as_ref(), Role::Color, range.notes),
            ..Material::default()
        }
    }

    fn extensions(&mut self, material: &mut Material, index: usize, json: &JsonMaterial, notes: &mut Notes) {
        let Some(extensions) = &json.extensions else { return };
        let mut range = Range { index, notes };
        material.unlit = extensions.unlit.is_some();
        if let Some(ior) = &extensions.ior {
            let ior = if ior.ior.0 == 0.0 { MAX_IOR } else { ior.ior.0 };
            material.ior = range.clamp("index of refraction", ior, [1.0, MAX_IOR]);
        }
        if let Some(specular) = &extensions.specular {
            material.specular = range.clamp("specular factor", specular.specular_factor.0, UNIT);
            material.specular_color =
                range.clamp_all("specular colour", specular.specular_color_factor.0, [0.0, f32::MAX]);
            material.specular_texture = self.texture(specular.specular_texture.as_ref(), Role::Data, range.notes);
            if specular.specular_color_texture.is_some() {
                range.notes.note(format!("material {index}: the specular colour texture is ignored"));
            }
        }
        if let Some(transmission) = &extensions.transmission {
            material.transmission = range.clamp("transmission", transmission.transmission_factor.0, UNIT);
            material.transmission_texture =
                self.texture(transmission.transmission_texture.as_ref(), Role::Data, range.notes);
        }
        if let Some(volume) = &extensions.volume {
            let thickness = range.clamp("thickness", volume.thickness_factor.0, [0.0, f32::MAX]);
            material.volume = thickness > 0.0;
            let color = range.clamp_all("attenuation colour", volume.attenuation_color.0, UNIT);
            let distance = volume.attenuation_distance.0;
            if distance.is_nan() || distance <= 0.0 {
                range.notes.fault(format!("material {index}: attenuation distance {distance} was ignored"));
            } else if material.volume {
                // KHR_materials_volume: T(x) = colour^(x / distance) = exp(-absorption x).
                let depth = color.map(|c| -c.max(DARKEST_ATTENUATION).ln());
                material.absorption = range.clamp_all("absorption", depth.map(|d| (d / distance).abs()), [0.0, 1e30]);
            }
        }
    }

    fn texture(&mut self, info: Option<&Info>, role: Role, notes: &mut Notes) -> Option<TextureRef> {
        let info = info?;
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.clone());
        self.reference((info.index, role), info.tex_coord, transform, notes)
    }

    /// Normal textures keep KHR_texture_transform among the extensions that the typed JSON does not know.
    fn normal_texture(&mut self, info: &NormalTexture, notes: &mut Notes) -> Option<TextureRef> {
        let raw = info.extensions.as_ref().and_then(|e| e.others.get("KHR_texture_transform"));
        let transform = raw.and_then(|raw| serde_json::from_value(raw.clone()).ok());
        self.reference((info.index, Role::Normal), info.tex_coord, transform, notes)
    }

    fn reference(
        &mut self,
        (texture, role): (Index<gltf::json::Texture>, Role),
        uv_set: u32,
        transform: Option<TextureTransform>,
        notes: &mut Notes,
    ) -> Option<TextureRef> {
        let index = texture.value();
        let uv_set = transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(uv_set);
        if uv_set > 1 {
            notes.fault(format!("texture {index}: coordinate set {uv_set} is not supported; the texture is ignored"));
            return None;
        }
        if self.root.textures.get(index)?.source.value() >= self.root.images.len() {
            notes.fault(format!("texture {index} has no image that can be read; it is ignored"));
            return None;
        }
        let matrix = uv_matrix(transform.unwrap_or_default());
        if !matrix.iter().flatten().all(|x| x.is_finite()) {
            notes.fault(format!("texture {index}: its transform is not finite; the texture is ignored"));
            return None;
        }
        let texture = *self.slots.entry((index, role)).or_insert_with(|| {
            self.used.push((index, role));
            self.used.len() as u32 - 1
        });
        Some(TextureRef { texture, uv_set, transform: matrix })
    }
}

/// KHR_texture_transform: translation * rotation * scale. The rotation is counter-clockwise as seen in the image,
/// whose v axis points down.
fn uv_matrix(t: TextureTransform) -> [[f32; 3]; 2] {
    let (sin, cos) = t.rotation.0.sin_cos();
    let ([sx, sy], [ox, oy]) = (t.scale.0, t.offset.0);
    [[cos * sx, sin * sy, ox], [-sin * sx, cos * sy, oy]]
}

/// The sampler of a texture, paired with image slot `image`.
pub(super) fn sampler(root: &Root, texture: usize, image: u32) -> Texture {
    let none = Sampler::default();
    let index = root.textures.get(texture).and_then(|t| t.sampler);
    let sampler = index.and_then(|s| root.samplers.get(s.value())).unwrap_or(&none);
    let wrap = |mode: &Checked<WrappingMode>| match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    let linear = sampler.mag_filter != Some(Checked::Valid(MagFilter::Nearest));
    Texture { image, wrap: [wrap(&sampler.wrap_s), wrap(&sampler.wrap_t)], linear }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_transform_of_the_extension() {
        // The example of KHR_texture_transform: a quarter turn about the lower left corner.
        let t: TextureTransform =
            serde_json::from_str(r#"{"offset": [0, 1], "rotation": 1.5707964, "scale": [0.5, 0.5]}"#).unwrap();
        let m = uv_matrix(t);
        let at = |u: f32, v: f32| m.map(|r| r[0] * u + r[1] * v + r[2]);
        let close = |a: [f32; 2], b: [f32; 2]| assert!((a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-6, "{a:?} {b:?}");
        close(at(0.0, 0.0), [0.0, 1.0]);
        close(at(1.0, 0.0), [0.0, 0.5]);
        close(at(0.0, 1.0), [0.5, 1.0]);
    }

    fn convert(json: &str) -> (Material, Notes) {
        let root: Root = serde_json::from_str(r#"{"asset": {"version": "2.0"}}"#).unwrap();
        let mut notes = Notes::default();
        let material = Converter::new(&root).material(0, &serde_json::from_str(json).unwrap(), &mut notes);
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
}
