// Appends the light vertices of one bounce, in the order of the photons.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"

layout(push_constant, scalar) uniform Params {
    uint capacity;
} params;

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Pending { Photon pending[]; };
layout(set = 0, binding = 19, scalar) readonly buffer PhotonCount { uint photon_count[]; };
layout(set = 0, binding = 20, scalar) writeonly buffer Vertices { Photon vertices[]; };

void main() {
    uint k = linear_id();
    if (k >= count[0]) return;
    uint target = photon_count[0] + k;
    if (target < params.capacity) vertices[target] = pending[list[k]];
}
