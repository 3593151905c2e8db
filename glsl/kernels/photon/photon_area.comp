// Areas of the photons' footprints: the reciprocal of the density that a photon stores.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Areas { float areas[]; };

void main() {
    uint k = linear_id();
    if (k < min(count[0], uint(photons.length()))) areas[k] = 1.0 / abs(uintBitsToFloat(photons[k].d.w));
}
