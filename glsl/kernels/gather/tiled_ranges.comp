// Where the list of each tile begins among the sorted entries, and after the last tile where all end.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Total { uint total[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Begins { uint begins[]; };

void main() {
    uint tile = linear_id();
    if (tile >= begins.length()) return;
    uint low = 0u, high = total[0];
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        if (keys[middle] < tile) low = middle + 1u;
        else high = middle;
    }
    begins[tile] = low;
}
