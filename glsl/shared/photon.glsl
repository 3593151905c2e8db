// Stored photons, eye hits, path states. Words are integers that carry float bits, not the other way round: integer
// loads and stores never quiet a NaN pattern or flush a denormal one.

#include "shared/aabb.glsl"

// State bits of a photon or an eye path.
const uint PATH_MEDIUM_MASK = 0xffffu; // Material index + 1 of the medium around it, 0 outside.
const uint MEDIUM_UNKNOWN = PATH_MEDIUM_MASK; // In place of a medium: trace_medium.comp finds out.
const uint PATH_DEPTH_SHIFT = 16u; // Lowest bit of the number of surfaces met.
const uint PATH_DEPTH_MASK = 0xffu; // After the shift.
const uint PATH_DIFFUSE = 1u << 24;    // Met a diffuse or rough glossy surface.
const uint PATH_SPECULAR = 1u << 25;   // Met a specular surface.
const uint PATH_DIFFUSE_AGAIN = 1u << 26; // Path tracing: met a second diffuse or rough glossy surface.
const uint PATH_END_SHIFT = 28u; // Lowest bit of what became of a photon: ENERGY_*.

// Where the light of photons went (lib/energy.glsl, photon_energy.comp).
const uint ENERGY_IN_FLIGHT = 0u; /// Photons on their way: all of them at first, none at the end.
const uint ENERGY_ABSORBED = 1u;  /// Taken by surfaces and media, less what survivors carry for others.
const uint ENERGY_ESCAPED = 2u;   /// Left the scene.
const uint ENERGY_ENDED = 3u;     /// Caustic photons at surfaces that scatter widely, with what they stored there.
const uint ENERGY_CUT = 4u;       /// Still in flight at the limit of bounces.
const uint ENERGY_CLAMPED = 5u;   /// Refused by a guard.
/// Lost by maps that know of no surface (Yao et al. 2010). It has the bits of ENERGY_ESCAPED, which is added to it.
const uint ENERGY_LOST = 6u;
const uint ENERGIES = 7u;         /// Number of them.

// Eye hit: seen by way of a mirror or glass, so not at its pixel's place in space.
const uint EYE_HIT_BENT = 0x80000000u;
// In w of a slot's gathered light: the estimator gave up, because its loops would have become too long for the driver.
const float UNFINISHED = -1.0;

// Photons on surfaces that turn away by more than this are another surface's: it keeps light out of corners.
const float SAME_SURFACE = 0.3;

// A material beyond the bits is not remembered: the back of its boundary still names it (lib/medium.glsl).
uint path_medium(uint material) {
    return material + 1u < PATH_MEDIUM_MASK ? material + 1u : 0u;
}

// Stored photon, 64 bytes: four vec4 loads in the gather.
//   a: position, octahedral normal       b: flux, octahedral direction of travel
//   c: dual vector u, zero                 d: dual vector v, 1 / area, negative for caustic photons
// Dual vectors measure an offset in units of the footprint's semiaxes.
//
// A light vertex, which is connected to the camera, is a photon without a footprint:
//   a: hit (lib/hit.glsl)    b: as above    c: medium, zero    d: zero and class
// The class is in the sign of the last word: negative for caustic light.
struct Photon {
    uvec4 a;
    uvec4 b;
    uvec4 c;
    uvec4 d;
};

const uint PACKED_WORDS = 5u; // Words of a packed photon of 20 bytes (lib/packed_photon.glsl).

const float SLAB = 0.5; // Half thickness of a footprint, in units of its longer semiaxis.

// One over the square of the longer semiaxis.
float inverse_longer2(Photon p) {
    vec3 u = uintBitsToFloat(p.c.xyz), v = uintBitsToFloat(p.d.xyz);
    return min(dot(u, u), dot(v, v));
}

// Eye hit, 80 bytes, one per path slot.
//   a: position, octahedral geometric normal
//   b: throughput times diffuse reflectance over pi, octahedral shading normal
//   c: throughput, halves: GGX alpha (negative: glass), F0 of the coat
//   d: octahedral direction to the eye, F0 as halves, metallic and F90 of the coat as bytes, triangle and EYE_HIT_BENT
//   e: boundaries of the surface around it (lib/boundary.glsl), 0 if there are none or nobody looked
struct EyeHit {
    uvec4 a;
    uvec4 b;
    uvec4 c;
    uvec4 d;
    uvec4 e;
};
