//! Materials whose numbers change, from the numbers that a file has for them.

use crate::scene::{Alpha, Material, MaterialId};

/// Least transmission colour of a volume: -ln of it is the largest optical depth at the attenuation distance.
const DARKEST_ATTENUATION: f32 = 1e-6;
/// Largest index of refraction that is read.
pub(in crate::scene) const MAX_IOR: f32 = 100.0;
/// In place of an index of 0, for which the Fresnel term is always 1 (KHR_materials_ior): in single precision a
/// boundary of this index reflects everything, and its square is far from overflow.
pub(in crate::scene) const MIRROR_IOR: f32 = 1e9;
/// Values of most factors.
pub(in crate::scene) const UNIT: [f32; 2] = [0.0, 1.0];
/// Far above any light, far below overflow when multiplied by areas and counts.
pub(in crate::scene) const RADIANCE: [f32; 2] = [0.0, 1e20];
/// Absorption per scene unit.
pub(in crate::scene) const ABSORPTION: [f32; 2] = [0.0, 1e30];

/// A property of a material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::scene) enum SurfaceField {
    BaseColor,
    Metallic,
    Roughness,
    Emission,
    EmissiveStrength,
    Cutoff,
    NormalScale,
    Ior,
    Specular,
    SpecularColor,
    Transmission,
    Thickness,
    AttenuationColor,
    AttenuationDistance,
    /// Of the texture with this number, in the order of [`Material::texture_refs`].
    TextureOffset(u8),
    TextureRotation(u8),
    TextureScale(u8),
}

/// What the file says where a number of the material follows from several of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) struct Sources {
    pub emission: [f32; 3],
    pub emissive_strength: f32,
    pub attenuation_color: [f32; 3],
    pub attenuation_distance: f32,
    /// Of the six textures.
    pub transforms: [UvTransform; 6],
}

impl Default for Sources {
    fn default() -> Self {
        Self {
            emission: [0.0; 3],
            emissive_strength: 1.0,
            attenuation_color: [1.0; 3],
            attenuation_distance: f32::INFINITY,
            transforms: [UvTransform::default(); 6],
        }
    }
}

/// A material that changes.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::scene) struct MovingSurface {
    pub material: MaterialId,
    /// Index in the file.
    pub of: u32,
    /// At rest, in the unit of the file.
    pub rest: Material,
    pub sources: Sources,
}

/// What KHR_texture_transform says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::scene) struct UvTransform {
    pub offset: [f32; 2],
    pub rotation: f32,
    pub scale: [f32; 2],
}

impl Default for UvTransform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2] }
    }
}

impl UvTransform {
    /// Translation * rotation * scale. The rotation is counter-clockwise as seen in the image, whose v axis points down
    pub fn matrix(&self) -> [[f32; 3]; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let ([sx, sy], [ox, oy]) = (self.scale, self.offset);
        [[cos * sx, sin * sy, ox], [-sin * sx, cos * sy, oy]]
    }
}

/// A value brought into range, NaN to its lower end.
pub(in crate::scene) fn clamped(value: f32, [low, high]: [f32; 2]) -> f32 {
    if value >= low { value.min(high) } else { low }
}

/// KHR_materials_volume: T(x) = colour^(x / distance) = exp(-absorption x), for a colour within 0 and 1 and a distance
/// above 0. It may be beyond [`ABSORPTION`].
pub(in crate::scene) fn absorption(color: [f32; 3], distance: f32) -> [f32; 3] {
    color.map(|c| (-c.max(DARKEST_ATTENUATION).ln() / distance).abs())
}

impl MovingSurface {
    /// Changes a number. Values are brought into range as when a file is read.
    pub fn set(&mut self, field: SurfaceField, value: &[f32]) {
        use SurfaceField as Field;
        let (m, s) = (&mut self.rest, &mut self.sources);
        match (field, value) {
            (Field::BaseColor, &[r, g, b, a]) => m.base_color = [r, g, b, a].map(|x| clamped(x, UNIT)),
            (Field::SpecularColor, &[r, g, b]) => m.specular_color = [r, g, b].map(|x| clamped(x, [0.0, f32::MAX])),
            (Field::Emission, &[r, g, b]) => s.emission = [r, g, b],
            (Field::AttenuationColor, &[r, g, b]) => s.attenuation_color = [r, g, b].map(|x| clamped(x, UNIT)),
            (Field::TextureOffset(place), &[u, v]) => s.transforms[usize::from(place)].offset = [u, v],
            (Field::TextureScale(place), &[u, v]) => s.transforms[usize::from(place)].scale = [u, v],
            (Field::TextureRotation(place), &[angle]) => s.transforms[usize::from(place)].rotation = angle,
            (_, &[x]) => self.set_number(field, x),
            _ => {}
        }
    }

    fn set_number(&mut self, field: SurfaceField, x: f32) {
        use SurfaceField as Field;
        let (m, s) = (&mut self.rest, &mut self.sources);
        match field {
            Field::Metallic => m.metallic = clamped(x, UNIT),
            Field::Roughness => m.roughness = clamped(x, UNIT),
            Field::EmissiveStrength => s.emissive_strength = x,
            Field::Ior => m.ior = if x == 0.0 { MIRROR_IOR } else { clamped(x, [1.0, MAX_IOR]) },
            Field::Specular => m.specular = clamped(x, UNIT),
            Field::Transmission => m.transmission = clamped(x, UNIT),
            Field::Thickness => m.volume = x > 0.0,
            Field::AttenuationDistance => s.attenuation_distance = x,
            Field::NormalScale if x.is_finite() => m.normal_scale = x,
            Field::Cutoff if x.is_finite() => {
                if let Alpha::Mask(cutoff) = &mut m.alpha {
                    *cutoff = x;
                }
            }
            _ => {}
        }
    }

    /// The material as it is now, where `unit` new units are one unit of the file.
    pub fn material(&self, unit: f64) -> Material {
        let s = &self.sources;
        let mut material = self.rest.clone();
        let emission = s.emission.map(|e| clamped(e, RADIANCE) * clamped(s.emissive_strength, RADIANCE));
        material.emissive = emission.map(|e| clamped(e, RADIANCE));
        let is_medium = material.volume && s.attenuation_distance > 0.0;
        let depth = if is_medium { absorption(s.attenuation_color, s.attenuation_distance) } else { [0.0; 3] };
        material.absorption = depth.map(|a| clamped((f64::from(clamped(a, ABSORPTION)) / unit) as f32, ABSORPTION));
        for (slot, transform) in material.texture_slots().into_iter().zip(&s.transforms) {
            let matrix = transform.matrix();
            if let Some(texture) = slot
                && matrix.iter().flatten().all(|x| x.is_finite())
            {
                texture.transform = matrix;
            }
        }
        material
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TextureRef;

    fn surface() -> MovingSurface {
        let texture = TextureRef { texture: 0, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
        let rest = Material { emissive_texture: Some(texture), alpha: Alpha::Mask(0.5), ..Material::default() };
        MovingSurface { material: MaterialId(0), of: 0, rest, sources: Sources::default() }
    }

    #[test]
    fn numbers_change_within_their_ranges() {
        use SurfaceField as Field;
        let mut surface = surface();
        let rest = surface.rest.clone();
        assert_eq!(surface.material(1.0), rest);
        surface.set(Field::BaseColor, &[2.0, f32::NAN, 0.5, 0.25]);
        surface.set(Field::Emission, &[1.0, 2.0, -1.0]);
        surface.set(Field::EmissiveStrength, &[10.0]);
        surface.set(Field::Ior, &[0.5]);
        surface.set(Field::Cutoff, &[0.75]);
        surface.set(Field::Roughness, &[0.5, 0.5]);
        surface.set(Field::TextureOffset(3), &[0.5, 0.25]);
        let now = surface.material(1.0);
        assert_eq!((now.base_color, now.emissive), ([1.0, 0.0, 0.5, 0.25], [10.0, 20.0, 0.0]));
        assert_eq!((now.ior, now.alpha, now.roughness), (1.0, Alpha::Mask(0.75), 1.0));
        assert_eq!(now.emissive_texture.map(|t| t.transform), Some([[1.0, 0.0, 0.5], [0.0, 1.0, 0.25]]));
    }

    #[test]
    fn absorption_follows_color_distance_and_unit() {
        use SurfaceField as Field;
        let mut surface = surface();
        surface.set(Field::AttenuationColor, &[0.25, 1.0, 0.0]);
        surface.set(Field::AttenuationDistance, &[2.0]);
        assert_eq!(surface.material(1.0).absorption, [0.0; 3], "a thin sheet absorbs nothing");
        surface.set(Field::Thickness, &[0.1]);
        let now = surface.material(0.5);
        assert!(now.volume && (now.absorption[0] - 4f32.ln()).abs() < 1e-6 && now.absorption[2].is_finite());
        assert_eq!(now.absorption[1], 0.0);
        surface.set(Field::AttenuationDistance, &[-1.0]);
        assert_eq!(surface.material(1.0).absorption, [0.0; 3]);
    }
}
