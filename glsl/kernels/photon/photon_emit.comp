// Photons leave the lights, chosen by power. Global photons fill all directions; caustic photons are aimed at the
// casters' spheres (Yao et al. 2010, section 5), which changes their density but not their expected flux.
//
// Differentials start at the spacing of the samples: a density of n photons per solid angle gives dd of length
// 1 / sqrt(density), which for an isotropic point light is eq. 9 of Fabianowski and Dingliana 2009, D = 2 sqrt(pi / n).
// Extensions: parallel light has dp from the density per area and dd = 0; area lights have both, dp from the density
// over the light and dd from the density of directions, so that the footprint is right near to and far from the light.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "lib/scene_bindings.glsl"
#include "shared/photon.glsl"

layout(constant_id = 20) const bool CAUSTIC = false;

layout(push_constant, scalar) uniform Params {
    uint count;
} params;

layout(set = 0, binding = 16, scalar) writeonly buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 17, scalar) writeonly buffer Flux { vec4 flux[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer States { uint states[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Differentials { Differential differentials[]; };
layout(set = 0, binding = 20, scalar) writeonly buffer List { uint list[]; };
#include "lib/textures.glsl"
#include "lib/bsdf.glsl"
#include "lib/intersect.glsl"
#include "lib/surface.glsl"
#include "lib/environment.glsl"
#include "lib/lights.glsl"

uint choose_caster(inout float u) {
    uint low = 0u, high = globals[0].caster_count - 1u;
    while (low < high) {
        uint middle = (low + high) >> 1;
        if (casters[middle].cumulative > u) high = middle;
        else low = middle + 1u;
    }
    float before = low == 0u ? 0.0 : casters[low - 1u].cumulative;
    u = clamp((u - before) / max(casters[low].cumulative - before, 1e-12), 0.0, 0.99999994);
    return low;
}

// 1 - cos of the half angle of a caster seen from p; 2 from inside of it.
float cone_of(Caster c, vec3 p, out vec3 axis) {
    vec3 offset = c.center - p;
    float d2 = dot(offset, offset), r2 = c.radius * c.radius;
    axis = d2 > 0.0 ? offset * inversesqrt(d2) : vec3(0.0, 0.0, 1.0);
    if (d2 <= r2) return 2.0;
    float s2 = r2 / d2;
    return s2 / (1.0 + sqrt(1.0 - s2)); // without cancellation for small angles
}

// Whether a direction is inside of the cone. By the sine: the cosine of a small angle has no digits left.
bool in_cone(Caster c, vec3 p, vec3 d) {
    vec3 offset = c.center - p;
    float d2 = dot(offset, offset), r2 = c.radius * c.radius;
    vec3 side = cross(offset, d);
    return d2 <= r2 || (dot(offset, d) > 0.0 && dot(side, side) <= r2);
}

// A direction from p towards the casters and its density per solid angle.
vec3 aim(vec3 p, float choice, vec2 u, out float pdf) {
    uint chosen = choose_caster(choice);
    vec3 axis;
    float open = cone_of(casters[chosen], p, axis);
    vec3 d = from_basis(axis, uniform_cone(u, open));
    pdf = 0.0;
    for (uint i = 0u; i < globals[0].caster_count; ++i) {
        open = cone_of(casters[i], p, axis);
        bool inside = i == chosen || in_cone(casters[i], p, d);
        pdf += inside ? casters[i].probability / (2.0 * PI * open) : 0.0;
    }
    return d;
}

vec2 disc(vec2 u) {
    float r = sqrt(u.x), phi = 2.0 * PI * u.y;
    return vec2(r * cos(phi), r * sin(phi));
}

// A point outside of the scene from which light along d reaches the scene or the casters, and its density per area.
vec3 start_outside(vec3 d, float choice, vec2 u, out float pdf) {
    Globals g = globals[0];
    vec3 center = g.center;
    float radius = g.radius;
    uint chosen = 0u;
    if (CAUSTIC) {
        chosen = choose_caster(choice);
        center = casters[chosen].center;
        radius = casters[chosen].radius;
    }
    vec3 p = center + from_basis(d, vec3(radius * disc(u), 0.0));
    pdf = 1.0 / (PI * radius * radius);
    if (CAUSTIC) {
        pdf = 0.0;
        for (uint i = 0u; i < g.caster_count; ++i) {
            vec3 offset = p - casters[i].center;
            float r2 = casters[i].radius * casters[i].radius;
            vec3 away = cross(offset, d); // a difference of squares would cancel for small casters
            pdf += i == chosen || dot(away, away) <= r2 ? casters[i].probability / (PI * r2) : 0.0;
        }
    }
    return p - d * (dot(p - g.center, d) + 1.5 * g.radius);
}

void main() {
    uint i = linear_id();
    if (i >= params.count) return;
    uint key = hash2(hash2(pass[0].seed, pass[0].index), CAUSTIC ? 0x9d2c5681u : 0x2545f491u);
    float choice = sequence1(i, key, 0u);
    Light l = lights[choose_light(choice)];
    vec2 u = sequence2(i, key, 1u);
    vec2 w = sequence2(i, key, 2u);
    float caster_choice = sequence1(i, key, 3u);
    float n = float(params.count) * l.probability;
    vec3 origin = l.position, d = vec3(0.0, 0.0, 1.0), power = vec3(0.0);
    float dp = 0.0, dd = 0.0, pdf = 1.0; // pdf: per solid angle and area, as the light needs
    if (l.kind == LIGHT_POINT || l.kind == LIGHT_SPOT) {
        bool spot = l.kind == LIGHT_SPOT;
        if (CAUSTIC) {
            d = aim(origin, caster_choice, u, pdf);
        } else {
            float open = spot ? 1.0 - l.cos_outer : 2.0;
            d = from_basis(spot ? l.direction : vec3(0.0, 0.0, 1.0), uniform_cone(u, open));
            pdf = 1.0 / (2.0 * PI * open);
        }
        float cosine = dot(d, l.direction);
        power = l.emission * (spot ? (cosine > l.cos_outer ? spot_falloff(l, cosine) : 0.0) : 1.0);
        dd = inversesqrt(n * pdf);
    } else if (l.kind == LIGHT_DIRECTIONAL) {
        d = l.direction;
        origin = start_outside(d, caster_choice, u, pdf);
        power = l.emission;
        dp = inversesqrt(n * pdf);
    } else if (ENVIRONMENT && l.kind == LIGHT_ENVIRONMENT) {
        float pdf_direction;
        vec3 radiance = sample_environment(w, d, pdf_direction);
        d = -d;
        origin = start_outside(d, caster_choice, u, pdf);
        dp = inversesqrt(n * pdf);
        power = radiance;
        pdf *= pdf_direction;
    } else if (AREA_LIGHTS) {
        BvhTriangle corners = triangles[l.triangle];
        vec2 b = uniform_triangle(w);
        vec3 e1 = corners.v1.xyz - corners.v0.xyz, e2 = corners.v2.xyz - corners.v0.xyz;
        vec3 normal = triangle_normal(e1, e2);
        origin = triangle_point(corners.v0.xyz, e1, e2, b);
        if (CAUSTIC) {
            d = aim(origin, caster_choice, u, pdf);
        } else {
            d = from_basis(normal, cosine_hemisphere(u));
            pdf = max(dot(d, normal), 1e-4) / PI;
        }
        origin = offset_point(origin, e1, e2, d);
        power = emission_at(l.triangle, b) * max(0.0, dot(d, normal));
        dd = inversesqrt(n * pdf);
        pdf /= l.area;
        dp = sqrt(l.area / n);
    }
    vec3 t, s;
    basis(d, t, s);
    rays[2u * i] = vec4(origin, 0.0);
    rays[2u * i + 1u] = vec4(d, 1.0); // w: path density
    // w: the spacing D of an isotropic light with this share of the photons, the unit of raw differentials.
    flux[i] = vec4(pdf > 0.0 ? power / (n * pdf) : vec3(0.0), sqrt(4.0 * PI / n));
    states[i] = 0u;
    differentials[i] = Differential(dp * t, dp * s, dd * t, dd * s);
    list[i] = i;
}
