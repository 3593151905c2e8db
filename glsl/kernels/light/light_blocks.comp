// Sums of whole blocks of the sorted splats, whatever their keys, so that the loops of light_sum are short.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"

layout(constant_id = 20) const uint BLOCK = 512; // splats

layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Splats { vec4 splats[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Blocks { vec4 blocks[]; };

void main() {
    uint block = linear_id();
    uint end = (block + 1u) * BLOCK;
    if (end > count[0]) return; // light_sum reads whole blocks only
    vec3 sum = vec3(0.0);
    for (uint i = end - BLOCK; i < end; ++i) sum += splats[order[i]].xyz;
    blocks[block] = vec4(sum, 0.0);
}
