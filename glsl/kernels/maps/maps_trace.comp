// Hits of the photons of a list by environment maps: of what all maps say the nearest one that is on the ray (Yao et
// al. 2010, section 5.2). A photon that no map places has left the scene or is lost, which nobody knows: it counts as
// escaped if at least half of the maps show nothing along its ray.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/maps.glsl"
#include "shared/photon.glsl"
#include "lib/maps.glsl"

layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Rays { vec4 rays[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Hits { uvec4 hits[]; };
layout(set = 0, binding = 20, scalar) buffer States { uint states[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Centres { vec4 centres[]; };
layout(set = 0, binding = 22, scalar) readonly buffer Texels { MapTexel texels[]; };
#include "lib/hit.glsl"
#include "lib/map_search.glsl"

void main() {
    uint i = linear_id();
    if (i >= count[0]) return;
    uint slot = list[i];
    vec3 origin = rays[2u * slot].xyz, d = rays[2u * slot + 1u].xyz;
    MapPoint best = MAP_NO_POINT;
    uint nothing = 0u;
    [[dont_unroll]] for (uint k = 0u; k < MAP_COUNT * MAP_LAYERS; ++k) {
        MapPoint p = map_find(k % MAP_COUNT, k / MAP_COUNT, origin, d);
        nothing += p.texel.triangle == BVH_MISS ? 1u : 0u;
        if (map_accepts(p) && (best.texel.triangle == BVH_MISS || p.t < best.t)) best = p;
    }
    if (best.texel.triangle == BVH_MISS) {
        hits[slot] = pack_hit(Hit(uintBitsToFloat(0x7f800000u), vec2(0.0), BVH_MISS));
        bool escaped = 2u * nothing >= MAP_COUNT * MAP_LAYERS;
        if (!escaped) states[slot] |= ENERGY_LOST << PATH_END_SHIFT;
        return;
    }
    hits[slot] = pack_hit(map_hit(best));
}
