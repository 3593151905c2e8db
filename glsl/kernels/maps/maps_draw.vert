// Draws every triangle on the six faces of a map, side by side in one picture: an instance is a face.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/bvh.glsl"
#include "shared/maps.glsl"
#include "lib/maps.glsl"

layout(push_constant, scalar) uniform Params {
    uint centre; // of the map
    float near;  // what is closer to the centre along the axis of a face is not drawn
} params;
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 16, scalar) readonly buffer Centres { vec4 centres[]; };
layout(location = 0) out vec2 barycentrics;
layout(location = 1) flat out uint triangle;
layout(location = 2) flat out uint face;

void main() {
    triangle = uint(gl_VertexIndex) / 3u;
    face = uint(gl_InstanceIndex);
    uint corner = uint(gl_VertexIndex) % 3u;
    BvhTriangle t = triangles[triangle];
    vec3 place = (corner == 0u ? t.v0.xyz : (corner == 1u ? t.v1.xyz : t.v2.xyz)) - centres[params.centre].xyz;
    vec3 turned = map_turned(face >> 1u, place);
    float depth = (face & 1u) != 0u ? -turned.x : turned.x;
    // From -1 to 1 on the face to its sixth of the picture. Depths fall from one at `near` to zero at infinity.
    float along = (turned.y + float(2u * face + 1u) * depth) / float(MAP_FACES) - depth;
    gl_Position = vec4(along, turned.z, params.near, depth);
    barycentrics = vec2(corner == 1u ? 1.0 : 0.0, corner == 2u ? 1.0 : 0.0);
}
