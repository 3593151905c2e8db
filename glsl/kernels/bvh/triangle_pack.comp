// The triangles of a tree as rays read them, in the order of its leaves.
//
// A tree that was built for other positions may hold a triangle that no ray can hit now: its box is inverted. It is
// written as one point, which nothing hits.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Item { uint items[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Positions { vec3 positions[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Corners { uvec3 corners[]; };
// Flags and material of each triangle.
layout(set = 0, binding = 5, scalar) readonly buffer Tags { uvec2 tags[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Triangles { BvhTriangle triangles[]; };

void main() {
    uint place = linear_id();
    if (place >= min(counts[LBVH_ITEMS], params.capacity)) return;
    uint id = items[place];
    uvec3 corner = corners[id];
    bool hittable = aabb_valid(boxes[id]);
    vec3 a = hittable ? positions[corner.x] : vec3(0.0);
    vec3 b = hittable ? positions[corner.y] : vec3(0.0);
    vec3 c = hittable ? positions[corner.z] : vec3(0.0);
    uvec2 tag = tags[id];
    triangles[place].v0 = vec4(a, uintBitsToFloat(id));
    triangles[place].v1 = vec4(b, uintBitsToFloat(tag.x));
    triangles[place].v2 = vec4(c, uintBitsToFloat(tag.y));
}
