// Density estimation at the eye hits from the photon BVH (Fabianowski and Dingliana 2009, section 6): every photon
// whose box holds the point is tested.
//
// The lanes of a subgroup are neighbouring pixels: they walk the tree together, into every node that any of them needs,
// so that control flow and loads are uniform. Each lane still adds its photons in the order of the leaves.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/photon.glsl"
#define ESTIMATE_TOGETHER
#include "lib/estimate.glsl"
#include "lib/packed_photon.glsl"
#include "lib/sampling.glsl"
#include "lib/walk.glsl"

// Steps after which a walk is given up and marked UNFINISHED; 0: none.
layout(constant_id = 22) const uint STEP_LIMIT = 0;

layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer PhotonNodes { BvhNode photon_nodes[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 22, scalar) readonly buffer Records { uint records[]; };      // instead of photons, if RECORD
layout(set = 0, binding = 23, scalar) readonly buffer Ranges { RadiusRange ranges[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Gathered { vec4 gathered[]; };

const uint DONE = 0xffffffffu;

uint stack[BVH_MAX_DEPTH + 2u];

bool holds(vec4 low, vec4 high, vec3 p) {
    return all(greaterThanEqual(p, low.xyz)) && all(lessThanEqual(p, high.xyz));
}

Photon load_photon(uint i) {
    if (RECORD == 0u) return photons[i];
    uint at = PACKED_WORDS * i;
    uvec3 position = uvec3(records[at], records[at + 1u], records[at + 2u]);
    return unpack20(position, records[at + 3u], records[at + 4u], ranges[0]);
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    Point x = point_of(eye_hits[slot]);
    Estimate sum = estimate_nothing();
    Walk walk = walk_start(pass[0], j, 0u);
    uint top = 1u, steps = 0u;
    stack[0] = DONE;
    uint current = 0u;
    while (current != DONE) {
        if (STEP_LIMIT != 0u) {
            if (steps > STEP_LIMIT) break;
            ++steps;
        }
        if ((current & BVH_LEAF) == 0u) {
            BvhNode node = photon_nodes[current];
            bool in0 = subgroupAny(holds(node.min0, node.max0, x.s.position));
            bool in1 = subgroupAny(holds(node.min1, node.max1, x.s.position));
            uint child0 = floatBitsToUint(node.min0.w), child1 = floatBitsToUint(node.max0.w);
            if (in0 && in1) stack[top++] = child1;
            current = in0 ? child0 : (in1 ? child1 : stack[--top]);
            continue;
        }
        uint first = current & BVH_FIRST_MASK;
        uint end = first + 1u + ((current & BVH_COUNT_MASK) / BVH_COUNT_ONE);
        if (STEP_LIMIT != 0u) steps += end - first;
        for (uint i = walk_enter(walk, first, end); walk_holds(walk, i, end); i = walk_next(walk, i)) {
            add_photon(sum, load_photon(i), x);
        }
        current = stack[--top];
    }
    vec3 factor = x.factor * walk_scale(walk);
    bool unfinished = STEP_LIMIT != 0u && steps > STEP_LIMIT;
    gathered[2u * slot] = unfinished ? vec4(UNFINISHED) : vec4(sum.caustic * factor, sum.tested);
    gathered[2u * slot + 1u] = unfinished ? vec4(UNFINISHED) : vec4(sum.other * factor, sum.accepted);
}
