// The finished tree: kept nodes without gaps, in the order of the nodes that there were; the items of leaves in the
// order of their nodes.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"
#include "lib/collapse.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer KeptCount { uint kept_count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Item { uint items[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Subtrees { Subtree subtrees[]; };
layout(set = 0, binding = 5, scalar) readonly buffer Kept { uint kept[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Places { uint places[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Firsts { uint firsts[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Finished { BvhNode finished[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer FinishedItems { uint finished_items[]; };
layout(set = 0, binding = 10, scalar) buffer Counts { uint counts[]; };

// Reference to a child in the finished tree; writes the items of a leaf from `first` on, depth first.
uint finished_child(uint child, inout uint first) {
    bool inner = (child & BVH_LEAF) == 0u;
    if (inner && subtrees[child].fused == 0u) return places[child];
    uint start = first;
    uint open[COLLAPSE_LEAF];
    open[0] = child;
    uint top = 1u;
    do {
        uint next = open[--top];
        if ((next & BVH_LEAF) != 0u) {
            finished_items[first++] = items[next & BVH_FIRST_MASK];
        } else {
            open[top++] = floatBitsToUint(nodes[next].max0.w);
            open[top++] = floatBitsToUint(nodes[next].min0.w);
        }
    } while (top > 0u);
    return BVH_LEAF | (first - start - 1u) * BVH_COUNT_ONE | start;
}

// The root of a tree of no or one item, which has no inner node of its own.
void small_tree(uint n) {
    Aabb box = aabb_empty();
    if (n == 1u) {
        box = boxes[items[0]];
        finished_items[0] = items[0];
    }
    Aabb none = aabb_empty();
    finished[0].min0 = vec4(box.min, uintBitsToFloat(BVH_LEAF));
    finished[0].max0 = vec4(box.max, uintBitsToFloat(BVH_LEAF));
    finished[0].min1 = vec4(none.min, 0.0);
    finished[0].max1 = vec4(none.max, 0.0);
}

void main() {
    uint i = linear_id();
    if (i >= params.capacity) return;
    uint n = counts[LBVH_ITEMS];
    if (i == 0u) {
        counts[LBVH_NODES] = max(kept_count[0], 1u);
        if (n < 2u) small_tree(n);
    }
    if (kept[i] == 0u) return;
    BvhNode node = nodes[i];
    uint first = firsts[i];
    node.min0.w = uintBitsToFloat(finished_child(floatBitsToUint(node.min0.w), first));
    node.max0.w = uintBitsToFloat(finished_child(floatBitsToUint(node.max0.w), first));
    finished[places[i]] = node;
}
