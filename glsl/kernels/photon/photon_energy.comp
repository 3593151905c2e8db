// Where the light of a class of photons is, summed over all of them: what surfaces have taken of each (w of its ray's
// origin), and what it carries, by what became of it. Each workgroup leaves its sums; the host adds them.
//
// Sums are pairs of floats (Knuth's exact addition), added in a fixed order: their error is far below that of the
// photons, so the ledger closes as well as these do.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "shared/photon.glsl"
#include "lib/energy.glsl"

layout(push_constant, scalar) uniform Params { uint count; } params;
layout(set = 0, binding = 16, scalar) readonly buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Flux { vec4 flux[]; };
layout(set = 0, binding = 18, scalar) readonly buffer States { uint states[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Partial { vec2 partial[]; }; // ENERGIES per workgroup

shared vec2 s_sum[256];

vec2 add_exactly(vec2 a, float x) {
    precise float sum = a.x + x;
    precise float part = sum - a.x;
    precise float rest = sum - part;
    precise float lost = (a.x - rest) + (x - part);
    precise float low = a.y + lost;
    return vec2(sum, low);
}

vec2 add_pairs(vec2 a, vec2 b) {
    return add_exactly(add_exactly(a, b.x), b.y);
}

// The sum over the workgroup, valid in invocation 0.
vec2 sum_of_group(vec2 value) {
    uint local = gl_LocalInvocationIndex;
    s_sum[local] = value;
    barrier();
    for (uint width = 128u; width > 0u; width >>= 1) {
        if (local < width) s_sum[local] = add_pairs(s_sum[local], s_sum[local + width]);
        barrier();
    }
    vec2 sum = s_sum[0];
    barrier();
    return sum;
}

void main() {
    uint each = (params.count + gl_NumWorkGroups.x - 1u) / gl_NumWorkGroups.x;
    uint first = gl_WorkGroupID.x * each, end = min(first + each, params.count);
    vec2 sums[ENERGIES];
    for (uint k = 0u; k < ENERGIES; ++k) sums[k] = vec2(0.0);
    for (uint i = first + gl_LocalInvocationIndex; i < end; i += 256u) {
        vec3 carried = flux[i].rgb;
        if (not_finite(carried)) continue; // counted where it is refused
        float energy = energy_of(carried);
        uint became = states[i] >> PATH_END_SHIFT;
        for (uint k = 0u; k < ENERGIES; ++k) sums[k] = add_exactly(sums[k], k == became ? energy : 0.0);
        sums[ENERGY_ABSORBED] = add_exactly(sums[ENERGY_ABSORBED], rays[2u * i].w);
    }
    for (uint k = 0u; k < ENERGIES; ++k) {
        vec2 sum = sum_of_group(sums[k]);
        if (gl_LocalInvocationIndex == 0u) partial[gl_WorkGroupID.x * ENERGIES + k] = sum;
    }
}
