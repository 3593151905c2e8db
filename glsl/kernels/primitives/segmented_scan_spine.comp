// The sum that each workgroup's share continues, in place, from the shares' own sums (at most one tile of them). A
// share with a head starts its sum anew, so the inclusive scan of the shares before it is what it continues. One
// workgroup.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/segmented.glsl"

layout(push_constant, scalar) uniform Params { uint count; } params;
layout(set = 0, binding = 0, scalar) buffer Partial { uint partial[]; };
layout(set = 0, binding = 1, scalar) readonly buffer PartialHead { uint partial_head[]; };

void main() {
    uint rank = workgroup_rank();
    uint base = rank * ITEMS;
    uint value[ITEMS];
    uint own[ITEMS];
    bool head[ITEMS];
    for (uint k = 0u; k < ITEMS; k++) {
        value[k] = base + k < params.count ? partial[base + k] : 0u;
        head[k] = base + k < params.count && partial_head[base + k] != 0u;
        own[k] = value[k];
    }
    Running carry = Running(0u, false);
    segmented_tile(rank, value, head, carry);
    // Inclusive result of share i = what share i + 1 continues.
    for (uint k = 0u; k < ITEMS; k++) {
        if (base + k + 1u < params.count) partial[base + k + 1u] = value[k] + own[k];
    }
    if (rank == 0u) partial[0] = 0u;
}
