// Union of the valid boxes of each workgroup's share; invalid and empty ones are passed over.
// The order of combination is fixed by count and grid alone: strided sums of 256 invocations, then a binary tree.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/chunk.glsl"
#include "shared/aabb.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Source { Aabb source[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Partial { Aabb partial[]; };

layout(constant_id = 8) const uint ITEMS = 8;
const uint TILE = 256u * ITEMS;
shared Aabb s_value[256];

Aabb identity() { return aabb_empty(); }
Aabb combine(Aabb a, Aabb b) {
    if (aabb_valid(b)) a = Aabb(min(a.min, b.min), max(a.max, b.max));
    return a;
}

void main() {
    uint n = min(count[0], params.capacity);
    Share share = share_of(gl_WorkGroupID.x, gl_NumWorkGroups.x, n, TILE);
    uint local = gl_LocalInvocationIndex;
    Aabb value = identity();
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
