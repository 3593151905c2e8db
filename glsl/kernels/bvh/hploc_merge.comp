// Clusters from the items up (Benthin, Meister, Barczak, Mehalwal, Tsakok and Kensler 2024, "H-PLOC: Hierarchical
// Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction"). At a node of the radix tree the
// clusters of both children are merged, nearest neighbours first (Meister and Bittner 2018, "Parallel locally-ordered
// clustering for bounding volume hierarchy construction"), until few are left, which go up; at the root one is left.
//
// The paper has a warp for every merge, with what its lanes hold in registers. Here it is a workgroup of 32 with shared
// memory, so that the tree is the same for every size of subgroups. A group starts where no child merges and climbs; of
// two groups that meet at a node the first ends and the second goes on, so no group waits. What a node becomes depends
// on its items alone.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 32) in;
#include "shared/aabb.glsl"
#include "shared/bvh.glsl"
#include "lib/lbvh.glsl"
#include "lib/hploc.glsl"
#include "lib/tree_area.glsl"

layout(push_constant, scalar) uniform Params { uint capacity; } params;
layout(set = 0, binding = 0, scalar) readonly buffer StartCount { uint start_count[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Starts { uint starts[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Scene { Aabb scene[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Ranges { uvec3 ranges[]; };
layout(set = 0, binding = 4, scalar) readonly buffer Parents { uint parents[]; };
layout(set = 0, binding = 5, scalar) coherent buffer Arrivals { uint arrivals[]; };
layout(set = 0, binding = 6, scalar) coherent buffer Clusters { Cluster clusters[]; };
layout(set = 0, binding = 7, scalar) coherent buffer ClusterBoxes { Aabb cluster_boxes[]; };
layout(set = 0, binding = 8, scalar) writeonly buffer Nodes { BvhNode nodes[]; };
// Links of the items, then of the nodes.
layout(set = 0, binding = 9, scalar) writeonly buffer Links { uint links[]; };

shared Cluster s_cluster[HPLOC_GROUP];
shared Aabb s_box[HPLOC_GROUP];
shared uint s_near[HPLOC_GROUP];
shared uint s_alive;
shared uint s_before;

// Brings the clusters that `here` says this invocation has to the front, in order; returns how many there are.
uint close_ranks(uint lane, bool here, Cluster cluster, Aabb box) {
    if (lane == 0u) s_alive = 0u;
    barrier();
    if (here) atomicOr(s_alive, 1u << lane);
    barrier();
    uint alive = s_alive;
    uint place = uint(bitCount(alive & ((1u << lane) - 1u)));
    if (here) {
        s_cluster[place] = cluster;
        s_box[place] = box;
    }
    barrier();
    return uint(bitCount(alive));
}

// The clusters of both children, those of the first child first.
uint load(uint lane, uvec3 range) {
    bool second = lane >= HPLOC_KEPT;
    uint place = second ? range.y + 1u + lane - HPLOC_KEPT : range.x + lane;
    bool here = place <= (second ? range.z : range.y);
    place = here ? place : range.x;
    Cluster cluster = clusters[place];
    Aabb box = cluster_boxes[place];
    return close_ranks(lane, here && cluster.reference != HPLOC_NONE, cluster, box);
}

void store(uint lane, uvec3 range, uint count) {
    if (lane >= HPLOC_KEPT || range.x + lane > range.z) return;
    bool here = lane < count;
    Cluster none = Cluster(HPLOC_NONE, 0u, 0u);
    clusters[range.x + lane] = here ? s_cluster[lane] : none;
    if (here) cluster_boxes[range.x + lane] = s_box[lane];
}

// Takes the cluster in the place `other` for the nearest if both boxes together are smaller than with the one so far,
// and the cluster of both is not too high.
void look_at(uint lane, uint other, uint count, uint most, float unit, inout float least, inout uint nearest) {
    if (other >= count) return; // before the first, too
    if (max(s_cluster[lane].height, s_cluster[other].height) >= most) return;
    float area = tree_area(aabb_union(s_box[lane], s_box[other]), unit);
    bool nearer = area < least || nearest == HPLOC_NONE;
    least = nearer ? area : least;
    nearest = nearer ? other : nearest;
}

// The neighbour with which a cluster has the smallest box; of equal ones the nearer in the list, of two as near the one
// that an even place and the next make a pair of, else the first. This orders pairs, so some two clusters are always
// each other's nearest, and equal boxes are paired off rather than strung together.
uint nearest_to(uint lane, uint count, uint radius, uint most, float unit) {
    uint nearest = HPLOC_NONE;
    float least = 0.0;
    if (lane >= count) return nearest;
    for (uint step = 1u; step <= radius; step++) {
        bool ahead_first = (step & 1u) != 0u && (lane & 1u) == 0u;
        uint near = ahead_first ? lane + step : lane - step;
        uint far = ahead_first ? lane - step : lane + step;
        look_at(lane, near, count, most, unit, least, nearest);
        look_at(lane, far, count, most, unit, least, nearest);
    }
    return nearest;
}

// Node `index` with the clusters in the places a and b as its children, the larger one first.
void write_node(uint index, uint a, uint b, float unit) {
    bool swapped = tree_area(s_box[a], unit) < tree_area(s_box[b], unit);
    uint first = swapped ? b : a;
    uint second = swapped ? a : b;
    uint child0 = s_cluster[first].reference;
    uint child1 = s_cluster[second].reference;
    nodes[index].min0 = vec4(s_box[first].min, uintBitsToFloat(child0));
    nodes[index].max0 = vec4(s_box[first].max, uintBitsToFloat(child1));
    nodes[index].min1 = vec4(s_box[second].min, 0.0);
    nodes[index].max1 = vec4(s_box[second].max, 0.0);
    bool leaf0 = (child0 & BVH_LEAF) != 0u;
    bool leaf1 = (child1 & BVH_LEAF) != 0u;
    links[leaf0 ? child0 & BVH_FIRST_MASK : params.capacity + child0] = lbvh_link(index, 0u);
    links[leaf1 ? child1 & BVH_FIRST_MASK : params.capacity + child1] = lbvh_link(index, 1u);
}

// Merges each pair of clusters that are each other's nearest; returns how many clusters are left. The last two of a
// tree become node 0.
uint merge(uint lane, uint count, uint radius, uint most, bool root, float unit) {
    uint other = nearest_to(lane, count, radius, most, unit);
    s_near[lane] = other;
    barrier();
    bool mutual = other != HPLOC_NONE && s_near[min(other, HPLOC_GROUP - 1u)] == lane;
    Cluster cluster = s_cluster[lane];
    Aabb box = s_box[lane];
    if (mutual && lane < other) {
        uint index = root && count == 2u ? 0u : s_cluster[other].label;
        write_node(index, lane, other, unit);
        cluster = Cluster(index, cluster.label, max(cluster.height, s_cluster[other].height) + 1u);
        box = aabb_union(box, s_box[other]);
    }
    barrier();
    return close_ranks(lane, lane < count && !(mutual && other < lane), cluster, box);
}

// Merges until at most `kept` clusters are left. Where heights allow no merge among neighbours, clusters look at all.
uint reduce(uint lane, uint count, uint kept, uint most, bool root, float unit) {
    uint radius = HPLOC_RADIUS;
    while (count > kept) {
        uint left = merge(lane, count, radius, most, root, unit);
        radius = left == count ? HPLOC_GROUP : HPLOC_RADIUS;
        count = left;
    }
    return count;
}

// Whether this group goes on at a parent: where both children merge, the second to arrive does.
bool goes_on(uint lane, uint parent) {
    uvec3 range = ranges[parent];
    bool both = hploc_merges(range.x, range.y) && hploc_merges(range.y + 1u, range.z);
    memoryBarrierBuffer();
    barrier();
    if (lane == 0u) s_before = both ? atomicAdd(arrivals[parent], 1u) : 1u;
    barrier();
    uint before = s_before;
    memoryBarrierBuffer();
    barrier();
    return before != 0u;
}

void main() {
    uint lane = gl_LocalInvocationIndex;
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (group >= start_count[0]) return;
    uint node = starts[group];
    float unit = tree_unit(scene[0]);
    uint depth = 0u;
    for (uint above = node; above != 0u && depth < BVH_MAX_DEPTH; above = parents[above]) depth++;
    for (uint level = 0u; level < BVH_MAX_DEPTH; level++) {
        uvec3 range = ranges[node];
        uint count = load(lane, range);
        uint most = HPLOC_ROOT_HEIGHT - min(depth, HPLOC_ROOT_HEIGHT - 1u);
        count = reduce(lane, count, HPLOC_KEPT, most, node == 0u, unit);
        if (node == 0u) {
            for (uint kept = HPLOC_KEPT / 2u; kept > 0u; kept /= 2u) {
                most++;
                count = reduce(lane, count, kept, most, true, unit);
            }
            break;
        }
        store(lane, range, count);
        node = parents[node];
        depth--;
        if (!goes_on(lane, node)) break;
    }
}
