// Leaves of the tree over the photons' centres (shared/knn.glsl).
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "shared/knn.glsl"
#include "lib/knn.glsl"

layout(push_constant, scalar) uniform Params {
    uint leaves; // of the tree
} params;

layout(set = 0, binding = 16, scalar) readonly buffer SortedCount { uint sorted_count[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 18, scalar) readonly buffer Sorted { Photon sorted[]; };
layout(set = 0, binding = 19, scalar) writeonly buffer Nodes { KnnNode nodes[]; };

void main() {
    uint leaf = linear_id();
    if (leaf >= params.leaves) return;
    KnnNode node = KnnNode(vec4(vec3(INFINITY), -1.0), vec4(vec3(-INFINITY), -1.0), 0xffffffffu);
    uint begin = KNN_LEAF * leaf, end = min(begin + KNN_LEAF, sorted_count[0]);
    [[dont_unroll]] for (uint k = begin; k < end; ++k) {
        Photon p = sorted[k];
        vec3 centre = uintBitsToFloat(p.a.xyz);
        float reach = REACH * longer_semiaxis(p);
        node.low = vec4(min(node.low.xyz, centre), is_caustic(p) ? max(node.low.w, reach) : node.low.w);
        node.high = vec4(max(node.high.xyz, centre), is_caustic(p) ? node.high.w : max(node.high.w, reach));
        node.first = min(node.first, order[k]);
    }
    nodes[params.leaves + leaf] = node;
}
