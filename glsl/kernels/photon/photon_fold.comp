// Finds the boundary nearest to each stored photon: rays along the photon's surface, to both ends of both semiaxes,
// meet what stands on it. Of the surfaces that they meet and that turn away from the photon's, the plane whose line is
// nearest in units of the semiaxes becomes the photon's fold.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/photon.glsl"
#include "lib/fold.glsl"

layout(set = 0, binding = 0, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 17, scalar) buffer Photons { Photon photons[]; };
// Surfaces that a mask partly cuts away do not end footprints.
#define TRACE_ACCEPT(triangle, barycentrics) false
#include "lib/traverse.glsl"

// Height of the rays over the surface in longer semiaxes: above its roughness, and below objects that matter at this
// size.
const float LIFT = 0.01;
// A line that touches the unit circle at 45 degrees between two rays is met at this length.
const float RAY_LENGTH = 1.4142;

void main() {
    uint i = linear_id();
    if (i >= count[0]) return;
    Photon p = photons[i];
    vec3 u = uintBitsToFloat(p.c.xyz), v = uintBitsToFloat(p.d.xyz), normal = oct_decode(p.a.w);
    vec3 position = uintBitsToFloat(p.a.xyz);
    vec3 major = u / dot(u, u), minor = v / dot(v, v);
    float lift = LIFT * inversesqrt(inverse_longer2(p));
    vec3 origin = position + normal * lift;
    vec3 nearest = vec3(0.0, 0.0, 1.0);
    [[dont_unroll]] for (uint k = 0u; k < 4u; ++k) {
        vec3 axis = (k < 2u ? major : minor) * ((k & 1u) == 0u ? 1.0 : -1.0);
        Hit hit = trace_closest(origin, axis, RAY_LENGTH);
        if (hit.triangle == BVH_MISS) continue;
        BvhTriangle t = triangles[hit.triangle];
        vec3 e1 = t.v1.xyz - t.v0.xyz, e2 = t.v2.xyz - t.v0.xyz;
        // In units of the longest edge: squares of lengths neither under- nor overflow.
        float unit = 1.0 / max_component(max(abs(e1), abs(e2)));
        vec3 wall = cross(e1 * unit, e2 * unit);
        float size = length(wall);
        if (!(size > 0.0)) continue;
        wall /= dot(wall, axis) > 0.0 ? -size : size;
        if (dot(wall, normal) > SAME_SURFACE) continue;
        vec2 across = vec2(dot(wall, major), dot(wall, minor));
        float steep = length(across);
        float reach = -dot(wall, axis) * hit.t / steep;
        if (steep > 0.0 && reach < nearest.z) nearest = vec3(-across / steep, max(reach, 0.0));
    }
    if (nearest.z < 1.0) photons[i].c.w = fold_encode(nearest.xy, nearest.z);
}
