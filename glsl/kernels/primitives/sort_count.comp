// How often each digit occurs in each worker's range: table[digit][worker].
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 16) in;
#include "lib/radix.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; uint shift; uint mask; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Table { uint table[]; };

void main() {
    uint n = min(count[0], params.capacity);
    uint workers = gl_NumWorkGroups.x * RADIX_WORKERS;
    uint worker = gl_WorkGroupID.x * RADIX_WORKERS + gl_LocalInvocationIndex;
    Share share = share_of(worker, workers, n, 1u);
    for (uint d = 0u; d < RADIX_DIGITS; d++) s_digit[counter(d)] = 0u;
    for (uint i = share.first; i < share.end; i++) s_digit[counter(digit_of(keys[i], params.shift, params.mask))]++;
    for (uint d = 0u; d < RADIX_DIGITS; d++) table[d * workers + worker] = s_digit[counter(d)];
}
