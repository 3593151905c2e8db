//! Which features of the kernels a scene needs.

use super::host::Host;
use super::lights::LightTable;
use crate::kernels::scene_data::Variant;
use crate::scene::needs::FOLLOWED_ROUGHNESS;
use crate::scene::{Material, Needs, Scene};

/// What the kernels have to do for a scene; everything if `full`.
pub fn variant(scene: &Scene, host: &Host, table: &LightTable, full: bool) -> Variant {
    let needs = Needs::of(scene);
    let world = &host.world;
    let mut v = Variant {
        textures: full || needs.textures,
        normal_maps: full || needs.normal_maps,
        alpha_mask: full || needs.alpha_mask,
        one_sided: full || needs.one_sided,
        glass: full || needs.transmission,
        absorption: full || needs.absorption,
        glossy: full || !needs.lambert_only,
        environment: full || host.sky.is_some(),
        area_lights: full || table.has_triangles,
        delta_lights: full || table.has_delta,
        guided: full,
        guided_samples: full,
        lens: full,
        smooth_normals: full || needs.normal_maps || host.any_smooth(scene, |_| true),
        gathers_glossy: full || scene.materials.iter().any(gathers_glossy),
        gathers_smooth: full || needs.normal_maps || host.any_smooth(scene, gathers),
        blinn_phong: false,
        shading_stride: 3,
        uv0_at: 0,
        uv1_at: 0,
        color_at: 0,
        tangent_at: 0,
    };
    let mut place = |wanted: bool, vectors: u32| {
        let at = v.shading_stride;
        v.shading_stride += if wanted { vectors } else { 0 };
        if wanted { at } else { 0 }
    };
    let uv0_at = place(!world.uvs[0].is_empty() && needs.uv_sets[0], 1);
    let uv1_at = place(!world.uvs[1].is_empty() && needs.uv_sets[1], 2);
    let color_at = place(!world.colors.is_empty(), 3);
    let tangent_at = place(!world.tangents.is_empty() && needs.normal_maps, 3);
    Variant { uv0_at, uv1_at, color_at, tangent_at, ..v }
}

/// Whether a surface of this material has a lobe that is gathered: not a pure mirror, nor pure glass.
fn gathers(m: &Material) -> bool {
    let textured = m.metallic_roughness_texture.is_some() || m.transmission_texture.is_some();
    let followed_only = (m.metallic >= 1.0 && m.roughness < FOLLOWED_ROUGHNESS) || m.transmission >= 1.0;
    !m.unlit && (textured || !followed_only)
}

fn gathers_glossy(m: &Material) -> bool {
    gathers(m) && (m.specular > 0.0 || m.metallic > 0.0 || m.transmission > 0.0)
}
