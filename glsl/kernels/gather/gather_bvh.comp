// Density estimation at the eye hits from the photon BVH (Fabianowski and Dingliana 2009, section 6): every photon whose
// box holds the point is tested, those whose footprint covers it are added up (eq. 1).
//
// The footprint is an ellipse in the photon's tangent plane with a slab of SLAB longer semiaxes around it. A point is
// projected along the photon's normal; the kernel over the ellipse times |N_x . N_photon| integrates to one over any
// surface that lies in the slab, which the paper's cut ellipsoid does only for planes.
//
// The lanes of a subgroup are neighbouring pixels: they walk the tree together, into every node that any of them needs,
// so that control flow and loads are uniform. Each lane still adds its photons in the order of the leaves.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_vote : require
layout(local_size_x = 64) in;
#include "lib/header.glsl"
#include "shared/bvh.glsl"
#include "shared/photon.glsl"

layout(constant_id = 5) const bool GLOSSY = true;
layout(constant_id = 9) const bool SMOOTH_NORMALS = true;
layout(constant_id = 20) const bool EPANECHNIKOV = true;

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
    // Decided by the surface, not by the program: a lean program gives the same bits.
    bool glossy = GLOSSY && !is_lambert(s);
    bool smooth_normal = SMOOTH_NORMALS && hit.a.w != hit.b.w;
    vec3 caustic = vec3(0.0), other = vec3(0.0);
    uint top = 1u;
    stack[0] = DONE;
    uint current = 0u;
    while (current != DONE) {
        if ((current & BVH_LEAF) == 0u) {
            BvhNode node = photon_nodes[current];
            bool in0 = subgroupAny(holds(node.min0, node.max0, s.position));
            bool in1 = subgroupAny(holds(node.min1, node.max1, s.position));
            uint child0 = floatBitsToUint(node.min0.w), child1 = floatBitsToUint(node.max0.w);
            if (in0 && in1) stack[top++] = child1;
            current = in0 ? child0 : (in1 ? child1 : stack[--top]);
            continue;
        }
        uint first = current & BVH_FIRST_MASK;
        uint end = first + 1u + ((current & BVH_COUNT_MASK) / BVH_COUNT_ONE);
        for (uint i = first; i < end; ++i) {
            Photon p = photons[i];
            vec3 offset = s.position - uintBitsToFloat(p.a.xyz);
            float u = dot(offset, uintBitsToFloat(p.c.xyz)), v = dot(offset, uintBitsToFloat(p.d.xyz));
            float r2 = u * u + v * v;
            if (!subgroupAny(r2 < 1.0)) continue;
            vec3 normal = oct_decode(p.a.w);
            float w = dot(offset, normal) * uintBitsToFloat(p.c.w);
            float facing = dot(normal, s.geometric);
            float signed_density = uintBitsToFloat(p.d.w);
            bool covers = r2 < 1.0 && abs(w) < 1.0 && facing > SAME_SURFACE;
            float density = covers ? abs(signed_density) * facing * (EPANECHNIKOV ? 2.0 * (1.0 - r2) : 1.0) : 0.0;
            vec3 light = uintBitsToFloat(p.b.xyz) * density;
            if (glossy || smooth_normal) {
                vec3 wi = -oct_decode(p.b.w);
                // Flux is counted per geometric area; the BSDF is meant for the shading normal (Veach 1997, 5.3.2).
                float n_i = dot(s.shading, wi), g_i = dot(s.geometric, wi);
                light *= n_i > 0.0 && g_i > 0.0 ? min(n_i / g_i, 4.0) : 0.0;
                if (glossy) light *= gathered_bsdf(s, to_eye, wi);
            }
            bool is_caustic = signed_density < 0.0;
            caustic += is_caustic ? light : vec3(0.0);
            other += is_caustic ? vec3(0.0) : light;
        }
        current = stack[--top];
    }
    vec3 factor = glossy ? through : uintBitsToFloat(hit.b.xyz);
    gathered[2u * slot] = vec4(caustic * factor, 0.0);
    gathered[2u * slot + 1u] = vec4(other * factor, 0.0);
}
