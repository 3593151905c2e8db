// What all density estimators share: which photons count at an eye hit, and how much. An estimator decides which photons
// it looks at, never what they are worth, so all of them give the same radiance (equation 1 of Fabianowski and Dingliana
// 2009, equation 3 of Mara, Luebke and McGuire 2013).
//
// The footprint is an ellipse in the photon's tangent plane with a slab of SLAB longer semiaxes around it. A point is
// projected along the photon's normal; the kernel over the ellipse times |N_x . N_photon| integrates to one over any
// surface that lies in the slab, which the first paper's cut ellipsoid does only for planes.
//
// Define ESTIMATE_TOGETHER where the lanes of a subgroup look at the same photons: those that no lane needs cost less then.

layout(constant_id = 5) const bool GLOSSY = true;
layout(constant_id = 9) const bool SMOOTH_NORMALS = true;
layout(constant_id = 20) const uint WEIGHT = 2; // of a photon within its footprint: WEIGHT_*
// Leaves the tested and the accepted photons of each slot in w, for measurements.
layout(constant_id = 21) const bool COUNT_PAIRS = false;

#include "shared/scene.glsl"
#include "lib/bsdf.glsl"
#include "lib/eye_hit.glsl"
#include "lib/point.glsl"

const uint WEIGHT_CONSTANT = 0u;
const uint WEIGHT_CONE = 1u;
const uint WEIGHT_EPANECHNIKOV = 2u;

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

// Weight of a photon at the squared relative radius r2 < 1, in units of the constant kernel's.
float kernel_weight(float r2) {
    if (WEIGHT == WEIGHT_EPANECHNIKOV) return 2.0 * (1.0 - r2);
    if (WEIGHT == WEIGHT_CONE) {
        // min(c, 1 - s / r) over its integral c (c^2 / 3 - c + 1), c = 1/5 (Mara, Luebke and McGuire 2013, equation 3).
        const float c = 0.2;
        return min(c, 1.0 - sqrt(r2)) / (c * (c * c / 3.0 - c + 1.0));
    }
    return 1.0;
}

// Offset of the point in units of the photon's semiaxes, squared.
float relative_radius2(Photon p, vec3 offset) {
    float u = dot(offset, uintBitsToFloat(p.c.xyz)), v = dot(offset, uintBitsToFloat(p.d.xyz));
    return u * u + v * v;
}

void add_photon(inout Estimate sum, Photon p, Point x) {
    vec3 offset = x.s.position - uintBitsToFloat(p.a.xyz);
    float r2 = relative_radius2(p, offset);
    if (COUNT_PAIRS) sum.tested += 1.0;
#ifdef ESTIMATE_TOGETHER
    if (!subgroupAny(r2 < 1.0)) return;
#else
    if (!(r2 < 1.0)) return;
#endif
    vec3 normal = oct_decode(p.a.w);
    float w = dot(offset, normal) * uintBitsToFloat(p.c.w);
    float facing = dot(normal, x.s.geometric);
    float signed_density = uintBitsToFloat(p.d.w);
    bool covers = r2 < 1.0 && abs(w) < 1.0 && facing > SAME_SURFACE;
    if (COUNT_PAIRS) sum.accepted += covers ? 1.0 : 0.0;
    vec3 light = photon_light(p, x, covers ? abs(signed_density) * facing * kernel_weight(r2) : 0.0);
    bool is_caustic = signed_density < 0.0;
    sum.caustic += is_caustic ? light : vec3(0.0);
    sum.other += is_caustic ? vec3(0.0) : light;
}
