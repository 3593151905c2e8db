// Packed photons in the order of a tree's leaves, or of cells.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Records { uint records[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Sorted { uint sorted[]; };

void main() {
    uint k = linear_id();
    if (k >= count[0]) return;
    uint from = PACKED_WORDS * order[k], to = PACKED_WORDS * k;
    for (uint i = 0u; i < PACKED_WORDS; ++i) sorted[to + i] = records[from + i];
}
