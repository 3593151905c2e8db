// Photons in the order of the tree's leaves, so that a gather reads them in a row.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Sorted { Photon sorted[]; };

void main() {
    uint k = linear_id();
    if (k < count[0]) sorted[k] = photons[order[k]];
}
