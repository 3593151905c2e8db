// What each node adds to the surface-area cost of a tree (Goldsmith and Salmon 1987; MacDonald and Booth 1990): the
// areas of its children's boxes, times the triangles of a leaf or the cost of a visit, over the area of the root's box.
// The sum is the expected number of triangle tests of a ray that meets the root's box; the root adds its own visit.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"
#include "lib/tree_area.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Costs { float costs[]; };

float child_cost(uint child, Aabb box, float unit) {
    uint items = ((child & BVH_COUNT_MASK) >> BVH_COUNT_SHIFT) + 1u;
    float weight = (child & BVH_LEAF) != 0u ? float(items) : BVH_NODE_COST;
    precise float cost = weight * tree_area(box, unit);
    return cost;
}

void main() {
    uint i = linear_id();
    if (i >= params.capacity) return;
    BvhNode root = nodes[0];
    Aabb all = aabb_union(Aabb(root.min0.xyz, root.max0.xyz), Aabb(root.min1.xyz, root.max1.xyz));
    float unit = tree_unit(all);
    precise float cost = 0.0;
    if (i < counts[LBVH_NODES] && counts[LBVH_ITEMS] > 0u) {
        BvhNode node = nodes[i];
        float cost0 = child_cost(floatBitsToUint(node.min0.w), Aabb(node.min0.xyz, node.max0.xyz), unit);
        float cost1 = child_cost(floatBitsToUint(node.max0.w), Aabb(node.min1.xyz, node.max1.xyz), unit);
        cost = (cost0 + cost1) / tree_area(all, unit);
        if (i == 0u) cost += BVH_NODE_COST;
    }
    costs[i] = cost;
}
