// What all density estimators share: which photons count at an eye hit, and how much. An estimator decides which
// photons it looks at, never what they are worth, so all of them give the same radiance (equation 1 of Fabianowski and
// Dingliana 2009, equation 3 of Mara, Luebke and McGuire 2013).
//
// The footprint is an ellipse in the photon's tangent plane with a slab of SLAB longer semiaxes around it. A point is
// projected along the photon's normal. The weight over the ellipse times |N_x . N_photon| integrates to one over any
// surface that lies in the slab; that of the first paper's cut ellipsoid does so only over planes. Where the surface
// ends near the point, footprints are folded back (lib/boundary.glsl).
//
// A kernel whose subgroups look at the same photons together defines ESTIMATE_TOGETHER: photons that no lane needs then
// cost less. A kernel that evaluates only what it has tested itself defines ESTIMATE_TESTED, and counts its tests.

layout(constant_id = 5) const bool GLOSSY = true;
layout(constant_id = 9) const bool SMOOTH_NORMALS = true;
layout(constant_id = 20) const uint WEIGHT = 2; // of a photon within its footprint: WEIGHT_*
// Leaves the tested and the accepted photons of each slot in w, for measurements.
layout(constant_id = 21) const bool COUNT_PAIRS = false;

#include "shared/scene.glsl"
layout(set = 0, binding = 13, scalar) readonly buffer Lobes { uint lobes[]; };
#include "lib/bsdf.glsl"
#include "lib/eye_hit.glsl"
#include "lib/point.glsl"

const uint WEIGHT_CONSTANT = 0u; /// The same weight over the whole footprint.
const uint WEIGHT_CONE = 1u; /// A cone with a flat top.
const uint WEIGHT_EPANECHNIKOV = 2u; /// Epanechnikov's parabola.

// Sums over photons, and counts of them if COUNT_PAIRS.
struct Estimate {
    vec3 caustic;
    vec3 other;
    float tested;
    float accepted;
};

Estimate estimate_nothing() {
    return Estimate(vec3(0.0), vec3(0.0), 0.0, 0.0);
}

// Weight of a photon at the squared relative radius r2 < 1, over the weight that is constant.
float radial_weight(float r2) {
    if (WEIGHT == WEIGHT_EPANECHNIKOV) return 2.0 * (1.0 - r2);
    if (WEIGHT == WEIGHT_CONE) {
        // min(c, 1 - s / r) over its integral c (c^2 / 3 - c + 1), c = 1/5 (Mara, Luebke and McGuire 2013, equation 3).
        const float c = 0.2;
        return min(c, 1.0 - sqrt(r2)) / (c * (c * c / 3.0 - c + 1.0));
    }
    return 1.0;
}

// Offset of the point in units of the photon's semiaxes.
vec2 relative_place(Photon p, vec3 offset) {
    return vec2(dot(offset, uintBitsToFloat(p.c.xyz)), dot(offset, uintBitsToFloat(p.d.xyz)));
}

// Whether the slab of the footprint holds a point of the photon's surface at this height above the photon's plane.
bool slab_holds(Photon p, float height) {
    return height * height * inverse_longer2(p) < SLAB * SLAB;
}

// Place of a photon along both axes of a point's boundaries, seen from the point, which is `offset` from the photon.
vec2 place_between(Boundaries b, vec3 offset) {
    return -vec2(dot(offset, b.across), dot(offset, b.along));
}

// Weight of a photon between boundaries: of its footprint, made as narrow as they are apart, and of its mirror images.
float folded_weight(Photon p, Boundaries b, vec3 offset) {
    vec2 place = place_between(b, offset);
    if (boundary_hides(b, place)) return 0.0;
    vec3 u = uintBitsToFloat(p.c.xyz), v = uintBitsToFloat(p.d.xyz);
    vec3 major = u / dot(u, u), minor = v / dot(v, v);
    Mirrors m = mirrors_of(vec2(dot(major, b.across), dot(minor, b.across)), b.reach.xy, b.unit);
    Mirrors l = mirrors_of(vec2(dot(major, b.along), dot(minor, b.along)), b.reach.zw, b.unit);
    vec2 at = relative_place(p, offset) - (m.wider * place.x + l.wider * place.y) / b.unit;
    float sum = 0.0;
    for (uint i = 0u; i < 3u; ++i) {
        for (uint k = 0u; k < 3u; ++k) {
            vec2 image = at + m.image[i] + l.image[k];
            float r2 = dot(image, image);
            sum += r2 < 1.0 ? radial_weight(r2) : 0.0;
        }
    }
    return sum * m.narrower * l.narrower;
}

// Weight of a photon at a place within its footprint, over the weight that is constant; 0 behind a boundary.
float place_weight(Photon p, Point x, vec3 offset, vec2 at) {
    if (x.boundaries.any) return folded_weight(p, x.boundaries, offset);
    return radial_weight(min(dot(at, at), 1.0));
}

void add_photon(inout Estimate sum, Photon p, Point x) {
    vec3 offset = x.s.position - uintBitsToFloat(p.a.xyz);
    vec2 at = relative_place(p, offset);
    float r2 = dot(at, at);
#ifndef ESTIMATE_TESTED
    if (COUNT_PAIRS) sum.tested += 1.0;
#endif
#ifdef ESTIMATE_TOGETHER
    if (!subgroupAny(r2 < 1.0)) return;
#else
    if (!(r2 < 1.0)) return;
#endif
    vec3 normal = oct_decode(p.a.w);
    float facing = dot(normal, x.s.geometric);
    float signed_density = uintBitsToFloat(p.d.w);
    bool covers = r2 < 1.0 && slab_holds(p, dot(offset, normal)) && facing > SAME_SURFACE;
    float weight = covers ? place_weight(p, x, offset, at) : 0.0;
    if (COUNT_PAIRS) sum.accepted += weight > 0.0 ? 1.0 : 0.0;
    vec3 light = photon_light(p, x, abs(signed_density) * facing * weight);
    bool is_caustic = signed_density < 0.0;
    sum.caustic += is_caustic ? light : vec3(0.0);
    sum.other += is_caustic ? vec3(0.0) : light;
}
