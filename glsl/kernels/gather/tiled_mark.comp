// Marks the pixels of the band whose first slot is listed.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Seen { uint seen[]; };

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    if (slot < seen.length()) seen[slot] = 1u;
}
