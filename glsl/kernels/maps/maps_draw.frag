// The triangle that is seen, and where. Faces are neighbours in the picture: what reaches beyond its own is dropped.
// Layers after the first leave out what is not behind the layer before (depth peeling, Everitt 2001).
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/bvh.glsl"
#include "shared/maps.glsl"
#include "lib/maps.glsl"

layout(constant_id = 41) const bool PEEL = false;
// What lies behind a layer by less than this part of its distance belongs to it.
const float BEHIND = 1e-4;

layout(push_constant, scalar) uniform Params {
    uint centre; // of the map
    float near;
    uint before; // first texel of the layer before
} params;
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Centres { vec4 centres[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Before { MapTexel before[]; };
layout(location = 0) in vec2 barycentrics;
layout(location = 1) flat in uint triangle;
layout(location = 2) flat in uint face;
layout(location = 0) out vec4 seen;

void main() {
    uvec2 at = uvec2(gl_FragCoord.xy);
    if (at.x / MAP_RESOLUTION != face) discard;
    vec2 b = max(barycentrics, vec2(0.0));
    b /= max(b.x + b.y, 1.0);
    if (PEEL) {
        BvhTriangle t = triangles[triangle];
        vec3 place = map_place(t, b.x, b.y);
        uint texel = (face * MAP_RESOLUTION + at.y) * MAP_RESOLUTION + at.x % MAP_RESOLUTION;
        MapTexel former = before[params.before + texel];
        if (former.triangle == triangle) discard;
        if (!(distance(place, centres[params.centre].xyz) > former.distance * (1.0 + BEHIND))) discard;
    }
    seen = vec4(float(triangle & ((1u << MAP_LOW_BITS) - 1u)) + 1.0, float(triangle >> MAP_LOW_BITS), b);
}
