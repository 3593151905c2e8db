// Sum since the last head, and whether there is a head, of each workgroup's share.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/segmented.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Heads { uint heads[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Partial { uint partial[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer PartialHead { uint partial_head[]; };

void main() {
    uint n = min(count[0], params.capacity);
    Share share = share_of(gl_WorkGroupID.x, gl_NumWorkGroups.x, n, TILE);
    uint rank = workgroup_rank();
    Running carry = Running(0u, false);
    for (uint tile = share.first; tile < share.end; tile++) {
        uint base = tile * TILE + rank * ITEMS;
        uint value[ITEMS];
        bool head[ITEMS];
        for (uint k = 0u; k < ITEMS; k++) {
            value[k] = base + k < n ? source[base + k] : 0u;
            head[k] = base + k < n && heads[base + k] != 0u;
        }
        segmented_tile(rank, value, head, carry);
    }
    if (gl_LocalInvocationIndex == 0u) {
        partial[gl_WorkGroupID.x] = carry.sum;
        partial_head[gl_WorkGroupID.x] = uint(carry.head);
    }
}
