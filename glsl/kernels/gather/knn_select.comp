// One step of a selection by digits, for the hits whose walk was given up: among the candidates whose order key
// (squared distance, then deposit index) starts with the digits chosen so far, how many have each value of the next
// digit of four bits. One dispatch a range of photons, because some drivers cut long loops; the first of a step chooses
// the digit before.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/knn.glsl"
#include "lib/knn_digits.glsl"

layout(push_constant, scalar) uniform Params {
    uint first; // photon of this dispatch
    uint most;  // photons of this dispatch
    uint digit; // of the key, from 0
} params;

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer PhotonCount { uint photon_count[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 21, scalar) buffer Keys { KnnKey keys[]; };

uint tally[32];

void main() {
    uint j = linear_id();
    uint stored = min(photon_count[0], photons.length());
    if (j >= count[0] || (params.first > 0u && params.first >= stored)) return;
    Point x = point_of(eye_hits[list[j]]);
    KnnKey caustic = keys[2u * j], other = keys[2u * j + 1u];
    if (params.first == 0u) {
        caustic = params.digit == 0u ? knn_any_key() : knn_choose(caustic, params.digit - 1u);
        other = params.digit == 0u ? knn_any_key() : knn_choose(other, params.digit - 1u);
        keys[2u * j] = caustic;
        keys[2u * j + 1u] = other;
    }
    [[dont_unroll]] for (uint k = 0u; k < 16u; ++k) {
        tally[k] = caustic.tally[k];
        tally[16u + k] = other.tally[k];
    }
    uint end = min(stored, params.first + params.most);
    [[dont_unroll]] for (uint i = params.first; i < end; ++i) {
        Photon p = photons[i];
        if (!is_candidate(p, x)) continue;
        uint high = floatBitsToUint(distance2(x.s.position - uintBitsToFloat(p.a.xyz)));
        bool first_heap = is_caustic(p);
        uvec2 chosen = first_heap ? uvec2(caustic.high, caustic.low) : uvec2(other.high, other.low);
        if (knn_starts_with(uvec2(high, i), chosen, params.digit)) {
            ++tally[(first_heap ? 0u : 16u) + knn_digit(uvec2(high, i), params.digit)];
        }
    }
    [[dont_unroll]] for (uint k = 0u; k < 16u; ++k) {
        keys[2u * j].tally[k] = tally[k];
        keys[2u * j + 1u].tally[k] = tally[16u + k];
    }
}
