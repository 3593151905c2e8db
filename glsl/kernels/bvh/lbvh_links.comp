// Children of every inner node, and every child's link to its parent (Karras 2012, "Maximizing parallelism in the
// construction of BVHs, octrees, and k-d trees", section 4). Node i starts or ends at item i; node 0 is the root.
//
// A child with at most LEAF_ITEMS items becomes a leaf as a whole. The nodes inside of it are made all the same,
// because its box grows through them; `kept` says which nodes the finished tree needs.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"

layout(constant_id = 0) const uint LEAF_ITEMS = 1;
layout(constant_id = 1) const bool END_FLAGS = false;
layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Codes { uint codes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 3, scalar) buffer Item { uint items[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Nodes { BvhNode nodes[]; };
// Links of the items, then of the inner nodes.
layout(set = 0, binding = 5, scalar) writeonly buffer Links { uint links[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Arrivals { uint arrivals[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Kept { uint kept[]; };

#include "lib/karras.glsl"

// Reference to the items first to last as a child, and the child's link to its parent. Inside of a leaf no references
// are followed, and no item but the leaf's last may be marked.
uint make_child(uint first, uint last, uint node, uint parent, uint side, bool inside) {
    links[first == last ? first : params.capacity + node] = lbvh_link(parent, side);
    uint count = last - first + 1u;
    if (count > LEAF_ITEMS) return node;
    if (END_FLAGS) {
        if (!inside) items[last] |= LBVH_END;
        return BVH_LEAF | first;
    }
    return BVH_LEAF | (count - 1u) * BVH_COUNT_ONE | first;
}

void write_node(uint i, Aabb a, uint child0, Aabb b, uint child1) {
    nodes[i].min0 = vec4(a.min, uintBitsToFloat(child0));
    nodes[i].max0 = vec4(a.max, uintBitsToFloat(child1));
    nodes[i].min1 = vec4(b.min, 0.0);
    nodes[i].max1 = vec4(b.max, 0.0);
}

// The root of a tree of no or one item, which has no inner node of its own.
void small_tree(uint n) {
    Aabb box = aabb_empty();
    if (n == 1u) box = boxes[items[0]];
    write_node(0u, box, BVH_LEAF, aabb_empty(), BVH_LEAF);
    kept[0] = 1u;
    if (n == 1u && END_FLAGS) items[0] |= LBVH_END;
}

void main() {
    uint n = counts[LBVH_ITEMS];
    uint i = linear_id();
    if (n < 2u && i == 0u) small_tree(n);
    if (n < 2u || i >= n - 1u) return;
    int direction;
    int end = other_end(int(i), int(n), direction);
    int first = min(int(i), end);
    int last = max(int(i), end);
    int split = split_of(first, last, int(n));
    bool inside = i != 0u && uint(last - first) < LEAF_ITEMS;
    uint child0 = make_child(uint(first), uint(split), uint(split), i, 0u, inside);
    uint child1 = make_child(uint(split) + 1u, uint(last), uint(split) + 1u, i, 1u, inside);
    write_node(i, aabb_empty(), child0, aabb_empty(), child1);
    arrivals[i] = 0u;
    kept[i] = uint(!inside);
}
