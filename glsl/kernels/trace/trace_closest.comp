#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Closest hits of a buffer of rays.
#include "lib/linear_id.glsl"
#include "shared/bvh.glsl"
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Params { uint count; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Hits { RayHit hits[]; };
#include "lib/traverse.glsl"

void main() {
    uint id = linear_id();
    if (id >= params.count) return;
    Ray ray = rays[id];
    Hit hit = trace_closest(ray.origin.xyz, ray.direction.xyz, ray.origin.w);
    hits[id] = RayHit(hit.t, hit.barycentrics.x, hit.barycentrics.y, hit.triangle);
}
