// Closest hit and any hit of a ray in a binary BVH.
//
// The including kernel declares, before the include, with glsl/shared/bvh.glsl:
//   readonly buffer of BvhNode named `nodes`, readonly buffer of BvhTriangle named `triangles`
// and may define TRACE_ACCEPT(triangle, barycentrics), a bool expression called for triangles with one of the flags
// TRACE_FLAGS (BVH_ALPHA_MASKED unless it is defined, too); where it is false, the ray goes on. Without it every
// triangle stops rays.
#include "lib/hit.glsl"
#include "lib/intersect.glsl"

// Marks the bottom of the stack: a leaf reference that no builder makes.
const uint TRACE_DONE = 0xffffffffu;

// More steps than any tree of BVH_MAX_DEPTH needs for a sane scene: a damaged tree must not hang the device.
const uint TRACE_MAX_STEPS = 1u << 22;

// Set when a traversal ended before its time: by the bound above, or because a software driver cut the loop (some do
// after 65,535 iterations, without a word). Kernels may count it.
bool trace_cut = false;

uint trace_stack[BVH_MAX_DEPTH + 2u];
float trace_stack_t[BVH_MAX_DEPTH + 2u];

// A frame for rays in the tree of `nodes`, whose root holds the bounds of the scene, and where to start: at the root
// unless the tree is empty.
RayFrame trace_frame(vec3 origin, vec3 direction, out uint start) {
    BvhNode root = nodes[0];
    vec3 low = min(root.min0.xyz, root.min1.xyz);
    vec3 high = max(root.max0.xyz, root.max1.xyz);
    start = low.x <= high.x ? 0u : TRACE_DONE;
    return ray_frame(origin, direction, low, high);
}

#ifndef TRACE_FLAGS
#define TRACE_FLAGS BVH_ALPHA_MASKED
#endif

bool trace_accepts(BvhTriangle triangle, uint index, vec2 barycentrics) {
#ifdef TRACE_ACCEPT
    return (floatBitsToUint(triangle.v1.w) & (TRACE_FLAGS)) == 0u || TRACE_ACCEPT(index, barycentrics);
#else
    return true;
#endif
}

// Next reference from the stack whose box the ray still enters in time.
uint trace_pop(inout uint top, float t_best) {
    do {
        top--;
    } while (trace_stack_t[top] > t_best);
    return trace_stack[top];
}

// Whether the ray, which is in a body, leaves it at this triangle.
bool trace_leaves(BvhTriangle t, vec3 direction) {
    bool boundary = (floatBitsToUint(t.v1.w) & BVH_BOUNDARY) != 0u;
    return boundary && dot(triangle_normal(t.v1.xyz - t.v0.xyz, t.v2.xyz - t.v0.xyz), direction) > 0.0;
}

Hit traverse(vec3 origin, vec3 direction, float t_min, float t_max, const bool any) {
    uint current;
    RayFrame ray = trace_frame(origin, direction, current);
    Hit hit = Hit(t_max, vec2(0.0), BVH_MISS);
    uint hit_id = BVH_MISS;
    uint top = 1u;
    trace_stack[0] = TRACE_DONE;
    trace_stack_t[0] = uintBitsToFloat(0xff800000u); // -inf: never behind any t_max
    uint steps = 0u;
    // Two inner loops rather than one branch: software drivers execute both sides of a branch, but leave a loop early.
    // They leave it at its end only, so that is where loops test.
    do {
        do {
            steps++;
            if ((current & BVH_LEAF) != 0u) break;
            BvhNode node = nodes[current];
            float leave0, leave1;
            float enter0 = max(box_enter(ray, node.min0.xyz, node.max0.xyz, leave0), t_min);
            float enter1 = max(box_enter(ray, node.min1.xyz, node.max1.xyz, leave1), t_min);
            bool hit0 = enter0 <= min(leave0, hit.t);
            bool hit1 = enter1 <= min(leave1, hit.t);
            uint child0 = floatBitsToUint(node.min0.w);
            uint child1 = floatBitsToUint(node.max0.w);
            bool swap = !hit0 || (hit1 && enter1 < enter0);
            if (hit0 && hit1) {
                trace_stack[top] = swap ? child0 : child1;
                trace_stack_t[top] = swap ? enter0 : enter1;
                top++;
            }
            current = swap ? child1 : child0;
            if (!hit0 && !hit1) current = trace_pop(top, hit.t);
        } while ((current & BVH_LEAF) == 0u && steps < TRACE_MAX_STEPS);
        do {
            if (current == TRACE_DONE) break;
            steps++;
            uint index = current & BVH_FIRST_MASK;
            BvhTriangle triangle = triangles[index];
            uint id = floatBitsToUint(triangle.v0.w);
            float t;
            vec2 barycentrics;
            mat3 corners = mat3(triangle.v0.xyz, triangle.v1.xyz, triangle.v2.xyz);
            bool found = intersect_triangle(ray, corners, t_min, t, barycentrics);
            found = found && (t < hit.t || (t == hit.t && id < hit_id));
            found = found && (t > 0.0 || trace_leaves(triangle, direction));
            found = found && trace_accepts(triangle, index, barycentrics);
            if (found) {
                hit = Hit(t, barycentrics, index);
                hit_id = id;
            }
            bool last = (current & BVH_COUNT_MASK) == 0u;
            current += 1u - BVH_COUNT_ONE;
            if (last) current = trace_pop(top, hit.t);
            if (any && hit.triangle != BVH_MISS) current = TRACE_DONE;
        } while (current != TRACE_DONE && (current & BVH_LEAF) != 0u && steps < TRACE_MAX_STEPS);
    } while (current != TRACE_DONE && steps < TRACE_MAX_STEPS);
    trace_cut = trace_cut || current != TRACE_DONE;
    return hit;
}

// The closest hit with 0 < t <= t_max; of hits at the same t, the one with the lowest original triangle id.
Hit trace_closest(vec3 origin, vec3 direction, float t_max) {
    return traverse(origin, direction, 0.0, t_max, false);
}

// The same for a path that may have crossed the other side of a thin body before it began: from t_min on, which is not
// above 0, it meets boundaries that it leaves a body by (way_back in lib/medium.glsl).
Hit trace_path(vec3 origin, vec3 direction, float t_min) {
    return traverse(origin, direction, min(t_min, 0.0), uintBitsToFloat(0x7f800000u), false);
}

// Whether anything is hit with 0 < t <= t_max.
bool trace_any(vec3 origin, vec3 direction, float t_max) {
    return traverse(origin, direction, 0.0, t_max, true).triangle != BVH_MISS;
}
