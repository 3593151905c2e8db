// Photons leave the lights, chosen by power. Global photons fill all directions; caustic photons are aimed at the
// casters' spheres (Yao et al. 2010, section 5), which changes their density but not their expected flux.
//
// Differentials start at the spacing of the samples: a density of n photons per solid angle gives dd of length
// 1 / sqrt(density), which for an isotropic point light is eq. 9 of Fabianowski and Dingliana 2009, D = 2 sqrt(pi / n).
// Light from infinity may start where a guide says that it is useful (src/render/scene/guide.rs), which changes the
// density of photons and not their expected flux either.
//
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
#include "lib/guide.glsl"
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

vec3 outside(vec3 p, vec3 d) {
    return p - d * (dot(p - globals[0].center, d) + 1.5 * globals[0].radius);
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
    return outside(p, d);
}

// A photon at its start.
struct Start {
    vec3 origin;
    vec3 direction;
    vec3 power;   // radiance, intensity or irradiance, with the cosine at an area light
    float pdf;    // of origin and direction, per solid angle and area, as the light needs
    float dp;     // length of the differentials of position
    float dd;     // and of direction
};

// Random numbers of a photon.
struct Numbers {
    float caster;   // choice among the casters, or of the side of a light that has two
    vec2 direction; // or place outside of the scene
    vec2 place;     // on the light, or direction of the environment
};

// Point and spot lights; `n` is the number of photons that the light shares out.
Start start_at_point(Light l, Numbers u, float n) {
    Start p = Start(l.position, vec3(0.0, 0.0, 1.0), vec3(0.0), 1.0, 0.0, 0.0);
    bool spot = l.kind == LIGHT_SPOT;
    if (CAUSTIC) {
        p.direction = aim(p.origin, u.caster, u.direction, p.pdf);
    } else {
        float open = spot ? 1.0 - l.cos_outer : 2.0;
        p.direction = from_basis(spot ? l.direction : vec3(0.0, 0.0, 1.0), uniform_cone(u.direction, open));
        p.pdf = 1.0 / (2.0 * PI * open);
    }
    float cosine = dot(p.direction, l.direction);
    p.power = l.emission * (spot ? (cosine > l.cos_outer ? spot_falloff(l, cosine) : 0.0) : 1.0);
    p.dd = inversesqrt(n * p.pdf);
    return p;
}

// Whether photons of a light start by the guide. Caustic photons are aimed at casters instead.
bool is_guided(Light l) {
    return GUIDED && !CAUSTIC && guide_has(l);
}

// Whether no guide leads a photon.
bool is_plain(Numbers u) {
    return u.caster < GUIDE_PLAIN;
}

// The numbers for a direction of the environment: as they are for a plain start, within a cell of the guide for others.
// Also the cell, and how many times more likely the guide chooses it than by power alone.
vec2 guided_place(Numbers u, out uint cell, out float preference) {
    vec2 place = is_plain(u) ? u.place : guide_place(guide_all_cells(), u.place);
    uvec2 at = guide_cell(place);
    cell = at.y * GUIDE_SIDE + at.x;
    preference = guide_preference(guide_all_cells(), at);
    return place;
}

// A start for light along d by a column of the guide, whose cell is preferred so much; the density per area of a start
// with this direction, relative to the directions' own density.
vec3 guided_start(vec3 d, uint column, float preference, Numbers u, out float pdf) {
    uint chosen;
    if (is_plain(u)) chosen = guide_choose_halo(u.caster / GUIDE_PLAIN);
    else chosen = guide_choose(column, (u.caster - GUIDE_PLAIN) / (1.0 - GUIDE_PLAIN));
    vec4 target = guide_sphere(chosen);
    vec3 p = target.xyz + from_basis(d, vec3(target.w * disc(u.direction), 0.0));
    pdf = (1.0 - GUIDE_PLAIN) * preference * guide_density(column, p, d, chosen);
    pdf += GUIDE_PLAIN * guide_density_plain(p, d, chosen);
    return outside(p, d);
}

// Directional lights.
Start start_parallel(Light l, Numbers u, float n) {
    Start p = Start(l.position, l.direction, l.emission, 1.0, 0.0, 0.0);
    if (is_guided(l)) p.origin = guided_start(p.direction, l.guide - 1u, 1.0, u, p.pdf);
    else p.origin = start_outside(p.direction, u.caster, u.direction, p.pdf);
    p.dp = inversesqrt(n * p.pdf);
    return p;
}

Start start_in_environment(Light l, Numbers u, float n) {
    Start p = Start(vec3(0.0), vec3(0.0), vec3(0.0), 1.0, 0.0, 0.0);
    float pdf_direction, cell_preference = 1.0;
    uint cell = 0u;
    bool guided = is_guided(l);
    if (guided) u.place = guided_place(u, cell, cell_preference);
    p.power = sample_environment(u.place, p.direction, pdf_direction);
    p.direction = -p.direction;
    if (guided) p.origin = guided_start(p.direction, l.guide - 1u + cell, cell_preference, u, p.pdf);
    else p.origin = start_outside(p.direction, u.caster, u.direction, p.pdf);
    p.dp = inversesqrt(n * p.pdf);
    p.pdf *= pdf_direction;
    return p;
}

// Emissive triangles.
Start start_on_triangle(Light l, Numbers u, float n) {
    Start p = Start(vec3(0.0), vec3(0.0), vec3(0.0), 1.0, 0.0, 0.0);
    BvhTriangle corners = triangles[l.triangle];
    vec2 b = lamp_point(corners, u.place);
    vec3 e1 = corners.v1.xyz - corners.v0.xyz, e2 = corners.v2.xyz - corners.v0.xyz;
    vec3 normal = triangle_normal(e1, e2);
    bool both = emits_from_back(l.triangle);
    p.origin = triangle_point(corners.v0.xyz, e1, e2, b);
    if (CAUSTIC) {
        p.direction = aim(p.origin, u.caster, u.direction, p.pdf);
    } else {
        vec3 side = both && u.caster < 0.5 ? -normal : normal;
        p.direction = from_basis(side, cosine_hemisphere(u.direction));
        p.pdf = max(dot(p.direction, side), 1e-4) / (both ? 2.0 * PI : PI);
    }
    p.origin = offset_point(p.origin, e1, e2, p.direction);
    float cosine = dot(p.direction, normal);
    p.power = emission_at(l.triangle, b) * (both ? abs(cosine) : max(0.0, cosine));
    p.dd = inversesqrt(n * p.pdf);
    p.pdf /= l.area;
    p.dp = sqrt(l.area / n);
    return p;
}

Start start_of(Light l, Numbers u, float n) {
    Start p = Start(l.position, vec3(0.0, 0.0, 1.0), vec3(0.0), 1.0, 0.0, 0.0);
    if (l.kind == LIGHT_POINT || l.kind == LIGHT_SPOT) {
        p = start_at_point(l, u, n);
    } else if (l.kind == LIGHT_DIRECTIONAL) {
        p = start_parallel(l, u, n);
    } else if (ENVIRONMENT && l.kind == LIGHT_ENVIRONMENT) {
        p = start_in_environment(l, u, n);
    } else if (AREA_LIGHTS) {
        p = start_on_triangle(l, u, n);
    }
    return p;
}

void main() {
    uint i = linear_id();
    if (i >= params.count) return;
    uint photons = CAUSTIC ? SALT_CAUSTIC_PHOTONS : SALT_GLOBAL_PHOTONS;
    uint key = hash2(hash2(pass[0].seed, pass[0].index), photons);
    float choice = sequence1(i, key, 0u);
    Light l = lights[choose_light(choice)];
    vec2 u = sequence2(i, key, 1u), w = sequence2(i, key, 2u);
    float n = float(params.count) * l.probability;
    Start p = start_of(l, Numbers(sequence1(i, key, 3u), u, w), n);
    vec3 t, s;
    basis(p.direction, t, s);
    rays[2u * i] = vec4(p.origin, 0.0); // w: absorbed of it so far
    rays[2u * i + 1u] = vec4(p.direction, 1.0); // w: path density
    // w: the spacing D of an isotropic light with this share of the photons, the unit of raw differentials.
    flux[i] = vec4(p.pdf > 0.0 ? p.power / (n * p.pdf) : vec3(0.0), sqrt(4.0 * PI / n));
    bool far = l.kind == LIGHT_DIRECTIONAL || l.kind == LIGHT_ENVIRONMENT;
    states[i] = ABSORPTION && !far ? MEDIUM_UNKNOWN : 0u;
    differentials[i] = Differential(p.dp * t, p.dp * s, p.dd * t, p.dd * s);
    list[i] = i;
}
