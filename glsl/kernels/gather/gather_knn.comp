// Density estimation from the k nearest photons of each class (lib/knn.glsl): a walk through the tree over their
// centres, the nearer child first, with the nearest k + 1 so far in a heap whose farthest prunes.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/photon.glsl"
#include "shared/knn.glsl"
#include "lib/knn.glsl"

// Loop iterations of a lane after which its walk is given up and marked UNFINISHED; 0: none.
layout(constant_id = 22) const uint STEP_LIMIT = 0;

layout(push_constant, scalar) uniform Params {
    uint leaves; // of the tree, a power of two
} params;

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer Nodes { KnnNode nodes[]; };
layout(set = 0, binding = 20, scalar) readonly buffer SortedCount { uint sorted_count[]; };
layout(set = 0, binding = 21, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 22, scalar) readonly buffer Sorted { Photon sorted[]; };
layout(set = 0, binding = 23, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 24, scalar) writeonly buffer Gathered { vec4 gathered[]; };

// Two heaps with the farthest at the root: caustic photons, then others.
float heap_distance[2u * (NEIGHBOURS + 1u)];
uint heap_photon[2u * (NEIGHBOURS + 1u)];
uint filled[2] = uint[2](0u, 0u);

// As deep as the tree can be, with one node left behind at each level.
uint stack_node[32];
float stack_bound[32];

uint steps = 0u;

// Where the farthest moves down from the root of a full heap to make room for (d, i).
void replace_farthest(uint base, float d, uint i) {
    uint hole = 0u, child = 1u;
    while (child <= NEIGHBOURS) {
        if (STEP_LIMIT != 0u) ++steps;
        if (child < NEIGHBOURS && nearer(heap_distance[base + child], heap_photon[base + child],
                                         heap_distance[base + child + 1u], heap_photon[base + child + 1u])) ++child;
        float far_distance = heap_distance[base + child];
        uint far_photon = heap_photon[base + child];
        if (!nearer(d, i, far_distance, far_photon)) break;
        heap_distance[base + hole] = far_distance;
        heap_photon[base + hole] = far_photon;
        hole = child;
        child = 2u * hole + 1u;
    }
    heap_distance[base + hole] = d;
    heap_photon[base + hole] = i;
}

void push(uint c, float d, uint i) {
    uint base = c * (NEIGHBOURS + 1u), hole = filled[c];
    if (STEP_LIMIT != 0u) ++steps; // the last iteration of a loop, in which it ends
    if (hole > NEIGHBOURS) {
        if (nearer(d, i, heap_distance[base], heap_photon[base])) replace_farthest(base, d, i);
        return;
    }
    filled[c] = hole + 1u;
    while (hole > 0u) {
        if (STEP_LIMIT != 0u) ++steps;
        uint parent = (hole - 1u) / 2u;
        if (!nearer(heap_distance[base + parent], heap_photon[base + parent], d, i)) break;
        heap_distance[base + hole] = heap_distance[base + parent];
        heap_photon[base + hole] = heap_photon[base + parent];
        hole = parent;
    }
    heap_distance[base + hole] = d;
    heap_photon[base + hole] = i;
}

// Whether a photon of this class, not before (d, i), can still be among the nearest.
bool open(uint c, float d, uint i) {
    uint base = c * (NEIGHBOURS + 1u);
    return filled[c] <= NEIGHBOURS || nearer(d, i, heap_distance[base], heap_photon[base]);
}

float bound_of(KnnNode node, vec3 p) {
    return distance2(max(max(node.low.xyz - p, p - node.high.xyz), vec3(0.0)));
}

bool wanted(KnnNode node, float bound) {
    bool caustic = node.low.w >= 0.0 && bound <= node.low.w * node.low.w && open(0u, bound, node.first);
    return caustic || (node.high.w >= 0.0 && bound <= node.high.w * node.high.w && open(1u, bound, node.first));
}

void visit_leaf(uint leaf, Point x, inout Estimate sum) {
    uint begin = KNN_LEAF * leaf, end = min(begin + KNN_LEAF, sorted_count[0]);
    if (STEP_LIMIT != 0u) steps += KNN_LEAF + 1u;
    [[dont_unroll]] for (uint k = begin; k < end; ++k) {
        Photon p = sorted[k];
        if (COUNT_PAIRS) sum.tested += 1.0;
        if (is_candidate(p, x)) {
            push(is_caustic(p) ? 0u : 1u, distance2(x.s.position - uintBitsToFloat(p.a.xyz)), order[k]);
        }
    }
}

void add_class(uint c, Point x, inout Estimate sum) {
    uint base = c * (NEIGHBOURS + 1u);
    bool full = filled[c] > NEIGHBOURS;
    float disc2 = full ? heap_distance[base] : -1.0;
    // In a full heap the root is the one beyond the k nearest.
    [[dont_unroll]] for (uint k = full ? 1u : 0u; k < filled[c]; ++k) {
        add_neighbour(sum, photons[heap_photon[base + k]], x, disc2);
    }
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    Point x = point_of(eye_hits[slot]);
    Estimate sum = estimate_nothing();
    uint top = 1u;
    stack_node[0] = 1u;
    stack_bound[0] = bound_of(nodes[1], x.s.position);
    while (top > 0u) {
        if (STEP_LIMIT != 0u) {
            if (steps > STEP_LIMIT) break;
            ++steps;
        }
        --top;
        uint at = stack_node[top];
        // The heaps may have closed since it was pushed.
        if (!wanted(nodes[at], stack_bound[top])) continue;
        if (at >= params.leaves) {
            visit_leaf(at - params.leaves, x, sum);
            continue;
        }
        uint near = 2u * at;
        float near_bound = bound_of(nodes[near], x.s.position), far_bound = bound_of(nodes[near + 1u], x.s.position);
        bool swapped = far_bound < near_bound;
        stack_node[top] = swapped ? near : near + 1u;
        stack_bound[top] = swapped ? near_bound : far_bound;
        stack_node[top + 1u] = swapped ? near + 1u : near;
        stack_bound[top + 1u] = swapped ? far_bound : near_bound;
        top += 2u;
    }
    bool unfinished = STEP_LIMIT != 0u && steps > STEP_LIMIT;
    if (!unfinished) {
        add_class(0u, x, sum);
        add_class(1u, x, sum);
    }
    gathered[2u * slot] = unfinished ? vec4(UNFINISHED) : vec4(sum.caustic * x.factor, sum.tested);
    gathered[2u * slot + 1u] = unfinished ? vec4(UNFINISHED) : vec4(sum.other * x.factor, sum.accepted);
}
