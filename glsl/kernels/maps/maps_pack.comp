// From the picture of a map to its texels, face after face, with their distances.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/maps.glsl"
#include "lib/maps.glsl"

layout(push_constant, scalar) uniform Params {
    uint centre;
    uint first; // texel of this map
} params;
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Centres { vec4 centres[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Drawn { vec4 drawn[]; };
layout(set = 0, binding = 18, scalar) buffer Texels { MapTexel texels[]; };

void main() {
    uint i = linear_id();
    if (i >= map_texels()) return;
    uint x = i % MAP_RESOLUTION, row = i / MAP_RESOLUTION;
    uint face = row / MAP_RESOLUTION, y = row % MAP_RESOLUTION;
    vec4 seen = drawn[(y * MAP_FACES + face) * MAP_RESOLUTION + x];
    MapTexel texel = MapTexel(uintBitsToFloat(0x7f800000u), BVH_MISS, 0.0, 0.0);
    if (seen.x >= 1.0) {
        texel.triangle = (uint(seen.x) - 1u) | uint(seen.y) << MAP_LOW_BITS;
        texel.b1 = seen.z;
        texel.b2 = seen.w;
        vec3 place = map_place(triangles[texel.triangle], texel.b1, texel.b2);
        texel.distance = distance(place, centres[params.centre].xyz);
    }
    texels[params.first + i] = texel;
}
