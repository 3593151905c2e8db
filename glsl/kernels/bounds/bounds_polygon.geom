// Points to polygons of CORNERS vertices around the footprints in the picture.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
#include "lib/math.glsl"
#include "shared/photon.glsl"
#include "shared/scene.glsl"
#include "lib/bounds.glsl"
layout(points) in;
layout(triangle_strip, max_vertices = 18) out;

layout(constant_id = 20) const uint CORNERS = 8; // 6 to 18

layout(push_constant, scalar) uniform Params {
    uint first_row; // of the image that the picture shows
    uint rows;
} params;
layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(location = 0) flat in uint photon_of_point[];
layout(location = 0) flat out uint photon;

void main() {
    View v = view_of(camera[0]);
    Rows rows = Rows(float(params.first_row), float(params.rows), float(camera[0].height));
    Ball b = ball_of(photons[photon_of_point[0]], v);
    uint corners = fills_picture(b, v) ? 4u : CORNERS;
    [[dont_unroll]] for (uint corner = 0u; corner < corners; ++corner) {
        photon = photon_of_point[0];
        gl_Position = polygon_corner(b, v, rows, corner, CORNERS);
        EmitVertex();
    }
    EndPrimitive();
}
