// The surface that each texel of the candidates' maps stands for, and which other candidates see its place: all that
// the choice of centres needs (Yao et al. 2010, section 4). A candidate sees a place if it is no farther than the
// plane of the triangle that its own map shows there; the paper's shadow test compares with the distance of the
// texel's middle, which is another one on surfaces at an angle.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/maps.glsl"
#include "lib/maps.glsl"
#include "lib/intersect.glsl"

layout(push_constant, scalar) uniform Params { uint candidates; } params;
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Centres { vec4 centres[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Texels { MapTexel texels[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Areas { float areas[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer SeenBy { uvec2 seen_by[]; };

// The inside of a closed body counts little: light hardly gets there, and what a centre sees of the back of a surface
// is hardly ever lit.
const float BACK = 0.05;
// Part of a distance by which a place may be behind what a map shows.
const float SLACK = 0.01;

bool sees(uint candidate, vec3 place, uint triangle) {
    vec3 centre = centres[candidate].xyz, to = place - centre;
    MapTexel texel = texels[candidate * map_texels() + map_texel(to)];
    if (texel.triangle == triangle) return true;
    if (texel.triangle == BVH_MISS) return false;
    BvhTriangle t = triangles[texel.triangle];
    vec3 normal = triangle_normal(t.v1.xyz - t.v0.xyz, t.v2.xyz - t.v0.xyz);
    // Along the direction to the place, in lengths of `to`.
    float plane = dot(t.v0.xyz - centre, normal) / dot(to, normal);
    float shown = plane > 0.0 && plane < 3.0e38 ? plane : texel.distance / length(to);
    return shown >= 1.0 - SLACK;
}

void main() {
    uint i = linear_id();
    if (i >= params.candidates * map_texels()) return;
    MapTexel texel = texels[i];
    uint own = i / map_texels();
    areas[i] = 0.0;
    seen_by[i] = uvec2(0u);
    if (texel.triangle == BVH_MISS) return;
    BvhTriangle t = triangles[texel.triangle];
    vec3 place = map_place(t, texel.b1, texel.b2), to = place - centres[own].xyz;
    vec3 normal = triangle_normal(t.v1.xyz - t.v0.xyz, t.v2.xyz - t.v0.xyz);
    float depth = max(abs(to.x), max(abs(to.y), abs(to.z)));
    float facing = -dot(to, normal);
    // Equation 1. A surface seen at a grazing angle is no larger than a texel's neighbours make it: bounded.
    float cosine = max(abs(facing), 0.02 * length(to));
    float area = 4.0 / float(MAP_RESOLUTION * MAP_RESOLUTION) * depth * depth * depth / cosine;
    areas[i] = facing > 0.0 ? area : BACK * area;
    uvec2 mask = uvec2(0u);
    for (uint c = 0u; c < params.candidates; ++c) {
        bool seen = c == own || sees(c, place, texel.triangle);
        if (seen && c < 32u) mask.x |= 1u << c;
        if (seen && c >= 32u) mask.y |= 1u << (c - 32u);
    }
    seen_by[i] = mask;
}
