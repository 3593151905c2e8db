// Indices of the items whose flag is not zero, in order: the scan's last step, writing where it would have counted.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/scan.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Flags { uint flags[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Partial { uint partial[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Survivors { uint survivors[]; };

void main() {
    uint n = min(count[0], params.capacity);
    Share share = share_of(gl_WorkGroupID.x, gl_NumWorkGroups.x, n, TILE);
    uint rank = workgroup_rank();
    uint carry = partial[gl_WorkGroupID.x];
    for (uint tile = share.first; tile < share.end; tile++) {
        uint first = min(tile * TILE + rank * ITEMS, n);
        uint end = first + min(ITEMS, n - first);
        uint kept = 0u;
        for (uint i = first; i < end; i++) kept += uint(flags[i] != 0u);
        uint all;
        uint place = carry + workgroup_exclusive_add(kept, all);
        for (uint i = first; i < end; i++) {
            if (flags[i] != 0u) survivors[place++] = i;
        }
        carry += all;
    }
}
