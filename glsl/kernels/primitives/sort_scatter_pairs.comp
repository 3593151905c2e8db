// Moves each key with its value to its place in the order of one digit; the scanned table says where each worker
// starts.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 16) in;
#include "lib/radix.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; uint shift; uint mask; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Table { uint table[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer SortedKeys { uint sorted_keys[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Values { uint values[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer SortedValues { uint sorted_values[]; };

void main() {
    uint n = min(count[0], params.capacity);
    uint workers = gl_NumWorkGroups.x * RADIX_WORKERS;
    uint worker = gl_WorkGroupID.x * RADIX_WORKERS + gl_LocalInvocationIndex;
    Share share = share_of(worker, workers, n, 1u);
    for (uint d = 0u; d < RADIX_DIGITS; d++) s_digit[counter(d)] = table[d * workers + worker];
    for (uint i = share.first; i < share.end; i++) {
        uint key = keys[i];
        uint slot = counter(digit_of(key, params.shift, params.mask));
        uint place = s_digit[slot];
        s_digit[slot] = place + 1u;
        sorted_keys[place] = key;
        sorted_values[place] = values[i];
    }
}
