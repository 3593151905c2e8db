// Radius of the disc of each photon's area, as bits that compare like the floats: for the range of packed records.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/packed_photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Radii { uint radii[]; };

void main() {
    uint i = linear_id();
    if (i < min(count[0], photons.length())) radii[i] = floatBitsToUint(disc_radius(photons[i]));
}
