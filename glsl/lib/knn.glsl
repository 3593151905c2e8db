// The k nearest photons of each class (Jensen 2001, "Realistic Image Synthesis Using Photon Mapping", chapter 7: two
// maps, searched apart). Candidates are the photons whose own footprint holds the point, so its longest radius is the
// search limit. With at most k of them, each counts within its own footprint. With more, the k nearest count within the
// disc whose radius is the distance to the next one: k photons in the disc of the (k + 1)-th estimate a uniform density
// without bias, k in the disc of the k-th itself overestimate it by k / (k - 1) (Loftsgaarden and Quesenberry 1965).
//
// Photons are ordered by squared distance, in single precision without contraction, and then by deposit index.

#include "lib/estimate.glsl"

layout(constant_id = 23) const uint NEIGHBOURS = 64; // k

// From the centre of a footprint to its farthest point, in longer semiaxes: sqrt(1 + SLAB^2), rounded up.
const float REACH = 1.1181;
/// Least radius of a disc, in the longer semiaxes of each of its photons: more than k photons at the point itself would
/// be infinitely bright.
const float KNN_LEAST_RADIUS = 1.0 / 256.0;

float longer_semiaxis(Photon p) {
    return inversesqrt(inverse_longer2(p));
}

bool is_caustic(Photon p) {
    return uintBitsToFloat(p.d.w) < 0.0;
}

// The bits of this must not depend on the kernel: a box's bound must not exceed the distances inside of it.
float distance2(vec3 v) {
    precise float sum = v.x * v.x + v.y * v.y + v.z * v.z;
    return sum;
}

// Whether (d, i) comes before (e, j).
bool nearer(float d, uint i, float e, uint j) {
    return d < e || (d == e && i < j);
}

// Whether add_photon would count it.
bool is_candidate(Photon p, Point x) {
    vec3 offset = x.s.position - uintBitsToFloat(p.a.xyz);
    vec2 at = relative_place(p, offset);
    if (!(dot(at, at) < 1.0) || !(place_weight(p, x, offset, at) > 0.0)) return false;
    vec3 normal = oct_decode(p.a.w);
    return slab_holds(p, dot(offset, normal)) && dot(normal, x.s.geometric) > SAME_SURFACE;
}

// Adds a candidate: within the disc of squared radius `disc2`, or within its own footprint where that is negative.
void add_neighbour(inout Estimate sum, Photon p, Point x, float disc2) {
    vec3 offset = x.s.position - uintBitsToFloat(p.a.xyz);
    float density;
    if (disc2 < 0.0) {
        float facing = dot(oct_decode(p.a.w), x.s.geometric);
        density = abs(uintBitsToFloat(p.d.w)) * facing * place_weight(p, x, offset, relative_place(p, offset));
    } else {
        float r2 = max(disc2, sqr(KNN_LEAST_RADIUS * longer_semiaxis(p)));
        density = radial_weight(min(distance2(offset) / r2, 1.0)) / (PI * r2);
    }
    vec3 light = photon_light(p, x, density);
    if (COUNT_PAIRS) sum.accepted += 1.0;
    sum.caustic += is_caustic(p) ? light : vec3(0.0);
    sum.other += is_caustic(p) ? vec3(0.0) : light;
}
