// How much is drawn: an instance, or a single vertex, for each photon.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"

struct DrawArgs {
    uint vertices;
    uint instances;
    uint first_vertex;
    uint first_instance;
};

layout(push_constant, scalar) uniform Params {
    uint vertices; // of each photon; 0: the photons are the vertices of one instance
} params;

layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) writeonly buffer Args { DrawArgs args[]; };

void main() {
    if (linear_id() != 0u) return;
    uint photons = count[0];
    args[0] = params.vertices > 0u ? DrawArgs(params.vertices, photons, 0u, 0u) : DrawArgs(photons, 1u, 0u, 0u);
}
