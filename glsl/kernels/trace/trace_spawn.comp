#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Origins of rays that leave hits along given directions.
#include "lib/linear_id.glsl"
#include "shared/bvh.glsl"
layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Params { uint count; } params;
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Hits { RayHit hits[]; };
layout(set = 0, binding = 3, scalar) buffer Rays { Ray rays[]; };
#include "lib/intersect.glsl"

void main() {
    uint id = linear_id();
    if (id >= params.count) return;
    RayHit hit = hits[id];
    if (hit.triangle == BVH_MISS) {
        rays[id].origin = vec4(0.0);
        return;
    }
    BvhTriangle at = triangles[hit.triangle];
    vec3 origin =
        offset_ray_origin(at.v0.xyz, at.v1.xyz, at.v2.xyz, vec2(hit.b1, hit.b2), rays[id].direction.xyz);
    rays[id].origin.xyz = origin;
}
