// Direct light at the eye hits: LIGHT_SAMPLES lights chosen by power, a shadow ray for each. Glass casts full shadows
// here; the light that it lets through arrives as caustic photons.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "lib/scene_bindings.glsl"
#include "shared/photon.glsl"
#include "lib/pixels.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) buffer Radiance { vec4 radiance[]; };
layout(set = 0, binding = 20, scalar) readonly buffer States { uint states[]; };
#include "lib/textures.glsl"
#include "lib/bsdf.glsl"
#include "lib/intersect.glsl"
#include "lib/surface.glsl"
#include "lib/medium.glsl"
#include "lib/environment.glsl"
#include "lib/guide.glsl"
#include "lib/lights.glsl"
#include "lib/eye_hit.glsl"
#include "lib/scatter.glsl"
#include "lib/path.glsl"
bool shadow_stops = false; // rays stop at holes
#define SHADOW_MEETS(triangle, barycentrics) is_covered(triangle, barycentrics)
#define TRACE_ACCEPT(triangle, barycentrics) (shadow_stops || SHADOW_MEETS(triangle, barycentrics))
#include "lib/traverse.glsl"
#include "lib/shadow.glsl"

layout(constant_id = 21) const uint LIGHT_SAMPLES = 1;
layout(constant_id = 23) const uint CANDIDATES = 1; // of which each sample is chosen
layout(constant_id = 22) const bool PATH = false; // path tracing: lights with an extent are found by both strategies
layout(constant_id = 24) const bool TOLD = false; // photons bring what reaches a surface by mirrors and glass alone

// A hit to light.
struct Lit {
    EyeHit hit;
    Surface s;
    vec3 to_eye;
    vec3 through;
    uint depth;  // of the path
    bool again;  // the path was scattered widely before
    uint medium; // around it there
    uint region; // of the guide
};

// A sample of a light, and the light that it brings if nothing stands between.
struct Candidate {
    vec3 light;
    LightSample from;
};

Candidate candidate(Lit at, uint key, uint index) {
    Surface s = at.s;
    float choice = sequence1(index, key, 1u);
    uint light = choose_light(choice);
    LightSample l = sample_light(light, s.position, at.region, sequence2(index, key, 2u));
    float cosine = dot(s.shading, l.to_light);
    // Positive comparisons: a light at the very point has no direction.
    if (!(cosine > 0.0 && dot(s.geometric, l.to_light) > 0.0 && max_component(l.weight) > 0.0)) {
        return Candidate(vec3(0.0), l);
    }
    vec3 f = uintBitsToFloat(at.hit.b.xyz);
    if (GLOSSY && !is_lambert(s)) {
        f = at.through * gathered_bsdf(s, at.to_eye, l.to_light);
        if (l.delta && !(TOLD && at.again)) f += at.through * followed_bsdf(s, at.to_eye, l.to_light);
    }
    if (PATH && !l.delta) {
        f *= balance(l.density, gathered_density(s, at.to_eye, l.to_light, at.depth >= ROULETTE_DEPTH));
    }
    return Candidate(f * l.weight * cosine, l);
}

// One of CANDIDATES candidates, drawn by the light that it brings and made up for that: lamps that are bright elsewhere
// do not take the samples of those that are bright here (Talbot, Cline and Egbert 2005, resampled importance sampling).
Candidate best_candidate(Lit at, uint key, uint index) {
    if (CANDIDATES == 1u) return candidate(at, key, index);
    Candidate kept = candidate(at, key, index * CANDIDATES);
    float own = luminance(kept.light), sum = own;
    uint seed = hash2(key ^ SALT_RESAMPLING, index);
    [[dont_unroll]] for (uint i = 1u; i < CANDIDATES; ++i) {
        Candidate other = candidate(at, key, index * CANDIDATES + i);
        float weight = luminance(other.light);
        sum += weight;
        if (weight > 0.0 && unit_float(hash2(seed, i)) * sum < weight) {
            kept = other;
            own = weight;
        }
    }
    kept.light *= own > 0.0 ? sum / float(CANDIDATES) / own : 0.0;
    return kept;
}

// Light that one sample brings.
vec3 sample_direct(Lit at, uint key, uint k) {
    uint index = pass[0].index * LIGHT_SAMPLES + k;
    Candidate c = best_candidate(at, key, index);
    if (c.light == vec3(0.0)) return c.light;
    BvhTriangle corners = triangles[at.hit.d.w & ~EYE_HIT_BENT];
    vec3 e1 = corners.v1.xyz - corners.v0.xyz, e2 = corners.v2.xyz - corners.v0.xyz;
    vec3 origin = offset_point(at.s.position, e1, e2, c.from.to_light);
    if (ALPHA_MASK) coverage_key = hash2(key ^ SALT_COVERAGE, index);
    return light_between(origin, c.from.target, at.medium, c.from.far) * c.light;
}

void main() {
    uint j = linear_id();
    if (j >= count[0] || globals[0].light_count == 0u) return;
    uint slot = list[j];
    uint depth = 0u, place = slot;
    if (PATH) {
        uint tag = uint(radiance[slot].w);
        if (tag == 0u) return;
        depth = tag_depth(tag);
        place = path_place(slot, tag_layer(tag), camera[0].pixels);
    }
    Lit at;
    at.hit = eye_hits[slot];
    at.s = surface_of(at.hit, at.to_eye, at.through);
    at.depth = depth;
    at.again = TOLD && (states[slot] & PATH_DIFFUSE) != 0u;
    at.medium = ABSORPTION || (ALPHA_MASK && GLASS) ? states[slot] & PATH_MEDIUM_MASK : 0u;
    at.region = sample_region(at.s.position);
    uint key = hash2(pass[0].seed, slot_key(slot, camera[0]) ^ SALT_DIRECT_LIGHT);
    if (PATH) key = hash2(key, depth);
    vec3 sum = vec3(0.0);
    [[dont_unroll]] for (uint k = 0u; k < LIGHT_SAMPLES; ++k) {
        sum += sample_direct(at, key, k);
    }
    radiance[place].xyz += sum / float(LIGHT_SAMPLES);
}
