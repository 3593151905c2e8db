// Flags of the photons whose ball may be in the picture.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "shared/scene.glsl"
#include "lib/bounds.glsl"

layout(push_constant, scalar) uniform Params {
    uint first_row; // of the image that the picture shows
    uint rows;
} params;

layout(set = 0, binding = 11, scalar) readonly buffer CameraBlock { Camera camera[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Flags { uint flags[]; };

void main() {
    uint i = linear_id();
    if (i >= min(count[0], photons.length())) return;
    View v = view_of(camera[0]);
    Rows rows = Rows(float(params.first_row), float(params.rows), float(camera[0].height));
    flags[i] = may_be_seen(ball_of(photons[i], v), v, rows) ? 1u : 0u;
}
