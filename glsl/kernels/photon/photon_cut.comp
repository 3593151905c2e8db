// Photons that are still in flight after the last bounce: they are cut, and the ledger of energy says so.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) buffer States { uint states[]; };

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    states[list[j]] |= ENERGY_CUT << PATH_END_SHIFT;
}
