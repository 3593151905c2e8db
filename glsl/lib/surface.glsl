// From a hit to a Surface: interpolation, textures, material.

#include "lib/hit.glsl"

// The interpolated normal of a triangle and how it changes, which differentials need beyond the Surface.
struct InterpolatedNormal {
    vec3 normal; // not normalised, towards the incoming ray
    vec3 dn1;    // differences along the edges e1 and e2 of the Surface
    vec3 dn2;
};

struct VertexData {
    vec3 normal;
    vec2 uv0;
    vec2 uv1;
    vec4 color;
    vec4 tangent;
};

vec3 unit_or(vec3 v, vec3 fallback) {
    float n = dot(v, v);
    return n > 1e-12 ? v * inversesqrt(n) : fallback;
}

vec2 interpolate_uv0(uint at, vec3 b) {
    if (UV0_AT == 0u) return vec2(0.0);
    vec3 u = vec3(shading_data[at].w, shading_data[at + 1u].w, shading_data[at + 2u].w);
    return vec2(dot(u, b), dot(shading_data[at + UV0_AT].xyz, b));
}

vec2 interpolate_uv1(uint at, vec3 b) {
    if (UV1_AT == 0u) return vec2(0.0);
    vec4 low = shading_data[at + UV1_AT], high = shading_data[at + UV1_AT + 1u];
    return low.xy * b.x + low.zw * b.y + high.xy * b.z;
}

vec4 interpolate_color(uint at, vec3 b) {
    if (COLOR_AT == 0u) return vec4(1.0);
    uint c = at + COLOR_AT;
    return shading_data[c] * b.x + shading_data[c + 1u] * b.y + shading_data[c + 2u] * b.z;
}

vec4 interpolate_tangent(uint at, vec3 b) {
    if (TANGENT_AT == 0u) return vec4(1.0, 0.0, 0.0, 1.0);
    uint t = at + TANGENT_AT;
    return shading_data[t] * b.x + shading_data[t + 1u] * b.y + shading_data[t + 2u] * b.z;
}

vec4 texture_or_one(uint use, vec2 uv0, vec2 uv1) {
    return TEXTURES && use != NO_TEXTURE ? sample_texture(use, uv0, uv1) : vec4(1.0);
}

// Where the vertex attributes of a triangle begin: they lie in the order of the scene, not of the tree's leaves.
uint shading_at(BvhTriangle triangle) {
    return floatBitsToUint(triangle.v0.w) * SHADING_STRIDE;
}

// The share of a surface with this alpha that is there: all or nothing with a mask (glTF 2.0, section 3.9.4).
float coverage_of(Material m, float alpha) {
    if (!ALPHA_MASK) return 1.0;
    if ((m.flags & MATERIAL_BLEND) != 0u) return clamp(alpha, 0.0, 1.0);
    return m.alpha_cutoff >= 0.0 && alpha < m.alpha_cutoff ? 0.0 : 1.0;
}

// The share of a triangle that is there at this point.
float coverage_at(uint triangle, vec2 barycentrics) {
    if (!ALPHA_MASK) return 1.0;
    Material m = materials[floatBitsToUint(triangles[triangle].v2.w)];
    if (m.alpha_cutoff < 0.0 && (m.flags & MATERIAL_BLEND) == 0u) return 1.0;
    uint at = shading_at(triangles[triangle]);
    vec3 b = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    float alpha = m.base_alpha * interpolate_color(at, b).a;
    vec4 texel = texture_or_one(m.base_color_texture, interpolate_uv0(at, b), interpolate_uv1(at, b));
    return coverage_of(m, alpha * texel.a);
}

// Names the ray that is traced, in the choices whether it meets what is there in part.
uint coverage_key = 0u;

vec3 coverage_along = vec3(0.0); // direction of the ray
uint coverage_medium = 0u;       // around it, as a path has it

// Whether the ray meets the triangle at this point: by chance, with the share that is there. It leaves a blended body
// as it came in (share_met in lib/medium.glsl).
bool is_covered(uint triangle, vec2 barycentrics) {
    BvhTriangle t = triangles[triangle];
    uint material = floatBitsToUint(t.v2.w);
    const uint BOTH = MATERIAL_VOLUME | MATERIAL_BLEND;
    if (GLASS && (materials[material].flags & BOTH) == BOTH) {
        vec3 normal = triangle_normal(t.v1.xyz - t.v0.xyz, t.v2.xyz - t.v0.xyz);
        if (dot(normal, coverage_along) > 0.0) return coverage_medium == material + 1u;
    }
    float share = coverage_at(triangle, barycentrics);
    return share >= 1.0 || unit_float(hash2(coverage_key, triangle)) < share;
}

// Whether a triangle emits from its back, too.
bool emits_from_back(uint triangle) {
    return (materials[floatBitsToUint(triangles[triangle].v2.w)].flags & MATERIAL_TWO_SIDED) != 0u;
}

// Emitted radiance of a side that emits, at a point of a triangle; the mean over what is there and what is not.
vec3 emission_at(uint triangle, vec2 barycentric) {
    uint m = floatBitsToUint(triangles[triangle].v2.w);
    vec3 emission = materials[m].emissive * coverage_at(triangle, barycentric);
    if (TEXTURES && materials[m].emissive_texture != NO_TEXTURE) {
        uint at = shading_at(triangles[triangle]);
        vec3 b = vec3(1.0 - barycentric.x - barycentric.y, barycentric);
        emission *= sample_texture(materials[m].emissive_texture, interpolate_uv0(at, b), interpolate_uv1(at, b)).rgb;
    }
    return emission;
}

// Texture values of a material; one where there is none.
struct MaterialTexels {
    vec4 base;
    vec4 metallic_roughness;
    vec4 normal;
    vec4 emissive;
    vec4 transmission;
    vec4 specular;
};

// One lookup in a loop over the material's textures instead of six copies of it.
MaterialTexels material_texels(Material m, vec2 uv0, vec2 uv1) {
    MaterialTexels x = MaterialTexels(vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0), vec4(1.0));
    if (!TEXTURES) return x;
    [[dont_unroll]] for (uint k = 0u; k < 6u; ++k) {
        uint use = k == 0u ? m.base_color_texture : k == 1u ? m.metallic_roughness_texture : k == 2u ? m.normal_texture
            : k == 3u ? m.emissive_texture : k == 4u ? m.transmission_texture : m.specular_texture;
        vec4 value = vec4(1.0);
        if (use != NO_TEXTURE) value = sample_texture(use, uv0, uv1);
        x.base = k == 0u ? value : x.base;
        x.metallic_roughness = k == 1u ? value : x.metallic_roughness;
        x.normal = k == 2u ? value : x.normal;
        x.emissive = k == 3u ? value : x.emissive;
        x.transmission = k == 4u ? value : x.transmission;
        x.specular = k == 5u ? value : x.specular;
    }
    return x;
}

void apply_normal_map(inout Surface s, Material m, uint at, vec3 b, vec3 map) {
    // In the frame of the front: from the back the same bumps are seen, with all normals turned round.
    float side = s.front ? 1.0 : -1.0;
    vec3 front = side * s.shading;
    vec4 tangent = interpolate_tangent(at, b);
    vec3 t = unit_or(tangent.xyz - front * dot(front, tangent.xyz), vec3(0.0));
    vec3 bitangent = cross(front, t) * (tangent.w < 0.0 ? -1.0 : 1.0);
    vec3 texel = map * 2.0 - 1.0;
    vec3 n = t * (texel.x * m.normal_scale) + bitangent * (texel.y * m.normal_scale) + front * texel.z;
    s.shading = unit_or(side * n, s.shading);
}

void apply_material(inout Surface s, Material m, vec4 color, MaterialTexels x) {
    vec4 base = vec4(m.base_color, m.base_alpha) * color * x.base;
    base.rgb = clamp(base.rgb, 0.0, 1.0);
    s.opacity = coverage_of(m, base.a);
    s.flags = m.flags;
    if ((m.flags & MATERIAL_UNLIT) != 0u) {
        s.emission = base.rgb;
        return;
    }
    bool emits = s.front || (m.flags & MATERIAL_TWO_SIDED) != 0u;
    s.emission = emits ? m.emissive * x.emissive.rgb : vec3(0.0);
    if (!GLOSSY) {
        s.diffuse = base.rgb * (1.0 - m.metallic);
        return;
    }
    vec4 mr = x.metallic_roughness;
    float metallic = clamp(m.metallic * mr.b, 0.0, 1.0);
    s.alpha = sqr(clamp(m.roughness * mr.g, 0.0, 1.0));
    float specular = m.specular * x.specular.a;
    float transmission = GLASS ? m.transmission * x.transmission.r : 0.0;
    vec3 dielectric = min(sqr((m.ior - 1.0) / (m.ior + 1.0)) * m.specular_color, vec3(1.0)) * specular;
    // Three materials by share: metal, glass, and a base under a coat.
    float coated = (1.0 - metallic) * (1.0 - transmission);
    s.metallic = metallic;
    s.glass = (1.0 - metallic) * transmission;
    s.f0 = dielectric * coated + base.rgb * metallic;
    s.f90 = specular * coated + metallic;
    s.f0_again = dielectric * dielectric * coated + base.rgb * base.rgb * metallic;
    s.coat_f0 = max_component(dielectric);
    s.coat_f90 = specular;
    s.diffuse = base.rgb * coated;
    s.transmission = base.rgb * s.glass;
    s.ior = m.ior;
    s.boundary = m.boundary;
    s.absorption = ABSORPTION ? m.absorption : vec3(0.0);
}

Surface load_surface(Hit hit, vec3 direction, out InterpolatedNormal interpolated) {
    BvhTriangle corners = triangles[hit.triangle];
    vec4 w0 = corners.v0, w1 = corners.v1, w2 = corners.v2;
    vec3 b = vec3(1.0 - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics);
    Surface s;
    s.e1 = w1.xyz - w0.xyz;
    s.e2 = w2.xyz - w0.xyz;
    s.position = triangle_point(w0.xyz, s.e1, s.e2, hit.barycentrics);
    s.material = floatBitsToUint(w2.w);
    vec3 normal = triangle_normal(s.e1, s.e2);
    s.front = dot(normal, direction) < 0.0;
    float side = s.front ? 1.0 : -1.0;
    s.geometric = side * normal;
    uint at = shading_at(corners);
    s.shading = s.geometric;
    interpolated.normal = s.geometric;
    interpolated.dn1 = vec3(0.0);
    interpolated.dn2 = vec3(0.0);
    vec2 uv0 = interpolate_uv0(at, b), uv1 = interpolate_uv1(at, b);
    Material m = materials[s.material];
    MaterialTexels texels_here = material_texels(m, uv0, uv1);
    if (SMOOTH_NORMALS) {
        vec3 n0 = shading_data[at].xyz, n1 = shading_data[at + 1u].xyz, n2 = shading_data[at + 2u].xyz;
        interpolated.normal = side * (b.x * n0 + b.y * n1 + b.z * n2);
        interpolated.dn1 = side * (n1 - n0);
        interpolated.dn2 = side * (n2 - n0);
        s.shading = unit_or(interpolated.normal, s.geometric);
        if (NORMAL_MAPS && m.normal_texture != NO_TEXTURE) apply_normal_map(s, m, at, b, texels_here.normal.xyz);
        // A direction below the shading horizon sees the geometric surface.
        if (dot(s.shading, direction) > -1e-4) s.shading = s.geometric;
    }
    s.diffuse = vec3(0.0);
    s.f0 = vec3(0.0);
    s.f90 = 0.0;
    s.f0_again = vec3(0.0);
    s.metallic = 0.0;
    s.coat_f0 = 0.0;
    s.coat_f90 = 0.0;
    s.alpha = 1.0;
    s.glass = 0.0;
    s.transmission = vec3(0.0);
    s.ior = 1.0;
    s.boundary = 0u;
    s.own_scale = 1.0;
    s.own_below = 1.0;
    s.mean_below = 1.0;
    s.absorption = vec3(0.0);
    apply_material(s, m, interpolate_color(at, b), texels_here);
    if (GLOSSY) look_from(s, -direction);
    return s;
}
