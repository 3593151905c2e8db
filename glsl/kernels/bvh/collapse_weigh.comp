// Which nodes the finished tree has, and how many items are in leaves that are their children. A node that nobody
// arrived at twice does not exist.
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
layout(set = 0, binding = 3, scalar) readonly buffer Inside { uint inside[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Kept { uint kept[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Held { uint held[]; };

uint items_in_leaf(uint child) {
    if ((child & BVH_LEAF) != 0u) return 1u;
    return subtrees[child].fused != 0u ? subtrees[child].items : 0u;
}

void main() {
    uint i = linear_id();
    if (i >= params.capacity) return;
    bool is_kept = arrivals[i] >= 2u && inside[i] == 0u;
    if (is_kept) is_kept = subtrees[i].fused == 0u;
    held[i] = 0u;
    if (is_kept) {
        uint child0 = floatBitsToUint(nodes[i].min0.w);
        uint child1 = floatBitsToUint(nodes[i].max0.w);
        held[i] = items_in_leaf(child0) + items_in_leaf(child1);
    }
    kept[i] = uint(is_kept);
}
