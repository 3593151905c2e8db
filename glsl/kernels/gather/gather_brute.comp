// Density estimation with every photon of a range at every listed eye hit: what all other estimators are compared with,
// and what finishes the hits that they gave up (UNFINISHED). One dispatch a range, because some drivers cut long loops.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#define ESTIMATE_TOGETHER
#include "lib/estimate.glsl"
#include "lib/sampling.glsl"
#include "lib/walk.glsl"

layout(push_constant, scalar) uniform Params {
    uint first; // photon of this dispatch; with 0 the sums start from nothing
    uint most;  // photons of this dispatch
} params;

layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer PhotonCount { uint photon_count[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 21, scalar) buffer Gathered { vec4 gathered[]; };

void main() {
    uint j = linear_id();
    uint stored = min(photon_count[0], photons.length());
    if (j >= count[0] || (params.first > 0u && params.first >= stored)) return;
    uint slot = list[j];
    Point x = point_of(eye_hits[slot]);
    Estimate sum = estimate_nothing();
    uint end = min(stored, params.first + params.most);
    // Each range is walked for itself: steps have no memory, so nothing needs to be carried over.
    Walk walk = walk_start(pass[0], j, params.first);
    for (uint i = walk_enter(walk, params.first, end); walk_holds(walk, i, end); i = walk_next(walk, i)) {
        add_photon(sum, photons[i], x);
    }
    vec3 factor = x.factor * walk_scale(walk);
    vec4 caustic = vec4(sum.caustic * factor, sum.tested), other = vec4(sum.other * factor, sum.accepted);
    if (params.first > 0u) {
        caustic += gathered[2u * slot];
        other += gathered[2u * slot + 1u];
    }
    gathered[2u * slot] = caustic;
    gathered[2u * slot + 1u] = other;
}
