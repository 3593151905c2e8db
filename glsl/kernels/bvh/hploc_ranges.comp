// The nodes of the radix tree over sorted codes, as the merging of clusters needs them: which items a node covers, its
// parent, and whether merging starts there, because none of its children merges. Every item is a cluster.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 256) in;
#include "lib/linear_id.glsl"
#include "shared/aabb.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"
#include "lib/hploc.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer Counts { uint counts[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Codes { uint codes[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Boxes { Aabb boxes[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Item { uint items[]; };
// First item, last item of the first child, last item.
layout(set = 0, binding = 4, scalar) writeonly buffer Ranges { uvec3 ranges[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Parents { uint parents[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Starts { uint starts[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Clusters { Cluster clusters[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer ClusterBoxes { Aabb cluster_boxes[]; };

#include "lib/karras.glsl"

void main() {
    uint n = counts[LBVH_ITEMS];
    uint i = linear_id();
    if (i >= params.capacity) return;
    starts[i] = 0u;
    if (i >= n) return;
    clusters[i] = Cluster(BVH_LEAF | i, i, 0u);
    cluster_boxes[i] = boxes[items[i]];
    if (i + 1u >= n) return;
    int direction;
    int end = other_end(int(i), int(n), direction);
    uint first = min(i, uint(end));
    uint last = max(i, uint(end));
    uint split = uint(split_of(int(first), int(last), int(n)));
    ranges[i] = uvec3(first, split, last);
    if (split != first) parents[split] = i;
    if (split + 1u != last) parents[split + 1u] = i;
    bool merges = i == 0u || hploc_merges(first, last);
    starts[i] = uint(merges && !hploc_merges(first, split) && !hploc_merges(split + 1u, last));
}
