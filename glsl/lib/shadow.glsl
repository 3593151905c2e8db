// Light that comes straight from one point to another. Include lib/traverse.glsl and lib/medium.glsl before; the
// including kernel defines SHADOW_MEETS(triangle, barycentrics), whether a ray meets a triangle that TRACE_ACCEPT asks
// about, and lets TRACE_ACCEPT(triangle, barycentrics) be shadow_accepts(triangle, barycentrics).
#include "lib/enclosing.glsl"

// Holes that a ray may pass where media begin and end at holes.
const uint MOST_HOLES = 256u;

// The same where bodies have holes: the media change on the way.
vec3 light_through_holes(vec3 origin, vec3 target, uint medium, bool far) {
    vec3 light = vec3(1.0);
    [[dont_unroll]] for (uint i = 0u; i < MOST_HOLES; ++i) {
        vec3 along = target - origin;
        shadow_stops = true;
        Hit hit = trace_closest(origin, along, 1.0);
        shadow_stops = false;
        if (hit.triangle == BVH_MISS) return far ? light : light * transmittance(medium, length(along));
        if (SHADOW_MEETS(hit.triangle, hit.barycentrics)) return vec3(0.0);
        BvhTriangle t = triangles[hit.triangle];
        vec3 e1 = t.v1.xyz - t.v0.xyz, e2 = t.v2.xyz - t.v0.xyz;
        origin = offset_point(triangle_point(t.v0.xyz, e1, e2, hit.barycentrics), e1, e2, along);
        uint material = floatBitsToUint(t.v2.w);
        bool boundary = (materials[material].flags & (MATERIAL_VOLUME | MATERIAL_BLEND)) == MATERIAL_VOLUME;
        bool leaves = boundary && dot(triangle_normal(e1, e2), along) > 0.0;
        light *= transmittance(leaves ? material + 1u : medium, hit.t * length(along));
        if (leaves) {
            shadow_stops = true;
            medium = enclosing_medium(origin);
            shadow_stops = false;
        } else if (boundary) {
            medium = path_medium(material);
        }
        coverage_medium = medium;
    }
    return vec3(0.0);
}

// Share of the light that is left of it on the way between two points, of which the first is in `medium`. Light from
// `far` is not absorbed: a boundary would stand between.
vec3 light_between(vec3 origin, vec3 target, uint medium, bool far) {
    coverage_along = target - origin;
    coverage_medium = medium;
    if (ABSORPTION && ALPHA_MASK) return light_through_holes(origin, target, medium, far);
    vec3 along = target - origin;
    if (trace_any(origin, along, 1.0)) return vec3(0.0);
    return ABSORPTION && !far ? transmittance(medium, length(along)) : vec3(1.0);
}
