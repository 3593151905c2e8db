// The layers of path tracing as the film takes them: caustic and other light per slot, as a gather leaves them.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "lib/path.glsl"

layout(push_constant, scalar) uniform Params {
    uint pixels;
} params;

layout(set = 0, binding = 16, scalar) readonly buffer Radiance { vec4 radiance[]; };
layout(set = 0, binding = 17, scalar) writeonly buffer Gathered { vec4 gathered[]; };

void main() {
    uint slot = linear_id();
    if (slot >= params.pixels) return;
    gathered[2u * slot] = vec4(radiance[path_place(slot, LAYER_CAUSTIC, params.pixels)].xyz, 0.0);
    gathered[2u * slot + 1u] = vec4(radiance[path_place(slot, LAYER_INDIRECT, params.pixels)].xyz, 0.0);
}
