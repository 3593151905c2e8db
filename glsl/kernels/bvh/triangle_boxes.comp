// Box of each triangle; the inverted box for one that no ray can hit: corners that do not exist or are not finite, no
// area. Builders leave inverted boxes out.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "lib/area.glsl"

layout(push_constant, scalar) uniform Params { uint vertices; uint triangles; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Corners { uvec3 corners[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Boxes { Aabb boxes[]; };

// NaN fails comparisons; in minima and maxima it is lost.
bool is_finite(vec3 v) {
    return all(lessThanEqual(abs(v), vec3(FLT_MAX)));
}

void main() {
    uint id = linear_id();
    if (id >= params.triangles) return;
    uvec3 corner = corners[id];
    bool known = max(corner.x, max(corner.y, corner.z)) < params.vertices;
    corner = known ? corner : uvec3(0u);
    vec3 a = positions[corner.x];
    vec3 b = positions[corner.y];
    vec3 c = positions[corner.z];
    Aabb box = Aabb(min(min(a, b), c), max(max(a, b), c));
    bool finite = is_finite(a) && is_finite(b) && is_finite(c);
    boxes[id] = known && finite && has_area(a, b, c) ? box : aabb_empty();
}
