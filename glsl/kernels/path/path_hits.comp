// Which of the listed paths are at a surface that gathers, in this step of path tracing.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Radiance { vec4 radiance[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer HitFlags { uint hit_flags[]; };

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    hit_flags[j] = radiance[list[j]].w != 0.0 ? 1u : 0u;
}
