// New boxes for a tree whose items have moved: each node with leaves starts with their boxes and climbs, as in
// lbvh_boxes.comp. Of the children of a node the last to arrive goes on with the union; no invocation waits.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"

// False where memory barriers may not stand in divergent code, see lbvh_boxes.comp.
layout(constant_id = 0) const bool FENCES = true;
layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Item { uint items[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Parents { uint parents[]; };
layout(set = 0, binding = 4, scalar) coherent buffer Arrivals { uint arrivals[]; };
layout(set = 0, binding = 5, scalar) coherent buffer Nodes { BvhNode nodes[]; };

// Union of the items of a leaf. Inverted boxes add nothing.
Aabb leaf_box(uint leaf, uint count) {
    Aabb box = aabb_empty();
    uint place = leaf & BVH_FIRST_MASK;
    uint end = min(place + ((leaf & BVH_COUNT_MASK) >> BVH_COUNT_SHIFT) + 1u, count);
    for (; place < end; place++) box = aabb_union(box, boxes[items[place]]);
    return box;
}

void write_box(uint node, uint side, Aabb box) {
    if (side == 1u) {
        nodes[node].min1 = vec4(box.min, 0.0);
        nodes[node].max1 = vec4(box.max, 0.0);
    } else {
        // Whole vectors are cheaper than three words, and the references do not change.
        nodes[node].min0 = vec4(box.min, nodes[node].min0.w);
        nodes[node].max0 = vec4(box.max, nodes[node].max0.w);
    }
}

Aabb both_boxes(uint node) {
    BvhNode n = nodes[node];
    return aabb_union(Aabb(n.min0.xyz, n.max0.xyz), Aabb(n.min1.xyz, n.max1.xyz));
}

void main() {
    uint node = linear_id();
    if (node >= min(counts[LBVH_NODES], params.capacity)) return;
    uint child0 = floatBitsToUint(nodes[node].min0.w);
    uint child1 = floatBitsToUint(nodes[node].max0.w);
    uint arriving = 0u;
    if ((child0 & BVH_LEAF) != 0u) {
        write_box(node, 0u, leaf_box(child0, counts[LBVH_ITEMS]));
        arriving++;
    }
    if ((child1 & BVH_LEAF) != 0u) {
        // A tree that is one leaf has no second child; its reference would be to an item of the first.
        bool absent = child1 == BVH_LEAF && (child0 & (BVH_LEAF | BVH_FIRST_MASK)) == BVH_LEAF;
        write_box(node, 1u, leaf_box(child1, absent ? 0u : counts[LBVH_ITEMS]));
        arriving++;
    }
    if (arriving == 0u) return;
    for (uint level = 0u; level < BVH_MAX_DEPTH; level++) {
        if (FENCES) memoryBarrierBuffer();
        uint before = atomicAdd(arrivals[node], arriving);
        if (before + arriving < 2u || node == 0u) break;
        if (FENCES) memoryBarrierBuffer();
        uint link = parents[node];
        write_box(link >> 1, link & 1u, both_boxes(node));
        node = link >> 1;
        arriving = 1u;
    }
}
