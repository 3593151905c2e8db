// Each node's link to its parent, and no arrivals yet.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Parents { uint parents[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Arrivals { uint arrivals[]; };

void main() {
    uint i = linear_id();
    if (i >= min(counts[LBVH_NODES], params.capacity)) return;
    arrivals[i] = 0u;
    uint child0 = floatBitsToUint(nodes[i].min0.w);
    uint child1 = floatBitsToUint(nodes[i].max0.w);
    if ((child0 & BVH_LEAF) == 0u) parents[child0] = lbvh_link(i, 0u);
    if ((child1 & BVH_LEAF) == 0u) parents[child1] = lbvh_link(i, 1u);
}
