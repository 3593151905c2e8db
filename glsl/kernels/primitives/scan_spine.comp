// Exclusive scan, in place, of the workgroups' sums (at most 1024), and their total. One workgroup.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 64) in;
#include "lib/subgroup.glsl"

const uint ITEMS = 16u;

layout(push_constant, scalar) uniform Params { uint count; } params;
layout(set = 0, binding = 0, scalar) buffer Partial { uint partial[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Total { uint total[]; };

void main() {
    uint base = workgroup_rank() * ITEMS;
    uint value[ITEMS];
    uint sum = 0u;
    for (uint k = 0u; k < ITEMS; k++) {
        value[k] = base + k < params.count ? partial[base + k] : 0u;
        sum += value[k];
    }
    uint all;
    uint running = workgroup_exclusive_add(sum, all);
    for (uint k = 0u; k < ITEMS; k++) {
        if (base + k < params.count) partial[base + k] = running;
        running += value[k];
    }
    if (gl_LocalInvocationIndex == 0u) total[0] = all;
}
