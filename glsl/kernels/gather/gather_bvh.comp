// Density estimation at the eye hits from the photon BVH (Fabianowski and Dingliana 2009, section 6): every photon
// whose box holds the point is tested.
//
// The lanes of a subgroup are neighbouring pixels: they walk the tree together, into every node that any of them needs,
// so that control flow is uniform and each lane loads a part for all. What a photon is worth is another matter: few of
// the photons count at one point, so each lane notes those that cover it, and evaluates them when enough are noted.
// Software drivers run the body of a branch that no lane takes, and that of a loop once more than it is needed: the
// loops test at their end, and the dear part has a loop of its own. Each lane adds its photons in the order of the
// leaves.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/photon.glsl"
#define ESTIMATE_TESTED
#include "lib/estimate.glsl"
#include "lib/packed_photon.glsl"
#include "lib/sampling.glsl"
#include "lib/walk.glsl"

// Steps after which a walk is given up and marked UNFINISHED; 0: none.
layout(constant_id = 22) const uint STEP_LIMIT = 0;

// A BvhNode, seen as what single lanes load of it.
struct BvhNodeRows {
    vec4 row[4];
};

layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer PhotonNodes { BvhNodeRows photon_nodes[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 22, scalar) readonly buffer Records { uint records[]; };      // instead of photons, if RECORD
layout(set = 0, binding = 23, scalar) readonly buffer Ranges { RadiusRange ranges[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Gathered { vec4 gathered[]; };

const uint DONE = 0xffffffffu;
const uint NOTED = 24u; // leaves that a lane notes before it evaluates their photons

uint stack[BVH_MAX_DEPTH + 2u];
uvec2 noted[NOTED]; // first photon of a leaf, and which of its photons cover the point

bool holds(vec4 low, vec4 high, vec3 p) {
    return all(greaterThanEqual(p, low.xyz)) && all(lessThanEqual(p, high.xyz));
}

// A node, each quarter of it loaded by other lanes.
BvhNode load_node(uint i) {
    vec4 own = photon_nodes[i].row[gl_SubgroupInvocationID & 3u];
    return BvhNode(
        subgroupBroadcast(own, 0u), subgroupBroadcast(own, 1u), subgroupBroadcast(own, 2u), subgroupBroadcast(own, 3u)
    );
}

Photon load_photon(uint i) {
    if (RECORD == 0u) return photons[i];
    uint at = PACKED_WORDS * i;
    uvec3 position = uvec3(records[at], records[at + 1u], records[at + 2u]);
    return unpack20(position, records[at + 3u], records[at + 4u], ranges[0]);
}

// Photons that the lanes of a subgroup load together: each lane one of them. Subgroups have at least four lanes.
uint loaded_together() {
    return gl_SubgroupSize >= 8u ? 8u : 4u;
}

// The bit of the k-th photon that was loaded together, if the point is within the cylinder over its ellipse.
uint covers_bit(uint k, vec3 point, vec3 place, vec3 u, vec3 v) {
    vec3 offset = point - subgroupBroadcast(place, k);
    vec2 at = vec2(dot(offset, subgroupBroadcast(u, k)), dot(offset, subgroupBroadcast(v, k)));
    return dot(at, at) < 1.0 ? 1u << k : 0u;
}

// Which of the first loaded_together() of `count` photons may count at the point.
uint covering(uint first, uint count, vec3 point) {
    Photon own = load_photon(first + min(gl_SubgroupInvocationID, count - 1u));
    vec3 place = uintBitsToFloat(own.a.xyz), u = uintBitsToFloat(own.c.xyz), v = uintBitsToFloat(own.d.xyz);
    uint mask = 0u;
    [[unroll]] for (uint k = 0u; k < 4u; ++k) mask |= covers_bit(k, point, place, u, v);
    if (gl_SubgroupSize >= 8u) {
        [[unroll]] for (uint k = 4u; k < 8u; ++k) mask |= covers_bit(k, point, place, u, v);
    }
    return mask & ((1u << count) - 1u);
}

// Which of the photons of a leaf the walk visits.
uint visited(inout Walk walk, uint first, uint end) {
    if (WALK_STRIDE == 1u) return 0xffffffffu;
    uint mask = 0u;
    for (uint i = walk_enter(walk, first, end); walk_holds(walk, i, end); i = walk_next(walk, i)) {
        mask |= 1u << (i - first);
    }
    return mask;
}

// Adds the photons of the leaves that this lane noted.
void evaluate(inout Estimate sum, Point x, uint count) {
    uint at = 0u;
    uvec2 leaf = noted[0];
    do {
        add_photon(sum, load_photon(leaf.x + uint(findLSB(leaf.y))), x);
        leaf.y &= leaf.y - 1u;
        if (leaf.y == 0u && ++at < count) leaf = noted[at];
    } while (leaf.y != 0u);
}

void main() {
    uint j = linear_id();
    bool here = j < count[0];
    uint slot = list[here ? j : 0u];
    Point x = point_of(eye_hits[slot]);
    if (!here) x.s.position = vec3(1e30); // in no box
    Estimate sum = estimate_nothing();
    Walk walk = walk_start(pass[0], j, 0u);
    uint top = 1u, steps = 0u;
    stack[0] = DONE;
    uint current = 0u;
    do {
        uint count = 0u;
        do {
            do {
                ++steps;
                if ((current & BVH_LEAF) != 0u) break;
                BvhNode node = load_node(current);
                bool in0 = subgroupAny(holds(node.min0, node.max0, x.s.position));
                bool in1 = subgroupAny(holds(node.min1, node.max1, x.s.position));
                uint child0 = floatBitsToUint(node.min0.w), child1 = floatBitsToUint(node.max0.w);
                if (in0 && in1) stack[top++] = child1;
                current = in0 ? child0 : (in1 ? child1 : stack[--top]);
            } while ((current & BVH_LEAF) == 0u);
            if (current == DONE) break;
            uint first = current & BVH_FIRST_MASK, of_leaf = 1u + ((current & BVH_COUNT_MASK) >> BVH_COUNT_SHIFT);
            uint mask = 0u, done = 0u;
            do {
                mask |= covering(first + done, of_leaf - done, x.s.position) << done;
                done += loaded_together();
            } while (done < of_leaf);
            uint visits = visited(walk, first, first + of_leaf);
            mask &= visits;
            if (COUNT_PAIRS) sum.tested += float(min(of_leaf, uint(bitCount(visits))));
            if (mask != 0u) noted[count++] = uvec2(first, mask);
            if (STEP_LIMIT != 0u) steps += of_leaf;
            current = stack[--top];
            if (STEP_LIMIT != 0u && steps > STEP_LIMIT) break;
        } while (current != DONE && !subgroupAny(count == NOTED));
        if (count > 0u) evaluate(sum, x, count);
        if (STEP_LIMIT != 0u && steps > STEP_LIMIT) break;
    } while (current != DONE);
    if (!here) return;
    vec3 factor = x.factor * walk_scale(walk);
    bool unfinished = STEP_LIMIT != 0u && steps > STEP_LIMIT;
    gathered[2u * slot] = unfinished ? vec4(UNFINISHED) : vec4(sum.caustic * factor, sum.tested);
    gathered[2u * slot + 1u] = unfinished ? vec4(UNFINISHED) : vec4(sum.other * factor, sum.accepted);
}
