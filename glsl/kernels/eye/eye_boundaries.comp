// Finds the boundaries of the surface around each eye hit (lib/boundary.glsl), as far as footprints reach.
//
// Rays along the surface, just above it, meet what stands on it. Rays just below it are inside of the body and meet the
// side at which it ends. Four pairs of them, turned by chance, find the nearest boundary; three more along its axes
// find those on the other sides. What is short beside its distance (a post) is found in some passes only, so it is a
// boundary as much as it fills of the view.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "lib/sampling.glsl"
#include "shared/bvh.glsl"
#include "shared/scene.glsl"
#include "shared/photon.glsl"
#include "lib/boundary.glsl"

layout(set = 0, binding = 0, scalar) readonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 1, scalar) readonly buffer Triangles { BvhTriangle triangles[]; };
layout(set = 0, binding = 7, scalar) readonly buffer GlobalsBlock { Globals globals[]; };
layout(set = 0, binding = 12, scalar) readonly buffer PassBlock { Pass pass[]; };
layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) buffer EyeHits { EyeHit eye_hits[]; };
// Surfaces that a mask partly cuts away do not end others.
#define TRACE_ACCEPT(triangle, barycentrics) false
#include "lib/traverse.glsl"

layout(push_constant, scalar) uniform Params {
    float widest;   // semiaxis at the first pass in lengths of Globals.footprint_unit, scaled by the schedule
    float shrinking; // the same in scene units
    float constant; // in scene units in every pass
} params;

// Distance of the rays from the surface, in the longest semiaxis: above its roughness, and below objects that matter at
// this size.
const float LIFT = 0.01;
// A line that touches a circle at 45 degrees between two rays is met at this length.
const float RAY_LENGTH = 1.4142;
// The sides of a round body belong to another surface beyond this part of its radius: sqrt(1 - 0.3^2), by SAME_SURFACE.
const float ROUND_END = 0.954;
// What lies across a ray at more than 60 degrees from it is no boundary along it.
const float LEAST_FACING = 0.5;

struct Place {
    vec3 position;
    vec3 normal;
    float lift;
};

// The boundary that a ray meets: its unit normal in the surface, away from the hit, and its distance; w < 0: none.
vec4 boundary_on(Place x, vec3 axis, float side, float reach) {
    const vec4 none = vec4(0.0, 0.0, 0.0, -1.0);
    Hit hit = trace_closest(x.position + x.normal * (side * x.lift), axis, reach);
    if (hit.triangle == BVH_MISS) return none;
    BvhTriangle t = triangles[hit.triangle];
    vec3 e1 = t.v1.xyz - t.v0.xyz, e2 = t.v2.xyz - t.v0.xyz;
    // In units of the longest edge: squares of lengths neither under- nor overflow.
    float unit = 1.0 / max_component(max(abs(e1), abs(e2)));
    vec3 met = cross(e1 * unit, e2 * unit);
    float size = length(met);
    if (!(size > 0.0)) return none;
    // Above the surface what is met faces the ray; below it the ray leaves the body.
    met *= sign(dot(met, axis)) * -side / size;
    vec3 across = met - x.normal * dot(met, x.normal);
    float steep = length(across);
    if (!(steep > 0.0)) return none;
    across *= -side / steep;
    float distance = hit.t * dot(axis, across);
    if (dot(met, x.normal) <= SAME_SURFACE) return vec4(across, max(distance, 0.0));
    // A round body turns away from the hit before it ends: over the distance its normal has turned by asin(steep).
    return side < 0.0 ? vec4(across, distance * ROUND_END / steep) : none;
}

// The nearer one of what the rays above and below the surface meet.
vec4 boundary_along(Place x, vec3 axis, float reach) {
    vec4 above = boundary_on(x, axis, 1.0, reach);
    vec4 below = boundary_on(x, axis, -1.0, reach);
    return above.w < 0.0 || (below.w >= 0.0 && below.w < above.w) ? below : above;
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    EyeHit hit = eye_hits[slot];
    Place x;
    x.position = uintBitsToFloat(hit.a.xyz);
    x.normal = oct_decode(hit.a.w);
    float scaled = max(params.widest * globals[0].footprint_unit, params.shrinking) * pass[0].radius_scale;
    float reach = max(scaled, params.constant);
    // Above what places are rounded to.
    x.lift = max(LIFT * reach, max_component(abs(x.position)) * 1e-6);
    // By place and not by slot: the same in bands of any size.
    uint seed = hash2(hash2(pass[0].seed ^ SALT_BOUNDARIES, pass[0].index), hash2(hit.a.x ^ hash(hit.a.y), hit.a.z));
    vec3 t, b;
    basis(x.normal, t, b);
    float turn = unit_float(hash(seed)) * (0.5 * PI);
    vec3 u = t * cos(turn) + b * sin(turn), v = cross(x.normal, u);
    vec4 nearest = vec4(0.0, 0.0, 0.0, reach);
    [[dont_unroll]] for (uint k = 0u; k < 4u; ++k) {
        vec4 found = boundary_along(x, (k < 2u ? u : v) * ((k & 1u) == 0u ? 1.0 : -1.0), RAY_LENGTH * reach);
        if (found.w >= 0.0 && found.w < nearest.w) nearest = found;
    }
    eye_hits[slot].e = uvec4(0u);
    if (!(nearest.w < reach)) return;
    vec3 across = nearest.xyz, along = cross(x.normal, across);
    vec4 relative = vec4(nearest.w / reach, vec3(BOUNDARY_FAR));
    [[dont_unroll]] for (uint k = 1u; k < 4u; ++k) {
        vec3 axis = k == 1u ? -across : (k == 2u ? along : -along);
        vec4 found = boundary_along(x, axis, reach);
        float facing = dot(found.xyz, axis);
        if (found.w >= 0.0 && facing > LEAST_FACING) relative[k] = found.w / (facing * reach);
    }
    eye_hits[slot].e = boundaries_encode(across, relative, reach);
}
