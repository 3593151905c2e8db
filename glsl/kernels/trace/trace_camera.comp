// Closest hits of the eye paths in a list. What comes straight from the camera looks through the backs of surfaces with
// one side.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/photon.glsl"
#include "lib/intersect.glsl"

layout(set = 0, binding = 0, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 19, scalar) readonly buffer States { uint states[]; };
layout(set = 0, binding = 20, scalar) writeonly buffer Hits { uvec4 hits[]; };

vec3 seen_along; // direction of the ray; zero if it sees backs

bool shows_front(uint index) {
    BvhTriangle t = triangles[index];
    return dot(triangle_normal(t.v1.xyz - t.v0.xyz, t.v2.xyz - t.v0.xyz), seen_along) <= 0.0;
}

#define TRACE_FLAGS BVH_ONE_SIDED
#define TRACE_ACCEPT(triangle, barycentrics) shows_front(triangle)
#include "lib/traverse.glsl"

void main() {
    uint i = linear_id();
    if (i >= count[0]) return;
    uint slot = list[i];
    vec3 direction = rays[2u * slot + 1u].xyz;
    seen_along = (states[slot] & (PATH_SPECULAR | PATH_DIFFUSE)) == 0u ? direction : vec3(0.0);
    Hit hit = trace_path(rays[2u * slot].xyz, direction, rays[2u * slot].w);
    hits[slot] = pack_hit(hit);
}
