// Adds up the sorted splats of each pixel of a band and class, in order: singly up to the first whole block, block by
// block, and singly to the end.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/scene.glsl"

layout(constant_id = 20) const uint BLOCK = 512; // as in light_blocks.comp

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Keys { uint keys[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Splats { vec4 splats[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Blocks { vec4 blocks[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Gathered { vec4 gathered[]; }; // of a pixel's first slot

// First sorted splat whose key is not below `key`.
uint first_of(uint key) {
    uint low = 0u, high = count[0];
    while (low < high) {
        uint middle = (low + high) >> 1;
        if (keys[middle] < key) low = middle + 1u;
        else high = middle;
    }
    return low;
}

vec3 sum_of(uint first, uint end) {
    vec3 sum = vec3(0.0);
    for (uint i = first; i < end; ++i) sum += splats[order[i]].xyz;
    return sum;
}

void main() {
    uint id = linear_id(); // pixel of the band and class
    if (id >= 2u * camera[0].pixels) return;
    uint key = 2u * camera[0].first_pixel + id;
    uint first = first_of(key), end = first_of(key + 1u);
    uint first_block = (first + BLOCK - 1u) / BLOCK, end_block = end / BLOCK;
    vec3 sum;
    if (first_block < end_block) {
        sum = sum_of(first, first_block * BLOCK);
        for (uint i = first_block; i < end_block; ++i) sum += blocks[i].xyz;
        sum += sum_of(end_block * BLOCK, end);
    } else {
        sum = sum_of(first, end);
    }
    gathered[id] = vec4(sum, 0.0);
}
