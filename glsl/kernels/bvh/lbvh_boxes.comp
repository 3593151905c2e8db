// Boxes from the items up: every item climbs, and at each node the first of the two children to arrive ends, the second
// goes on with the union. No invocation waits. What the first has written is visible to the second: barriers stand
// between the writing and the atomic addition, and between the addition and the reading.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"

// Lavapipe of Mesa 22.3.6 takes a memory barrier for a control barrier, and a control barrier that some invocations do
// not reach ends the others' loops. Its atomics are sequentially consistent by themselves, so there the barriers are
// left out.
layout(constant_id = 0) const bool FENCES = true;
layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Item { uint items[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Links { uint links[]; };
layout(set = 0, binding = 4, scalar) coherent buffer Arrivals { uint arrivals[]; };
layout(set = 0, binding = 5, scalar) coherent buffer Nodes { BvhNode nodes[]; };

void main() {
    uint k = linear_id();
    uint n = counts[LBVH_ITEMS];
    if (n < 2u || k >= n) return;
    Aabb box = boxes[items[k] & ~LBVH_END];
    uint link = links[k];
    for (uint level = 0u; level < BVH_MAX_DEPTH; level++) {
        uint node = link >> 1;
        bool second = (link & 1u) != 0u;
        if (second) {
            nodes[node].min1 = vec4(box.min, 0.0);
            nodes[node].max1 = vec4(box.max, 0.0);
        } else {
            // Whole vectors are cheaper than three words, and the references do not change any more.
            nodes[node].min0 = vec4(box.min, nodes[node].min0.w);
            nodes[node].max0 = vec4(box.max, nodes[node].max0.w);
        }
        if (FENCES) memoryBarrierBuffer();
        uint before = atomicAdd(arrivals[node], 1u);
        if (before == 0u || node == 0u) break;
        if (FENCES) memoryBarrierBuffer();
        if (second) {
            box = aabb_union(box, Aabb(nodes[node].min0.xyz, nodes[node].max0.xyz));
        } else {
            box = aabb_union(box, Aabb(nodes[node].min1.xyz, nodes[node].max1.xyz));
        }
        link = links[params.capacity + node];
    }
}
