// Flags of the listed eye hits that an estimator gave up because its loops would have become longer than the driver
// runs.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Gathered { vec4 gathered[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Flags { uint flags[]; };

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    flags[j] = gathered[2u * list[j]].w == UNFINISHED ? 1u : 0u;
}
