// Largest distance, along any axis, from a photon's centre to the sides of its footprint's box, as the bits of a float.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/hash.glsl"
#include "lib/packed_photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Extents { uint extents[]; };

void main() {
    uint i = linear_id();
    if (i >= min(count[0], extents.length())) return;
    Aabb box = boxes[i];
    vec3 centre = uintBitsToFloat(photons[i].a.xyz);
    precise vec3 above = box.max - centre, below = centre - box.min;
    // More than the differences can have lost by rounding.
    precise float extent = max(max_component(above), max_component(below)) * 1.000001;
    // A place packed in 12 bytes moves by up to 0.001 of the level's radius.
    if (RECORD == 12u) extent *= 1.004;
    extents[i] = aabb_valid(box) && extent >= 0.0 && extent <= FLT_MAX ? floatBitsToUint(extent) : 0u;
}
