// An icosahedron per photon, as a list of 60 vertices, around its footprint in space.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "lib/math.glsl"
#include "shared/photon.glsl"
#include "shared/scene.glsl"
#include "lib/bounds.glsl"

layout(push_constant, scalar) uniform Params {
    uint first_row; // of the image that the picture shows
    uint rows;
} params;
layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Seen { uint seen[]; }; // photons that may be in the picture
layout(location = 0) flat out uint photon;

void main() {
    photon = seen[gl_InstanceIndex];
    View v = view_of(camera[0]);
    Rows rows = Rows(float(params.first_row), float(params.rows), float(camera[0].height));
    gl_Position = icosahedron_corner(ball_of(photons[photon], v), v, rows, uint(gl_VertexIndex));
}
