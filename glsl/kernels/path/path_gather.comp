// Adds what caustic photons bring to the listed hits of path tracing.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/scene.glsl"
#include "shared/photon.glsl"
#include "lib/path.glsl"

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Gathered { vec4 gathered[]; }; // per slot: caustic, then other
layout(set = 0, binding = 19, scalar) buffer Radiance { vec4 radiance[]; };

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    uint layer = tag_layer(uint(radiance[slot].w)) == LAYER_DIRECT ? LAYER_CAUSTIC : LAYER_INDIRECT;
    radiance[path_place(slot, layer, camera[0].pixels)].xyz += gathered[2u * slot].xyz;
}
