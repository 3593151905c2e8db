//! Vertex attributes and textures as the kernels read them.

use crate::constants::{
    MATERIAL_BLEND, MATERIAL_TWO_SIDED, MATERIAL_UNLIT, MATERIAL_VOLUME, NO_TEXTURE, TEXTURE_LINEAR, TEXTURE_SRGB,
    TEXTURE_UV1, WRAP_CLAMP, WRAP_MIRROR, WRAP_REPEAT, WRAP_V_SHIFT,
};
use std::ops::Range;

use crate::kernels::generated::{Material as DeviceMaterial, TextureUse};
use crate::kernels::scene_data::Variant;
use crate::scene::{Alpha, Material, Scene, Texture, TextureRef, World, Wrap};

/// Vertex attributes of a range of the world's triangles, laid out by `variant` (glsl/lib/scene_bindings.glsl).
pub fn vertex_data(world: &World, triangles: Range<u32>, variant: &Variant) -> Vec<[f32; 4]> {
    let stride = variant.shading_stride as usize;
    let mut data = vec![[0.0; 4]; (triangles.len() * stride).max(1)];
    for (at, id) in triangles.enumerate() {
        let corners = world.triangles[id as usize].map(|corner| corner as usize);
        let vectors = &mut data[at * stride..(at + 1) * stride];
        // Zero stands for the triangle's own normal: flat triangles shade to the same bits whether the program
        // interpolates normals or not.
        let flat = is_flat(world, id);
        for (k, &corner) in corners.iter().enumerate() {
            let [x, y, z] = if flat { [0.0; 3] } else { world.normals[corner] };
            let uv0 = world.uvs[0].get(corner).copied().unwrap_or_default();
            vectors[k] = [x, y, z, uv0[0]];
            if variant.uv0_at > 0 {
                vectors[variant.uv0_at as usize][k] = uv0[1];
            }
            if variant.uv1_at > 0 {
                let uv1 = world.uvs[1].get(corner).copied().unwrap_or_default();
                let place = &mut vectors[variant.uv1_at as usize + k / 2];
                place[2 * (k % 2)] = uv1[0];
                place[2 * (k % 2) + 1] = uv1[1];
            }
            if variant.color_at > 0 {
                vectors[variant.color_at as usize + k] = world.colors.get(corner).copied().unwrap_or([1.0; 4]);
            }
            if variant.tangent_at > 0 {
                let tangent = world.tangents.get(corner).copied().unwrap_or([1.0, 0.0, 0.0, 1.0]);
                vectors[variant.tangent_at as usize + k] = tangent;
            }
        }
    }
    data
}

/// Whether the vertex normals of a triangle are its own normal but for rounding. True for triangles without area.
pub fn is_flat(world: &World, id: u32) -> bool {
    let vector = |v: [f32; 3]| glam::DVec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2]));
    let corners = world.triangles[id as usize];
    let [a, b, c] = corners.map(|corner| vector(world.positions[corner as usize]));
    let normal = (b - a).cross(c - a).normalize_or_zero();
    // The sine of 1e-5 rad: rounding stays below it, and no tessellation of a curved mirror is so fine that it would
    // count as flat.
    let differs = |corner: &u32| {
        let n = vector(world.normals[*corner as usize]);
        n.dot(normal) < 0.0 || n.cross(normal).length() > 1e-5
    };
    normal == glam::DVec3::ZERO || !corners.iter().any(differs)
}

/// MATERIAL_* of a material.
fn flags(m: &Material) -> u32 {
    let flags = [
        // What lets no light through has no inside to see.
        (MATERIAL_VOLUME, m.volume && m.transmission > 0.0),
        (MATERIAL_UNLIT, m.unlit),
        (MATERIAL_BLEND, m.alpha == Alpha::Blend),
        (MATERIAL_TWO_SIDED, m.double_sided),
    ];
    flags.iter().filter(|(_, set)| *set).fold(0, |all, (flag, _)| all | flag)
}

/// Materials, texture uses and texels.
#[derive(Default)]
pub struct Textures {
    pub materials: Vec<DeviceMaterial>,
    pub uses: Vec<TextureUse>,
    pub texels: Vec<u32>,
    /// Images that are used, in the order of their texels.
    images: Vec<usize>,
    /// Texels of these images.
    texel_count: u32,
}

impl Textures {
    /// Packs the images that materials use, one after the other.
    pub fn of(scene: &Scene) -> Self {
        let mut packed = Self::without_texels(scene);
        packed.texels.reserve_exact(packed.texel_count as usize);
        for &image in &packed.images {
            packed.texels.extend(scene.images[image].rgba.iter().map(|texel| u32::from_le_bytes(*texel)));
        }
        packed
    }

    /// The same but for the texels, which other factors do not change.
    pub fn without_texels(scene: &Scene) -> Self {
        let mut packed = Self::default();
        let mut first_texel = vec![None; scene.images.len()];
        for material in &scene.materials {
            let converted = packed.material(scene, material, &mut first_texel);
            packed.materials.push(converted);
        }
        packed
    }

    fn material(&mut self, scene: &Scene, m: &Material, first: &mut [Option<u32>]) -> DeviceMaterial {
        let mut texture = |reference: &Option<TextureRef>, srgb: bool| match reference {
            Some(reference) => self.texture(scene, reference, srgb, first),
            None => NO_TEXTURE,
        };
        DeviceMaterial {
            base_color: [m.base_color[0], m.base_color[1], m.base_color[2]],
            base_alpha: m.base_color[3],
            emissive: m.emissive,
            metallic: m.metallic,
            specular_color: m.specular_color,
            specular: m.specular,
            absorption: m.absorption,
            roughness: m.roughness,
            transmission: m.transmission,
            ior: m.ior,
            normal_scale: m.normal_scale,
            // A cut-off below 0 cuts nothing away.
            alpha_cutoff: if let Alpha::Mask(cutoff) = m.alpha { cutoff } else { -1.0 },
            flags: flags(m),
            base_color_texture: texture(&m.base_color_texture, true),
            metallic_roughness_texture: texture(&m.metallic_roughness_texture, false),
            normal_texture: texture(&m.normal_texture, false),
            emissive_texture: texture(&m.emissive_texture, true),
            transmission_texture: texture(&m.transmission_texture, false),
            specular_texture: texture(&m.specular_texture, false),
            boundary: 0,        // the tables of lobes know
            light_density: 0.0, // the light table knows
        }
    }

    fn texture(&mut self, scene: &Scene, reference: &TextureRef, srgb: bool, first: &mut [Option<u32>]) -> u32 {
        let Texture { image, wrap, linear } = scene.textures[reference.texture as usize];
        let source = &scene.images[image as usize];
        let first_texel = *first[image as usize].get_or_insert_with(|| {
            let at = self.texel_count;
            self.images.push(image as usize);
            self.texel_count += source.rgba.len() as u32;
            at
        });
        let mode = |wrap: Wrap| match wrap {
            Wrap::Repeat => WRAP_REPEAT,
            Wrap::Clamp => WRAP_CLAMP,
            Wrap::Mirror => WRAP_MIRROR,
        };
        let mut flags = mode(wrap[0]) | (mode(wrap[1]) << WRAP_V_SHIFT);
        flags |= if linear { TEXTURE_LINEAR } else { 0 } | if srgb { TEXTURE_SRGB } else { 0 };
        flags |= if reference.uv_set == 1 { TEXTURE_UV1 } else { 0 };
        self.uses.push(TextureUse {
            first_texel,
            width: source.width,
            height: source.height,
            flags,
            row_u: reference.transform[0],
            row_v: reference.transform[1],
        });
        self.uses.len() as u32 - 1
    }
}
