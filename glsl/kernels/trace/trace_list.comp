// Closest hits of the rays in a list of slots (eye paths or photons).
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"

layout(constant_id = 20) const bool PHOTONS = false;

layout(set = 0, binding = 0, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Hits { uvec4 hits[]; };
#include "lib/traverse.glsl"

void main() {
    uint i = linear_id();
    if (i >= count[0]) return;
    uint slot = list[i];
    vec4 origin = rays[2u * slot], direction = rays[2u * slot + 1u];
    // Where the ray of a path in a body begins, if it is negative; photons keep it with their direction.
    Hit hit = trace_path(origin.xyz, direction.xyz, PHOTONS ? direction.w : origin.w);
    hits[slot] = pack_hit(hit);
}
