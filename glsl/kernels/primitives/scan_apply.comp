// Exclusive scan of each workgroup's share, starting from the sum of all shares before it.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/scan.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Partial { uint partial[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Target { uint target[]; };

void main() {
    uint n = min(count[0], params.capacity);
    Share share = share_of(gl_WorkGroupID.x, gl_NumWorkGroups.x, n, TILE);
    uint rank = workgroup_rank();
    uint carry = partial[gl_WorkGroupID.x];
    for (uint tile = share.first; tile < share.end; tile++) {
        uint first = min(tile * TILE + rank * ITEMS, n);
        uint end = first + min(ITEMS, n - first);
        uint sum = 0u;
        for (uint i = first; i < end; i++) sum += source[i];
        uint all;
        uint running = carry + workgroup_exclusive_add(sum, all);
        for (uint i = first; i < end; i++) {
            target[i] = running;
            running += source[i];
        }
        carry += all;
    }
}
