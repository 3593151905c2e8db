// Density estimation at the eye hits from the photon BVH (Fabianowski and Dingliana 2009, section 6): every photon whose
// box holds the point is tested, those whose footprint covers it are added up (eq. 1).
//
// The footprint is an ellipse in the photon's tangent plane with a slab of SLAB longer semiaxes around it. A point is
// projected along the photon's normal; the kernel over the ellipse times |N_x . N_photon| integrates to one over any
// surface that lies in the slab, which the paper's cut ellipsoid does only for planes.
#version 460
#extension GL_GOOGLE_include_directive : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/photon.glsl"

layout(constant_id = 5) const bool GLOSSY = true;
layout(constant_id = 9) const bool SMOOTH_NORMALS = true;
layout(constant_id = 20) const bool EPANECHNIKOV = true;
// Leaves the tested and the accepted photons of each slot in w, for measurements.
layout(constant_id = 21) const bool COUNT_PAIRS = false;

layout(set = 0, binding = 16, scalar) readonly buffer List { uint list[]; };
layout(set = 0, binding = 17, scalar) readonly buffer Count { uint count[]; };
layout(set = 0, binding = 18, scalar) readonly buffer EyeHits { EyeHit eye_hits[]; };
layout(set = 0, binding = 19, scalar) readonly buffer PhotonNodes { BvhNode photon_nodes[]; };
layout(set = 0, binding = 20, scalar) readonly buffer Photons { Photon photons[]; };
layout(set = 0, binding = 21, scalar) writeonly buffer Gathered { vec4 gathered[]; };
#include "shared/scene.glsl"
#include "lib/bsdf.glsl"
#include "lib/eye_hit.glsl"

// Photons on surfaces that turn away by more than this are another surface's: it keeps light out of corners.
const float SAME_SURFACE = 0.3;
const uint DONE = 0xffffffffu;

uint stack[BVH_MAX_DEPTH + 2u];

bool holds(vec4 low, vec4 high, vec3 p) {
    return all(greaterThanEqual(p, low.xyz)) && all(lessThanEqual(p, high.xyz));
}

void main() {
    uint j = linear_id();
    if (j >= count[0]) return;
    uint slot = list[j];
    EyeHit hit = eye_hits[slot];
    vec3 to_eye, through;
    Surface s = surface_of(hit, to_eye, through);
    vec3 caustic = vec3(0.0), other = vec3(0.0);
    float tested = 0.0, accepted = 0.0;
    uint top = 1u;
    stack[0] = DONE;
    uint current = 0u;
    while (current != DONE) {
        if ((current & BVH_LEAF) == 0u) {
            BvhNode node = photon_nodes[current];
            bool in0 = holds(node.min0, node.max0, s.position), in1 = holds(node.min1, node.max1, s.position);
            uint child0 = floatBitsToUint(node.min0.w), child1 = floatBitsToUint(node.max0.w);
            if (in0 && in1) stack[top++] = child1;
            current = in0 ? child0 : child1;
            if (!in0 && !in1) current = stack[--top];
        } else {
            Photon p = photons[current & BVH_FIRST_MASK];
            vec3 offset = s.position - uintBitsToFloat(p.a.xyz);
            vec3 normal = oct_decode(p.a.w);
            float u = dot(offset, uintBitsToFloat(p.c.xyz)), v = dot(offset, uintBitsToFloat(p.d.xyz));
            float w = dot(offset, normal) * uintBitsToFloat(p.c.w);
            float r2 = u * u + v * v;
            float facing = dot(normal, s.geometric);
            if (COUNT_PAIRS) tested += 1.0;
            if (r2 < 1.0 && abs(w) < 1.0 && facing > SAME_SURFACE) {
                if (COUNT_PAIRS) accepted += 1.0;
                float signed_density = uintBitsToFloat(p.d.w);
                float density = abs(signed_density) * facing * (EPANECHNIKOV ? 2.0 * (1.0 - r2) : 1.0);
                vec3 light = uintBitsToFloat(p.b.xyz) * density;
                if (GLOSSY || SMOOTH_NORMALS) {
                    vec3 wi = -oct_decode(p.b.w);
                    // Flux is counted per geometric area; the BSDF is meant for the shading normal (Veach 1997, 5.3.2).
                    float n_i = dot(s.shading, wi), g_i = dot(s.geometric, wi);
                    light *= n_i > 0.0 && g_i > 0.0 ? min(n_i / g_i, 4.0) : 0.0;
                    if (GLOSSY) light *= gathered_bsdf(s, to_eye, wi);
                }
                caustic += signed_density < 0.0 ? light : vec3(0.0);
                other += signed_density < 0.0 ? vec3(0.0) : light;
            }
            bool last = (current & BVH_COUNT_MASK) == 0u;
            current += 1u - BVH_COUNT_ONE;
            if (last) current = stack[--top];
        }
    }
    vec3 factor = GLOSSY ? through : uintBitsToFloat(hit.b.xyz);
    gathered[2u * slot] = vec4(caustic * factor, tested);
    gathered[2u * slot + 1u] = vec4(other * factor, accepted);
}
