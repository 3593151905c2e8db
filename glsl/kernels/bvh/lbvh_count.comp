// How many boxes are in the tree: valid codes come first, so the one invocation at the boundary knows.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "lib/morton.glsl"
#include "lib/lbvh.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Codes { uint codes[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Counts { uint counts[]; };
// Inner nodes before fusing, at least the root.
layout(set = 0, binding = 3, scalar) writeonly buffer Inner { uint inner[]; };

void publish(uint valid, uint all) {
    uint nodes = max(valid, 2u) - 1u;
    counts[LBVH_ITEMS] = valid;
    counts[LBVH_DEGENERATE] = all - valid;
    counts[LBVH_NODES] = nodes;
    inner[0] = nodes;
}

void main() {
    uint i = linear_id();
    uint n = min(count[0], params.capacity);
    if (i == 0u && (n == 0u || codes[0] == MORTON_NONE)) publish(0u, n);
    if (i >= n) return;
    bool last = i + 1u == n || codes[i + 1u] == MORTON_NONE;
    if (codes[i] != MORTON_NONE && last) publish(i + 1u, n);
}
