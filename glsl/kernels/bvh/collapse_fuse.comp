// Which subtrees are cheaper as a leaf, by the surface-area heuristic, from the items up: every item climbs, and of the
// children of a node the last to arrive goes on, as in lbvh_boxes.comp.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"
#include "lib/collapse.glsl"
#include "lib/tree_area.glsl"

// False where memory barriers may not stand in divergent code, see lbvh_boxes.comp.
layout(constant_id = 0) const bool FENCES = true;
layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Scene { Aabb scene[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Links { uint links[]; };
layout(set = 0, binding = 4, scalar) coherent buffer Arrivals { uint arrivals[]; };
layout(set = 0, binding = 5, scalar) coherent buffer Subtrees { Subtree subtrees[]; };

// What is known of a child: an item costs one test.
Subtree child_of(uint child, float area) {
    if ((child & BVH_LEAF) != 0u) return Subtree(1u, area, 0u);
    return subtrees[child];
}

void main() {
    uint k = linear_id();
    uint n = counts[LBVH_ITEMS];
    if (n < 2u || k >= n) return;
    float unit = tree_unit(scene[0]);
    uint link = links[k];
    for (uint level = 0u; level < BVH_MAX_DEPTH; level++) {
        uint at = link >> 1;
        if (FENCES) memoryBarrierBuffer();
        uint before = atomicAdd(arrivals[at], 1u);
        if (before == 0u) break;
        if (FENCES) memoryBarrierBuffer();
        BvhNode node = nodes[at];
        Aabb box0 = Aabb(node.min0.xyz, node.max0.xyz);
        Aabb box1 = Aabb(node.min1.xyz, node.max1.xyz);
        Subtree a = child_of(floatBitsToUint(node.min0.w), tree_area(box0, unit));
        Subtree b = child_of(floatBitsToUint(node.max0.w), tree_area(box1, unit));
        float area = tree_area(aabb_union(box0, box1), unit);
        uint items = a.items + b.items;
        precise float apart = BVH_NODE_COST * area + (a.cost + b.cost);
        precise float together = float(items) * area;
        // The root is a node in any case.
        bool fused = at != 0u && items <= COLLAPSE_LEAF && together <= apart;
        subtrees[at] = Subtree(items, fused ? together : apart, uint(fused));
        if (at == 0u) break;
        link = links[params.capacity + at];
    }
}
