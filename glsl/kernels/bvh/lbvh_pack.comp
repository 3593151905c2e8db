// Moves the nodes that fusing has left to the front, in order, and redirects the references.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Inner { uint inner[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Kept { uint kept[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Places { uint places[]; };
layout(set = 0, binding = 3, scalar) readonly buffer KeptCount { uint kept_count[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Packed { BvhNode packed[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Counts { uint counts[]; };

float redirect(float bits) {
    uint child = floatBitsToUint(bits);
    return (child & BVH_LEAF) != 0u ? bits : uintBitsToFloat(places[child]);
}

void main() {
    uint i = linear_id();
    if (i >= min(inner[0], params.capacity)) return;
    if (i == 0u) counts[LBVH_NODES] = kept_count[0];
    if (kept[i] == 0u) return;
    BvhNode node = nodes[i];
    node.min0.w = redirect(node.min0.w);
    node.max0.w = redirect(node.max0.w);
    packed[places[i]] = node;
}
