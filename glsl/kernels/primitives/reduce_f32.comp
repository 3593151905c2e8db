// Sum of each workgroup's share.
// The order of combination is fixed by count and grid alone: strided sums of 256 invocations, then a binary tree.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/chunk.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Source { float source[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Partial { float partial[]; };

layout(constant_id = 8) const uint ITEMS = 8;
const uint TILE = 256u * ITEMS;
shared float s_value[256];

float identity() { return 0.0; }
float combine(float a, float b) {
    precise float sum = a + b;
    return sum;
}

void main() {
    uint n = min(count[0], params.capacity);
    Share share = share_of(gl_WorkGroupID.x, gl_NumWorkGroups.x, n, TILE);
    uint local = gl_LocalInvocationIndex;
    float value = identity();
    for (uint tile = share.first; tile < share.end; tile++) {
        for (uint k = 0u; k < TILE; k += 256u) {
            uint i = tile * TILE + k + local;
            if (i < n) value = combine(value, source[i]);
        }
    }
    s_value[local] = value;
    barrier();
    for (uint width = 128u; width > 0u; width >>= 1) {
        if (local < width) s_value[local] = combine(s_value[local], s_value[local + width]);
        barrier();
    }
    if (local == 0u) partial[gl_WorkGroupID.x] = s_value[0];
}
