// Sum of each workgroup's share; with NONZERO the number of its items that are not zero.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/scan.glsl"

layout(constant_id = 0) const bool NONZERO = false;
layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Partial { uint partial[]; };

void main() {
    uint n = min(count[0], params.capacity);
    Share share = share_of(gl_WorkGroupID.x, gl_NumWorkGroups.x, n, TILE);
    uint sum = 0u;
    for (uint tile = share.first; tile < share.end; tile++) {
        uint base = tile * TILE + gl_LocalInvocationID.x;
        for (uint k = 0u; k < ITEMS; k++) {
            uint i = base + k * 256u;
            uint value = i < n ? source[i] : 0u;
            sum += NONZERO ? uint(value != 0u) : value;
        }
    }
    uint total;
    workgroup_exclusive_add(sum, total);
    if (gl_LocalInvocationIndex == 0u) partial[gl_WorkGroupID.x] = total;
}
