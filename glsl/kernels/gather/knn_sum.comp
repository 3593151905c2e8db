// Sum over the k nearest photons of each class, after selection by digits (knn_select.comp): all candidates before the
// key that was found, one dispatch a range of photons.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/knn.glsl"
#include "lib/knn_digits.glsl"

layout(push_constant, scalar) uniform Params {
    uint first; // photon of this dispatch; with 0 the sums start from nothing
    uint most;  // photons of this dispatch
} params;

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer PhotonCount { uint photon_count[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Keys { KnnKey keys[]; };
layout(set = 0, binding = 22, scalar) buffer Gathered { vec4 gathered[]; };

void main() {
    uint j = linear_id();
    uint stored = min(photon_count[0], photons.length());
    if (j >= count[0] || (params.first > 0u && params.first >= stored)) return;
    uint slot = list[j];
    Point x = point_of(eye_hits[slot]);
    KnnKey caustic = knn_choose(keys[2u * j], KNN_DIGITS - 1u), other = knn_choose(keys[2u * j + 1u], KNN_DIGITS - 1u);
    Estimate sum = estimate_nothing();
    uint end = min(stored, params.first + params.most);
    [[dont_unroll]] for (uint i = params.first; i < end; ++i) {
        Photon p = photons[i];
        if (COUNT_PAIRS) sum.tested += 1.0;
        if (!is_candidate(p, x)) continue;
        uint high = floatBitsToUint(distance2(x.s.position - uintBitsToFloat(p.a.xyz)));
        uvec2 end_key = is_caustic(p) ? uvec2(caustic.high, caustic.low) : uvec2(other.high, other.low);
        bool all = end_key.x == KNN_ALL;
        bool before = high < end_key.x || (high == end_key.x && i < end_key.y);
        if (all || before) add_neighbour(sum, p, x, all ? -1.0 : uintBitsToFloat(end_key.x));
    }
    vec4 light = vec4(sum.caustic * x.factor, sum.tested), rest = vec4(sum.other * x.factor, sum.accepted);
    if (params.first > 0u) {
        light += gathered[2u * slot];
        rest += gathered[2u * slot + 1u];
    }
    gathered[2u * slot] = light;
    gathered[2u * slot + 1u] = rest;
}
