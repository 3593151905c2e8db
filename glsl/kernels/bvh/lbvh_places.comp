// The same as lbvh_codes.comp for boxes of triangles: their places alone decide.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "lib/morton.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Scene { Aabb scene[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Codes { uint codes[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Index { uint index[]; };

void main() {
    uint i = linear_id();
    if (i >= min(count[0], params.capacity)) return;
    Aabb box = boxes[i];
    codes[i] = aabb_valid(box) ? morton_place_code(box, scene[0]) : MORTON_NONE;
    index[i] = i;
}
