// Depths of the listed eye hits, by pixel of the band.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "shared/scene.glsl"
#include "lib/bounds.glsl"

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Depths { float depths[]; };

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    vec3 offset = uintBitsToFloat(eye_hits[slot].a.xyz) - camera[0].position;
    depths[slot] = depth_of_hit(dot(offset, normalize(camera[0].forward)));
}
