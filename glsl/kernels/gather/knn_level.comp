// One level of the tree over the photons' centres (shared/knn.glsl) from the level below it.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/knn.glsl"

layout(push_constant, scalar) uniform Params {
    uint first; // node of the level, and how many there are
} params;

layout(set = 0, binding = 16, scalar) buffer Nodes { KnnNode nodes[]; };

void main() {
    uint j = linear_id();
    if (j >= params.first) return;
    uint at = params.first + j;
    KnnNode a = nodes[2u * at], b = nodes[2u * at + 1u];
    vec4 low = vec4(min(a.low.xyz, b.low.xyz), max(a.low.w, b.low.w));
    nodes[at] = KnnNode(low, max(a.high, b.high), min(a.first, b.first));
}
