// Marks the nodes inside of leaves. A leaf has at most four items, hence nodes at two levels below its own.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"
#include "lib/collapse.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Arrivals { uint arrivals[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Subtrees { Subtree subtrees[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Inside { uint inside[]; };

void mark(uint child) {
    if ((child & BVH_LEAF) != 0u) return;
    inside[child] = 1u;
    uint child0 = floatBitsToUint(nodes[child].min0.w);
    uint child1 = floatBitsToUint(nodes[child].max0.w);
    if ((child0 & BVH_LEAF) == 0u) inside[child0] = 1u;
    if ((child1 & BVH_LEAF) == 0u) inside[child1] = 1u;
}

void main() {
    uint i = linear_id();
    if (i >= params.capacity || arrivals[i] < 2u || subtrees[i].fused == 0u) return;
    mark(floatBitsToUint(nodes[i].min0.w));
    mark(floatBitsToUint(nodes[i].max0.w));
}
