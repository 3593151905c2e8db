// Rays by environment maps beside the truth, by the tree: how often each map says what, and what all of them say
// together (Yao et al. 2010, figure 7).
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/maps.glsl"
#include "lib/maps.glsl"

layout(push_constant, scalar) uniform Params { uint count; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 17, scalar) writeonly buffer Hits { RayHit hits[]; };
layout(set = 0, binding = 18, scalar) buffer Counts { uint counts[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Centres { vec4 centres[]; };
layout(set = 0, binding = 22, scalar) readonly buffer Texels { MapTexel texels[]; };
#include "lib/traverse.glsl"
#include "lib/map_search.glsl"

// Part of the distance to which a point is the hit, if it is not on the same triangle.
const float SAME = 0.05;

uint judged(MapPoint p, Hit truth) {
    if (p.texel.triangle == BVH_MISS) return MAP_NONE;
    if (!map_accepts(p)) return MAP_BESIDE;
    if (p.texel.triangle == truth.triangle) return MAP_RIGHT;
    if (truth.triangle == BVH_MISS) return MAP_EARLY;
    if (abs(p.t - truth.t) <= SAME * truth.t) return MAP_RIGHT;
    return p.t > truth.t ? MAP_LATER : MAP_EARLY;
}

void main() {
    uint i = linear_id();
    if (i >= params.count) return;
    vec3 origin = rays[i].origin.xyz, d = rays[i].direction.xyz;
    Hit truth = trace_closest(origin, d, uintBitsToFloat(0x7f800000u));
    MapPoint best = MAP_NO_POINT;
    [[dont_unroll]] for (uint k = 0u; k < MAP_COUNT * MAP_LAYERS; ++k) {
        MapPoint p = map_find(k % MAP_COUNT, k / MAP_COUNT, origin, d);
        atomicAdd(counts[judged(p, truth)], 1u);
        if (map_accepts(p) && (best.texel.triangle == BVH_MISS || p.t < best.t)) best = p;
    }
    bool found = best.texel.triangle != BVH_MISS, there = truth.triangle != BVH_MISS;
    uint all = there ? MAPS_LOST : MAPS_ESCAPED;
    if (found) all = there ? (judged(best, truth) == MAP_RIGHT ? MAPS_RIGHT : MAPS_WRONG) : MAPS_PHANTOM;
    atomicAdd(counts[all], 1u);
    Hit hit = found ? map_hit(best) : Hit(uintBitsToFloat(0x7f800000u), vec2(0.0), BVH_MISS);
    hits[i] = RayHit(hit.t, hit.barycentrics.x, hit.barycentrics.y, hit.triangle);
}
