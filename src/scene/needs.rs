//! What a scene requires of the renderer; everything else is left out of kernels, passes and buffers.

use super::{Alpha, Light, Material, Scene};
use crate::constants::{ALPHA_GATHER, ALPHA_SMOOTH};

/// Perceptual roughness below which a reflection or refraction is traced as perfectly smooth. GGX alpha is its
/// square, below 1e-3: a lobe narrower than a pixel.
pub const SMOOTH_ROUGHNESS: f32 = 0.03;
const _: () = assert!(SMOOTH_ROUGHNESS * SMOOTH_ROUGHNESS < ALPHA_SMOOTH);

/// Roughness below which a glossy lobe is followed rather than gathered: its GGX alpha is [`ALPHA_GATHER`].
pub const FOLLOWED_ROUGHNESS: f32 = 0.316_227_77;
const _: () = assert!((FOLLOWED_ROUGHNESS * FOLLOWED_ROUGHNESS / ALPHA_GATHER - 1.0).abs() < 1e-6);

/// Whether a surface of this material continues caustic paths.
pub fn is_specular(m: &Material) -> bool {
    // Textures multiply factors, so a texture may reach down to 0.
    let lowest = if m.metallic_roughness_texture.is_some() { 0.0 } else { m.roughness };
    let reflects = m.metallic > 0.0 || m.specular > 0.0;
    !m.unlit && (m.transmission > 0.0 || (reflects && lowest < FOLLOWED_ROUGHNESS))
}

/// The features that the triangles, lights and textures of a scene use. Unused materials do not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Needs {
    /// Any image texture.
    pub textures: bool,
    /// Tangent-space normal maps.
    pub normal_maps: bool,
    /// Colours at vertices.
    pub vertex_colors: bool,
    /// Texture coordinate sets 0 and 1.
    pub uv_sets: [bool; 2],
    /// Surfaces that the camera does not see from behind.
    pub one_sided: bool,
    /// Surfaces with holes, or there in part: alpha masks and blending.
    pub alpha_mask: bool,
    /// Paths that continue without a lobe: smooth metal or coat, or any transmission.
    pub specular_chains: bool,
    /// Refraction, or light through a thin sheet.
    pub transmission: bool,
    /// A transmissive volume that absorbs.
    pub absorption: bool,
    /// Transmission without a volume.
    pub thin_sheets: bool,
    /// Lobes of metal, coat or rough glass wider than [`SMOOTH_ROUGHNESS`].
    pub glossy: bool,
    /// No surface reflects other than by Lambert's law.
    pub lambert_only: bool,
    /// Surfaces that can focus light: transmissive ones, mirrors, sharp glossy ones.
    pub caustic_casters: bool,
    /// Point lights.
    pub point_lights: bool,
    /// Spot lights.
    pub spot_lights: bool,
    /// Directional lights.
    pub directional_lights: bool,
    /// Emissive triangles.
    pub area_lights: bool,
    /// Light from infinity that is not black.
    pub environment: bool,
    /// Surfaces shown without shading.
    pub unlit: bool,
    /// Emission that varies over a triangle.
    pub emissive_textures: bool,
}

impl Needs {
    /// Looks at every material that a triangle uses, at the lights and at the environment.
    pub fn of(scene: &Scene) -> Self {
        let used = scene.used_materials();
        let mut needs = Self::default();
        for (material, _) in scene.materials.iter().zip(&used).filter(|(_, used)| **used) {
            needs.add_material(material);
        }
        needs.vertex_colors = scene.meshes.iter().any(|mesh| !mesh.colors.is_empty());
        for light in &scene.lights {
            match light {
                Light::Point { .. } => needs.point_lights = true,
                Light::Spot { .. } => needs.spot_lights = true,
                Light::Directional { .. } => needs.directional_lights = true,
            }
        }
        needs.environment = scene.environment.as_ref().is_some_and(|e| e.radiance.iter().any(|t| *t != [0.0; 3]));
        needs.lambert_only = !needs.specular_chains && !needs.glossy;
        needs
    }

    fn add_material(&mut self, m: &Material) {
        for texture in m.texture_refs() {
            self.textures = true;
            self.uv_sets[texture.uv_set as usize & 1] = true;
        }
        self.one_sided |= m.is_one_sided();
        self.alpha_mask |= m.alpha != Alpha::Opaque;
        self.unlit |= m.unlit;
        if m.unlit {
            // Shown as it is: its reflection, normals and emission are never asked for.
            return;
        }
        self.normal_maps |= m.normal_texture.is_some();
        self.area_lights |= m.emissive != [0.0; 3];
        self.emissive_textures |= m.emissive_texture.is_some() && m.emissive != [0.0; 3];
        // Textures multiply factors, so a factor is the largest value and a texture may reach down to 0.
        let lowest_roughness = if m.metallic_roughness_texture.is_some() { 0.0 } else { m.roughness };
        let transmits = m.transmission > 0.0;
        let reflects = m.metallic > 0.0 || m.specular > 0.0;
        self.transmission |= transmits;
        self.thin_sheets |= transmits && !m.volume;
        self.absorption |= transmits && m.volume && m.absorption != [0.0; 3];
        self.specular_chains |= transmits || (reflects && lowest_roughness < SMOOTH_ROUGHNESS);
        self.caustic_casters |= is_specular(m);
        self.glossy |= (transmits || reflects) && m.roughness >= SMOOTH_ROUGHNESS;
    }

    /// Every feature with its name, in a fixed order.
    fn features(&self) -> [(&'static str, bool); 20] {
        [
            ("textures", self.textures),
            ("normal maps", self.normal_maps),
            ("vertex colours", self.vertex_colors),
            ("texture coordinates 0", self.uv_sets[0]),
            ("texture coordinates 1", self.uv_sets[1]),
            ("one-sided surfaces", self.one_sided),
            ("alpha masks", self.alpha_mask),
            ("specular chains", self.specular_chains),
            ("transmission", self.transmission),
            ("absorption", self.absorption),
            ("thin sheets", self.thin_sheets),
            ("glossy lobes", self.glossy),
            ("caustics", self.caustic_casters),
            ("point lights", self.point_lights),
            ("spot lights", self.spot_lights),
            ("directional lights", self.directional_lights),
            ("area lights", self.area_lights),
            ("environment light", self.environment),
            ("unlit surfaces", self.unlit),
            ("emissive textures", self.emissive_textures),
        ]
    }

    /// Names of what the scene needs.
    pub fn kept(&self) -> Vec<&'static str> {
        self.features().into_iter().filter(|(_, needed)| *needed).map(|(name, _)| name).collect()
    }

    /// Names of what is left out.
    pub fn left_out(&self) -> Vec<&'static str> {
        self.features().into_iter().filter(|(_, needed)| !*needed).map(|(name, _)| name).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shapes::Mesh;
    use crate::scene::{Environment, TextureRef};

    const TEXTURE: TextureRef = TextureRef { texture: 0, uv_set: 1, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };

    fn needs(material: Material) -> Needs {
        let mut scene = Scene::default();
        scene.add(&Mesh::quad([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), material);
        // Not used by any triangle, so it must not count.
        scene.materials.push(Material { alpha: Alpha::Blend, ..Material::glass(1.5) });
        Needs::of(&scene)
    }

    #[test]
    fn a_diffuse_scene_needs_next_to_nothing() {
        let needs = needs(Material::lambert([0.5; 3]));
        assert_eq!(needs, Needs { lambert_only: true, ..Needs::default() });
        assert!(needs.kept().is_empty());
        assert_eq!(needs.left_out().len(), 20);
    }

    #[test]
    fn each_kind_of_material() {
        let base = Needs { caustic_casters: true, ..Needs::default() };
        assert_eq!(needs(Material::mirror()), Needs { specular_chains: true, ..base });
        let satin = Needs { glossy: true, ..Needs::default() };
        assert_eq!(needs(Material::metal([1.0; 3], 0.5)), satin);
        assert_eq!(needs(Material::metal([1.0; 3], 0.2)), Needs { caustic_casters: true, ..satin });
        let coat = Material { specular: 1.0, roughness: 0.0, ..Material::lambert([0.5; 3]) };
        assert_eq!(needs(coat), Needs { specular_chains: true, ..base });
        let glass = Needs { specular_chains: true, transmission: true, ..base };
        assert_eq!(needs(Material::glass(1.5)), glass);
        let sheet = Material { volume: false, ..Material::glass(1.5) };
        assert_eq!(needs(sheet), Needs { thin_sheets: true, ..glass });
        let tinted = Material { absorption: [0.0, 1.0, 0.0], ..Material::glass(1.5) };
        assert_eq!(needs(tinted), Needs { absorption: true, ..glass });
        let lambert = Needs { lambert_only: true, ..Needs::default() };
        let emitter = Needs { area_lights: true, one_sided: true, ..lambert };
        assert_eq!(needs(Material::emitter([1.0; 3])), emitter);
        assert_eq!(needs(Material { unlit: true, ..Material::mirror() }), Needs { unlit: true, ..lambert });
        for alpha in [Alpha::Mask(0.5), Alpha::Blend] {
            let holes = Material { alpha, ..Material::lambert([1.0; 3]) };
            assert_eq!(needs(holes), Needs { alpha_mask: true, ..lambert });
        }
    }

    #[test]
    fn textures_reach_from_the_factor_down_to_zero() {
        let textured = Needs { textures: true, uv_sets: [false, true], caustic_casters: true, ..Needs::default() };
        let any = Material { metallic_roughness_texture: Some(TEXTURE), ..Material::metal([1.0; 3], 1.0) };
        assert_eq!(needs(any), Needs { glossy: true, specular_chains: true, ..textured });
        let dark = Material { emissive_texture: Some(TEXTURE), ..Material::mirror() };
        assert_eq!(needs(dark), Needs { specular_chains: true, ..textured });
        let lit = Material { emissive_texture: Some(TEXTURE), ..Material::emitter([1.0; 3]) };
        let found = needs(lit);
        assert!(found.emissive_textures && found.area_lights && found.lambert_only);
    }

    #[test]
    fn lights_count_by_kind_and_black_skies_not_at_all() {
        let mut scene = Scene { environment: Some(Environment::constant([0.0; 3])), ..Scene::default() };
        assert!(!Needs::of(&scene).environment);
        scene.environment = Some(Environment::default_sky());
        scene.lights.push(Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [1.0; 3] });
        assert_eq!(Needs::of(&scene).kept(), ["directional lights", "environment light"]);
    }
}
